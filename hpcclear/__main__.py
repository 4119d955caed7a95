"""The program: ``hpcclear`` and ``python -m hpcclear``, a process that begins and ends sooner than Python does by itself."""

import atexit
import contextlib
import ctypes
import gc
import os
import sys

_LOADED = 500_000
"""Objects, more than a command loads with its libraries; it works on a fraction of it, in arrays."""


def main() -> None:
    """Run a command; ends the process with its exit code."""
    _collect_after_loading()
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # it was closed before
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 - stays open
    from hpcclear.cli import main as command

    try:
        command()
    except SystemExit as end:
        _leave(end.code)


def _collect_after_loading() -> None:
    """Look for unreachable objects only from the first collection on that loading alone cannot cause.

    Loading makes hundreds of thousands that all stay, and looking through them again and again took a tenth of a start.
    """
    usual = gc.get_threshold()

    def first(phase: str, _: object) -> None:
        if phase == "start":
            gc.set_threshold(*usual)
            gc.callbacks.remove(first)

    gc.callbacks.append(first)
    gc.set_threshold(_LOADED, *usual[1:])


def _leave(code: object) -> None:
    """End the process with an exit code, without freeing one by one what the system frees at once: a third of a start."""
    atexit._run_exitfuncs()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # its reader is gone, or it was closed
            stream.flush()
    number = code if isinstance(code, int) else int(code is not None)
    if os.name == "posix":
        # not os._exit: MPI libraries report to the launcher when the process exits
        ctypes.CDLL(None).exit(number)
    os._exit(number)


if __name__ == "__main__":
    main()
