"""Where compiled code is kept: a private cache that notices every change of source.

Numba's own cache looks at one file only and serves stale code when a function in another file was edited. Here
the folder's name holds a hash of all sources and of the versions that shape the code. The cache is pickle,
so the folder must belong to the user and be closed to others.
"""

import contextlib
import hashlib
import os
import platform
import re
from functools import cache
from pathlib import Path

import llvmlite
import numba
import numpy as np

from hpcclear.base.kept import replace
from hpcclear.base.private import private_folder, refusal
from hpcclear.base.remarks import remark


def _compiled_sources(root: Path) -> list[Path]:
    """Files whose code or constants end up in compiled functions: whatever compiles, the kernel, the status codes."""
    # of laws the texts are, each named by its content
    kernel = ("layout", "physics", "contacts", "linkage", "stepping")
    parts = {path for room in kernel for path in (root / "dynamics" / room).rglob("*.py")}
    compiles = re.compile(rb"jit|numba|llvmlite|base\.cached")  # or emits what is compiled
    parts |= {path for path in root.rglob("*.py") if compiles.search(path.read_bytes())}
    names = ("numbered.py", "outcome.py", "unrolled.py")
    return sorted(parts | {root / "base" / name for name in names})


@cache
def source_key() -> str:
    """Hash of the sources that are compiled and of the versions that shape compiled code (16 hex digits).

    Read again where a source was written since; reading all of them takes a fortieth of a start.
    """
    root = Path(__file__).parent.parent
    versions = (numba.__version__, llvmlite.__version__, np.__version__, platform.python_version())
    seen = hashlib.sha256(repr((str(root), versions, _listing(root))).encode()).hexdigest()
    kept = _place()[0] / "sources"
    with contextlib.suppress(OSError, ValueError):
        before, key, check = kept.read_text().split()
        if before == seen and check == _check(seen, key):
            return key
    digest = hashlib.sha256()
    for path in _compiled_sources(root):
        digest.update(str(path.relative_to(root)).encode())
        digest.update(path.read_bytes())
    for version in versions:
        digest.update(version.encode())
    digest.update(str(root).encode())
    key = digest.hexdigest()[:16]
    with contextlib.suppress(OSError):  # another process reads the old file or the new one
        replace(kept, f"{seen} {key} {_check(seen, key)}\n".encode())
    return key


def _check(*words: str) -> str:
    """A digest by which a damaged file is known."""
    return hashlib.sha256(" ".join(words).encode()).hexdigest()[:16]


def _listing(root: Path) -> list[tuple[str, int, int, int, int]]:
    """Path, size, number, and times of the last write and change of every source, in order: no write leaves all as they are."""
    found, folders = [], [str(root)]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for one in entries:
                if one.name.endswith(".py"):
                    s = one.stat()
                    found.append((one.path, s.st_size, s.st_ino, s.st_mtime_ns, s.st_ctime_ns))
                elif one.name != "__pycache__" and one.is_dir():
                    folders.append(one.path)
    return sorted(found)


@cache
def _place() -> tuple[Path, bool]:
    """The user's ``NUMBA_CACHE_DIR`` and True, or where that is not the user's alone this package's own folder.

    Node-local disk by default; ``HPCCLEAR_CACHE`` names another parent. See `hpcclear.base.private.private_folder`.
    """
    named, why = os.environ.get("NUMBA_CACHE_DIR"), ""
    if named:
        own = Path(named).resolve()
        why = refusal(own)
        if not why:
            return own, True
    folder = private_folder("HPCCLEAR_CACHE")
    if named:
        remark(f"Warning: NUMBA_CACHE_DIR {named} {why}. Compiled code is kept in {folder}")
    return folder, False


@cache
def chosen_folder() -> str:
    """Return the folder of compiled code, made if need be: the user's, or one of these sources in this package's own."""
    place, named = _place()
    folder = place if named else place / source_key()
    folder.mkdir(mode=0o700, exist_ok=True)
    return str(folder)
