"""Vectors of eight as values of compiled code, against NumPy."""

import re
from pathlib import Path

import numpy as np
import pytest
from numba import njit

import hpcclear
from hpcclear.base import eight
from hpcclear.base.code_folder import _compiled_sources
from hpcclear.base.eight import above, fetch, put, size, spread

ROWS = 24


@njit
def operate(m, number):
    a, b = fetch(m, 0), fetch(m, 1)
    put(m, 2, a + b * number - number / a)
    put(m, 3, (number - a) * (b + number) / (a * b))
    put(m, 4, size(a))
    put(m, 5, above(a, b, spread(number)))


@njit
def copy_behind(m, row):
    put(m, row + 1, fetch(m, row))


@pytest.fixture
def rows():
    return np.random.default_rng(8).normal(size=(ROWS, eight.EIGHT))


def test_operations_go_number_by_number(rows):
    a, b = rows[0].copy(), rows[1].copy()
    operate(rows.ravel(), 0.7)
    np.testing.assert_allclose(rows[2], a + b * 0.7 - 0.7 / a, rtol=1e-13)
    np.testing.assert_allclose(rows[3], (0.7 - a) * (b + 0.7) / (a * b), rtol=1e-13)
    np.testing.assert_array_equal(rows[4], abs(a))
    np.testing.assert_array_equal(rows[5], np.where(a > 0.0, b, 0.7))


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
    copy_behind(rows.ravel(), row)
    np.testing.assert_array_equal(rows[row + 1], before[row])
    others = [k for k in range(ROWS) if k != row + 1]
    np.testing.assert_array_equal(rows[others], before[others])
