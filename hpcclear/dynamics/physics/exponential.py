"""A falling exponential without a branch or a library call, so that loops over lanes vectorise."""

import math

from hpcclear.base.bits import halved
from hpcclear.base.jit import lane_function

_MOST = 700.0
_PER_HALVING = 1.4426950408889634  # 1/ln 2
_LN2_HIGH, _LN2_LOW = 0.6931471803691238, 1.9082149292705877e-10


@lane_function
def falling(x):
    """exp(-x) for x >= 0 within two ulps, and exp(-700) beyond 700; NaN stays NaN.

    x is brought within half of ln 2 as in Sun's fdlibm (e_exp.c), and the rest is Taylor's series.
    """
    x = _MOST if x > _MOST else x
    k = math.floor(x * _PER_HALVING + 0.5)
    r = (k * _LN2_HIGH - x) + k * _LN2_LOW
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
    return (1.0 + (r + r * r * p)) * halved(k)
