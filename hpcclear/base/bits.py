"""From the bits of a double, vectorisable: a cheap base-2 logarithm and exponential, enough for a step-size factor, and exact
powers of two."""

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.extending import intrinsic

from hpcclear.base.jit import lane_function


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


@lane_function
def halved(k):
    """2**-k, exactly, for whole k from 0 to 1000."""
    # added to 1.5 * 2**52 a small whole number stands in the lowest bits; twelve of them become the exponent
    return _double_of(_bits_of(1023.0 - k + 6755399441055744.0) << 52)  # type: ignore[call-arg]


def _view(context, builder, kind, value, offset):
    """Array structure over the same numbers from `offset` on, without a count of references."""
    whole = context.make_array(kind)(context, builder, value)
    part = context.make_array(kind)(context, builder)
    context.populate_array(
        part,
        data=builder.gep(whole.data, [ir.Constant(ir.IntType(64), offset)]),
        shape=whole.shape,
        strides=whole.strides,
        itemsize=whole.itemsize,
        meminfo=None,
    )
    return part._getvalue()


@intrinsic(prefer_literal=True)
def beyond(typingctx, array, offset):
    """View of a flat array from a constant offset on, at a distance the compiler knows (a slice's would be clamped first).

    It does not keep the array alive.
    """

    def codegen(context, builder, signature, args):
        return _view(context, builder, signature.args[0], args[0], offset.literal_value)

    return array(array, offset), codegen


@intrinsic
def borrowed(typingctx, array):
    """The same array without its count of references; None stays None.

    Every function that is not inlined counts each array up and down with atomic instructions, which took a fifth of an
    implicit step. The caller keeps the array alive.
    """

    def codegen(context, builder, signature, args):
        if isinstance(array, types.NoneType):
            return args[0]
        return _view(context, builder, signature.args[0], args[0], 0)

    return array(array), codegen


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
