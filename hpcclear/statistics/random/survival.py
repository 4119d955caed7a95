"""Shares and quantiles of service lives, with confidence intervals for any number of them.

C. J. Clopper and E. S. Pearson, "The use of confidence or fiducial limits illustrated in the case of the binomial",
Biometrika 26 (1934), doi:10.1093/biomet/26.4.404.
"""

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array

CONFIDENCE = 0.95


def share_interval(
    hits: ArrayLike, draws: ArrayLike, confidence: float = CONFIDENCE
) -> tuple[Array, Array]:
    """Clopper and Pearson's two-sided confidence interval of a probability; 0 and 1 without draws. Arrays of any shape.

    Of so many independent `draws`, `hits` met the event; neither need be whole.
    """
    from scipy.special import betaincinv  # a fifth of a second, and pages need the quantiles alone

    hit = np.asarray(hits, dtype=float)
    rest, tail = np.asarray(draws) - hit, 0.5 * (1.0 - confidence)
    lower = betaincinv(np.where(hit > 0, hit, 1.0), rest + 1.0, tail)
    upper = betaincinv(hit + 1.0, np.where(rest > 0, rest, 1.0), 1.0 - tail)
    return np.where(hit > 0, lower, 0.0), np.where(rest > 0, upper, 1.0)


def quantiles(values: Array, levels: Array) -> Array:
    """Empirical quantiles over the first axis, shape (levels, ...); infinite values count, NaN are left out.

    The least value that at least that share of the values does not exceed: an infinite one stays infinite.
    """
    ordered, total = np.sort(values, axis=0), (~np.isnan(values)).sum(axis=0)  # NaN stand last
    rank = np.maximum(np.ceil(np.multiply.outer(levels, total)).astype(int) - 1, 0)
    return np.asarray(np.take_along_axis(ordered, rank, axis=0))


def rank_correlation(first: Array, second: Array) -> float:
    """Spearman's rank correlation of two samples (n,), of the rows that both know; NaN of fewer than four."""
    from scipy.stats import rankdata

    both = np.isfinite(first) & np.isfinite(second)
    if both.sum() < 4 or np.ptp(first[both]) == 0.0 or np.ptp(second[both]) == 0.0:
        return float("nan")
    return float(np.corrcoef(rankdata(first[both]), rankdata(second[both]))[0, 1])


def order_interval(values: Array, level: float, unknown: int = 0) -> tuple[float, float]:
    """95 % confidence interval of a quantile of independent, finite values (n,), by their order alone; NaN where too few are
    known.

    `level`: probability of staying below, strictly between 0 and 1. The interval holds wherever `unknown` further values lie,
    such as those of failed simulations.
    Source: H. A. David and H. N. Nagaraja, "Order Statistics" (2003), section 7.1, doi:10.1002/0471722162.
    """
    from scipy.special import bdtr

    total = len(values) + unknown
    if total == 0:
        return np.nan, np.nan
    tail = 0.5 * (1.0 - CONFIDENCE)
    below = bdtr(np.arange(total), total, level)  # of at most k values below the quantile
    lower = int(np.searchsorted(below, tail, side="right")) - 1 - unknown  # those may all be lowest
    upper = int(np.searchsorted(below, 1.0 - tail))
    ranked = np.sort(values)
    least = ranked[lower] if 0 <= lower < len(ranked) else np.nan
    most = ranked[upper] if upper < len(ranked) else np.nan
    return float(least), float(most)


def fewest(level: float) -> int:
    """Number of independent values from which on `order_interval` has both ends of the interval of a quantile."""
    tail = 0.5 * (1.0 - CONFIDENCE)
    return int(np.ceil(np.log(tail) / np.log(max(level, 1.0 - level)) - 1e-12))
