"""Where compiled code is kept: a private cache that notices every change of source.

The folder's name holds a hash of all sources and of the versions that shape the code. What is in it runs, so it must belong to
the user and be closed to others.
"""

import contextlib
import hashlib
import os
import platform
import re
from functools import cache
from pathlib import Path

import llvmlite
import numpy as np

from hpcclear.base.private import private_folder


def _compiled_sources(root: Path) -> list[Path]:
    """Files whose code or constants end up in compiled functions: whatever compiles, the kernel, the status codes."""
    # of laws the texts are, each named by its content
    kernel = ("layout", "physics", "contacts", "linkage", "stepping")
    parts = {path for room in kernel for path in (root / "dynamics" / room).rglob("*.py")}
    compiles = re.compile(rb"jit|llvmlite|lowering")  # or emits what is compiled
    parts |= {path for path in root.rglob("*.py") if compiles.search(path.read_bytes())}
    names = ("numbered.py", "outcome.py", "unrolled.py")
    return sorted(parts | {root / "base" / name for name in names})


@cache
def source_key() -> str:
    """Hash of the sources that are compiled and of the versions that shape compiled code (16 hex digits).

    Read again where a source was written since; reading all of them takes a fortieth of a start.
    """
    root = Path(__file__).parent.parent
    versions = (llvmlite.__version__, np.__version__, platform.python_version())
    seen = hashlib.sha256(repr((str(root), versions, _listing(root))).encode()).hexdigest()
    kept = _place() / "sources"
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
        part = kept.with_name(f"sources.{os.getpid()}.part")
        part.write_text(f"{seen} {key} {_check(seen, key)}\n")
        os.replace(part, kept)
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
def _place() -> Path:
    """This package's own folder: on node-local disk by default, ``HPCCLEAR_CACHE`` names another parent."""
    return private_folder("HPCCLEAR_CACHE")


@cache
def chosen_folder() -> str:
    """Return the folder of the compiled code of these sources, made if need be."""
    folder = _place() / source_key()
    folder.mkdir(mode=0o700, exist_ok=True)
    return str(folder)
