"""Files of the compile cache: each is whole or is made again, by one process while others wait.

A file may be cut off or hold anything after a full disk, a fault of the storage or a power failure, and machine code that is
damaged ends a process, or computes something else. So each has a digest of its name and content: code that came to stand
under another name, as files that a repaired disk gives back may, is of another function.
"""

import contextlib
import glob
import hashlib
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from hpcclear.base.lock import Lock
from hpcclear.base.plain import plain
from hpcclear.base.remarks import remark

PATIENCE = 300.0
"""Seconds a process waits for one that compiles the same, once: one that was stopped keeps its lock."""

SILENT = 10.0
"""Seconds of waiting after which that is said."""

_given_up = False
_said: list[str] = []


def digest(content: bytes) -> bytes:
    """SHA-256 of a content."""
    return hashlib.sha256(content).digest()


def read(path: Path) -> bytes | None:
    """Return the content of a file that `write` made; None if there is none, also where it was damaged and is dropped."""
    try:
        stored = path.read_bytes()
    except OSError:
        return None
    content = stored[32:]
    if digest(path.name.encode() + content) == stored[:32]:
        return content
    drop(path)
    return None


def write(path: Path, content: bytes) -> None:
    """Write a file whole or not at all; where none can be written, nothing is kept, and that is said."""
    try:
        replace(path, digest(path.name.encode() + content) + content)
    except OSError as error:
        remark(f"Warning: compiled code is not kept: {path.parent}: {error.strerror or error}")


def replace(path: Path, stored: bytes) -> None:
    """Put a file in place, whole or not at all; raises OSError."""
    with tempfile.NamedTemporaryFile(
        dir=path.parent, prefix=f"{path.name}.", suffix=".part", delete=False
    ) as part:
        try:
            part.write(stored)
            part.flush()
            os.replace(part.name, path)
        except OSError:
            with contextlib.suppress(OSError):
                os.unlink(part.name)
            raise


def drop(path: Path) -> None:
    """Remove a damaged file; whoever removes it says so, on whatever rank: one line in a process."""
    try:
        path.unlink()
    except FileNotFoundError:
        return
    except OSError:
        pass  # somebody else's, or a directory: compiled anew every time
    text = f"Warning: the cache of compiled code in {path.parent} was damaged: compiling again"
    if not _said:
        sys.stderr.write(f"{plain(text)}\n")
    _said.append(text)


def made(path: Path, make: Callable[[], bytes]) -> bytes:
    """Content of a file that is kept, or that one process makes while others wait; see `lock`."""
    content = read(path)
    if content is None:
        held = lock(path)
        try:
            content = read(path)  # by whoever had the lock before
            if content is None:
                content = make()
                write(path, content)
        finally:
            unlock(held)
    return content


def lock(path: Path) -> Lock | None:
    """Take the lock of a file that is to be made; return what `unlock` takes, None where it cannot be had.

    It ends with the process that holds it. Where there are none, or one is held too long, others may make the file. One
    who has waited looks for the file that was made before making it.
    """
    global _given_up
    wanted = Lock(path.parent, f"{path.name}.lock")
    began, said = time.monotonic(), False
    with contextlib.suppress(OSError):  # no file can be made there, or the file system has no locks
        while not wanted.take():
            if _given_up:
                return None
            waited = time.monotonic() - began
            if waited > SILENT and not said:
                remark("Note: another process compiles the same code: waiting for it")
                said = True
            _given_up = waited > PATIENCE
            time.sleep(0.05)
        with contextlib.suppress(OSError):
            for left in path.parent.glob(f"{glob.escape(path.name)}.*.part"):
                left.unlink()  # by one that was killed while writing
        return wanted
    return None


def unlock(held: Lock | None) -> None:
    """Give back what `lock` returned."""
    if held is not None:
        with contextlib.suppress(OSError):
            held.release()
