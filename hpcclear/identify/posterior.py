"""Posterior distribution of what is not known, given features; its intervals are calibrated on the ensemble itself.

A Kriging model of each combination of features gives their mean over the inputs. What it misses at a point that was left out
is the scatter of the model: chaos, effects of few revolutions and lack of fit. Its covariance and that of the measured noise
make the likelihood, a Student t, as chaos has heavy tails.

Members of the ensemble are then treated as machines whose truth is known, each by models fitted without it. How far their
truths lie out, in half-widths, says by how much intervals have to be widened (conformal prediction), and how badly a signal
of the model itself may fit. Intervals are never made narrower.

Sources: P. Del Moral, A. Doucet and A. Jasra, "Sequential Monte Carlo samplers", J. R. Statist. Soc. B 68 (2006),
doi:10.1111/j.1467-9868.2006.00553.x; V. Vovk, A. Gammerman and G. Shafer, "Algorithmic Learning in a Random World" (2005).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

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


class Fit(NamedTuple):
    """How well the model explains features: distance of the combinations from the nearest prediction, and of all else."""

    scores: float
    rest: float


@dataclass(frozen=True)
class Likelihood:
    """Log-likelihood of places in the unit cube, given combinations of features."""

    models: tuple[Kriging, ...]
    scatter: Callable[[Array], Array]
    """Relative variance of the model's scatter (n,) at places (n, d)."""
    axes: Array
    """Combinations (q, q) in which both covariances are diagonal, those of the model ones."""
    noise: Array
    """Variances (q,) of the measured noise along them."""

    def distance(self, places: Array, scores: Array) -> tuple[Array, Array]:
        """Squared distance of the scores (q,) from predictions at places (n, d), and log of the determinant, (n,) each."""
        mean = np.column_stack([one.predict(places) for one in self.models])
        variance = self.scatter(places)[:, None] + self.noise
        return (((scores - mean) @ self.axes) ** 2 / variance).sum(1), np.log(variance).sum(1)

    def __call__(self, places: Array, scores: Array) -> Array:
        """Log-likelihood (n,)."""
        square, determinant = self.distance(places, scores)
        power = 0.5 * (FREEDOM + len(self.noise))
        return -power * np.log1p(square / FREEDOM) - 0.5 * determinant


@dataclass(frozen=True)
class Model:
    """Models of an ensemble's features: of all members, and of all but one group.

    Attributes
    ----------
    places : ndarray, shape (n, d)
    scores, rest : ndarray, shapes (n, q) and (n, p)
        Combinations of the members' features, and what these leave.
    likelihoods : tuple of Likelihood
        That of all members first, then one for each group left out.
    distances : tuple of ndarray, shape (p, p)
        Inverse covariances of the rests, in the same order.
    noise, noise_rest : ndarray, shapes (q, q) and (p,)
        Covariance of the measured noise in the combinations, and variances in the features, in units of the noise.
    """

    places: Array
    scores: Array
    rest: Array
    likelihoods: tuple[Likelihood, ...]
    distances: tuple[Array, ...]
    noise: Array

    @classmethod
    def of(
        cls, places: Array, scores: Array, rest: Array, noise: Array, noise_rest: Array,
        unknowns: int, rng: np.random.Generator,
    ) -> "Model":  # fmt: skip
        """Fit the models; shapes as above, `noise_rest` (p, p), the first `unknowns` of the inputs are identified."""
        bounds = np.tile([0.0, 1.0], (places.shape[1], 1))
        models = tuple(
            fit_kriging(
                places, column, bounds, rng=rng, restarts=0, lengths=LENGTHS, kernel="matern-5/2"
            )
            for column in scores.T
        )
        missed = np.column_stack([one.leave_one_out() for one in models]) - scores
        missed[~np.isfinite(missed)] = 0.0
        scatter, covariance = _scatter(places[:, :unknowns], missed)
        values, axes = eigh(noise, covariance)
        groups = _groups(len(places))
        kept = [np.ones(len(places), bool), *(groups != k for k in range(FOLDS))]
        likelihoods = tuple(
            Likelihood(
                tuple(_without(m, rows) for m in models), scatter, axes, np.maximum(values, 0.0)
            )
            for rows in kept
        )
        distances = tuple(_inverse(rest[rows], noise_rest) for rows in kept)
        return cls(places, scores, rest, likelihoods, distances, noise)

    def posterior(
        self, scores: Array, rest: Array, particles: int, rng: np.random.Generator, group: int = -1
    ) -> tuple[Array, Fit]:
        """Return particles (n, d) of the posterior and the fit, by the models that leave a group out; -1: none."""
        likelihood = self.likelihoods[group + 1]
        found = sequential(lambda x: likelihood(x, scores), self.places.shape[1], particles, rng)
        nearest = float(likelihood.distance(found, scores)[0].min()) / len(scores)
        left = float(rest @ self.distances[group + 1] @ rest) / len(rest)
        return found, Fit(nearest, left)


