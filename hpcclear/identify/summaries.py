"""Summaries of features: each input of a machine as a regression on its features, and what the summaries leave of them.

The mean of an input given the features is the number that infers it best. A kernel ridge regression on the members of an
ensemble estimates it; its settings are those with the smallest leave-one-out errors.

Source: P. Fearnhead and D. Prangle, "Constructing summary statistics for approximate Bayesian computation",
J. R. Statist. Soc. B 74 (2012), doi:10.1111/j.1467-9868.2011.01010.x.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.distance import cdist

from hpcclear.base.arrays import Array, Integers

CUTS = (12, 24, 64)
"""Highest harmonics of the features that are tried: high ones have more information, but low ones depend more smoothly on the
inputs."""

SHARES = (0.0, 1.0)
"""Units of a feature that are tried: the variance of its noise, plus this share of its variance over the ensemble."""

LENGTHS = (1.0, 2.0, 4.0)
"""Length scales of the kernel that are tried, in units of the spread of the features."""

PENALTIES = (0.003, 0.01, 0.03, 0.1)
"""Penalties of the regression that are tried."""

LINEAR = 0.1
"""Share of a linear kernel, which continues beyond the members."""

FLOOR = 3e-3
"""Least noise of a feature, in units of its standard deviation over the ensemble: a model is not better than that."""

PREDICTABLE = 0.1
"""Share of an input's variance that its regression explains at least; others are no summaries."""


@dataclass(frozen=True)
class InputRegression:
    """An input, between 0 and 1, as a function of features.

    `centre`, `scale` (p,): mean of the features, and the reciprocals of their units, 0 where a feature is not used; `rows` (n,
    p): features of the members in these units; `weights` (n,); `left_out` (n,): of each member, by the regression without it.
    """

    centre: Array
    scale: Array
    rows: Array
    weights: Array
    length: float
    left_out: Array

    def __call__(self, features: Array) -> Array:
        """Return the input (m,) at features (m, p)."""
        rows = (features - self.centre) * self.scale
        return np.asarray(0.5 + _kernel(rows, self.rows, self.length) @ self.weights)


def regressions(
    features: Array, noise: Array, orders: Integers, places: Array
) -> tuple[InputRegression, ...]:
    """A regression of each input, of members at `places` (n, d) with features (n, p) that have noise as measured.

    `noise`, `orders` (p,): its variances, and the highest harmonic in each feature.
    """
    centre = features.mean(axis=0)
    best: list[InputRegression | None] = [None] * places.shape[1]
    least = np.full(places.shape[1], np.inf)
    for scale in _scales(features, noise, orders):
        rows = (features - centre) * scale
        for length in LENGTHS:
            values, axes = eigh(_kernel(rows, rows, length))
            turned = axes.T @ (places - 0.5)
            for penalty in PENALTIES:
                inverse = 1.0 / (values + penalty)
                weights = axes @ (inverse[:, None] * turned)
                error = weights / (axes**2 @ inverse)[:, None]
                size = (error**2).mean(axis=0)
                for k in np.flatnonzero(size < least):
                    left_out = places[:, k] - error[:, k]
                    best[k] = InputRegression(centre, scale, rows, weights[:, k], length, left_out)
                least = np.minimum(size, least)
    return tuple(one for one in best if one is not None)


def informative(made: tuple[InputRegression, ...], places: Array) -> tuple[InputRegression, ...]:
    """Return those that explain their inputs (n, d); one at least."""
    left = [np.mean((one.left_out - own) ** 2) for one, own in zip(made, places.T, strict=True)]
    explained = 1.0 - np.array(left) / places.var(axis=0)
    kept = explained > PREDICTABLE
    kept[int(np.argmax(explained))] = True
    return tuple(one for one, own in zip(made, kept, strict=True) if own)


def _scales(features: Array, noise: Array, orders: Integers) -> Iterator[Array]:
    """Reciprocal units (p,) of the features, by their highest harmonic and the unit of each."""
    spread = features.var(axis=0)
    masks = {(orders <= cut).tobytes(): orders <= cut for cut in CUTS}
    for mask in masks.values():
        for share in SHARES:
            unit = np.sqrt(noise + np.maximum(share, FLOOR**2) * spread)
            scale = np.where(mask & (unit > 0.0), 1.0 / np.where(unit > 0.0, unit, 1.0), 0.0)
            size = float(np.sqrt((spread * scale**2).sum()))
            if size > 0.0:
                yield scale / size


def _kernel(rows: Array, others: Array, length: float) -> Array:
    """Matern-5/2 kernel with a linear share, (m, n)."""
    distance = np.sqrt(5.0) * cdist(rows, others) / length
    smooth = (1.0 + distance + distance**2 / 3.0) * np.exp(-distance)
    return np.asarray(smooth + LINEAR * (rows @ others.T) / length**2)


@dataclass(frozen=True)
class Expected:
    """Features that members with the same summaries have, by ridge regression on trigonometric functions.

    `frequency` (q, t), `phase` (t,), `coefficients` (1 + q + t, p); `left` (n, p): what the regression without it leaves of
    each member's features.
    """

    frequency: Array
    phase: Array
    coefficients: Array
    left: Array

    @classmethod
    def of(cls, summaries: Array, features: Array, rng: np.random.Generator) -> "Expected":
        """Fit it to the members' summaries (n, q) and features (n, p)."""
        frequency = rng.standard_normal((summaries.shape[1], 60)) * 2.0
        phase = rng.uniform(0.0, 2.0 * np.pi, 60)
        terms = _terms(summaries, frequency, phase)
        solver = np.linalg.solve(terms.T @ terms + 0.3 * np.eye(terms.shape[1]), terms.T)
        coefficients = solver @ features
        share = np.einsum("ij,ji->i", terms, solver)
        left = (features - terms @ coefficients) / (1.0 - share)[:, None]
        return cls(frequency, phase, coefficients, left)

    def __call__(self, summaries: Array) -> Array:
        """Return the features (p,) of summaries (q,)."""
        terms = _terms(summaries[None], self.frequency, self.phase)
        return np.asarray((terms @ self.coefficients)[0])


def _terms(summaries: Array, frequency: Array, phase: Array) -> Array:
    """Terms (n, 1 + q + t) of the ridge regression."""
    waves = np.cos(summaries @ frequency + phase)
    return np.column_stack([np.ones(len(summaries)), summaries, waves])
