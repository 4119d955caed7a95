"""Compiled functions that come from the cache on disk without what only compiling needs.

Before Numba loads machine code it imports its own library for compiled programs: arrays, strings, random numbers, linear
algebra. That took a third of the start of a command, and code that is compiled already calls nothing of it. Numba imports it
itself where it compiles.
"""

from types import MethodType
from typing import Any

from numba import njit
from numba.core.caching import Cache
from numba.core.ccallback import CFunc
from numba.core.runtime import rtsys
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import Signature


def _load_overload(cache: Any, signature: Any, context: Any) -> Any:
    """Load the machine code of a signature; None where it is not on disk. In place of `Cache.load_overload`."""
    rtsys.initialize(context)  # counts of references, which compiled code links to
    with cache._guard_against_spurious_io_errors():
        return cache._load_overload(signature, context)


def _lightly(compiled: Any) -> Any:
    """Give one function this way of loading; Numba's own stays where a version of it has other names."""
    if isinstance(compiled._cache, Cache) and hasattr(Cache, "_load_overload"):
        compiled._cache.load_overload = MethodType(_load_overload, compiled._cache)
    return compiled


def cached(function: Any, **options: Any) -> Any:
    """Compile a function for Python at its first call, or load it; `options` as those of `numba.njit`."""
    return _lightly(njit(cache=True, error_model="numpy", **options)(function))


def c_function(signature: Signature, function: Any, **options: Any) -> CFunc:
    """Compile a C function, or load it, as `numba.cfunc` does; callers take its ``address``."""
    compiled = CFunc(
        function,
        normalize_signature(signature),
        locals={},
        options={"error_model": "numpy", **options},
    )
    compiled.enable_caching()
    _lightly(compiled).compile()
    return compiled
