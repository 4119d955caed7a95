"""A folder that only its user can write to, for what is loaded without being checked, such as compiled code."""

import atexit
import contextlib
import getpass
import os
import shutil
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from hpcclear.base import host
from hpcclear.base.errors import InputError
from hpcclear.base.remarks import remark

_PROBE = 4096  # bytes; on a full disk a directory can often be made and nothing be written into it


def user_name() -> str:
    """Return the name of the user, or the number where the system knows no name."""
    try:
        return getpass.getuser()
    except (ImportError, KeyError, OSError):
        return str(host.user_number() or 0)


def private_folder(variable: str) -> Path:
    """Return a folder that belongs to the user and that nobody else can write to or exchange, made if need be.

    Candidates are, in this order: ``hpcclear-USER`` in the directory that the environment names by `variable`, else in the
    system's directory for temporary files; then ``hpcclear`` in the user's own cache, which is used with a remark. Where
    neither can be used it is a temporary one, which is removed at the end of the process.

    Raises InputError: nothing can be written anywhere.
    """
    refusals: list[str] = []
    for candidate in _candidates(variable):
        why = refusal(candidate)
        if not why:
            if refusals:
                remark(f"Warning: {'; '.join(refusals)}. Compiled code is kept in {candidate}")
            return candidate
        refusals.append(f"{candidate} {why}")
    try:
        last = Path(tempfile.mkdtemp(prefix="hpcclear-"))
    except OSError:
        reason = f"there is no place for compiled code ({'; '.join(refusals)})"
        remedy = "Set it to a directory of your own with free space"
        raise InputError(variable, os.environ.get(variable), reason, remedy) from None
    atexit.register(shutil.rmtree, last, ignore_errors=True)
    anew = "Compiled code is not kept: every command compiles anew"
    remark(f"Warning: {'; '.join(refusals)}. {anew}")
    return last


def _candidates(variable: str) -> Iterator[Path]:
    name = f"hpcclear-{user_name()}"
    if os.environ.get(variable):
        yield Path(os.environ[variable]).absolute() / name
    else:
        with contextlib.suppress(OSError):  # it looks for a place that can be written to
            yield Path(tempfile.gettempdir()).absolute() / name
    with contextlib.suppress(RuntimeError):  # a user without a home
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        yield home.absolute() / "hpcclear"


def refusal(folder: Path) -> str:
    """Make a folder; return why code that is loaded unchecked cannot be kept in it, or nothing."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        about = folder.lstat()
        user = host.user_number()
        if not stat.S_ISDIR(about.st_mode) or user not in (None, about.st_uid):
            return "is not a directory of yours"
        # on native Windows the directory of temporary files is the user's own
        if user is not None and about.st_mode & 0o077:
            return "is open to others (chmod 700 mends that)"
        for parent in () if user is None else folder.resolve().parents:
            if _exchangeable(parent.stat()):
                return f"can be exchanged by whoever may write to {parent}"
    except OSError as error:
        return f"cannot be made ({error.strerror})"
    try:
        with tempfile.TemporaryFile(dir=folder) as trial:
            trial.write(bytes(_PROBE))
            trial.flush()
    except OSError as error:
        return f"cannot be written to ({error.strerror or error})"
    return ""


def _exchangeable(about: os.stat_result) -> bool:
    """Whether somebody other than the user and root may rename what is in a directory."""
    if about.st_uid not in _trusted_users():
        return True
    if about.st_mode & stat.S_ISVTX:
        return False
    return bool(about.st_mode & 0o002) or (bool(about.st_mode & 0o020) and not _own_group(about))


def _trusted_users() -> set[int]:
    """Numbers of the user and of root, who in a container without a root of its own shows up as the overflow user."""
    trusted = {0, host.user_number() or 0}
    with contextlib.suppress(OSError, ValueError):
        maps = [line.split() for line in Path("/proc/self/uid_map").read_text().splitlines()]
        if not any(int(inside) == 0 for inside, _, _ in maps):
            trusted.add(int(Path("/proc/sys/kernel/overflowuid").read_text()))
    return trusted


def _own_group(about: os.stat_result) -> bool:
    """Whether a directory's group is root's, or the user's alone: the one that many systems make for each user."""
    if about.st_gid == 0:
        return True
    name, members = host.group_members(about.st_gid)
    return name == user_name() and members <= {user_name()}
