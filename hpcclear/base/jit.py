"""How this package compiles: the decorators."""

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import TypeVar

FASTMATH = {"contract", "nsz", "arcp"}
"""Rewrites allowed in the kernel: none that changes what NaN or a clip does, none that reorders a sum."""

Function = TypeVar("Function", bound=Callable[..., object])


def narrow_vectors() -> None:
    """Have the function that calls this use vectors of 256 bits at most, whatever the processor.

    For loops over coordinates, of which there are four as a rule: with 512 bits they do not fill one vector, and a single
    response by the pair took 1.4 times as long.
    """


class KernelFunction:
    """A function of the kernel, for the lowering to write out where another of the same `kind` ("lane" or "scalar") calls it.

    Where Python or a function of Numba's calls it, Numba compiles it with `targetoptions`, and is loaded for that only: a
    fifth of the start of a command. `py_func`: the function as it was defined; `apart`: see there.
    """

    def __init__(self, function: Callable[..., object], kind: str, **options: object) -> None:
        update_wrapper(self, function)
        self.py_func, self.kind, self.targetoptions, self.apart = function, kind, options, False

    @cached_property
    def dispatcher(self) -> Callable[..., object]:
        """The function as Numba compiles it; on disk only what Python calls one by one is kept."""
        from hpcclear.base.cached import cached, inlined

        return (inlined if self.kind == "lane" else cached)(self.py_func, **self.targetoptions)

    def __call__(self, *arguments: object) -> object:
        """Call what Numba compiled."""
        return self.dispatcher(*arguments)

    @property
    def _numba_type_(self) -> object:
        return self.dispatcher._numba_type_  # type: ignore[attr-defined]


def lane_function(function: Function, fastmath: set[str] = FASTMATH) -> Function:
    """Compile what runs inside a loop over lanes: inlined, branch-free, vectorised there."""
    return KernelFunction(function, "lane", forceinline=True, fastmath=fastmath)  # type: ignore[return-value]


def apart(compiled: Function) -> Function:
    """Have a function optimised on its own before it is inlined; to stand above the decorator that compiles.

    For sums of products: which of two products is fused with their sum goes by the order the compiler has put them in, and
    a function of its own is looked at whatever stands around its calls. Without this a sum may come out
    another way in one scene than in the next, in the last bit.
    """
    compiled.apart = True  # type: ignore[attr-defined]
    return compiled


def scalar_function(function: Function) -> Function:
    """Compile what runs for one lane or one point at a time."""
    return KernelFunction(function, "scalar")  # type: ignore[return-value]
