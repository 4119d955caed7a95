"""Vectors of eight as values of compiled code, against NumPy."""

import numpy as np
import pytest

from hpcclear.base import eight
from hpcclear.base.eight import above, fetch, put, size, spread
from hpcclear.base.jit import FASTMATH
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import DOUBLE, Kind

ROWS = 24


def operate(m, number):
    a, b = fetch(m, 0), fetch(m, 1)
    put(m, 2, a + b * number - number / a)
    put(m, 3, (number - a) * (b + number) / (a * b))
    put(m, 4, size(a))
    put(m, 5, above(a, b, spread(number)))


@pytest.fixture(params=["compiled", "Python"])
def operated(request):
    """`operate` by both."""
    kinds = [Kind("array", (DOUBLE, 1)), Kind(DOUBLE)]
    return operate if request.param == "Python" else Compiled(operate, kinds, FASTMATH)


@pytest.fixture
def rows():
    return np.random.default_rng(8).normal(size=(ROWS, eight.EIGHT))


def test_operations_go_number_by_number(rows, operated):
    a, b = rows[0].copy(), rows[1].copy()
    operated(rows.ravel(), 0.7)
    np.testing.assert_allclose(rows[2], a + b * 0.7 - 0.7 / a, rtol=1e-13)
    np.testing.assert_allclose(rows[3], (0.7 - a) * (b + 0.7) / (a * b), rtol=1e-13)
    np.testing.assert_array_equal(rows[4], abs(a))
    np.testing.assert_array_equal(rows[5], np.where(a > 0.0, b, 0.7))


def test_what_is_no_number_is_not_above(rows, operated):
    rows[0, ::2] = np.nan
    operated(rows.ravel(), 0.7)
    np.testing.assert_array_equal(rows[5, ::2], 0.7)
