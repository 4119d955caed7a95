"""Where compiled code is kept: a private cache that notices every change of source.

Numba's own cache looks at one file only and serves stale code when a function in another file was edited. Here
the folder's name holds a hash of all sources and of the versions that shape the code. The cache is pickle,
so the folder must belong to the user and be closed to others.
"""

import hashlib
import os
import platform
from functools import cache
from pathlib import Path

import llvmlite
import numba
import numpy as np

from hpcclear.base.private import private_folder, unwritable
from hpcclear.base.remarks import remark


def _compiled_sources(root: Path) -> list[Path]:
    """Files whose code or constants end up in compiled functions: whatever compiles, the kernel, the status codes."""
    # of laws the texts are, each named by its content
    kernel = ("layout", "physics", "contacts", "linkage", "stepping")
    parts = {path for room in kernel for path in (root / "dynamics" / room).rglob("*.py")}
    parts |= {path for path in root.rglob("*.py") if _compiles(path.read_bytes())}
    parts |= set((root / "base" / "text").glob("*.py"))
    return sorted(
        parts
        | {
            root / "base" / name
            for name in ("numbered.py", "one_text.py", "outcome.py", "unrolled.py")
        }
    )


def _compiles(source: bytes) -> bool:
    """Whether a file has what is compiled, or what emits it."""
    return any(word in source for word in (b"jit", b"numba", b"llvmlite", b"base.cached"))


@cache
def source_key() -> str:
    """Hash of the sources that are compiled and of the versions that shape compiled code (16 hex digits)."""
    root = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for path in _compiled_sources(root):
        digest.update(str(path.relative_to(root)).encode())
        digest.update(path.read_bytes())
    versions = (numba.__version__, llvmlite.__version__, np.__version__, platform.python_version())
    for version in versions:
        digest.update(version.encode())
    digest.update(str(root).encode())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Return this user's private folder for compiled code of these sources, made if need be.

    Node-local disk by default; ``HPCCLEAR_CACHE`` names another parent. See `hpcclear.base.private.private_folder`.
    """
    folder = private_folder("HPCCLEAR_CACHE") / source_key()
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


@cache
def chosen_folder() -> str:
    """Return the user's ``NUMBA_CACHE_DIR`` if it can be written to, else this package's own folder."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    if not named:
        return str(cache_folder())
    why = unwritable(Path(named))
    if not why:
        return named
    folder = str(cache_folder())
    remark(
        f"Warning: NUMBA_CACHE_DIR {named} cannot be written to ({why}). Compiled code is kept in {folder}"
    )
    return folder
