"""Shares and quantiles of lives, with limits that hold for any number of them.

C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated in the case of the binomial",
Biometrika 26 (1934), doi:10.1093/biomet/26.4.404.
"""

import numpy as np

from hpcclear.base.arrays import Array, Integers

CONFIDENCE = 0.95


def share_limits(count: Integers, total: int) -> tuple[Array, Array]:
    """Clopper and Pearson's 95 % limits of a probability, from `count` (n,) of `total`; 0 and 1 of none."""
    from scipy.special import betaincinv  # a fifth of a second, and pages need the quantiles alone

    count = np.asarray(count)
    if total == 0:
        return np.zeros(count.shape), np.ones(count.shape)
    tail = 0.5 * (1.0 - CONFIDENCE)
    rest = total - count
    lower = betaincinv(np.maximum(count, 1), rest + 1, tail)
    upper = betaincinv(count + 1, np.maximum(rest, 1), 1.0 - tail)
    return np.where(count > 0, lower, 0.0), np.where(rest > 0, upper, 1.0)


def quantiles(values: Array, levels: Array) -> Array:
    """Empirical quantiles over the first axis, shape (levels, ...); infinite values count, NaN are left out.

    The least value that at least that share of the values does not exceed: an infinite one stays infinite.
    """
    known = np.where(np.isnan(values), np.inf, values)
    ordered = np.sort(known, axis=0)
    total = (~np.isnan(values)).sum(axis=0)
    found = []
    for level in levels:
        rank = np.maximum(np.ceil(level * total).astype(int) - 1, 0)
        value = np.take_along_axis(ordered, rank[None], axis=0)[0]
        found.append(np.where(total > 0, value, np.nan))
    return np.stack(found)


def quantile_limits(values: Array, levels: Array) -> tuple[Array, Array]:
    """95 % limits of quantiles of values (n,) that are independent, (levels,) each: two of the ordered values.

    Whatever the distribution, a quantile lies between the values of two ranks with a binomial probability (H. A. David and
    H. N. Nagaraja, "Order Statistics" (2003), doi:10.1002/0471722162). NaN are left out; where there are too few values for a
    limit it is minus or plus infinity.
    """
    from scipy.special import bdtr

    ordered = np.sort(values[~np.isnan(values)])
    total, tail = len(ordered), 0.5 * (1.0 - CONFIDENCE)
    padded = np.concatenate([[-np.inf], ordered, [np.inf]])
    limits = np.empty((2, len(levels)))
    counts = np.arange(total + 1.0)
    for k, level in enumerate(levels):
        below = bdtr(counts, total, level) if total else np.ones(1)  # of at most so many values
        lower = int(
            (below <= tail).sum()
        )  # the largest rank with P(fewer values below) within the tail
        upper = int((below < 1.0 - tail).sum()) + 1
        limits[:, k] = padded[lower], padded[upper]
    return limits[0], limits[1]


def rank_correlation(first: Array, second: Array) -> float:
    """Spearman's rank correlation of two samples (n,), of the rows that both know; NaN of fewer than four."""
    from scipy.stats import rankdata

    both = np.isfinite(first) & np.isfinite(second)
    if both.sum() < 4 or np.ptp(first[both]) == 0.0 or np.ptp(second[both]) == 0.0:
        return float("nan")
    return float(np.corrcoef(rankdata(first[both]), rankdata(second[both]))[0, 1])
