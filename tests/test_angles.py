"""Sine and cosine of compiled motions: accurate in every quarter, far out, on the edges between quarters; NaN stays NaN."""

import math

import numpy as np
import pytest
from numba import njit

from hpcclear.dynamics.physics.angles import sincos


@njit
def of_all(angles):
    found = np.empty((2, len(angles)))
    for k in range(len(angles)):
        found[0, k], found[1, k] = sincos(angles[k])
    return found


def edges(quarters):
    """The doubles around odd multiples of 45 degrees, where one quarter's polynomials meet the next one's."""
    middle = (2 * quarters + 1) * (math.pi / 4.0)
    return np.concatenate([np.nextafter(middle, -np.inf), middle, np.nextafter(middle, np.inf)])


@pytest.mark.parametrize(
    "angles",
    [
        np.random.default_rng(1).uniform(-10.0, 10.0, 100_000),
        np.random.default_rng(2).uniform(-1e4, 1e4, 100_000),
        edges(np.arange(-6000, 6000)),
        np.arange(-6000, 6000) * (math.pi / 2.0),
        np.array([0.0, -0.0, 5e-324, -1e-300, 1e-9]),
    ],
    ids=["near", "far", "edges", "quarters", "small"],
)
def test_every_quarter_is_accurate(angles):
    s, c = of_all(angles)
    assert np.abs(s - np.sin(angles)).max() <= 2e-16
    assert np.abs(c - np.cos(angles)).max() <= 2e-16
    quarter = np.rint(angles / (math.pi / 2.0)).astype(int) % 4
    assert len(angles) < 10 or set(quarter) == {0, 1, 2, 3}  # each has its own signs


def test_what_is_no_angle_is_no_number():
    assert np.isnan(of_all(np.array([math.nan, math.inf, -math.inf]))).all()
