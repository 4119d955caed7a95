"""What several estimates of like numbers say together of each of them: random effects.

The numbers scatter about a common mean, and each estimate has an error. Noisy estimates lean on the common mean, exact ones
stand by themselves. How much the numbers scatter is not known either: it is averaged over, weighted by how well it explains
the estimates.

Sources: D. B. Rubin, "Estimation in parallel randomized experiments", J. Educ. Stat. 6 (1981), doi:10.3102/10769986006004377;
A. Gelman, "Prior distributions for variance parameters in hierarchical models", Bayesian Analysis 1 (2006),
doi:10.1214/06-BA117A (all standard deviations of the scatter are equally likely beforehand).
"""

import numpy as np

from hpcclear.base.arrays import Array

EXACT = 1e-9
"""Error, over the largest of all numbers, below which an estimate counts as exact."""

LEAST, MOST, COUNT = 1e-4, 3.0, 200
"""Standard deviations of the scatter that are averaged over: over the largest difference and error, and how many."""


def together(values: Array, errors: Array) -> tuple[Array, Array]:
    """Estimates of each of n numbers by all of them, and their standard errors.

    Parameters
    ----------
    values, errors : array, shape (n,)
        Estimates and standard errors; where one of them is NaN, only the others are known of that number.

    Returns
    -------
    two arrays, shape (n,)
        All NaN where nothing is known.
    """
    known = np.isfinite(values) & np.isfinite(errors)
    if not known.any():
        return np.full(len(values), np.nan), np.full(len(values), np.nan)
    least = EXACT * float(abs(values[known]).max()) or EXACT
    error = np.where(known, np.maximum(errors, least), np.inf)
    value = np.where(known, values, 0.0)
    largest = max(float(np.ptp(values[known])), float(error[known].max()))
    scatter = largest * np.concatenate([[0.0], np.geomspace(LEAST, MOST, COUNT)])
    # rows: standard deviations of the scatter
    variances = error**2 + scatter[:, None] ** 2
    total = (1.0 / variances).sum(axis=1)
    mean = (value / variances).sum(axis=1) / total
    off = np.where(known, (value - mean[:, None]) ** 2 / variances, 0.0).sum(axis=1)
    logarithm = -0.5 * (np.log(variances[:, known]).sum(axis=1) + np.log(total) + off)
    weights = np.exp(logarithm - logarithm.max()) * np.gradient(scatter)
    weights /= weights.sum()
    own = np.where(
        known, scatter[:, None] ** 2 / variances, 0.0
    )  # what an estimate counts beside the mean
    found = mean[:, None] + own * (value - mean[:, None])
    beside = np.where(known, own * np.where(known, error, 0.0) ** 2, scatter[:, None] ** 2)
    doubt = beside + (1.0 - own) ** 2 / total[:, None]
    middle = weights @ found
    return middle, np.sqrt(weights @ (doubt + (found - middle) ** 2))
