"""Functions of statistics that Numba compiles, from this package's own cache on disk.

The folder is this package's alone: of the host process, what Numba keeps where and compiles for what stays as it is.
"""

import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import MethodType
from typing import TypeVar

from llvmlite import ir
from numba import config, njit, types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.caching import Cache, IndexDataCacheFile, NullCache
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.serialize import dumps
from numba.core.typing import Signature
from numba.extending import intrinsic, lower_builtin, overload, register_jitable, type_callable

from hpcclear.base import bits, kept
from hpcclear.base.code_folder import chosen_folder, source_key
from hpcclear.base.lock import Lock
from hpcclear.base.width import asked_width, features

Function = TypeVar("Function", bound=Callable[..., object])


@contextmanager
def _set(name: str, value: object) -> Iterator[None]:
    """Have a setting of Numba inside the block, and the host's own behind it."""
    before = getattr(config, name)
    setattr(config, name, value)
    try:
        yield
    finally:
        setattr(config, name, before)


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


class _Files:
    """Machine code of one function on disk, a file for each signature. In place of Numba's `IndexDataCacheFile`.

    That has an index beside the code: a process that is killed between the two, or one that writes at the same time, leaves an
    index that names the code of another signature.
    """

    def __init__(self, usual: IndexDataCacheFile) -> None:
        self._start = Path(usual._cache_path) / str(usual._index_name).removesuffix(".nbi")
        self._of = source_key(), usual._version, usual._source_stamp
        self._locks: dict[Path, Lock | None] = {}

    def _path(self, key: object) -> Path:
        name = kept.digest(repr((self._of, key)).encode()).hex()[:32]
        return self._start.with_name(f"{self._start.name}.{name}.code")

    def load(self, key: object) -> object:
        """What is kept for a key; where that is nothing, None, and this process alone compiles it until `release`."""
        path = self._path(key)
        content = kept.read(path)
        if content is None and path not in self._locks:
            with suppress(OSError):  # nothing is kept then
                path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._locks[path] = kept.lock(path)
            content = kept.read(path)  # by whoever had the lock before
        return None if content is None else pickle.loads(content)

    def save(self, key: object, data: object) -> None:
        """Keep what was compiled for a key."""
        kept.write(self._path(key), dumps(data))

    def flush(self) -> None:
        """Forget nothing: what is compiled anew replaces it."""

    def release(self) -> None:
        """Let others compile, or load what was compiled."""
        while self._locks:
            kept.unlock(self._locks.popitem()[1])


def _compile(compiled: CPUDispatcher, *signature: object) -> object:
    """Compile a function, or load it from this package's cache. In place of its own `compile`."""
    if isinstance(compiled._cache, NullCache):
        _keep(compiled)
    try:
        return type(compiled).compile(compiled, *signature)
    finally:
        if isinstance(compiled._cache, Cache) and isinstance(compiled._cache._cache_file, _Files):
            compiled._cache._cache_file.release()


def _keep(compiled: CPUDispatcher) -> None:
    """Give one function a cache of `_Files`."""
    with _set("CACHE_DIR", chosen_folder()), suppress(RuntimeError):  # no place can be written to
        compiled.enable_caching()  # reads the folder
    found = compiled._cache
    if isinstance(found, Cache):
        found._cache_file = _Files(found._cache_file)
        found._impl.locator.ensure_cache_path = lambda: None  # `_Files` makes it


def cached(function: Function, **options: object) -> Function:
    """Compile a function for Python at its first call, or load it; `options` as those of `numba.njit`."""
    compiled = njit(error_model="numpy", **options)(function)
    compiled.compile = MethodType(_compile, compiled)  # most functions are never called
    return compiled  # type: ignore[no-any-return]


def inlined(function: Function, **options: object) -> Function:
    """Compile a function for those that call it; `options` as those of `numba.njit`."""
    return njit(error_model="numpy", **options)(function)  # type: ignore[no-any-return]


def _convert(function: Function, given: types.Type, made: types.Type, to: ir.Type) -> None:
    """Register a function with Numba that reads the bits of a number as another type."""

    def lower(
        context: object, builder: ir.IRBuilder, signature: object, values: list[ir.Value]
    ) -> ir.Value:
        return builder.bitcast(values[0], to)

    type_callable(function)(lambda context: lambda x: made)
    lower_builtin(function, given)(lower)


@intrinsic
def _called_at(
    typing: object, address: types.Type, arrays: types.Type
) -> tuple[Signature, Callable[..., ir.Value]]:
    """Numba's form of `bits.call_at`."""

    def lower(
        context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: list[ir.Value]
    ) -> ir.Value:
        parts = zip(arrays.types, cgutils.unpack_tuple(builder, values[1]), strict=True)
        places = [context.make_array(kind)(context, builder, part).data for kind, part in parts]
        function = ir.FunctionType(ir.VoidType(), [place.type for place in places])
        builder.call(builder.inttoptr(values[0], function.as_pointer()), places)
        return context.get_dummy_value()

    return types.void(types.int64, arrays), lower


_prepare()
overload(bits.call_at)(lambda address, arrays: lambda address, arrays: _called_at(address, arrays))
_convert(bits.bits_of, types.float64, types.int64, ir.IntType(64))
_convert(bits.double_of, types.int64, types.float64, ir.DoubleType())
register_jitable(bits.no_less)
register_jitable(bits.no_more)
