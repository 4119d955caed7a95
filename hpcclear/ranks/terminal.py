"""The terminal that a person watches: one line at its end shows what goes on, and is replaced by what is shown next."""

import functools
import os
import sys
import textwrap
from typing import Literal, TextIO

from hpcclear.base.plain import plain
from hpcclear.ranks.launcher import is_launched

Style = Literal["auto", "bar", "log", "quiet"]
"""How progress is shown: by that line, by lines of a log, or not at all; ``auto`` is the first on a terminal, else a log."""

_LAUNCHERS = ("mpiexec", "mpirun", "prterun", "orterun")
WIDTH = 80
"""Columns of what is printed."""

_LONGEST_BAR = 40

_drawn: list[TextIO] = []
"""The terminal whose last line is to be replaced, if there is one."""


def announce(text: str, style: Style = "auto") -> None:
    """Show what begins: on a terminal until something else is shown, in a log as a line."""
    shown = terminal() if style in ("auto", "bar") else None
    if shown:
        draw(shown, text)
    elif style != "quiet":
        write(text)


def write(text: str) -> None:
    """Write a text on standard error: a line in a log, lines of 80 columns on a terminal."""
    clear()
    lines = plain(text).splitlines()
    if terminal():
        fill = functools.partial(textwrap.fill, break_long_words=False, break_on_hyphens=False)
        lines = [fill(line, WIDTH) if len(line) > WIDTH else line for line in lines]
    sys.stderr.write("\n".join([*lines, ""]))
    sys.stderr.flush()


def clear() -> None:
    """Take away what a terminal shows of progress: what follows stays."""
    while _drawn:
        stream = _drawn.pop()
        stream.write("\r\x1b[2K")
        stream.flush()


def draw(stream: TextIO, text: str, share: float | None = None) -> None:
    """Replace the last line of a terminal; `share`, from 0 to 1, is drawn as a bar where there is room."""
    try:
        columns = os.get_terminal_size(stream.fileno()).columns or 80
    except (OSError, ValueError):
        columns = 80
    room = min(columns - len(text) - 3, _LONGEST_BAR)
    if share is not None and room > 3 and "utf" in (stream.encoding or "").lower():
        filled = round(share * room)
        text = f"{text}  {'━' * filled}{'─' * (room - filled)}"
    clear()
    stream.write(plain(text)[: columns - 1])
    stream.flush()
    _drawn.append(stream)


def terminal() -> TextIO | None:
    """The terminal on which messages appear, also those of ranks of a local mpiexec; None if they go to a file."""
    return sys.stderr if sys.stderr.isatty() else launching_terminal()


@functools.cache
def launching_terminal() -> TextIO | None:
    """The terminal on which a local mpiexec shows what its ranks write; None if there is none.

    Ranks write to a pipe even when a person watches, so look up the standard error of mpiexec (Linux only).
    """
    if sys.platform != "linux" or not is_launched():
        return None
    pid = os.getppid()
    try:
        for _ in range(3):  # proxy, mpiexec
            with open(f"/proc/{pid}/stat", encoding="utf-8") as status:
                name, _, rest = status.read().partition("(")[2].rpartition(")")
            if name.startswith(_LAUNCHERS):
                return _open_terminal(os.readlink(f"/proc/{pid}/fd/2"))
            pid = int(rest.split()[1])
    except OSError:  # another user's process, or another namespace
        return None
    return None


def _open_terminal(path: str) -> TextIO | None:
    if not path.startswith("/dev/"):
        return None
    descriptor = os.open(path, os.O_WRONLY | os.O_NOCTTY)
    if os.isatty(descriptor):
        return os.fdopen(descriptor, "w")
    os.close(descriptor)
    return None
