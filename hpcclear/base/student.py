"""Quantiles of Student's t, without SciPy's special functions, whose loading took a sixth of a response's whole time."""

import math
from functools import lru_cache
from statistics import NormalDist

import numpy as np

_MOST = 1000
"""Degrees of freedom above which the series is long, and less exact than SciPy."""

_SURE = 0.9999
"""Probability above which what is left of 1 is no longer exact to ten digits."""


@lru_cache(maxsize=256)
def student(confidence: float, freedom: float) -> float:
    """Two-sided quantile: what Student's t of so many degrees of freedom does not exceed with a probability of `confidence`.

    Newton's method on the distribution function, which is concave there: from the normal distribution's smaller quantile
    it comes closer from below with every step, until rounding ends it.
    """
    if not (1 <= freedom <= _MOST and freedom == int(freedom) and 0.0 <= confidence <= _SURE):
        from scipy.special import stdtrit

        return float(stdtrit(freedom, 0.5 + 0.5 * confidence))
    density = math.exp(math.lgamma(0.5 * (freedom + 1)) - math.lgamma(0.5 * freedom))
    density *= 2.0 / math.sqrt(math.pi * freedom)
    t, step = NormalDist().inv_cdf(0.5 + 0.5 * confidence), math.inf
    while step > 1e-15 * t:
        slope = density * (1.0 + t * t / freedom) ** (-0.5 * (freedom + 1))
        step = (confidence - _within(t, int(freedom))) / slope
        t += max(step, 0.0)
    return t


def _within(t: float, freedom: int) -> float:
    """Probability that Student's t lies between -t and t (Abramowitz and Stegun, Handbook, 26.7.3 and 26.7.4)."""
    angle = math.atan2(t, math.sqrt(freedom))
    cosine, odd = math.cos(angle), freedom % 2
    k = np.arange(2 + odd, freedom, 2.0)
    terms = np.cumprod((k - 1.0) / k * cosine**2)
    total = math.sin(angle) * cosine**odd * (1.0 + float(terms.sum()))
    if not odd:
        return total
    return 2.0 / math.pi * (angle + (total if freedom > 1 else 0.0))
