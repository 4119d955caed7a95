"""Exponential, logarithm, powers and what is made of them, in arithmetic that vectorises, after Sun's fdlibm; to a few ulp."""

import math

from hpcclear.base.bits import bits_of, double_of, no_less
from hpcclear.base.exponentials import falling
from hpcclear.base.jit import lane_function

_OF_ARTANH = tuple(1.0 / k for k in range(21, 0, -2))
_OF_ARCTAN = tuple((k % 4 - 2.0) / k for k in range(23, 1, -2))


@lane_function
def exponential(x):
    """exp(x), between exp(-700) and exp(700)."""
    return falling(no_less(-x, -700.0))


@lane_function
def logarithm(x):
    """Natural logarithm of x > 0; some -709 of 0, NaN of NaN.

    x is m 2^e with m within a root of 2 of 1, and log m = 2 artanh((m - 1)/(m + 1)), by its series.
    """
    bits = bits_of(no_less(x, 2.2250738585072014e-308))
    # a whole number below 2^52 in the lowest bits of 2^52 is added to it
    exponent = double_of((bits >> 52) | 0x4330000000000000) - 4503599627371519.0
    m = double_of((bits & 0x000FFFFFFFFFFFFF) | 0x3FF0000000000000)
    large = m > 1.4142135623730951
    m = 0.5 * m if large else m
    exponent = exponent + 1.0 if large else exponent
    s = (m - 1.0) / (m + 1.0)
    q = s * s
    p = 1.0 / 23.0
    for factor in _OF_ARTANH:
        p = p * q + factor
    found = exponent * 1.9082149292705877e-10 + 2.0 * s * p + exponent * 0.6931471803691238
    return found if x == x else x


@lane_function
def power(x, y):
    """x**y of x >= 0; 0 of 0."""
    raised = exponential(y * logarithm(x))
    return raised if x > 0.0 else 0.0 * x


@lane_function
def tanh(x):
    """Hyperbolic tangent."""
    fallen = falling(2.0 * abs(x))
    return math.copysign((1.0 - fallen) / (1.0 + fallen), x)


@lane_function
def arctan(x):
    """Arc tangent, rad, within 1e-15: its argument brought below tan(pi/16) by two steps of a half angle."""
    a = abs(x)
    inverted = a > 1.0
    a = 1.0 / no_less(a, 1e-300) if inverted else a
    t = a / (1.0 + math.sqrt(1.0 + a * a))
    t = t / (1.0 + math.sqrt(1.0 + t * t))
    q = t * t
    p = -1.0 / 25.0
    for factor in _OF_ARCTAN:
        p = p * q + factor
    angle = 4.0 * (t - t * q * p)
    angle = 1.5707963267948966 - angle if inverted else angle
    return math.copysign(angle, x)
