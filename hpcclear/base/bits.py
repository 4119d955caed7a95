"""What is vectorised though no operator says it: bounds without a branch, bits of a double; arrays and functions at addresses.

The lowering (`hpcclear.base.lowering.arithmetic`) has instructions of its own for these. `hpcclear.base.cached` registers with
Numba those that Numba compiles.
"""

import struct


def bits_of(x):
    """The bits of a double as a whole number."""
    return struct.unpack("<q", struct.pack("<d", x))[0]


def double_of(n):
    """The double that a whole number is the bits of."""
    return struct.unpack("<d", struct.pack("<q", n))[0]


def no_less(x, least):
    """x, or `least` where that is more: one instruction without a branch. NaN stays NaN."""
    return least if least > x else x


def no_more(x, most):
    """x, or `most` where that is less. NaN stays NaN."""
    return most if most < x else x


def beyond(array, offset):
    """View of a flat array from an offset on, at a distance that the compiler knows where the offset is known."""
    return array[offset:]


def carray(address, shape):
    """The array of doubles at an address: in compiled code only."""
    raise NotImplementedError


def call_at(address, arrays):
    """Call the C function at an address with the places of a tuple's arrays; it returns nothing: in compiled code only.

    The compiler sees no more of it than that, so its caller is compiled without it, once for all.
    """
    raise NotImplementedError
