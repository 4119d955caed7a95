"""Files that are whole or absent: written aside, synced, renamed; and what to say when they cannot be."""

import contextlib
import errno
import os
import re
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path

from hpcclear.base import host
from hpcclear.base.errors import InputError, refused

Buffer = bytes | memoryview

TEMPORARY = re.compile(r"\.hpcclear-[0-9a-f]{16}\.tmp")
"""Names of files that were being written; what is left of them after a kill is rubbish."""

_LOOK = 4096  # bytes at each end of a file in which the mark of its kind stands

_OPENS_DIRECTORIES = os.open in os.supports_dir_fd  # not on native Windows

_ATTEMPTS = 5  # of writing a file whose temporary a run that starts takes for such a leftover


def refuse_foreign(path: Path, mark: bytes) -> None:
    """Refuse to replace what this program did not write: devices, pipes, and files without its mark.

    What is not there is nobody's. A symbolic link to a file may be replaced, since what it leads to stays; one that leads
    nowhere may not, since results were meant to go where it leads. `mark`: what every file of the kind to be written holds near
    one of its ends; empty: none may be there. Raises InputError: something of somebody else's is in the way.
    """
    try:
        about = path.lstat()
        # /dev/stdout is a link, at times to a file
        if stat.S_ISLNK(about.st_mode) and path.parent.resolve() != Path("/dev"):
            about = path.stat()
            ours = stat.S_ISREG(about.st_mode)
        else:
            ours = stat.S_ISREG(about.st_mode) and _is_marked(path, mark)
    except FileNotFoundError:
        if path.is_symlink():
            reason = f"it is a symbolic link to {path.readlink()}, which is not there"
            remedy = "Name that file instead, or remove the link"
            raise InputError("output", str(path), reason, remedy) from None
        return
    except (OSError, ValueError) as error:
        raise refused(path, error) from None
    if stat.S_ISDIR(about.st_mode):
        raise refused(path, OSError(errno.EISDIR, ""))
    if not ours:
        reason, remedy = "it is not a regular file", "Choose another name"
        if stat.S_ISREG(about.st_mode):
            reason = "the existing file was not written by hpcclear, or it was cut off"
            if path.suffix.lower() == ".csv":  # known by its headings alone
                reason = "the existing table has other headings than this one"
            remedy += ", or move that file away"
        raise InputError("output", str(path), reason, remedy)


def _is_marked(path: Path, mark: bytes) -> bool:
    """Whether a regular file holds the mark near an end."""
    if not mark:
        return False
    with path.open("rb") as file:
        begin = file.read(_LOOK)
        file.seek(max(0, os.fstat(file.fileno()).st_size - _LOOK))
        return mark in begin or mark in file.read(_LOOK)


def write_bytes(path: Path, content: Buffer, mark: bytes = b"") -> None:
    """Put `content` at `path` whole: temporary name beside it, fsync, rename, fsync of the parent.

    A symbolic link at `path` is replaced, never followed; a file is, if it holds `mark` near an end (`refuse_foreign`). The
    temporary is removed when anything goes wrong. Raises InputError: the place cannot be written to (permission, missing
    directory, directory in the way), or holds what this program did not write. Raises StorageError: the disk is full or
    fails, or a file size limit is met.
    """
    refuse_foreign(path, mark)
    with _opened(path) as (directory, name):
        if not any(_replaced(name, content, directory) for _ in range(_ATTEMPTS)):
            raise OSError(errno.EIO, "temporary files are removed at once")
        if directory is not None:
            fsync_directory(directory)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[tuple[int | None, str]]:
    """The open directory of a file and the name in it: a link swapped in meanwhile cannot lead elsewhere.

    None and the whole path where the system opens no directories. Errors of the system within name the file itself.
    """
    try:
        if not _OPENS_DIRECTORIES:
            yield None, str(path)
            return
        directory = os.open(path.parent, host.flags("O_RDONLY", "O_DIRECTORY"))
        try:
            yield directory, path.name
        finally:
            os.close(directory)
    except OSError as error:
        raise refused(path, error) from None


def _replaced(name: str, content: Buffer, directory: int | None) -> bool:
    """Write aside and rename; False if somebody removed the temporary in between."""
    temporary = _aside(name)
    try:
        _write_whole(temporary, content, directory)
        try:
            os.replace(temporary, name, src_dir_fd=directory, dst_dir_fd=directory)
        except FileNotFoundError:
            return False
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary, dir_fd=directory)
        raise
    return True


def _aside(name: str) -> str:
    """A new name beside a file, one of `TEMPORARY`."""
    return os.path.join(os.path.dirname(name), f".hpcclear-{secrets.token_hex(8)}.tmp")


def remove_leftovers(directory: Path) -> None:
    """Remove what killed runs were writing in a directory; who is writing there now tries again."""
    for path in directory.glob(".hpcclear-*.tmp"):
        if TEMPORARY.fullmatch(path.name) and path.is_file() and not path.is_symlink():
            with contextlib.suppress(OSError):  # somebody else's, or gone
                path.unlink()


def _write_whole(name: str, content: Buffer, directory: int | None) -> None:
    how = host.flags("O_WRONLY", "O_CREAT", "O_EXCL", "O_NOFOLLOW")
    file = os.open(name, how, 0o666, dir_fd=directory)
    try:
        rest = memoryview(content)
        while rest:
            rest = rest[os.write(file, rest) :]
        os.fsync(file)
    finally:
        os.close(file)  # may raise as well: NFS reports a full disk here


def fsync_directory(descriptor: int) -> None:
    """Make a rename durable; file systems that cannot are left alone."""
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise


def probe(path: Path, mark: bytes = b"") -> None:
    """Refuse a place that `write_bytes` could not write to, before hours are spent on it; arguments and errors as there."""
    refuse_foreign(path, mark)
    with _opened(path) as (directory, name):
        trial = _aside(name)
        try:
            _write_whole(trial, b"", directory)
        finally:
            with contextlib.suppress(FileNotFoundError):  # a run that starts took it for a leftover
                os.unlink(trial, dir_fd=directory)
