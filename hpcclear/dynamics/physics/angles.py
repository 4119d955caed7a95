"""Sine and cosine by polynomial, since a library call keeps the compiler from vectorising the lanes."""

import math
from functools import partial

from hpcclear.base.bits import bits_of, double_of
from hpcclear.base.jit import apart, lane_function

# pi/2 in two parts: the first has zeros in its last bits, so that k * _HALF_PI_HIGH is exact for moderate k
_HALF_PI_HIGH = 1.5707963267341256
_HALF_PI_LOW = 6.077100506506192e-11
_ROUNDING = 6755399441055744.0  # 1.5 * 2**52: added, it rounds to a whole number and leaves that in the lowest bits


@lane_function
def with_sign(number, turn):
    """A number, with the other sign where the second lowest bit of a whole number is set: of the quarters that Sun's fdlibm
    (e_rem_pio2.c) counts, the lowest two bits say which of sine and cosine it is, and its sign."""
    return double_of(bits_of(number) ^ ((turn & 2) << 62))


# Neither "reassoc" nor "arcp" here: the two-part reduction relies on the order of the operations.
@apart
@partial(lane_function, fastmath={"contract"})
def sincos(angle):
    """Sine and cosine of an angle in rad, within 2e-16 absolute for |angle| < 1e4.

    Reduction to [-pi/4, pi/4], then the minimax polynomials of Sun's fdlibm (k_sin.c, k_cos.c).
    """
    shifted = angle * (2.0 / math.pi) + _ROUNDING
    quarter = shifted - _ROUNDING
    turn = bits_of(shifted)  # its lowest two bits: which quarter
    r = (angle - quarter * _HALF_PI_HIGH) - quarter * _HALF_PI_LOW
    z = r * r
    p = 1.58969099521155010221e-10
    p = p * z - 2.50507602534068634195e-08
    p = p * z + 2.75573137070700676789e-06
    p = p * z - 1.98412698298579493134e-04
    p = p * z + 8.33333333332248946124e-03
    p = p * z - 1.66666666666666324348e-01
    sine = r + r * (z * p)
    p = -1.13596475577881948265e-11
    p = p * z + 2.08757232129817482790e-09
    p = p * z - 2.75573143513906633035e-07
    p = p * z + 2.48015872894767294178e-05
    p = p * z - 1.38888888888741095749e-03
    p = p * z + 4.16666666666666019037e-02
    cosine = 1.0 - (0.5 * z - z * z * p)
    swapped = turn & 1 == 1
    s = cosine if swapped else sine
    c = sine if swapped else cosine
    return with_sign(s, turn), with_sign(c, turn + 1)
