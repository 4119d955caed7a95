"""Which input makes how much of the scatter of f, and what less scatter of it would bring, from samples that are there.

f is fitted by a cubic of each input and by products of each two, all standardised. What the terms of an input explain is its
contribution; inputs that vary together have one in common. With the scatter of an input halved the fitted values are those at
half its distance from the mean; what the fit does not explain stays as it is. Errors come from leaving out one replicate at a
time (jackknife), since points of one sequence are no independent ones.

Sources: A. Saltelli et al., "Global Sensitivity Analysis: The Primer" (2008), doi:10.1002/9780470725184; B. Sudret, "Global
sensitivity analysis using polynomial chaos expansions", Reliab. Eng. Syst. Saf. 93 (2008), doi:10.1016/j.ress.2007.04.002;
B. Efron and C. Stein, "The jackknife estimate of variance", Ann. Statist. 9 (1981), doi:10.1214/aos/1176345462.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from hpcclear.base.arrays import Array

DEGREE = 3
"""Of the polynomial in each input."""

LESS = 0.5
"""Of its scatter, that an input keeps."""

FEWEST = 4
"""Values for each term of the fit, at least."""


@dataclass(frozen=True)
class Contributions:
    """Of the inputs of one design; all NaN where there are too few values, 0 where f does not scatter.

    Attributes
    ----------
    share, share_error : array, shape (inputs,)
        Of the variance of f; inputs of one group have the same number, which is that of the group.
    halved, halved_error : array, shape (inputs,)
        By how much the standard deviation of f falls with half the scatter of an input, over it.
    rest, rest_error : float
        Share of the variance that no input explains by the fit.
    """

    share: Array
    share_error: Array
    halved: Array
    halved_error: Array
    rest: float
    rest_error: float


def contributions(inputs: Array, f: Array, groups: Sequence[int]) -> Contributions:
    """Contributions of inputs to the variance of f.

    Parameters
    ----------
    inputs : array, shape (r, n, d)
        n points of each of r replicates.
    f : array, shape (r, n)
        NaN where a simulation failed.
    groups : sequence of int, length d
        Inputs of one number vary together.
    """
    size, good = inputs.shape[2], np.isfinite(f)
    nothing = np.full(size, np.nan)
    unknown = Contributions(nothing, nothing, nothing, nothing, np.nan, np.nan)
    terms = _terms(size)
    if len(f) < 2 or good.sum() < FEWEST * (len(terms) + 1):
        return unknown
    middle, scale = inputs[good].mean(axis=0), inputs[good].std(axis=0)
    x = (inputs - middle) / np.where(scale > 0.0, scale, 1.0)
    level = float(f[good].mean())
    if not float(f[good].std()) > 1e-9 * abs(level):
        none = np.zeros(size)
        return Contributions(none, none, none, none, 0.0, 0.0)
    moments = np.array(
        [_moments(x[k][good[k]], f[k][good[k]] - level, terms) for k in range(len(f))]
    )
    whole = _found(moments.sum(axis=0), terms, groups)
    left = np.array([_found(moments.sum(axis=0) - one, terms, groups) for one in moments])
    errors = np.sqrt((len(f) - 1.0) / len(f) * ((left - left.mean(axis=0)) ** 2).sum(axis=0))
    rest = float(whole[-1]), float(errors[-1])
    return Contributions(whole[:size], errors[:size], whole[size:-1], errors[size:-1], *rest)


Term = tuple[tuple[int, ...], int]


def _terms(size: int) -> list[Term]:
    """Inputs of each term, and its power where it has one input."""
    single = [((k,), power) for k in range(size) for power in range(1, DEGREE + 1)]
    return [*single, *((pair, 1) for pair in combinations(range(size), 2))]


def _moments(x: Array, f: Array, terms: Sequence[Term]) -> Array:
    """Sums of products of one, all terms and f, of some values."""
    columns = [np.prod(x[:, list(which)], axis=1) ** power for which, power in terms]
    table = np.column_stack([np.ones(len(f)), *columns, f])
    return np.asarray(table.T @ table)


def _found(moments: Array, terms: Sequence[Term], groups: Sequence[int]) -> Array:
    """Shares, falls of the standard deviation, and the rest, (2 d + 1,)."""
    size, count = len(groups), float(moments[0, 0])
    means = moments[0, 1:] / count
    covariance = moments[1:, 1:] / count - np.outer(means, means)
    within, against, variance = covariance[:-1, :-1], covariance[:-1, -1], float(covariance[-1, -1])
    weights = np.asarray(np.linalg.lstsq(within, against, rcond=1e-12)[0], float)

    def explained(its: Array) -> float:
        return float(its @ within @ its)

    fitted = explained(weights)
    noise = max(variance - fitted, 0.0) * count / max(count - len(terms) - 1.0, 1.0)
    shares, falls = np.empty(size), np.empty(size)
    for group in set(groups):
        own = np.array([all(groups[i] == group for i in which) for which, _ in terms])
        part = (
            explained(np.where(own, weights, 0.0)) - noise * own.sum() / count
        )  # a fit explains noise, too
        shares[[i for i in range(size) if groups[i] == group]] = max(part, 0.0) / variance
    for i in range(size):
        less = np.array([LESS**power if i in which else 1.0 for which, power in terms])
        change = explained(weights * less) - fitted
        falls[i] = 1.0 - np.sqrt(max(variance + change, 0.0) / variance)
    return np.concatenate([shares, falls, [min(noise / variance, 1.0)]])
