"""How this package compiles: the decorators, and the width of its vectors."""

from collections.abc import Hashable, Iterator
from contextlib import contextmanager

import llvmlite.binding
from numba import njit

from hpcclear.base.cached import Function, cached, features_in_use

FASTMATH = {"contract", "nsz", "arcp"}
"""Rewrites allowed in the kernel: none that changes what NaN or a clip does, none that reorders a sum."""


def doubles_in_a_vector() -> int:
    """Numbers that a vector register of this processor holds: 8, 4 or 2."""
    features = llvmlite.binding.get_host_cpu_features()
    if features.get("avx512f", False):
        return 8
    return 4 if features.get("avx", False) else 2


def doubles_in_use() -> int:
    """Numbers in the vectors that the compiler uses: half of the available ones where it prefers 256 bits."""
    half = "+prefer-256-bit" in features_in_use()
    return min(doubles_in_a_vector(), 4 if half else 8)


@contextmanager
def interleaved(lanes: int) -> Iterator[None]:
    """Have loops over so many lanes that are compiled inside taken all at once, vector by vector in one batch.

    The work on one vector waits for its own roots and quotients, and the processor looks too few instructions ahead to begin
    with the next: a force evaluation took one and a half times as long. LLVM would interleave only what needs no more
    registers than there are. Every number is computed as it would be alone.
    """
    option = "-force-vector-interleave={}"
    llvmlite.binding.set_option("", option.format(max(lanes // doubles_in_use(), 1)))
    try:
        yield
    finally:
        llvmlite.binding.set_option("", option.format(0))  # as LLVM finds best


def narrow_vectors() -> None:
    """Have the function that calls this use vectors of 256 bits at most, whatever the processor.

    For loops over coordinates, of which there are four as a rule: with 512 bits they do not fill one vector, and a single
    response by the pair took 1.4 times as long.
    """


_written: dict[object, str] = {}
_apart = set[object]()


def written_kind(function: object) -> str | None:
    """Whether calls of a function are written out, and in functions of which kind: "lane", "scalar" or None."""
    return _written.get(function) if isinstance(function, Hashable) else None


def lane_function(function: Function) -> Function:
    """Compile what runs inside a loop over lanes: inlined, branch-free, vectorised there."""
    compiled = njit(forceinline=True, error_model="numpy", fastmath=FASTMATH)(function)
    _written[compiled] = "lane"
    return compiled


def stands_apart(function: object) -> bool:
    """Whether it is marked by `apart`."""
    return function in _apart


def apart(compiled: Function) -> Function:
    """Have a function optimised on its own before it is inlined; to stand above the decorator that compiles.

    For sums of products: which of two products is fused with their sum goes by the order the compiler has put them in, and
    a function of its own is looked at whatever stands around its calls. Without this a sum may come out
    another way in one scene than in the next, in the last bit.
    """
    _apart.add(compiled)
    return compiled


def scalar_function(function: Function) -> Function:
    """Compile what runs for one lane or one point at a time."""
    compiled = cached(function)
    _written[compiled] = "scalar"
    return compiled
