"""Errors a user can mend: one message with key, value, reason and remedy."""

import errno
import os
import platform
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from hpcclear.base import host
from hpcclear.base.plain import plain

MOST_LISTED = 20
LONGEST_SHOWN = 400  # characters of a value; a path may have four thousand

_BAD_NAMES = (
    errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EEXIST, errno.EACCES, errno.EPERM, errno.EROFS,
)  # fmt: skip


_LONG = re.compile(r"(?=[\d.]{16})\d+\.\d+(?:e[-+]\d+)?")
"""A number with the digits of a float that was computed: nobody writes as many."""
_BOXED = re.compile(r"\bnp\.(?:\w+\(([^()]*)\)|(True|False)_)")


def unboxed(value: object) -> object:
    """Return a value with plain numbers for NumPy's, whose `repr` names their type, also inside lists, tuples and dicts."""
    if hasattr(value, "tolist"):  # NumPy need not be loaded
        return value.tolist()
    if isinstance(value, dict):
        return {unboxed(key): unboxed(entry) for key, entry in value.items()}
    if type(value) is list or type(value) is tuple:
        return type(value)(map(unboxed, value))
    return value


class InputError(ValueError):
    """Bad input; the command line prints the message and exits with code 2.

    `key`: where the value stands, a dotted scene path, an option, or a file; `value`: what was found there; `reason`: why it
    cannot be used; `remedy`: what to write instead.
    """

    def __init__(self, key: str, value: object, reason: str, remedy: str) -> None:
        self.key = key
        self.value = value
        self.reason = reason
        self.remedy = remedy
        super().__init__(key, value, reason, remedy)  # args, so that pickling keeps all four

    def __str__(self) -> str:
        shown = repr(unboxed(self.value))
        if not isinstance(self.value, str):
            shown = _LONG.sub(lambda number: f"{float(number[0]):.4g}", shown)
        # a file's place is of use only whole
        if len(shown) > 80 and os.sep not in shown:
            shown = shown[:77] + "..."
        elif len(shown) > LONGEST_SHOWN:
            shown = shown[: LONGEST_SHOWN // 2] + " ... " + shown[-LONGEST_SHOWN // 2 :]
        # texts that were made of sequences of NumPy's numbers
        return plain(_BOXED.sub(r"\1\2", f"{self.key} = {shown}: {self.reason}. {self.remedy}"))


@contextmanager
def at(key: str, value: object = ...) -> Iterator[None]:
    """Raise errors that have a reason and a remedy as InputError of an entry, with the `value` that stands there, if given."""
    try:
        yield
    except ValueError as error:
        if not hasattr(error, "remedy"):
            raise
        place = ".".join(filter(None, (key, getattr(error, "key", ""))))
        found = getattr(error, "value", ...) if value is ... else value
        raise InputError(place, found, error.reason, error.remedy) from None  # type: ignore[attr-defined]


def _alike(word: str, one: str) -> float:
    """How alike a word is to a dotted path, which is more alike where the word, or its last part, is a part of it."""
    from difflib import SequenceMatcher  # only who errs waits for it

    shared = (word.rpartition(".")[2] in one.split(".")) + (word in one)
    return shared + SequenceMatcher(None, word[:80], one).ratio()


def nearest(word: str, words: Sequence[str]) -> str:
    """A sentence that points to the nearest of `words`, or lists them."""
    from difflib import get_close_matches

    close = [one for one in words if one.lower() == word.lower()]
    close += get_close_matches(word[:80], words, n=3, cutoff=0.6)
    # whoever writes the beginning of a name means it
    close.sort(key=lambda one: not one.lower().startswith(word.lower()))
    if close:
        return f"Did you mean {close[0]!r}?"
    if not words:
        return "Remove it"
    more = len(words) - MOST_LISTED
    if more > 0:  # of a list that is cut, what is alike stands first
        words = sorted(words, key=lambda one: -_alike(word, one))
    return "Use one of: " + ", ".join(words[:MOST_LISTED]) + (f" ({more} more)" if more > 0 else "")


def content_of(path: Path, what: str, most: int, remedy: str, shorter: str) -> bytes:
    """Bytes of a regular file, `most` of them at most; InputError of `what` says what to give instead, or how to shorten it."""
    try:
        if not path.is_file():
            reason = "is not a regular file" if path.exists() else "there is no such regular file"
            raise InputError(what, str(path), reason, remedy)
        with path.open("rb") as stream:
            data = stream.read(min(path.stat().st_size, most) + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        raise InputError(what, str(path), reason, remedy) from None
    if len(data) > most:
        raise InputError(what, str(path), f"is larger than {most} bytes", shorter)
    return data


class StorageError(RuntimeError):
    """The disk refused a write; what was there before is intact. Exit code 1.

    `path`: the file that was to be written; `reason`: what the operating system said; `remedy`: what to do about it.
    """

    def __init__(self, path: str, reason: str, remedy: str) -> None:
        self.path = path
        self.reason = reason
        self.remedy = remedy
        super().__init__(path, reason, remedy)  # args, so that pickling keeps all three

    def __str__(self) -> str:
        return plain(f"cannot write {self.path}: {self.reason}. {self.remedy}")


_USER_ERRORS = {
    errno.EACCES: "Give yourself permission to write there, or choose another place",
    errno.EPERM: "Give yourself permission to write there, or choose another place",
    errno.EROFS: "The file system is read-only; choose another place",
    errno.ENOENT: "Make the directory first, or choose another place",
    errno.ENOTDIR: "A part of the path is a file; choose another place",
    errno.EISDIR: "A directory of this name is in the way; choose another name",
    errno.ENOTEMPTY: "A directory of this name is in the way; choose another name",
    errno.EEXIST: "A file of this name is in the way; choose another name",
    errno.ELOOP: "A symbolic link is in the way; choose another place",
    errno.ENAMETOOLONG: "Choose a shorter name",
}
_DISK_ERRORS = {
    errno.ENOSPC: "Free some space (or remove files, where there may be only so many), then run the same command again",
    errno.EDQUOT: "Your quota is used up: free some space, then run the same command again",
    errno.EMFILE: "Raise the limit of open files (ulimit -n), then run the same command again",
    errno.ENFILE: "Close other programs, then run the same command again",
    errno.EFBIG: "Raise the file size limit (ulimit -f), then run the same command again",
}


def refused(path: Path, error: OSError | ValueError) -> InputError | StorageError:
    """What to raise for an error met while writing `path`: a wrong place or a failing disk.

    A `ValueError` (a NUL character, text that no file name can be) is a wrong place.
    """
    if isinstance(error, ValueError):
        reason = "the system does not allow this name"
        return InputError("output", str(path), reason, "Choose another name")
    reason = os.strerror(error.errno) if error.errno else str(error)
    if error.errno in _USER_ERRORS:
        return InputError("output", str(path), reason, _USER_ERRORS[error.errno])
    remedy = _DISK_ERRORS.get(error.errno or 0, "Check the disk, then run the same command again")
    return StorageError(str(path), reason, remedy + "; results written earlier are intact")


class LimitError(RuntimeError):
    """The machine, or a limit that was set for the process, is too small for the work. Exit code 1."""


LEAST_ADDRESS_SPACE = 800
"""MB of it that one process takes to load the program and a compiled kernel, and some 100 more: libraries differ."""

LEAST_BESIDE_OTHERS = 1050
"""MB that each takes under an MPI launcher: the library maps buffers that it shares with the ranks of its node."""


def check_address_space(others: bool = False) -> None:
    """Raise LimitError where the process may not have enough address space (``ulimit -v``) to load everything.

    `others`: other ranks run beside it. To be called before anything is loaded: out of memory amid an import Python 3.11
    may raise the error for ever.
    """
    limit = host.address_space_limit()
    least = LEAST_BESIDE_OTHERS if others else LEAST_ADDRESS_SPACE
    if limit is not None and limit < least * 2**20:
        raise _out_of_memory(f"the limit of address space is {limit // 2**20} MB, it takes {least}")


def mendable(error: BaseException) -> InputError | LimitError | None:
    """What a user can do about an error that is no fault of the program; None if it may be one.

    Too little memory shows itself in many ways under a limit of address space (``ulimit -v``): libraries that cannot
    be mapped, errors from inside an import. Paths may be too long, or lead where nobody may look, for any call.
    """
    chain = list(_chain(error))
    for one in chain:
        number = one.errno if isinstance(one, OSError) else None
        if isinstance(one, OSError) and number in _DISK_ERRORS:
            place = one.filename or "output"
            return LimitError(f"{place}: {os.strerror(number)}. {_DISK_ERRORS[number]}")
        if isinstance(one, OSError) and number in _BAD_NAMES and one.filename is not None:
            name = one.filename
            name = os.fsdecode(name) if isinstance(name, bytes) else str(name)
            remedy = "Choose another name or place"
            return InputError("file", name, os.strerror(number or 0), remedy)
        if isinstance(one, ModuleNotFoundError) and one.name in host.UNIX_MODULES:
            reason = f"this command needs the module {one.name}, which only Unix has"
            return InputError("system", platform.system(), reason, host.WSL)
        if isinstance(one, MemoryError) or number == errno.ENOMEM:
            return _out_of_memory(str(one))
    limit, kinds = host.address_space_limit(), (ImportError, SystemError, OSError)
    if limit is not None and any(isinstance(one, kinds) for one in chain):
        return _out_of_memory(f"the limit of address space is {limit // 2**20} MB")
    return None


def _out_of_memory(why: str) -> LimitError:
    known = f" ({why})" if why else ""
    remedy = "Give the job more memory, or fewer ranks a node, and run the same command again"
    return LimitError(f"out of memory{known}. {remedy}")


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    """An error, and those that it came of."""
    seen: list[BaseException] = []
    while error is not None and error not in seen:
        yield error
        seen.append(error)
        error = error.__cause__ or error.__context__
