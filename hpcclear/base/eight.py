"""Vectors of eight numbers as values of compiled code, for eight samples in a batch.

The compiler makes vectors of short loops only where it can show that no store meets a load, which it cannot once a row's
place is a number that comes at run time; and every one of eight copies that are written out is read instead, which took
most of the time to compile. A vector is one value here, whatever rows it comes from. Where registers hold fewer numbers LLVM
splits it.
"""

import operator

from llvmlite import ir
from numba import types
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
