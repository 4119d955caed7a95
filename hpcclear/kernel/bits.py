"""Cheap base-2 logarithm and exponential from the bits of a double: enough for a step-size factor, and vectorisable."""

from llvmlite import ir
from numba import types
from numba.core.extending import intrinsic

from ..jit import lane_function


@intrinsic
def _bits_of(typingctx, x):
    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), codegen


@intrinsic
def _double_of(typingctx, n):
    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), codegen


@lane_function
def rough_log2(x):
    """log2 of x >= 0 within 0.09; about -1023 for 0, above 1024 for NaN and infinity."""
    return _bits_of(x) * 2.220446049250313e-16 - 1023.0  # type: ignore[call-arg]


@lane_function
def rough_exp2(y):
    """2**y within 0.3 % for |y| < 1000."""
    y = y + 1023.0
    s = y - int(y)
    # the chord of 2**s overshoots it: a parabola takes most of the difference away
    bits = int((y - 0.3371894346 * s * (1.0 - s)) * 4503599627370496.0)
    return _double_of(bits)  # type: ignore[call-arg]


@intrinsic(prefer_literal=True)
def beyond(typingctx, array, offset):
    """View of a flat array from a constant offset on, at a distance the compiler knows (a slice's would be clamped first)."""

    def codegen(context, builder, signature, args):
        kind = signature.args[0]
        whole = context.make_array(kind)(context, builder, args[0])
        part = context.make_array(kind)(context, builder)
        data = builder.gep(whole.data, [ir.Constant(ir.IntType(64), offset.literal_value)])
        context.populate_array(
            part,
            data=data,
            shape=whole.shape,
            strides=whole.strides,
            itemsize=whole.itemsize,
            meminfo=whole.meminfo,
            parent=whole.parent,
        )
        view = part._getvalue()
        context.nrt.incref(builder, kind, view)
        return view

    return array(array, offset), codegen
