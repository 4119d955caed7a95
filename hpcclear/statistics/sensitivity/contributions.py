"""Which input makes how much of the scatter of f, and what less scatter of it would bring, from samples that are there.

f is fitted by a cubic of each input and by products of each two, all standardised. What the terms of an input explain is its
contribution; inputs that vary together have one in common. With the scatter of inputs halved the fitted values are those at
half their distances from the mean, correlations as they were; what the fit does not explain stays as it is. Errors come from
leaving out one replicate at a time (jackknife), since points of one sequence are no independent ones.

Sources: A. Saltelli et al., "Global Sensitivity Analysis: The Primer" (2008), doi:10.1002/9780470725184; B. Sudret, "Global
sensitivity analysis using polynomial chaos expansions", Reliab. Eng. Syst. Saf. 93 (2008), doi:10.1016/j.ress.2007.04.002;
B. Efron and C. Stein, "The jackknife estimate of variance", Ann. Statist. 9 (1981), doi:10.1214/aos/1176345462.
"""

from collections.abc import Callable, Sequence
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

    `share` (inputs,): of the variance of f; inputs of one group have the same number, which is that of the group. `halved`
    (inputs,): by how much the standard deviation of f falls with half the scatter of an input, over it. `together`: from
    several inputs to this fall with the scatter of all of them halved at once, and its error; it does not follow from single
    ones, since correlations and interactions count. `rest`: share of the variance that no input explains by the fit.
    """

    share: Array
    share_error: Array
    halved: Array
    halved_error: Array
    together: Callable[[Sequence[int]], tuple[float, float]]
    rest: float
    rest_error: float


def contributions(inputs: Array, f: Array, groups: Sequence[int]) -> Contributions:
    """Contributions to the variance of f (r, n) of inputs (r, n, d): n points of each of r replicates.

    Failed simulations are NaN in f; inputs of one number in `groups` (d of them) vary together.
    """
    size, good = inputs.shape[2], np.isfinite(f)
    # inputs of each term, and its power where it has one input
    terms: list[Term] = [((k,), power) for k in range(size) for power in range(1, DEGREE + 1)]
    terms += [(pair, 1) for pair in combinations(range(size), 2)]
    if len(f) < 2 or good.sum() < FEWEST * (len(terms) + 1):
        return _always(np.nan, size)
    middle, scale = inputs[good].mean(axis=0), inputs[good].std(axis=0)
    x = (inputs - middle) / np.where(scale > 0.0, scale, 1.0)
    level = float(f[good].mean())
    if not float(f[good].std()) > 1e-9 * abs(level):
        return _always(0.0, size)
    each = ((own[kept], its[kept] - level) for own, its, kept in zip(x, f, good, strict=True))
    moments = np.array([_moments(*one, terms) for one in each])
    whole = _Fit(moments.sum(axis=0), terms)
    left = [_Fit(moments.sum(axis=0) - one, terms) for one in moments]

    def estimated(of: Callable[[_Fit], Sequence[float]]) -> tuple[Array, Array]:
        each = np.array([of(fit) for fit in left])
        squares = ((each - each.mean(axis=0)) ** 2).sum(axis=0)
        return np.array(of(whole)), np.sqrt((len(f) - 1.0) / len(f) * squares)

    def joint(chosen: Sequence[int]) -> tuple[float, float]:
        value, error = estimated(lambda fit: [fit.fall(chosen)])
        return float(value[0]), float(error[0])

    shares = estimated(lambda fit: fit.shares(groups))
    falls, errors = estimated(lambda fit: [fit.fall([k]) for k in range(size)])
    rest, doubt = estimated(lambda fit: [fit.rest])
    return Contributions(*shares, falls, errors, joint, float(rest[0]), float(doubt[0]))


def _always(value: float, size: int) -> Contributions:
    """One number for all that would be found."""
    each = np.full(size, value)
    return Contributions(each, each, each, each, lambda _: (value, value), value, value)


Term = tuple[tuple[int, ...], int]


def _moments(x: Array, f: Array, terms: Sequence[Term]) -> Array:
    """Sums of products of one, all terms and f, of some values."""
    columns = [np.prod(x[:, list(which)], axis=1) ** power for which, power in terms]
    table = np.column_stack([np.ones(len(f)), *columns, f])
    return np.asarray(table.T @ table)


class _Fit:
    """The fit of f by all terms, from their moments."""

    def __init__(self, moments: Array, terms: Sequence[Term]) -> None:
        self.terms, self.count = terms, float(moments[0, 0])
        means = moments[0, 1:] / self.count
        covariance = moments[1:, 1:] / self.count - np.outer(means, means)
        self.within, self.variance = covariance[:-1, :-1], float(covariance[-1, -1])
        found = np.linalg.lstsq(self.within, covariance[:-1, -1], rcond=1e-12)[0]
        self.weights = np.asarray(found, float)
        self.fitted = self._explained(self.weights)
        left = max(self.variance - self.fitted, 0.0)
        self.noise = left * self.count / max(self.count - len(terms) - 1.0, 1.0)

    def _explained(self, weights: Array) -> float:
        return float(weights @ self.within @ weights)

    @property
    def rest(self) -> float:
        """Share of the variance that is not explained."""
        return min(self.noise / self.variance, 1.0)

    def shares(self, groups: Sequence[int]) -> list[float]:
        """Of the variance, of the group of each input."""
        found = {}
        for group in set(groups):
            own = np.array([all(groups[i] == group for i in which) for which, _ in self.terms])
            part = self._explained(np.where(own, self.weights, 0.0))
            part -= self.noise * own.sum() / self.count  # a fit explains noise, too
            found[group] = max(part, 0.0) / self.variance
        return [found[group] for group in groups]

    def fall(self, chosen: Sequence[int]) -> float:
        """Of the standard deviation with the scatter of these inputs halved."""
        less = [LESS ** (power * sum(i in chosen for i in which)) for which, power in self.terms]
        change = self._explained(self.weights * less) - self.fitted
        return 1.0 - float(np.sqrt(max(self.variance + change, 0.0) / self.variance))
