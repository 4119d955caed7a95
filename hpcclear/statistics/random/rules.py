"""What moments of surrogates need of distributions: Gauss rules, integrals of a squared-exponential kernel.

Of uniform and normal laws by formula, of samples by the values themselves, of any other by its quantile function
(`hpcclear.base.quantiles`).

Sources: G. H. Golub and J. H. Welsch, "Calculation of Gauss quadrature rules", Math. Comp. 23
(1969), doi:10.1090/S0025-5718-69-99647-1; W. Gautschi, "Orthogonal Polynomials" (2004), section 2.2
(discretised Stieltjes procedure).
"""

from functools import lru_cache, singledispatch
from math import inf, pi, sqrt

import numpy as np
from scipy.linalg import eigh_tridiagonal
from scipy.special import ndtr, roots_legendre

from hpcclear.base.arrays import Array
from hpcclear.base.quantiles import TAIL, Empirical, Normal, Quantiles, Uniform

FINE = 400
"""Nodes of the inner products that define rules, and steps of a quantile function."""

Rule = tuple[np.ndarray, np.ndarray]
"""Nodes and weights."""


@singledispatch
def rule(law: Quantiles, count: int) -> Rule:
    """Gauss rule with `count` nodes, whose weights add up to 1."""
    values, weights = _table(law)
    middle = weights @ values
    scale = sqrt(weights @ (values - middle) ** 2)
    nodes, weights = _gauss_rule((values - middle) / scale, weights, count)
    return np.clip(middle + scale * nodes, *law.span), weights


@rule.register
def _(law: Uniform, count: int) -> Rule:
    nodes, weights = legendre(count)
    low, high = law.span
    return low + (high - low) * nodes, weights


@rule.register
def _(law: Normal, count: int) -> Rule:
    nodes, weights = _truncated_rule(*_limits(law), count)  # Hermite's would go beyond the span
    return np.clip(law.middle + law.deviation * nodes, *law.span), weights


@rule.register
def _(law: Empirical, count: int) -> Rule:
    return _sampled_rule(law.values, count)


@singledispatch
def kernel_integral(law: Quantiles, centres: Array, length: float) -> Array:
    """Expectation of ``exp(-(x - centre)**2 / (2 length**2))``; of a normal that is not cut off, over all of it.

    By quantiles it is summed at steps of the place in standard deviations of a normal, where the trapezoidal rule is good:
    what is smooth vanishes at both ends.
    """
    values, weights = _table(law)
    steps = (values - np.asarray(centres)[..., None]) / length
    return np.exp(-0.5 * steps**2) @ weights


@kernel_integral.register
def _(law: Uniform, centres: Array, length: float) -> Array:
    low, high = ((limit - centres) / length for limit in law.span)
    return sqrt(2 * pi) * length / (law.span[1] - law.span[0]) * _normal_between(low, high)


@kernel_integral.register
def _(law: Normal, centres: Array, length: float) -> Array:
    (lower, upper), mass = (-inf, inf), 1.0
    if law.reach != inf:
        (lower, upper), mass = law.span, float(_normal_between(*map(np.float64, _limits(law))))
    mean, deviation = law.middle, law.deviation
    width = sqrt(deviation**2 + length**2)  # the product of density and kernel is normal again
    narrow = deviation * length / width
    middle = (mean * length**2 + np.asarray(centres) * deviation**2) / width**2
    height = length / width * np.exp(-0.5 * ((centres - mean) / width) ** 2)
    return height * _normal_between((lower - middle) / narrow, (upper - middle) / narrow) / mass


@kernel_integral.register
def _(law: Empirical, centres: Array, length: float) -> Array:
    whole = np.zeros(np.shape(centres))
    for value in law.values:  # one after the other: centres may be many
        whole += np.exp(-0.5 * ((value - centres) / length) ** 2)
    return whole / len(law.values)


@lru_cache(maxsize=64)
def legendre(count: int) -> Rule:
    """Nodes and weights (they add up to 1) of the Gauss-Legendre rule on [0, 1]; read-only."""
    nodes, weights = roots_legendre(count)
    nodes, weights = 0.5 * (1.0 + nodes), 0.5 * weights
    nodes.setflags(write=False)
    weights.setflags(write=False)
    return nodes, weights


def nodes_needed(law: Quantiles, length: float, tolerance: float, most: int) -> int:
    """Fewest nodes that integrate every kernel, and every product of two, to `tolerance`; 0 if `most` nodes are not enough.

    Second moments need the product of two kernels of length scale l, which is one of l / sqrt(2)
    about the middle of their centres (times a factor <= 1): so that narrower kernel is tested, with
    its centre all over the support and three length scales beyond. The tolerance is absolute; the kernel itself is at most 1.
    """
    narrow = length / sqrt(2)
    low, high = law.span
    centres = np.linspace(low - 3 * narrow, high + 3 * narrow, 201)
    cut = law
    if isinstance(law, Normal) and law.reach == inf:
        cut = Normal(law.middle, law.deviation, TAIL * law.deviation)
    exact = kernel_integral(cut, centres, narrow)
    for count in range(1, most + 1):
        nodes, weights = rule(law, count)
        kernels = np.exp(-0.5 * ((nodes[:, None] - centres) / narrow) ** 2)
        if abs(weights @ kernels - exact).max() <= tolerance:
            return count
    return 0


@lru_cache(maxsize=64)
def _table(law: Quantiles) -> Rule:
    """Values of a law by its quantiles, (m,), and their probabilities."""
    places = np.linspace(-TAIL, TAIL, FINE + 1)
    weights = np.exp(-0.5 * places**2)
    return law(ndtr(places)), weights / weights.sum()


def _limits(law: Normal) -> tuple[float, float]:
    """Ends of its span in standard deviations."""
    low, high = law.span
    return (low - law.middle) / law.deviation, (high - law.middle) / law.deviation


@lru_cache(maxsize=256)
def _truncated_rule(low: float, high: float, count: int) -> Rule:
    """Gauss rule of the standard normal truncated at two bounds (discretised Stieltjes)."""
    low, high = max(low, -TAIL - 3), min(high, TAIL + 3)
    nodes, weights = legendre(FINE)
    x = low + (high - low) * nodes
    weights = weights * np.exp(-0.5 * (x**2 - np.min(x**2)))
    return _gauss_rule(x, weights / weights.sum(), count)


@lru_cache(maxsize=256)
def _sampled_rule(values: tuple[float, ...], count: int) -> Rule:
    """Gauss rule of values with equal chance; of no more different values than nodes, these themselves."""
    places, times = np.unique(np.array(values), return_counts=True)
    weights = times / times.sum()
    if len(places) > count:
        found = _gauss_rule(places, weights, count)
        return np.clip(found[0], values[0], values[-1]), found[1]
    missing = count - len(places)
    return np.append(places, np.full(missing, places[-1])), np.append(weights, np.zeros(missing))


def _gauss_rule(x: np.ndarray, weights: np.ndarray, count: int) -> Rule:
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
    """Probability of a standard normal between bounds, keeping its digits in the upper tail."""
    flip = low > 0
    low, high = np.where(flip, -high, low), np.where(flip, -low, high)
    return ndtr(high) - ndtr(low)
