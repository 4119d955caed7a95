"""Vectors of eight numbers as values of compiled code, for what has eight stages side by side.

The compiler makes vectors of short loops only where it can show that no store meets a load, which it cannot once a row's
place is a number that comes at run time; and Numba reads every one of eight copies that are written out instead, which took
most of the time to compile. A vector is one value here, whatever rows it comes from. Where registers hold fewer numbers LLVM
splits it.
"""

import operator

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel import models
from numba.core.extending import lower_builtin, register_model
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature

from hpcclear.base.jit import FASTMATH, emitted

EIGHT = 8
_ALIGNED = 8  # bytes that a row's address is known to be a multiple of


class Eight(types.Type):  # type: ignore[misc]
    """Numba's type of a vector of eight doubles."""

    def __init__(self) -> None:
        super().__init__("Eight")


eight = Eight()
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, EIGHT)
_FLAGS = tuple(sorted(FASTMATH))


@register_model(Eight)
class _EightModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager, kind):
        super().__init__(manager, kind, _VECTOR)


def _spread(builder, number):
    """A vector of eight times the same number."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, _index(0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), EIGHT), None)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), mask)


def _index(k):
    return ir.Constant(ir.IntType(32), k)


def _indices(first, count):
    kind = ir.VectorType(ir.IntType(32), count)
    return ir.Constant(kind, [_index(first + k) for k in range(count)])


def _place(context, builder, kind, array, row):
    """Address of a row of a flat array, as that of a vector."""
    data = context.make_array(kind)(context, builder, array).data
    start = builder.mul(row, ir.Constant(row.type, EIGHT))
    return builder.bitcast(builder.gep(data, [start]), _VECTOR.as_pointer())


_CASES = [
    signature(eight, eight, eight),
    signature(eight, eight, types.float64),
    signature(eight, types.float64, eight),
]
_OPERATIONS = (
    (operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv")
)  # fmt: skip


def _define(function, name):
    """`function` of two vectors, or of a vector and a number on either side."""

    class Template(ConcreteTemplate):  # type: ignore[misc]
        cases = _CASES

    infer_global(function)(Template)

    def lowered(context, builder, sig, args):
        vectors = [
            value if kind == eight else _spread(builder, value)
            for kind, value in zip(sig.args, args, strict=True)
        ]
        return getattr(builder, name)(*vectors, flags=_FLAGS)

    for case in _CASES:
        lower_builtin(function, *case.args)(lowered)


for _function, _name in _OPERATIONS:
    _define(_function, _name)


@emitted
def fetch(typingctx, array, row):
    """Row of a flat array of doubles: what stands from 8 row on."""

    def codegen(context, builder, sig, args):
        return builder.load(_place(context, builder, sig.args[0], *args), align=_ALIGNED)

    return eight(array, types.intp), codegen


@emitted
def put(typingctx, array, row, vector):
    """Put a vector into a row of a flat array of doubles."""

    def codegen(context, builder, sig, args):
        place = _place(context, builder, sig.args[0], *args[:2])
        builder.store(args[2], place, align=_ALIGNED)
        return context.get_dummy_value()

    return types.void(array, types.intp, eight), codegen


@emitted
def spread(typingctx, number):
    """A vector of eight times the same number."""

    def codegen(context, builder, sig, args):
        return _spread(builder, args[0])

    return eight(types.float64), codegen


@emitted
def nine_rows(typingctx, array, row):
    """Nine rows of a flat array, one after the other: kept in registers as far as there are any."""
    kind = types.UniTuple(eight, EIGHT + 1)

    def codegen(context, builder, sig, args):
        rows = [builder.add(args[1], ir.Constant(args[1].type, k)) for k in range(EIGHT + 1)]
        vectors = [
            builder.load(_place(context, builder, sig.args[0], args[0], one), align=_ALIGNED)
            for one in rows
        ]
        return context.make_tuple(builder, kind, vectors)

    return kind(array, types.intp), codegen


@emitted
def combined(typingctx, rows, first, array, row):
    """Nine rows times nine numbers, summed: `first`, then those of a row of a flat array."""

    def codegen(context, builder, sig, args):
        vectors = cgutils.unpack_tuple(builder, args[0])
        data = context.make_array(sig.args[2])(context, builder, args[2]).data
        start = builder.mul(args[3], ir.Constant(args[3].type, EIGHT))
        # two sums side by side: each addition waits for the one before
        sums = [builder.fmul(vectors[0], _spread(builder, args[1])), None]
        for k in range(EIGHT):
            place = builder.gep(data, [builder.add(start, ir.Constant(start.type, k))])
            number = _spread(builder, builder.load(place))
            product, which = builder.fmul(vectors[k + 1], number), (k + 1) % 2
            before = sums[which]
            sums[which] = product if before is None else builder.fadd(before, product)
        return builder.fadd(*sums)

    return eight(rows, types.float64, array, types.intp), codegen


@emitted
def total_of(typingctx, vector):
    """Sum of a vector's numbers, by halves."""

    def codegen(context, builder, sig, args):
        left, count = args[0], EIGHT
        while count > 1:
            count //= 2
            halves = [
                builder.shuffle_vector(
                    left, ir.Constant(left.type, ir.Undefined), _indices(first, count)
                )
                for first in (0, count)
            ]
            left = builder.fadd(*halves)
        return builder.extract_element(left, _index(0))

    return types.float64(eight), codegen


@emitted
def largest_of(typingctx, vector):
    """The largest of a vector's numbers; which of them where one is none is not said."""

    def codegen(context, builder, sig, args):
        numbers = [builder.extract_element(args[0], _index(k)) for k in range(EIGHT)]
        while len(numbers) > 1:
            pairs = zip(numbers[::2], numbers[1::2], strict=True)
            numbers = [builder.select(builder.fcmp_ordered(">", a, b), a, b) for a, b in pairs]
        return numbers[0]

    return types.float64(eight), codegen


@emitted
def either(typingctx, condition, vector, other):
    """The first of two vectors where a condition holds, else the second."""

    def codegen(context, builder, sig, args):
        return builder.select(args[0], args[1], args[2])

    return eight(types.boolean, eight, eight), codegen


@emitted
def above(typingctx, vector, yes, no):
    """Of two vectors, number by number, the first where a third is above 0, else the second."""

    def codegen(context, builder, sig, args):
        nothing = _spread(builder, ir.Constant(_DOUBLE, 0.0))
        return builder.select(builder.fcmp_ordered(">", args[0], nothing), args[1], args[2])

    return eight(eight, eight, eight), codegen


@emitted
def size(typingctx, vector):
    """A vector's numbers without their signs."""

    def codegen(context, builder, sig, args):
        kind = ir.VectorType(ir.IntType(64), EIGHT)
        mask = ir.Constant(kind, [ir.Constant(ir.IntType(64), (1 << 63) - 1)] * EIGHT)
        bits = builder.and_(builder.bitcast(args[0], kind), mask)
        return builder.bitcast(bits, _VECTOR)

    return eight(eight), codegen


@emitted
def column(typingctx, array, row, place):
    """What stands at a place of eight rows of a flat array, one after the other."""

    def codegen(context, builder, sig, args):
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        start = builder.add(builder.mul(args[1], ir.Constant(args[1].type, EIGHT)), args[2])
        vector = ir.Constant(_VECTOR, ir.Undefined)
        for k in range(EIGHT):
            address = builder.gep(data, [builder.add(start, ir.Constant(start.type, EIGHT * k))])
            vector = builder.insert_element(vector, builder.load(address), _index(k))
        return vector

    return eight(array, types.intp, types.intp), codegen
