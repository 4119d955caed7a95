"""What the lowering of a text computes with: numbers as LLVM's values, and arrays and tuples that are known by their parts."""

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import NamedTuple, TypeAlias

import numpy as np
from llvmlite import ir

from hpcclear.base.eight import EIGHT

Value: TypeAlias = ir.Value
"""LLVM's, or what is known of Python (a number, a function, an array, None), or a tuple of these. llvmlite has no types."""
Flags: TypeAlias = Collection[str]
"""Rewrites that are allowed in arithmetic of doubles, as LLVM calls them."""

DOUBLE, WHOLE, TRUTH = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
VECTOR = ir.VectorType(DOUBLE, EIGHT)
ORDER = [TRUTH, WHOLE, DOUBLE, VECTOR]  # types of numbers, each of which holds those before


class Array(NamedTuple):
    """An array by its place in memory and its lengths, all of them LLVM's values; C order."""

    data: Value
    shape: tuple[Value, ...]


def whole(number: int) -> ir.Constant:
    """A whole number as a value."""
    return ir.Constant(WHOLE, number)


def wider(one: ir.Type | None, other: ir.Type) -> ir.Type:
    """The type of numbers that holds those of two types."""
    return other if one is None else max(one, other, key=ORDER.index)


class Kind(NamedTuple):
    """What an argument is, without its values: the same kinds have the same code."""

    of: Value
    """A type of numbers; "array" of `parts[0]` with `parts[1]` dimensions; a class of tuples; None; "known", not
    passed: `parts[1]` of the type `parts[0]`."""
    parts: tuple[Value, ...] = ()


DOUBLES, COUNTS = Kind(DOUBLE.as_pointer()), Kind(WHOLE.as_pointer())  # places of numbers in memory


def is_known(value: Value) -> bool:
    """Whether a value is Python's, and not LLVM's or a tuple with some of LLVM's."""
    if isinstance(value, tuple):
        return all(map(is_known, value))
    return not isinstance(value, ir.Value)


def kind_of(value: Value, known: bool = False) -> Kind:
    """The kind of a value: of LLVM, or as Python has it; where it counts as `known`, what Python has is part of the kind."""
    if value is None:
        return Kind(None)
    if isinstance(value, Array):
        return Kind("array", (value.data.type.pointee, len(value.shape)))
    if isinstance(value, np.ndarray):
        return Kind("array", (DOUBLE if value.dtype == np.float64 else WHOLE, value.ndim))
    if isinstance(value, tuple):
        return Kind(type(value), tuple(kind_of(one, known) for one in value))
    if isinstance(value, ir.Value):
        return Kind(value.type)
    if known:
        return Kind("known", (type(value), value))
    return Kind(DOUBLE if isinstance(value, float) else WHOLE)


def types_of(kind: Kind) -> Iterator[ir.Type]:
    """Types of the numbers and places that a value of a kind is passed as."""
    if kind.of == "array":
        yield kind.parts[0].as_pointer()
        yield from [WHOLE] * kind.parts[1]
    elif isinstance(kind.of, ir.Type):
        yield kind.of
    elif kind.of != "known":
        for part in kind.parts:
            yield from types_of(part)


def flat(value: Value) -> Iterator[Value]:
    """Numbers and places that a value is passed as; of an array of Python its address and lengths."""
    if isinstance(value, np.ndarray):
        assert value.flags.c_contiguous
        yield value.ctypes.data
        yield from value.shape
    elif isinstance(value, tuple):
        for part in value:
            yield from flat(part)
    elif value is not None:
        yield value


def gathered(kind: Kind, parts: Iterator[Value]) -> Value:
    """The value of a kind from what it was passed as."""
    if kind.of == "array":
        return Array(next(parts), tuple(next(parts) for _ in range(kind.parts[1])))
    if isinstance(kind.of, ir.Type):
        return next(parts)
    if kind.of == "known":
        return kind.parts[1]
    if kind.of is None:
        return None
    return rebuilt(kind.of, [gathered(one, parts) for one in kind.parts])


def rebuilt(maker: Callable[..., Value], items: Iterable[Value]) -> Value:
    """A tuple of a class, named or not."""
    return maker(*items) if hasattr(maker, "_fields") else tuple(items)


def wider_kind(one: Kind, other: Kind) -> Kind:
    """The kind that holds values of two kinds that differ in types of numbers at most."""
    if isinstance(one.of, ir.Type):
        return Kind(wider(one.of, other.of))
    if one.of == "array":
        return one
    return Kind(one.of, tuple(map(wider_kind, one.parts, other.parts)))
