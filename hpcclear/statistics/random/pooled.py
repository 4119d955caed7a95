"""What several estimates of like numbers say together of each of them: random effects.

The numbers scatter about a common mean, and each estimate has an error. Noisy estimates lean on the common mean, exact ones
stand by themselves. How large the mean and the scatter are is not known either: both are averaged over, weighted by how well
they explain the estimates. Beforehand they are about as large as is typical, or many times larger or smaller (half-Cauchy
densities): that decides where estimates are too noisy to show anything, and nowhere else.

Sources: D. B. Rubin, "Estimation in parallel randomized experiments", J. Educ. Stat. 6 (1981), doi:10.3102/10769986006004377;
A. Gelman, "Prior distributions for variance parameters in hierarchical models", Bayesian Analysis 1 (2006),
doi:10.1214/06-BA117A.
"""

import numpy as np

from hpcclear.base.arrays import Array

SIZES = np.geomspace(1e-3, 1e3, 37)
"""Of mean and scatter, over what is typical, that are averaged over."""


def together(values: Array, errors: Array, typical: float) -> tuple[Array, Array]:
    """Estimates of each of n numbers by all of them, and their standard errors; all NaN where nothing is known.

    Where a value or its error is NaN, only the others are known of that number. `typical`: how large they are as a rule.
    """
    known = np.isfinite(values) & np.isfinite(errors)
    if not known.any():
        return np.full(len(values), np.nan), np.full(len(values), np.nan)
    value, own = np.where(known, values, 0.0), np.where(known, errors, 0.0) ** 2
    # rows: all pairs of sizes of mean and scatter; columns: numbers
    large, scatter = (size.reshape(-1, 1) ** 2 for size in np.meshgrid(*[typical * SIZES] * 2))
    each = np.where(known, 1.0 / (own + scatter), 0.0)
    sharp = each.sum(axis=1, keepdims=True) + 1.0 / large
    mean = (each * value).sum(axis=1, keepdims=True) / sharp
    off = (each * (value - mean) ** 2).sum(axis=1, keepdims=True) + mean**2 / large
    logarithm = np.log(each[:, known]).sum(axis=1, keepdims=True) - np.log(large * sharp) - off
    before = [np.sqrt(size) / (1.0 + size / typical**2) for size in (large, scatter)]
    weights = np.exp(0.5 * (logarithm - logarithm.max())) * before[0] * before[1]
    weights /= weights.sum()
    counts = each * scatter  # what an estimate counts beside the mean
    found = mean + counts * (value - mean)
    doubt = np.where(known, counts * own, scatter) + (1.0 - counts) ** 2 / sharp
    middle = (weights * found).sum(axis=0)
    return middle, np.sqrt((weights * (doubt + (found - middle) ** 2)).sum(axis=0))
