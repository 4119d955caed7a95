"""A second process that compiles beside this one: the first result takes half as long on two cores.

What it has compiled this process loads from disk, so nothing is lost where it fails: it is compiled here then.
"""

import contextlib
import importlib
import os
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

from hpcclear.base import isolated, kept
from hpcclear.base.code_folder import chosen_folder, source_key
from hpcclear.base.cores import own_cores
from hpcclear.base.remarks import remark

PATIENCE = 120.0  # s, after which it is given up


def _mark(part: str) -> Path:
    """Where it is noted that a part was compiled."""
    return Path(chosen_folder()) / f"compiled-{source_key()}-{part.replace(':', '-')}"


@contextlib.contextmanager
def compiled_beside(parts: Sequence[str]) -> Iterator[None]:
    """Have what is not yet on disk compiled by another process; at the end of the block it is.

    Parameters
    ----------
    parts : sequence of str
        ``"module:function"`` or ``"module:function:word"``: functions that compile, and the number or name they take. The
        first takes longest: where it is there, the others are not worth another process.
    """
    wanted = [part for part in parts if not _mark(part).exists()]
    if not (wanted and wanted[0] == parts[0] and own_cores() > 1):
        yield
        return
    first = _mark(wanted[0])
    lock = kept.lock(first, wait=False)
    try:
        if lock is None and kept.is_locked(
            first
        ):  # another process has it compiled: this one will load it
            yield
        else:
            with _other(wanted):
                yield
    finally:
        kept.unlock(lock)


@contextlib.contextmanager
def _other(parts: Sequence[str]) -> Iterator[None]:
    """Have parts compiled by a process of their own; at the end of the block they are, or are this one's to compile."""
    quiet = subprocess.DEVNULL
    try:
        other = subprocess.Popen(
            isolated.python("hpcclear.base.beside:compile_parts", *parts),
            stdin=quiet, stdout=quiet, stderr=subprocess.PIPE, text=True, errors="replace",
            env={**os.environ, "NUMBA_CACHE_DIR": chosen_folder()},  # also where that is a folder of this process alone
        )  # fmt: skip
    except OSError:  # no room for another process
        yield
        return
    try:
        yield
        with contextlib.suppress(subprocess.TimeoutExpired):
            said = other.communicate(timeout=PATIENCE)[1]
            for line in said.splitlines():
                if line.startswith("Warning:"):  # a damaged file; errors are this process's to find
                    remark(line)
    finally:
        if other.poll() is None:
            other.kill()
        other.communicate()


def compile_parts(*parts: str) -> None:
    """Compile parts, as `compiled_beside` names them, and note it."""
    for part in parts:
        module, function, *words = part.split(":")
        known = [int(word) if word.isdecimal() else word for word in words]
        getattr(importlib.import_module(module), function)(*known)
        note_compiled([part])


def note_compiled(parts: Sequence[str]) -> None:
    """Note that parts are on disk, so that no other process is started for them."""
    for part in parts:
        with contextlib.suppress(OSError):
            _mark(part).touch()
