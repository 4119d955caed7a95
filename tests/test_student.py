"""Quantiles of Student's t against SciPy's, for every number of degrees of freedom that the series is for and beyond it."""

import math

import pytest
from scipy.special import stdtrit

from hpcclear.base import student


@pytest.mark.parametrize("confidence", [0.0, 0.1, 0.5, 0.95, 0.99, 0.9999, 0.999999])
def test_quantiles_are_those_of_scipy(confidence):
    for freedom in (*range(1, 70), 99, 100, 511, 999, 1000, 1001, 2.5, 1e5):
        expected = stdtrit(freedom, 0.5 + 0.5 * confidence)
        assert student.student(confidence, freedom) == pytest.approx(expected, rel=1e-10, abs=1e-14)


def test_without_freedom_there_is_no_quantile_and_certainty_has_no_bound():
    assert math.isnan(student.student(0.95, 0))
    assert student.student(1.0, 3) == math.inf
