"""Global sensitivity: Sobol indices of independent inputs, with confidence intervals from randomised replicates.

They say which share of the variance of f over the whole box an input is responsible for, alone
(first order) and with all its interactions (total), where the first-order derivative only speaks
of one point. The inputs must be independent and uniform in their bounds: an inertia whose bounds
depend on a mass enters as the ratio, which is independent, not as the inertia.

Estimators: Saltelli et al. 2010 for the first order, Jansen 1999 for the total
(DOI 10.1016/j.cpc.2009.09.018, table 2, rows b and f), on independently scrambled Sobol sequences.
What differs between these replicates is the error: resampled points would ignore that a sequence
fills the box evenly. The indices are ratios of means over all points, and their error is the
jackknife's, which leaves out one replicate at a time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.student import student
from hpcclear.statistics.surrogate.metrics import ROUNDING

REPLICATES = 16
"""Replicates of a design. With fewer, Student's quantile makes intervals wider than the error needs: 1.09 times here, 1.21
with 8. With more, each sequence is shorter and the indices scatter more."""


@dataclass(frozen=True)
class SobolIndices:
    """Shares of the variance, without unit; NaN where f does not vary."""

    first: Array
    total: Array
    """first and total: shape (d,)."""
    first_interval: Array
    total_interval: Array
    """first_interval and total_interval, shape (d, 2); NaN where a single replicate is left."""
    variance: float
    """Of f over the box, in its squared unit."""


def sobol_design(bounds: ArrayLike, n_rows: int, rng: np.random.Generator) -> Array:
    """Points to simulate, (n_rows (d + 2), d): two samples A and B, then for each input A with that column of B.

    `bounds` (d, 2); `n_rows`: a power of two. The generator scrambles the Sobol sequences, `REPLICATES` of equal length.
    """
    box = np.asarray(bounds, float)
    d = len(box)
    replicates = min(REPLICATES, n_rows)
    length = n_rows // replicates
    unit = np.concatenate([qmc.Sobol(2 * d, rng=rng).random(length) for _ in range(replicates)])
    unit = np.stack([unit[:, :d], unit[:, d:]])
    a, b = box[:, 0] + unit * (box[:, 1] - box[:, 0])
    own = np.eye(d, dtype=bool)[:, np.newaxis]  # of each input, which column is B's
    return np.vstack([a, b, *np.where(own, b, a)])


def analyse_sobol(values: ArrayLike, n_inputs: int, *, confidence: float = 0.95) -> SobolIndices:
    """Indices from the values (n_rows (n_inputs + 2),) at the points of `sobol_design`, and their intervals.

    Values that are not finite are failed simulations; their rows are dropped. Raises InputError if fewer than two rows
    succeeded.
    """
    y = np.asarray(values, float).reshape(n_inputs + 2, -1)
    rows = np.arange(y.shape[1])
    replicate = rows * min(REPLICATES, len(rows)) // len(rows)
    finite = np.isfinite(y).all(axis=0)
    y, replicate = y[:, finite], replicate[finite]
    if y.shape[1] < 2:
        reason = "a simulation failed in nearly every row"
        remedy = "look at their status, correct the cause, or narrow the bounds"
        raise InputError("values", int(np.count_nonzero(~finite)), reason, remedy)
    first, total = indices = _indices(y)
    reach = _jackknife(y, replicate) * student(confidence, max(len(np.unique(replicate)) - 1, 1))
    alone, whole = np.stack([indices - reach, indices + reach], axis=-1)
    return SobolIndices(first, total, alone, whole, float(y[:2].var()))


def _jackknife(y: Array, replicate: Integers) -> Array:
    """Standard errors of `_indices`, shape (2, d), from what each replicate changes by being left out; NaN of one replicate."""
    names = np.unique(replicate)
    if len(names) < 2:
        return np.full((2, len(y) - 2), np.nan)
    without = np.stack([_indices(y[:, replicate != name]) for name in names])
    return np.asarray(((len(names) - 1) * without.var(axis=0)) ** 0.5)


def noise_share(values: Array, nearby: Array, variance: float) -> tuple[float, float]:
    """Share of a variance that is no input's, and its standard error: of f at points (n,) and right beside them (n,).

    Where motion is chaotic f has a part that any change of the inputs draws anew. It is in each total index, that of an input
    which does nothing included, and in no first-order one. NaN from fewer than four points that both succeeded.
    """
    halves = 0.5 * (values - nearby) ** 2
    halves = halves[np.isfinite(halves)]
    if len(halves) < 4 or not variance > 0.0:
        return np.nan, np.nan
    error = halves.std(ddof=1) / len(halves) ** 0.5
    return float(halves.mean() / variance), float(error / variance)


def _indices(y: Array) -> Array:
    """First-order and total indices, shape (2, d), from rows A, B, AB_1 ... AB_d, shape (d + 2, n)."""
    both = y[:2]
    if np.ptp(both) <= ROUNDING * np.abs(both).max():  # nothing to share out
        return np.full((2, len(y) - 2), np.nan)
    a, b, *mixed = y - both.mean()  # centred: the product below cancels less
    variance = both.var()
    first = np.array([np.mean(b * (m - a)) for m in mixed]) / variance
    total = np.array([np.mean((a - m) ** 2) for m in mixed]) / (2.0 * variance)
    return np.stack([first, total])
