"""Ramps of friction in the lanes (paper eqs. 9-10)."""

from hpcclear.base.bits import no_less, no_more
from hpcclear.base.jit import lane_function


@lane_function
def saturated(x):
    """Clip to [-1, 1]; NaN stays NaN."""
    return no_less(no_more(x, 1.0), -1.0)


@lane_function
def share_of(x):
    """Clip to [0, 1]; NaN stays NaN."""
    return no_less(no_more(x, 1.0), 0.0)
