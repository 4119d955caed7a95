"""Reliability indices over designs, from weighted draws at many designs of a region.

Of a single design thousands of draws are needed for the probability of a rare failure. Between designs of a small region its
index -Phi^-1(p) changes nearly linearly, so that the draws of all of them make one model: a quadratic polynomial of the design,
which has the level and the slopes at once. Draws at designs that fail often count by their relative error, those at designs
that hardly fail by the error in units of the allowed probability: that is where the edge between both is.

Source: R. W. M. Wedderburn, "Quasi-likelihood functions, generalized linear models, and the Gauss-Newton method", Biometrika 61
(1974) 439-447, doi:10.1093/biomet/61.3.439.
"""

from collections.abc import Callable

import numpy as np
from scipy.special import log_ndtr, ndtr

from hpcclear.base.arrays import Array
from hpcclear.statistics.random.tail import MOST, of_share

STEPS, LONGEST = 50, 0.5
"""Steps of a fit, and by how much one may change the index of a draw's design."""

PRIOR = 10.0
"""Standard deviation of what a coefficient is thought to be: indices over the whole range of a variable, or its square."""

RIDGE = 1e-2
"""Penalty of coefficients of a polynomial that is fitted to values."""

DISPERSION = 4.0
"""Variance of one draw over that of a count: weights differ, and half of the draws do not fail."""


def terms(places: Array) -> Array:
    """Terms of a quadratic polynomial, (n, d) to (n, 1 + d + d (d + 1) / 2)."""
    size = places.shape[1]
    first, second = np.triu_indices(size)
    return np.column_stack([np.ones(len(places)), places, places[:, first] * places[:, second]])


def quadratic(places: Array, values: Array, bounds: Array) -> Callable[[Array], Array]:
    """Fit a quadratic polynomial, as far as values need it, to those that are known, (n,) at (n, d), with bounds (d, 2)."""
    middle, half = bounds.mean(axis=1), np.diff(bounds, axis=1)[:, 0] / 2.0
    known = np.isfinite(values)
    table = terms((places[known] - middle) / half)
    penalty = np.full(table.shape[1], RIDGE)
    penalty[0] = 0.0
    found = np.linalg.solve(table.T @ table + np.diag(penalty), table.T @ values[known])
    return lambda points: np.asarray(terms((points - middle) / half) @ found)


def fitted(places: Array, failing: Array, allowed: float) -> Callable[[Array], Array]:
    """Fit the index over a region, and return it as a function of places, (n, d) to (n,).

    Parameters
    ----------
    places : array, shape (n, d)
        Of each draw's design, from the middle of the region, in units of the variables' ranges.
    failing : array, shape (n,)
        Weight of a draw that fails, else 0: on average the probability at its place.
    allowed : float
        Probability that is of interest.
    """
    table = terms(places)
    penalty = np.eye(table.shape[1]) / PRIOR**2
    first = np.zeros(table.shape[1])
    first[0] = of_share(min(max(failing.mean(), 1e-2 * allowed), 0.5))
    found = first.copy()
    for _ in range(STEPS):
        index = np.clip(table @ found, -MOST, MOST)
        chance = ndtr(-index)
        slope = np.exp(-0.5 * index**2 - log_ndtr(-index)) / np.sqrt(2.0 * np.pi)  # of log chance
        scale = DISPERSION * np.maximum(chance, allowed)
        score = -table.T @ (slope * (failing - chance) / scale) - penalty @ (found - first)
        information = (table.T * (slope**2 * chance / scale)) @ table + penalty
        step = np.linalg.solve(information, score)
        longest = float(abs(table @ step).max())
        found = found + step * min(1.0, LONGEST / max(longest, 1e-300))
        if longest < 1e-6:
            break
    return lambda places: np.asarray(np.clip(terms(places) @ found, -MOST, MOST))
