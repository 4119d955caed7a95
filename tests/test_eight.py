"""Vectors of eight as values of compiled code, against NumPy."""

import re
from pathlib import Path

import numpy as np
import pytest
from numba import njit

import hpcclear
from hpcclear.base import eight
from hpcclear.base.eight import (
    above,
    column,
    combined,
    either,
    fetch,
    largest_of,
    nine_rows,
    put,
    size,
    spread,
    total_of,
)
from hpcclear.base.jit import _compiled_sources

ROWS = 24


@njit
def operate(m, number):
    a, b = fetch(m, 0), fetch(m, 1)
    put(m, 2, a + b * number - number / a)
    put(m, 3, (number - a) * (b + number) / (a * b))
    put(m, 4, size(a))
    put(m, 5, above(a, b, spread(number)))
    put(m, 6, either(number > 0.0, a, b))
    put(m, 7, either(number < 0.0, a, b))
    return total_of(a), largest_of(a)


@njit
def combine(m, first, row):
    put(m, row + 1, combined(nine_rows(m, 0), first, m, row))
    put(m, row + 2, column(m, 2, 3))


@pytest.fixture
def rows():
    return np.random.default_rng(8).normal(size=(ROWS, eight.EIGHT))


def test_operations_go_number_by_number(rows):
    a, b = rows[0].copy(), rows[1].copy()
    total, largest = operate(rows.ravel(), 0.7)
    assert total == pytest.approx(a.sum(), rel=1e-14)
    assert largest == a.max()
    np.testing.assert_allclose(rows[2], a + b * 0.7 - 0.7 / a, rtol=1e-13)
    np.testing.assert_allclose(rows[3], (0.7 - a) * (b + 0.7) / (a * b), rtol=1e-13)
    np.testing.assert_array_equal(rows[4], abs(a))
    np.testing.assert_array_equal(rows[5], np.where(a > 0.0, b, 0.7))
    np.testing.assert_array_equal(rows[6], a)
    np.testing.assert_array_equal(rows[7], b)


def test_what_is_no_number_is_not_above(rows):
    rows[0, ::2] = np.nan
    operate(rows.ravel(), 0.7)
    np.testing.assert_array_equal(rows[5, ::2], 0.7)


def test_whatever_emits_code_is_in_the_key_of_what_was_compiled():
    """Numba's own cache would serve what an older version of such a file had emitted."""
    package = Path(hpcclear.__file__).parent
    known = set(_compiled_sources(package))
    emitting = {
        path for path in package.rglob("*.py")
        if re.search(r"^\s*(from|import) (numba|llvmlite)", path.read_text(), re.MULTILINE)
    }  # fmt: skip
    assert Path(eight.__file__) in emitting
    assert emitting <= known


@pytest.mark.parametrize("row", [10, 20])
def test_rows_may_be_told_at_run_time(rows, row):
    before = rows.copy()
    combine(rows.ravel(), -1.5, row)
    expected = -1.5 * before[0] + before[row] @ before[1:9]
    np.testing.assert_allclose(rows[row + 1], expected, rtol=1e-12, atol=1e-13)
    np.testing.assert_array_equal(rows[row + 2], before[2:10, 3])
    others = [k for k in range(ROWS) if k not in (row + 1, row + 2)]
    np.testing.assert_array_equal(rows[others], before[others])
