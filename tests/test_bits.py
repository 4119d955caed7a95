"""Limits without a branch: what is no number stays none, in lanes as alone, whichever side it stands on."""

import math

import numpy as np

from hpcclear.base.bits import no_less, no_more
from hpcclear.base.jit import FASTMATH
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import DOUBLE, Kind

VALUES = np.array(
    [-math.inf, -2.0, -1.0, -0.5, -5e-324, 0.0, 0.5, 1.0, 2.0, math.inf, math.nan] * 3
)


def limited(x, low, high):
    for k in range(len(x)):
        low[k], high[k] = no_less(x[k], -1.0), no_more(x[k], 1.0)


def test_limits_are_kept_and_nan_stays_nan():
    low, high = np.empty((2, len(VALUES)))
    Compiled(limited, [Kind("array", (DOUBLE, 1))] * 3, FASTMATH)(VALUES, low, high)
    np.testing.assert_array_equal(low, np.maximum(VALUES, -1.0))  # which hands NaN on
    np.testing.assert_array_equal(high, np.minimum(VALUES, 1.0))
    assert np.isnan(low).sum() == np.isnan(high).sum() == 3