@dataclass(frozen=True)
class Calibration:
    """What members of the ensemble, treated as machines, teach about intervals and fits.

    Attributes
    ----------
    widening : ndarray, shape (unknowns,)
        By which half-widths are multiplied, at least 1.
    coverage : ndarray, shape (unknowns,)
        Share of members whose truth lies in the 95 % interval before widening.
    fits : ndarray, shape (members, 2)
        Columns as in `Fit`.
    half_width : ndarray, shape (members, unknowns)
        Of the widened intervals, as shares of the bounds' range.
    """

    widening: Array
    coverage: Array
    fits: Array
    half_width: Array

    @classmethod
    def of(
        cls, model: Model, noisy: Callable[[np.random.Generator], tuple[Array, Array]], unknowns: int,
        members: int, particles: int, seeds: Sequence[int],
    ) -> "Calibration":  # fmt: skip
        """Treat the first members as machines; `noisy` draws the noise of combinations and rests for all of them."""
        count = min(members, len(model.places))
        score_noise, rest_noise = noisy(np.random.default_rng([*seeds, 0]))
        groups = _groups(len(model.places))
        out, half, fits = [], [], []
        for k in range(count):
            rng = np.random.default_rng([*seeds, 1, k])
            scores, rest = model.scores[k] + score_noise[k], model.rest[k] + rest_noise[k]
            found, fit = model.posterior(scores, rest, particles, rng, int(groups[k]))
            low, middle, high = np.quantile(found[:, :unknowns], LEVELS, axis=0)
            truth = model.places[k, :unknowns]
            side = np.where(truth < middle, middle - low, high - middle)
            out.append(np.abs(truth - middle) / np.maximum(side, 1e-9))
            half.append(0.5 * (high - low))
            fits.append(fit)
        score = np.sort(np.array(out), axis=0)
        rank = min(int(np.ceil(0.95 * (count + 1))), count) - 1
        widening = np.maximum(score[rank], 1.0)
        return cls(widening, (score <= 1.0).mean(axis=0), np.array(fits), np.array(half) * widening)

    def doubt(self, fit: Fit) -> Array:
        """Return the logarithmic standard scores (2,) of a fit among those of the members."""
        logs = np.log(np.maximum(self.fits, 1e-300))
        middle = np.median(logs, axis=0)
        upper = np.quantile(logs, 0.84, axis=0) - middle
        found: Array = (np.log(np.maximum(fit, 1e-300)) - middle) / np.maximum(upper, 0.05)
        return found


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
        factor = np.linalg.cholesky(
            np.cov(places.T).reshape(dimensions, -1) + 1e-12 * np.eye(dimensions)
        )
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


def _groups(count: int) -> Integers:
    """Group of each member."""
    return np.arange(count) % FOLDS


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


def _inverse(rest: Array, noise: Array) -> Array:
    """Inverse covariance (p, p) of what combinations leave, of members and of noise."""
    covariance = _shrunk(np.cov(rest.T) + noise)
    floor = 1e-3 * np.trace(covariance) / len(covariance)
    return np.asarray(np.linalg.inv(covariance + floor * np.eye(len(covariance))))


def _scatter(unknowns: Array, missed: Array) -> tuple[Callable[[Array], Array], Array]:
    """Relative variance of what models miss over the unknowns, and its covariance (q, q), from the errors (n, q) at (n, k)."""
    whole = _shrunk(missed.T @ missed / len(missed) + 1e-12 * np.eye(missed.shape[1]))
    squares = np.einsum("ij,ij->i", missed, np.linalg.solve(whole, missed.T).T) / missed.shape[1]
    common = float(squares.mean())

    def relative(places: Array) -> Array:
        near = np.zeros((len(places), len(unknowns)))
        for column, own in zip(
            places.T, unknowns.T, strict=False
        ):  # further columns are nuisance inputs
            near += (column[:, None] - own) ** 2
        weight = np.exp(-0.5 * near / NEAR**2)
        return np.asarray((weight @ squares + common) / (weight.sum(1) + 1.0))

    scale = relative(unknowns)
    covariance = _shrunk((missed / scale[:, None]).T @ missed / len(missed))
    return relative, covariance + 1e-9 * np.trace(covariance) * np.eye(len(covariance))
