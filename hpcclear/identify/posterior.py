"""Posterior distribution of what is not known, given summaries of features, with intervals calibrated on the ensemble itself.

A Kriging model of each summary gives its mean over the inputs. The leave-one-out errors of these models are the scatter: chaos,
effects of few revolutions, measured noise and lack of fit. Its covariance makes the likelihood, a Student t, as chaos has
heavy tails.

Members of the ensemble are then treated as machines whose truth is known, each by models fitted without it. How far their
truths lie out, in half-widths, says by how much intervals have to be widened (conformal prediction), and how badly a signal
of the model itself may fit. Intervals are never made narrower.

Sources: P. Del Moral, A. Doucet and A. Jasra, "Sequential Monte Carlo samplers", J. R. Statist. Soc. B 68 (2006),
doi:10.1111/j.1467-9868.2006.00553.x; V. Vovk, A. Gammerman and G. Shafer, "Algorithmic Learning in a Random World" (2005).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from hpcclear.base.arrays import Array, Integers
from hpcclear.statistics.surrogate.fitting import fit_kriging
from hpcclear.statistics.surrogate.kriging import Kriging

FOLDS = 8
"""Groups of members, each predicted by models that were fitted without it."""

FREEDOM = 6.0
"""Degrees of freedom of the likelihood."""

NEAR = 0.12
"""Width of the neighbourhood, in the unit cube of the unknowns, over which the scatter of the model is averaged."""

SHRINKAGE = 0.1
"""Share of a covariance matrix that is taken from its diagonal."""

MOVES = 4
"""Steps of each particle at a temperature."""

LENGTHS = (0.1, 100.0)
"""Length scales of the models in the unit cube: shorter ones would interpolate chaos."""

LEVELS = (0.025, 0.5, 0.975)
"""Quantiles of an interval and its median."""


@dataclass(frozen=True)
class Likelihood:
    """Log-likelihood of places in the unit cube, given summaries of features."""

    models: tuple[Kriging, ...]
    scatter: Callable[[Array], Array]
    """Relative variance of the scatter (n,) at places (n, d)."""
    inverse: Array
    """Inverse covariance (q, q) of the scatter where its relative variance is 1."""

    def __call__(self, places: Array, summaries: Array) -> Array:
        """Log-likelihood (n,) of places (n, d), given summaries (q,)."""
        missed = summaries - np.column_stack([one.predict(places) for one in self.models])
        variance = self.scatter(places)
        square = ((missed @ self.inverse) * missed).sum(1) / variance
        power = 0.5 * (FREEDOM + len(summaries))
        return -power * np.log1p(square / FREEDOM) - 0.5 * len(summaries) * np.log(variance)


@dataclass(frozen=True)
class Model:
    """Models of an ensemble's summaries: of all members at `places` (n, d), and of all but one group.

    `summaries` (n, q), `rest` (n, p): of the members' features, each by regressions without the member, and what these leave
    of them; `likelihoods`: that of all members, then one for each group left out; `distances`, (p, p) each: inverse
    covariances of the rests, in the same order.
    """

    places: Array
    summaries: Array
    rest: Array
    likelihoods: tuple[Likelihood, ...]
    distances: tuple[Array, ...]

    @classmethod
    def of(
        cls, places: Array, summaries: Array, rest: Array, unknowns: int, rng: np.random.Generator
    ) -> "Model":
        """Fit the models; shapes as above, the first `unknowns` of the inputs are identified."""
        bounds = np.tile([0.0, 1.0], (places.shape[1], 1))
        fit = partial(fit_kriging, rng=rng, restarts=0, lengths=LENGTHS, kernel="matern-5/2")
        models = tuple(fit(places, column, bounds) for column in summaries.T)
        missed = np.column_stack([one.leave_one_out() for one in models]) - summaries
        missed[~np.isfinite(missed)] = 0.0
        scatter, covariance = _scatter(places[:, :unknowns], missed)
        inverse = np.asarray(np.linalg.inv(covariance), float)
        groups = np.arange(len(places)) % FOLDS
        kept = [np.ones(len(places), bool), *(groups != k for k in range(FOLDS))]
        fewer = (tuple(_without(one, rows) for one in models) for rows in kept)
        likelihoods = tuple(Likelihood(own, scatter, inverse) for own in fewer)
        distances = tuple(_inverse(rest[rows]) for rows in kept)
        return cls(places, summaries, rest, likelihoods, distances)

    def posterior(
        self, summaries: Array, particles: int, rng: np.random.Generator, group: int = -1
    ) -> Array:
        """Return particles (n, d) of the posterior, by the models that leave a group out; -1: none."""
        likelihood = self.likelihoods[group + 1]
        return sequential(lambda x: likelihood(x, summaries), self.places.shape[1], particles, rng)

    def fit(self, rest: Array, group: int = -1) -> float:
        """Return how far what the summaries leave of features (p,) lies from that of the members: 1 is usual."""
        return float(rest @ self.distances[group + 1] @ rest) / len(rest)


@dataclass(frozen=True)
class Calibration:
    """What members of the ensemble, treated as machines, teach about intervals and fits.

    `widening` (unknowns,): by which half-widths are multiplied, at least 1; `coverage` (unknowns,): share of members whose
    truth lies in the 95 % interval before; `fits` (members,): as of `Model.fit`.
    """

    widening: Array
    coverage: Array
    fits: Array

    @classmethod
    def of(
        cls, model: Model, unknowns: int, members: int, particles: int, seeds: Sequence[int]
    ) -> "Calibration":
        """Treat the first members as machines."""
        count = min(members, len(model.places))
        groups = np.arange(len(model.places)) % FOLDS
        out, fits = [], []
        for k in range(count):
            rng = np.random.default_rng([*seeds, 1, k])
            found = model.posterior(model.summaries[k], particles, rng, int(groups[k]))
            low, middle, high = np.quantile(found[:, :unknowns], LEVELS, axis=0)
            truth = model.places[k, :unknowns]
            side = np.where(truth < middle, middle - low, high - middle)
            out.append(np.abs(truth - middle) / np.maximum(side, 1e-9))
            fits.append(model.fit(model.rest[k], int(groups[k])))
        score = np.sort(np.array(out), axis=0)
        rank = min(int(np.ceil(0.95 * (count + 1))), count) - 1
        return cls(np.maximum(score[rank], 1.0), (score <= 1.0).mean(axis=0), np.array(fits))

    def doubt(self, fit: float) -> float:
        """Logarithmic standard score of a fit among those of the members."""
        logs = np.log(np.maximum(self.fits, 1e-300))
        middle = float(np.median(logs))
        upper = float(np.quantile(logs, 0.84)) - middle
        return (float(np.log(max(fit, 1e-300))) - middle) / max(upper, 0.05)


def sequential(
    likelihood: Callable[[Array], Array], dimensions: int, particles: int, rng: np.random.Generator
) -> Array:
    """Return particles (n, d) of a posterior over the unit cube, by a tempered sequential Monte Carlo sampler."""
    strata = rng.permuted(np.tile(np.arange(particles), (dimensions, 1)), axis=1).T
    places = (strata + rng.random((particles, dimensions))) / particles
    values, power, size = likelihood(places), 0.0, 1.0
    while power < 1.0:
        step = _step(values, 1.0 - power)
        power += step
        weights = np.exp(step * (values - values.max()))
        chosen = _resampled(weights / weights.sum(), rng)
        places, values = places[chosen], values[chosen]
        covariance = np.cov(places.T).reshape(dimensions, -1)
        factor = np.linalg.cholesky(covariance + 1e-12 * np.eye(dimensions))
        for _ in range(MOVES):
            jump = rng.standard_normal(places.shape) @ factor.T * (2.38 * size / dimensions**0.5)
            tried = np.abs(places + jump) % 2.0  # reflected at both ends
            tried = np.where(tried > 1.0, 2.0 - tried, tried)
            new = likelihood(tried)
            taken = np.log(rng.random(particles)) < power * (new - values)
            places = np.where(taken[:, None], tried, places)
            values = np.where(taken, new, values)
            size = float(np.clip(size * np.exp(taken.mean() - 0.3), 0.05, 2.0))
    return places


def _step(values: Array, most: float) -> float:
    """Largest step of the power that leaves half of the effective sample size."""

    def effective(step: float) -> float:
        weights = np.exp(step * (values - values.max()))
        return float(weights.sum() ** 2 / (weights @ weights))

    if effective(most) >= 0.5 * len(values):
        return most
    low, high = 0.0, most
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle) >= 0.5 * len(values) else (low, middle)
    return max(low, 1e-6)


def _resampled(weights: Array, rng: np.random.Generator) -> Integers:
    """Indices of a systematic resampling."""
    count = len(weights)
    places = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), places), count - 1)


def _without(model: Kriging, rows: Array) -> Kriging:
    """A model of the same kernel, fitted to some of its points."""
    if rows.all():
        return model
    inputs, values = model.inputs[rows], model.values[rows]
    bare = replace(model, inputs=inputs, values=values, alpha=values)
    matrix = cho_factor(bare._noisy_covariance(), lower=True)
    return replace(bare, alpha=cho_solve(matrix, (values - model.mean) / model.scale))


def _shrunk(covariance: Array) -> Array:
    """A covariance matrix, part of it its diagonal."""
    return (1.0 - SHRINKAGE) * covariance + SHRINKAGE * np.diag(np.diag(covariance))


def _inverse(rest: Array) -> Array:
    """Inverse covariance (p, p) of what summaries leave of members' features (n, p), shrunk towards its diagonal.

    The share of the diagonal is that of Y. Chen et al., "Shrinkage algorithms for MMSE covariance estimation", IEEE Trans.
    Signal Process. 58 (2010), doi:10.1109/TSP.2010.2053029, eq. 23, for features of unit variance.
    """
    count, size = rest.shape
    deviation = np.maximum(rest.std(axis=0), 1e-12)
    unit = (rest - rest.mean(axis=0)) / deviation
    related = unit.T @ unit / count
    square = float((related**2).sum())
    above = (1.0 - 2.0 / size) * square + size**2
    below = (count + 1.0 - 2.0 / size) * (square - size)
    share = min(1.0, above / below) if below > 0.0 else 1.0
    shrunk = (1.0 - share) * related + share * np.eye(size)
    return np.asarray(np.linalg.inv(shrunk) / np.outer(deviation, deviation))


def _scatter(unknowns: Array, missed: Array) -> tuple[Callable[[Array], Array], Array]:
    """Relative variance of what models miss over the unknowns, and its covariance (q, q), from the errors (n, q) at (n, k)."""
    whole = _shrunk(missed.T @ missed / len(missed) + 1e-12 * np.eye(missed.shape[1]))
    squares = np.einsum("ij,ij->i", missed, np.linalg.solve(whole, missed.T).T) / missed.shape[1]
    common = float(squares.mean())

    def relative(places: Array) -> Array:
        near = cdist(places[:, : unknowns.shape[1]], unknowns, "sqeuclidean")
        weight = np.exp(-0.5 / NEAR**2 * near)
        return np.asarray((weight @ squares + common) / (weight.sum(1) + 1.0))

    scale = relative(unknowns)
    covariance = _shrunk((missed / scale[:, None]).T @ missed / len(missed))
    return relative, covariance + 1e-9 * np.trace(covariance) * np.eye(len(covariance))
