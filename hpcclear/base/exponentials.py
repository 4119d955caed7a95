"""Exponentials that are vectorised, from the bits of a double: a cheap base-2 logarithm and exponential, enough for a step-size
factor, and a falling exponential that is good to the last digits.
"""

from hpcclear.base.bits import bits_of, double_of
from hpcclear.base.jit import lane_function


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
