"""What is vectorised though no operator says it: bounds without a branch; from the bits of a double a cheap base-2 logarithm
and exponential, enough for a step-size factor, and a falling exponential that is good to the last digits.

The lowering (`hpcclear.base.lowering.arithmetic`) has instructions of its own for what is no lane function here.
"""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, register_jitable

from hpcclear.base.jit import lane_function


@intrinsic
def bits_of(typingctx, x):
    """The bits of a double as a whole number."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.IntType(64))

    return types.int64(types.float64), codegen


@intrinsic
def double_of(typingctx, n):
    """The double that a whole number is the bits of."""

    def codegen(context, builder, signature, args):
        return builder.bitcast(args[0], ir.DoubleType())

    return types.float64(types.int64), codegen


@register_jitable
def no_less(x, least):
    """x, or `least` where that is more: one instruction without a branch. NaN stays NaN."""
    return least if least > x else x


@register_jitable
def no_more(x, most):
    """x, or `most` where that is less. NaN stays NaN."""
    return most if most < x else x


@lane_function
def rough_log2(x):
    """log2 of x >= 0 within 0.09; about -1023 for 0, above 1024 for NaN and infinity."""
    return bits_of(x) * 2.220446049250313e-16 - 1023.0


@lane_function
def rough_exp2(y):
    """2**y within 0.3 % for |y| < 1000."""
    y = y + 1023.0
    s = y - int(y)
    # the chord of 2**s overshoots it: a parabola takes most of the difference away
    bits = int((y - 0.3371894346 * s * (1.0 - s)) * 4503599627370496.0)
    return double_of(bits)


@lane_function
def falling(x, most=700.0):
    """exp(-x) for x >= 0, to a few ulp, and no less than exp(-most); NaN stays NaN.

    x is brought within half of ln 2 as in Sun's fdlibm (e_exp.c), the rest is Taylor's series. Adding 1.5 * 2**52 rounds to a
    whole number and leaves it in the lowest bits, of which twelve become the exponent.
    """
    x = most if x > most else x
    shifted = 6755399441055744.0 - x * 1.4426950408889634
    power = shifted - 6755399441055744.0
    r = -x - power * 0.6931471803691238
    r = r - power * 1.9082149292705877e-10
    p = 1.6059043836821613e-10  # 1/13!
    p = p * r + 2.08767569878681e-09
    p = p * r + 2.505210838544172e-08
    p = p * r + 2.755731922398589e-07
    p = p * r + 2.7557319223985893e-06
    p = p * r + 2.48015873015873e-05
    p = p * r + 0.0001984126984126984
    p = p * r + 0.001388888888888889
    p = p * r + 0.008333333333333333
    p = p * r + 0.041666666666666664
    p = p * r + 0.16666666666666666
    p = p * r + 0.5
    p = p * r + 1.0
    p = p * r + 1.0
    return p * double_of((bits_of(shifted) + 1023) << 52)


def beyond(array, offset):
    """View of a flat array from an offset on, at a distance that the compiler knows where the offset is known."""
    return array[offset:]


@intrinsic
def call_at(typingctx, address, arrays):
    """Call the C function at an address with the places of a tuple's arrays; it returns nothing.

    The compiler sees no more of it than that, so its caller is compiled without it, once for all.
    """

    def codegen(context, builder, signature, args):
        parts = cgutils.unpack_tuple(builder, args[1])
        kinds = signature.args[1].types
        pointers = [
            context.make_array(kind)(context, builder, part).data
            for kind, part in zip(kinds, parts, strict=True)
        ]
        function = ir.FunctionType(ir.VoidType(), [pointer.type for pointer in pointers])
        builder.call(builder.inttoptr(args[0], function.as_pointer()), pointers)
        return context.get_dummy_value()

    return types.void(types.int64, arrays), codegen
