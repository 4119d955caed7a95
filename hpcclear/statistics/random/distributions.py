"""Distributions of random inputs: draws, Gauss rules, integrals of a squared-exponential kernel.

Sources: G. H. Golub and J. H. Welsch, "Calculation of Gauss quadrature rules", Math. Comp. 23
(1969), doi:10.1090/S0025-5718-69-99647-1; W. Gautschi, "Orthogonal Polynomials" (2004), section 2.2
(discretised Stieltjes procedure).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import inf, isfinite, pi, sqrt

import numpy as np
from scipy.linalg import eigh_tridiagonal
from scipy.special import ndtr, roots_legendre

from hpcclear.base.errors import InputError
from hpcclear.base.normal import TAIL, truncated_quantile
from hpcclear.base.quantiles import Quantiles

FINE = 400
"""Legendre nodes of the inner products that define the rule of a truncated normal."""


@dataclass(frozen=True)
class Uniform:
    """Uniform between `lower` and `upper`."""

    lower: float
    upper: float

    def __post_init__(self) -> None:
        _check_limits(self.lower, self.upper)

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest value."""
        return self.lower, self.upper

    def draw(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """Independent draws, ``(size,)``."""
        return rng.uniform(self.lower, self.upper, size)

    def density(self, x: np.ndarray) -> np.ndarray:
        """Probability density at `x`, inside the support."""
        return np.full(np.shape(x), 1.0 / (self.upper - self.lower))

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and weights (they add up to 1) of the Gauss rule with `count` nodes."""
        nodes, weights = legendre(count)
        return self.lower + (self.upper - self.lower) * nodes, weights

    def kernel_integral(self, centres: np.ndarray, length: float) -> np.ndarray:
        """Expectation of ``exp(-(x - centre)**2 / (2 length**2))``, by error functions."""
        low, high = ((limit - centres) / length for limit in self.support)
        return sqrt(2 * pi) * length / (self.upper - self.lower) * _normal_between(low, high)


@dataclass(frozen=True)
class Normal:
    """Normal with the given mean and standard deviation.

    Draws, density and rules are cut off at `TAIL` deviations; `kernel_integral` is of all of it.
    """

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        _check_normal(self.mean, self.deviation)

    @property
    def cut(self) -> "TruncatedNormal":
        """What is left inside the support."""
        return TruncatedNormal(self.mean, self.deviation, *self.support)

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest value that counts: `TAIL` deviations either side."""
        return self.mean - TAIL * self.deviation, self.mean + TAIL * self.deviation

    def draw(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """Independent draws, ``(size,)``, clipped to the support."""
        return np.clip(rng.normal(self.mean, self.deviation, size), *self.support)

    def density(self, x: np.ndarray) -> np.ndarray:
        """Probability density at `x`, inside the support."""
        return self.cut.density(x)

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and weights (they add up to 1) of the Gauss rule with `count` nodes."""
        return self.cut.rule(count)  # Hermite nodes would go beyond the support

    def kernel_integral(self, centres: np.ndarray, length: float) -> np.ndarray:
        """Expectation of ``exp(-(x - centre)**2 / (2 length**2))``."""
        return _normal_kernel_integral(self.mean, self.deviation, centres, length, -inf, inf)


@dataclass(frozen=True)
class TruncatedNormal:
    """Normal with the given mean and standard deviation, cut off at `lower` and `upper`."""

    mean: float
    deviation: float
    lower: float
    upper: float

    def __post_init__(self) -> None:
        _check_normal(self.mean, self.deviation)
        _check_limits(self.lower, self.upper)
        if self._mass < 1e-9:
            raise InputError(
                "lower, upper",
                (self.lower, self.upper),
                "contain less than 1e-9 of the normal distribution",
                "choose bounds nearer to its mean",
            )

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest value."""
        return self.lower, self.upper

    @property
    def _limits(self) -> tuple[float, float]:
        return (self.lower - self.mean) / self.deviation, (self.upper - self.mean) / self.deviation

    @property
    def _mass(self) -> float:
        low, high = self._limits
        return float(_normal_between(np.float64(low), np.float64(high)))

    def draw(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """Independent draws, ``(size,)``, by inversion."""
        places = truncated_quantile(rng.random(size), *self._limits)
        return np.clip(self.mean + self.deviation * places, self.lower, self.upper)

    def density(self, x: np.ndarray) -> np.ndarray:
        """Probability density at `x`, inside the support."""
        return _bell((x - self.mean) / self.deviation) / (self.deviation * self._mass)

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and weights (they add up to 1) of the Gauss rule with `count` nodes."""
        nodes, weights = _truncated_rule(*self._limits, count)
        return np.clip(self.mean + self.deviation * nodes, self.lower, self.upper), weights

    def kernel_integral(self, centres: np.ndarray, length: float) -> np.ndarray:
        """Expectation of ``exp(-(x - centre)**2 / (2 length**2))``."""
        mean, deviation = self.mean, self.deviation
        whole = _normal_kernel_integral(mean, deviation, centres, length, self.lower, self.upper)
        return whole / self._mass


@dataclass(frozen=True)
class Samples:
    """Each of some values (in rising order, two or more) with equal chance: what was measured, or came of simulations.

    Nothing is made of what lies between them, so moments are those of the values themselves.
    """

    values: tuple[float, ...]

    def __post_init__(self) -> None:
        known = np.asarray(self.values, float)
        if len(known) < 2 or not np.isfinite(known).all() or (np.diff(known) < 0.0).any():
            raise InputError(
                "values", self.values, "not finite, not rising or fewer than two", "sort them"
            )

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest value."""
        return self.values[0], self.values[-1]

    def draw(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """Independent draws, ``(size,)``."""
        return rng.choice(np.array(self.values), size)

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and weights (they add up to 1) of the Gauss rule with `count` nodes."""
        return _sampled_rule(self.values, count)

    def piece(self, count: int, lower: float, upper: float) -> tuple[np.ndarray, np.ndarray]:
        """The same of the values from `lower` on and below `upper`, weights adding up to their share.

        The highest value belongs to the piece that ends with it.
        """
        low, high = self.support
        inside = tuple(x for x in self.values if lower <= x < upper or x == upper == high)
        if not inside:
            return np.full(count, np.clip(lower, low, high)), np.zeros(count)
        nodes, weights = _sampled_rule(inside, count)
        return nodes, weights * (len(inside) / len(self.values))

    def kernel_integral(self, centres: np.ndarray, length: float) -> np.ndarray:
        """Expectation of ``exp(-(x - centre)**2 / (2 length**2))``."""
        whole = np.zeros(np.shape(centres))
        for value in self.values:  # one after the other: centres may be many
            whole += np.exp(-0.5 * ((value - centres) / length) ** 2)
        return whole / len(self.values)


@dataclass(frozen=True)
class Tabled:
    """Any other that has no jumps, by its quantile function.

    What it integrates is summed at steps of its place in standard deviations of a normal, where the trapezoidal rule is good:
    what is smooth vanishes at both ends.
    """

    quantiles: Quantiles

    @property
    def support(self) -> tuple[float, float]:
        """Lowest and highest value that counts."""
        return self.quantiles.span

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        """Values, (m,), and their probabilities."""
        places = np.linspace(-TAIL, TAIL, FINE + 1)
        weights = np.exp(-0.5 * places**2)
        return self.quantiles(ndtr(places)), weights / weights.sum()

    def draw(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """Independent draws, ``(size,)``, by inversion."""
        return self.quantiles(rng.random(size) + 2.0**-54)

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Nodes and weights (they add up to 1) of the Gauss rule with `count` nodes."""
        values, weights = self._table
        middle = weights @ values
        scale = sqrt(weights @ (values - middle) ** 2)
        nodes, weights = _gauss_rule((values - middle) / scale, weights, count)
        return np.clip(middle + scale * nodes, *self.support), weights

    def kernel_integral(self, centres: np.ndarray, length: float) -> np.ndarray:
        """Expectation of ``exp(-(x - centre)**2 / (2 length**2))``."""
        values, weights = self._table
        steps = (values - np.asarray(centres)[..., None]) / length
        return np.exp(-0.5 * steps**2) @ weights


Distribution = Uniform | Normal | TruncatedNormal | Samples | Tabled


@lru_cache(maxsize=64)
def legendre(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (they add up to 1) of the Gauss-Legendre rule on [0, 1]; read-only."""
    nodes, weights = roots_legendre(count)
    nodes, weights = 0.5 * (1.0 + nodes), 0.5 * weights
    nodes.setflags(write=False)
    weights.setflags(write=False)
    return nodes, weights


def piece_rule(
    distribution: Distribution, count: int, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Rules over the part of the support between limits, ``(n, count)`` nodes and weights.

    The weights of a row add up to the probability of its part: 0 where the limits leave nothing.

    Raises
    ------
    InputError
        If the distribution is known by its quantiles alone.
    """
    if isinstance(distribution, Tabled):
        raise InputError("distribution", distribution, "has no known density", 'use "monte-carlo"')
    low, high = distribution.support
    if isinstance(distribution, Samples):
        rules = [distribution.piece(count, *ends) for ends in zip(lower, upper, strict=True)]
        return np.stack([one[0] for one in rules]), np.stack([one[1] for one in rules])
    low, high = np.maximum(lower, low)[:, None], np.minimum(upper, high)[:, None]
    width = np.maximum(high - low, 0.0)
    nodes, weights = legendre(count)
    places = low + width * nodes
    return places, width * weights * distribution.density(places)


def nodes_needed(
    distribution: Distribution, length: float, tolerance: float, most: int, *, pieces: bool = False
) -> int:
    """Fewest nodes that integrate every kernel, and every product of two, to `tolerance`.

    Second moments need the product of two kernels of length scale l, which is one of l / sqrt(2)
    about the middle of their centres (times a factor <= 1): so that narrower kernel is tested, with
    its centre all over the support and three length scales beyond.

    Parameters
    ----------
    length : float
        Length scale, in the unit of the distribution.
    tolerance : float
        Absolute; the kernel itself is at most 1.
    most : int
        Where to give up.
    pieces : bool
        Whether for `piece_rule` instead of the distribution's Gauss rule.

    Returns
    -------
    int
        0 if `most` nodes are not enough.
    """
    narrow = length / sqrt(2)
    low, high = distribution.support
    centres = np.linspace(low - 3 * narrow, high + 3 * narrow, 201)
    within = distribution.cut if isinstance(distribution, Normal) else distribution
    exact = within.kernel_integral(centres, narrow)
    ends = np.array([low]), np.array([high])
    for count in range(1, most + 1):
        if pieces:
            nodes, weights = (a[0] for a in piece_rule(distribution, count, *ends))
        else:
            nodes, weights = distribution.rule(count)
        kernels = np.exp(-0.5 * ((nodes[:, None] - centres) / narrow) ** 2)
        if abs(weights @ kernels - exact).max() <= tolerance:
            return count
    return 0


@lru_cache(maxsize=256)
def _truncated_rule(low: float, high: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss rule of the standard normal cut off at two limits (discretised Stieltjes)."""
    low, high = max(low, -TAIL - 3), min(high, TAIL + 3)
    nodes, weights = legendre(FINE)
    x = low + (high - low) * nodes
    weights = weights * np.exp(-0.5 * (x**2 - np.min(x**2)))
    return _gauss_rule(x, weights / weights.sum(), count)


@lru_cache(maxsize=256)
def _sampled_rule(values: tuple[float, ...], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss rule of values with equal chance; of no more different values than nodes, these themselves."""
    places, times = np.unique(np.array(values), return_counts=True)
    weights = times / times.sum()
    if len(places) > count:
        found = _gauss_rule(places, weights, count)
        return np.clip(found[0], values[0], values[-1]), found[1]
    missing = count - len(places)
    return np.append(places, np.full(missing, places[-1])), np.append(weights, np.zeros(missing))


def _gauss_rule(x: np.ndarray, weights: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss rule of masses `weights` at `x` (discretised Stieltjes), with fewer nodes than masses."""
    diagonal, side = np.zeros(count), np.zeros(count)
    before, now = np.zeros_like(x), np.ones_like(x)
    for k in range(count):
        diagonal[k] = weights @ (x * now**2)
        following = (x - diagonal[k]) * now - side[k] * before
        norm = sqrt(weights @ following**2)
        before, now = now, following / norm
        if k + 1 < count:
            side[k + 1] = norm
    places, vectors = eigh_tridiagonal(diagonal, side[1:])
    return places, vectors[0] ** 2 / (vectors[0] ** 2).sum()


def _normal_between(low: np.ndarray | np.float64, high: np.ndarray | np.float64) -> np.ndarray:
    """Probability of a standard normal between limits, keeping its digits in the upper tail."""
    flip = low > 0
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    return ndtr(high) - ndtr(low)


def _normal_kernel_integral(
    mean: float, deviation: float, centres: np.ndarray, length: float, lower: float, upper: float
) -> np.ndarray:
    """Integral of normal density times kernel between limits: the product is normal again."""
    width = sqrt(deviation**2 + length**2)
    narrow = deviation * length / width
    middle = (mean * length**2 + np.asarray(centres) * deviation**2) / width**2
    height = length / width * np.exp(-0.5 * ((centres - mean) / width) ** 2)
    return height * _normal_between((lower - middle) / narrow, (upper - middle) / narrow)


def _bell(z: np.ndarray) -> np.ndarray:
    return np.exp(-0.5 * np.square(z)) / sqrt(2 * pi)


def _check_limits(lower: float, upper: float) -> None:
    if not (isfinite(lower) and isfinite(upper) and lower < upper):
        raise InputError(
            "lower, upper", (lower, upper), "crossed or not finite", "give lower < upper"
        )


def _check_normal(mean: float, deviation: float) -> None:
    if not (isfinite(mean) and isfinite(deviation) and deviation > 0):
        raise InputError(
            "mean, deviation",
            (mean, deviation),
            "no normal distribution",
            "give a standard deviation > 0",
        )
