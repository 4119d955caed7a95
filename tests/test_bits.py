"""Limits without a branch: what is no number stays none, in lanes as alone, whichever side it stands on."""

import math

import numpy as np
from numba import njit

from hpcclear.base.bits import no_less, no_more

VALUES = np.array(
    [-math.inf, -2.0, -1.0, -0.5, -5e-324, 0.0, 0.5, 1.0, 2.0, math.inf, math.nan] * 3
)


@njit
def limited(x):
    low, high = np.empty(len(x)), np.empty(len(x))
    for k in range(len(x)):
        low[k], high[k] = no_less(x[k], -1.0), no_more(x[k], 1.0)
    return low, high


def test_limits_are_kept_and_nan_stays_nan():
    low, high = limited(VALUES)
    np.testing.assert_array_equal(low, np.maximum(VALUES, -1.0))  # which hands NaN on
    np.testing.assert_array_equal(high, np.minimum(VALUES, 1.0))
    assert np.isnan(low).sum() == np.isnan(high).sum() == 3
