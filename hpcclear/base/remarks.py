"""Remarks for the user from where nothing is known of terminals and ranks: each once in a process."""

import sys
from collections.abc import Callable

from hpcclear.base.plain import plain

_made: set[str] = set()


_listeners: list[Callable[[str], object]] = [lambda text: sys.stderr.write(f"{plain(text)}\n")]


def listen(listener: Callable[[str], object]) -> None:
    """Let `listener` get every further remark, in place of standard error."""
    _listeners[0] = listener


def remark(text: str) -> None:
    """Give a sentence to the listener, unless it has had the same one."""
    if text not in _made:
        _made.add(text)
        _listeners[0](text)
