"""Compiled functions that come from this package's own cache on disk, without what only compiling needs.

The folder is this package's alone: of the host process, what Numba keeps where and compiles for what stays as it is.

Before Numba loads machine code it imports its own library for compiled programs: arrays, strings, random numbers, linear
algebra; and with code in which a function of that library is written out, the module of that function. That took a third of the
start of a command, and code that is compiled already calls nothing of it. Numba imports it itself where it compiles.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from types import MethodType
from typing import Any

from numba import config, njit
from numba.core import environment
from numba.core.caching import Cache
from numba.core.ccallback import CFunc
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import Signature

from hpcclear.base.code_folder import chosen_folder
from hpcclear.base.width import asked_width, features


@contextmanager
def _set(name: str, value: object, owner: object = config) -> Iterator[None]:
    """Have a setting of Numba inside the block, and the host's own behind it."""
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)


def _prepare() -> None:
    """Have Numba make its compiler for the vectors that this processor is fast with, if it has not made it yet.

    It is made once a process, for all that is compiled there; where the host has compiled before, its choice holds.
    """
    asked_width()  # refused if it is none, also where the user names the processor to Numba, and it says nothing
    chosen = config.CPU_FEATURES
    if config.ENABLE_AVX and config.CPU_NAME is None and chosen is None:
        chosen = features()
    with _set("CPU_FEATURES", chosen):
        cpu_target.target_context.codegen()


def features_in_use() -> str:
    """Features of the processor that Numba compiles for, as LLVM names them."""
    return str(cpu_target.target_context.codegen()._tm_features)


def _environment(module: str, constants: list[object], name: str) -> environment.Environment:
    """Make what machine code finds its module and its Python objects by. In place of `environment._rebuild_env`.

    Of Numba's own functions without such objects only the name of the module is used.
    """
    if constants or not module.startswith("numba.") or environment.lookup_environment(name):
        return _usual_environment(module, constants, name)
    made = environment.Environment({"__name__": module})
    made.env_name = name
    environment.Environment._memo[name] = made  # as Numba does: one for each name
    return made


_usual_environment: Any = getattr(environment, "_rebuild_env", None)


def _load_overload(cache: Any, signature: Any, context: Any) -> Any:
    """Load the machine code of a signature; None where it is not on disk. In place of `Cache.load_overload`."""
    rtsys.initialize(context)  # counts of references, which compiled code links to
    with cache._guard_against_spurious_io_errors(), _set("_rebuild_env", _environment, environment):
        return cache._load_overload(signature, context)


def _lightly(compiled: Any) -> Any:
    """Give one function this way of loading; Numba's own stays where a version of it has other names."""
    known = hasattr(Cache, "_load_overload") and _usual_environment is not None
    if known and isinstance(compiled._cache, Cache):
        compiled._cache.load_overload = MethodType(_load_overload, compiled._cache)
    return compiled


def cached(function: object, **options: object) -> Any:
    """Compile a function for Python at its first call, or load it; `options` as those of `numba.njit`."""
    with _set("CACHE_DIR", chosen_folder()):  # read where the function's own cache is made, here
        return _lightly(njit(cache=True, error_model="numpy", **options)(function))


def c_function(signature: Signature, function: Any, **options: Any) -> CFunc:
    """Compile a C function, or load it, as `numba.cfunc` does; callers take its ``address``."""
    compiled = CFunc(
        function,
        normalize_signature(signature),
        locals={},
        options={"error_model": "numpy", **options},
    )
    with _set("CACHE_DIR", chosen_folder()):
        compiled.enable_caching()
    _lightly(compiled).compile()
    return compiled


_prepare()
