"""Maximum likelihood of Kriging's length scales and variances, with gradients that cost no more than the likelihood.

For W = (alpha alpha' - K^-1) * S, elementwise, S the covariance without noise (of another kernel than the squared exponential,
what stands in its place: `kernels.with_slopes`), the derivative by the logarithm of a length scale is half the sum of
W_ij (z_i - z_j)^2 over all pairs, z that input over its length scale. Multiplied out, that is a product of W and z for all
length scales at once, in place of a matrix of derivatives for each.

Of many points the search begins on a part, where more starts cost little, and goes on with twice as many from the best that was
found. An input that a part sees no influence of has a length scale so long that nothing would ever shorten it again: where
the search leaves the first part, length scales are cut.

Sources: C. E. Rasmussen and C. K. I. Williams, "Gaussian Processes for Machine Learning" (2006), eqs. 5.8 and 5.9; the search
is that of scikit-learn's GaussianProcessRegressor (L-BFGS-B over logarithms, further starts uniform in these).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg.blas import dsymm, dsyr
from scipy.linalg.lapack import dpotrf, dpotri, dpotrs
from scipy.spatial.distance import cdist

from hpcclear.base.arrays import Array, Integers
from hpcclear.statistics.surrogate.kernels import (
    SQUARED_EXPONENTIAL,
    Errors,
    Kernel,
    correlation,
    with_slopes,
)

PART = 250
"""Points that the first part of many has at least; fewer than twice as many are searched as a whole."""
FURTHER = 6
"""Starts more on the first part, between these bounds of signal variance, length scales and noise variance."""
SPANS = (0.3, 10.0), (0.1, 1.0), (1e-6, 1e-3)
FLAT = 1e-6
"""Relative change of the likelihood below which it is at its most, where values have known errors."""
LONGEST = 1.0
"""Length scales are cut there when the search leaves the first part."""


@dataclass(frozen=True)
class Fitted:
    """What maximises the likelihood: length scales (d,) in the unit cube, variances over that of the values, and `alpha` (n,),
    ``K^-1 values``, noise in K.
    """

    length_scales: Array
    signal_variance: float
    noise_variance: float
    alpha: Array


def maximise(
    unit: Array,
    values: Array,
    known: Sequence[Array],
    bounds: Array,
    restarts: int,
    seed: int,
    *,
    kernel: Kernel = SQUARED_EXPONENTIAL,
    errors: Errors | None = None,
) -> Fitted:
    """The most likely signal variance, length scales and noise variance of values (n,) of mean 0 at points (n, d) in the unit
    cube.

    The search begins from those that are `known`, (d + 2,) each in this order, and from further `restarts` by the seed, within
    `bounds` (d + 2, 2). `errors`: what is known of those of the values; else they are all alike.
    """
    tolerance = FLAT if errors else None
    errors = errors or Errors(np.ones(len(values)))
    centred, limits = unit - 0.5, np.log(bounds)
    draws = np.random.RandomState(seed)
    starts = [np.log(one) for one in known]
    starts += [draws.uniform(limits[:, 0], limits[:, 1]) for _ in range(restarts)]
    parts = _parts(len(values), draws)
    if len(parts) > 1:
        low, high = np.log([SPANS[0], *[SPANS[1]] * unit.shape[1], SPANS[2]]).T
        starts += [np.clip(draws.uniform(low, high), *limits.T) for _ in range(FURTHER)]
    for number, part in enumerate(parts, 1):
        seen = centred[part], values[part], kernel, errors.of(part)
        top = _climbed(starts, limits, tolerance, *seen)
        if number == 1 < len(parts):
            top[1:-1] = np.minimum(top[1:-1], np.log(LONGEST))
        starts = [top]
    best = np.exp(top)
    scaled = unit / best[1:-1]
    covariance = best[0] * correlation(cdist(scaled, scaled, "sqeuclidean"), kernel)
    errors.added(covariance, float(best[-1]))
    factor, _ = dpotrf(covariance, lower=1)
    alpha, _ = dpotrs(factor, values, lower=1)
    return Fitted(best[1:-1], float(best[0]), float(best[-1]), alpha)


def _parts(count: int, draws: np.random.RandomState) -> list[Integers]:
    """Which points the search sees one time after the other, each twice as many; all of them at last."""
    sizes = [count]
    while sizes[0] >= 2 * PART:
        sizes.insert(0, sizes[0] // 2)
    order = draws.permutation(count)
    return [np.sort(order[:size]) for size in sizes]


def _climbed(starts: list[Array], limits: Array, tolerance: float | None, *of: Any) -> Array:
    """The best that is found from these starts, logarithms as `negative_likelihood` of so much takes them, shape (d + 2,)."""
    from scipy.optimize import minimize  # only fitting needs it

    given = {"args": of, "method": "L-BFGS-B", "jac": True, "bounds": limits, "tol": tolerance}
    found = [minimize(negative_likelihood, one, **given) for one in starts]
    return np.asarray(min(found, key=lambda one: float(one.fun)).x)


def negative_likelihood(
    theta: Array,
    centred: Array,
    values: Array,
    kernel: Kernel = SQUARED_EXPONENTIAL,
    errors: Errors | None = None,
) -> tuple[float, Array]:
    """Minus the log likelihood, and its gradient (d + 2,); infinite, and 0, where the covariance matrix cannot be factored.

    `theta` (d + 2,): logarithms of signal variance, length scales and noise variance; `centred` (n, d): points; `values` (n,)
    and `errors`: as `maximise` takes them.
    """
    noise, count = np.exp(theta[-1]), len(values)
    level = theta[0] if kernel == SQUARED_EXPONENTIAL else 0.0
    scaled = centred / np.exp(theta[1:-1])
    halves, ones = -0.5 * np.einsum("ij,ij->i", scaled, scaled), np.ones(count)
    # -|z_i - z_j|^2 / 2, with the logarithm of the signal where that is an exponent, as one product
    left, right = np.column_stack([scaled, halves + level, ones]), [scaled.T, ones, halves]
    exponents = left @ np.vstack(right)
    smooth, slopes = with_slopes(exponents, theta[0], kernel)
    covariance = smooth.copy()
    errors = errors or Errors(np.ones(count))
    errors.added(covariance, noise)
    # LAPACK and BLAS take the transpose without a copy, and touch its lower triangle only
    factor, failed = dpotrf(covariance.T, lower=1, overwrite_a=1, clean=0)
    if failed:
        return np.inf, np.zeros_like(theta)
    alpha, _ = dpotrs(factor, values, lower=1)
    logarithm = np.log(np.diag(factor)).sum()
    inverse, _ = dpotri(factor, lower=1, overwrite_c=1)
    noisy = noise * float((errors.own * (alpha**2 - np.diag(inverse))).sum())
    known = 0.0 if errors.common is None else _weighed(errors.common, alpha, inverse)
    weights = dsyr(-1.0, alpha, lower=1, a=inverse, overwrite_a=1)  # K^-1 - alpha alpha'
    weights *= slopes.T
    table = np.column_stack([scaled, ones])
    products = dsymm(-1.0, weights, table, lower=1)
    rows = products[:, -1]
    lengths = rows @ scaled**2 - np.einsum("ij,ij->j", scaled, products[:, :-1])
    # the sum of (alpha alpha' - K^-1) * S: all of K but the errors
    signal = rows.sum() if kernel == SQUARED_EXPONENTIAL else values @ alpha - count - noisy - known
    gradient = [0.5 * signal, *lengths, 0.5 * noisy]
    constant = 0.5 * count * np.log(2.0 * np.pi)
    return float(0.5 * values @ alpha + logarithm + constant), -np.array(gradient)


def _weighed(matrix: Array, alpha: Array, inverse: Array) -> float:
    """The sum of (alpha alpha' - K^-1) * a symmetric matrix, from the lower triangle of K^-1."""
    below = 2.0 * np.tril(inverse).ravel() @ matrix.ravel() - np.diag(inverse) @ np.diag(matrix)
    return float(alpha @ matrix @ alpha - below)
