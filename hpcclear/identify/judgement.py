"""What measured spectra say, given an ensemble: posterior, calibrated intervals, and whether the model explains them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from hpcclear.base.arrays import Array
from hpcclear.identify.features import Choice, Layout, sensed
from hpcclear.identify.measured import Measured
from hpcclear.identify.posterior import LEVELS, Calibration, Model
from hpcclear.identify.signals import Sensor
from hpcclear.identify.training import Ensemble

REFUSED = 3.5
"""Standard score of a fit, among those of the ensemble's own members, from which on the model does not explain a signal."""

POOR = 1.0
"""Standard score from which on intervals are widened."""

PARTICLES = 3000
CALIBRATED = 96
"""Members that are treated as machines."""

PARTICLES_OF_A_MEMBER = 400
PREDICTABLE = 0.1
"""Share of a combination's variance over the ensemble that its Kriging model explains at least; others say nothing."""


@dataclass(frozen=True)
class Prepared:
    """Models of an ensemble for signals of one kind and noise, and their calibration."""

    ensemble: Ensemble
    layouts: tuple[Layout, ...]
    sensor: Sensor
    choice: Choice
    model: Model
    calibration: Calibration
    features: Array
    """Of the members, shape (n, p)."""
    columns: tuple[int, ...]
    """Inputs that the models have, columns of the places."""

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the features."""
        return tuple(label for one in self.layouts for label in one.labels)


@dataclass(frozen=True)
class Verdict:
    """What one measurement says.

    Attributes
    ----------
    particles : ndarray, shape (n, inputs)
        Of the posterior, SI, widened about the median as the intervals are.
    interval : ndarray, shape (3, unknowns)
        Lower end, median and upper end, SI.
    doubt : ndarray, shape (2,)
        Standard scores of the fit: of the informative combinations, and of all other features.
    explained : bool
    worst : int
        Feature that fits least.
    measured, predicted, deviation : ndarray, shape (p,)
        Features, their predictive mean and standard deviation.
    """

    particles: Array
    interval: Array
    doubt: Array
    explained: bool
    worst: int
    measured: Array
    predicted: Array
    deviation: Array


def features_of(measured: Sequence[Measured], layouts: Sequence[Layout]) -> tuple[Array, Array]:
    """Return the features (p,) of the signals of one measurement, and their variances (p,)."""
    pairs = [
        layout.values(one.spectrum, measured=True)
        for one, layout in zip(measured, layouts, strict=True)
    ]
    return np.concatenate([own for own, _ in pairs]), np.concatenate([own for _, own in pairs])


def members_of(
    ensemble: Ensemble, layouts: Sequence[Layout], sensor: Sensor, frequency: float
) -> tuple[Array, Array]:
    """Return the features (n, p) of the members as a sensor has them, and their variances (n, p)."""
    errors = ensemble.inputs.sensor_errors(ensemble.places, sensor)
    pairs = [
        layout.values(sensed(ensemble.spectrum(layout.name), sensor, frequency, *errors))
        for layout in layouts
    ]
    return np.concatenate([own for own, _ in pairs], 1), np.concatenate(
        [own for _, own in pairs], 1
    )


def prepare(
    ensemble: Ensemble, layouts: Sequence[Layout], sensor: Sensor, frequency: float, variance: Array,
    seed: int, members: int = CALIBRATED,
) -> Prepared:  # fmt: skip
    """Fit and calibrate models for signals with features of these variances (p,).

    Raises
    ------
    InputError
        Fewer members than the models need.
    """
    with threadpool_limits(limits=1, user_api="blas"):  # more threads change the last bits
        return _prepared(ensemble, layouts, sensor, frequency, variance, seed, members)


def _prepared(
    ensemble: Ensemble, layouts: Sequence[Layout], sensor: Sensor, frequency: float, variance: Array,
    seed: int, members: int,
) -> Prepared:  # fmt: skip
    features, own = members_of(ensemble, layouts, sensor, frequency)
    size, unknowns = ensemble.inputs.size, len(ensemble.inputs.unknowns)
    further = [size + k for k, error in enumerate((sensor.gain_error, sensor.angle_error)) if error]
    columns = (*range(size), *further)
    places = ensemble.places[:, list(columns)]
    choice = Choice.of(features, variance + own.mean(axis=0))
    rng = np.random.default_rng([seed, 0x6964])
    choice = choice.only(predictable(places, choice.scores(features), rng))
    projector = np.eye(len(variance)) - choice.basis @ choice.basis.T
    relative = variance / choice.unit**2
    model = Model.of(
        places, choice.scores(features), choice.rest(features), choice.noise_of(variance),
        projector @ (relative[:, None] * projector), unknowns, rng,
    )  # fmt: skip

    def noisy(stream: np.random.Generator) -> tuple[Array, Array]:
        drawn = stream.standard_normal(features.shape) * np.sqrt(relative)
        return drawn @ choice.basis, drawn @ projector

    calibration = Calibration.of(
        model, noisy, unknowns, members, PARTICLES_OF_A_MEMBER, (seed, 0x63616C)
    )
    return Prepared(ensemble, tuple(layouts), sensor, choice, model, calibration, features, columns)


def judged(prepared: Prepared, values: Array, seed: int, particles: int = PARTICLES) -> Verdict:
    """Return what the features (p,) of a measurement say."""
    with threadpool_limits(limits=1, user_api="blas"):
        choice, rng = prepared.choice, np.random.default_rng([seed, 0x706F])
        scores, rest = choice.scores(values), choice.rest(values)
        found, fit = prepared.model.posterior(scores, rest, particles, rng)
        mean, deviation = _predictive(prepared, found)
    doubt = prepared.calibration.doubt(fit)
    inputs, unknowns = prepared.ensemble.inputs, len(prepared.ensemble.inputs.unknowns)
    middle = np.median(found[:, :unknowns], axis=0)
    wide = found.copy()
    factor = prepared.calibration.widening * _poor(doubt)
    wide[:, :unknowns] = np.clip(middle + factor * (found[:, :unknowns] - middle), 0.0, 1.0)
    size = inputs.size
    physical = inputs.values(wide[:, :size])
    interval = np.quantile(physical[:, :unknowns], LEVELS, axis=0)
    score = np.abs(values - mean) / deviation
    return Verdict(
        physical, interval, doubt, bool(doubt.max() < REFUSED), int(np.argmax(score)), values, mean, deviation
    )  # fmt: skip


def _poor(doubt: Array) -> float:
    """By how much a poor fit widens intervals: the model is off by about as much more than its own scatter."""
    return float(np.exp(0.5 * max(0.0, float(doubt.max()) - POOR)))


def _predictive(prepared: Prepared, found: Array) -> tuple[Array, Array]:
    """Mean and standard deviation (p,) of the features by the posterior: of the smooth part, its scatter, and noise."""
    choice, model = prepared.choice, prepared.model
    likelihood = model.likelihoods[0]
    scores = np.column_stack([one.predict(found) for one in likelihood.models])
    mean = choice.centre + choice.unit * (
        choice.basis @ scores.mean(axis=0) + model.rest.mean(axis=0)
    )
    missed = np.column_stack([one.leave_one_out() for one in likelihood.models]) - model.scores
    left = model.rest - model.rest.mean(axis=0) + missed @ choice.basis.T
    spread = (scores @ choice.basis.T).var(axis=0) + (left**2).mean(axis=0)
    return mean, choice.unit * np.sqrt(spread + 1.0)  # 1: the noise, in its own unit


def predictable(places: Array, scores: Array, rng: np.random.Generator) -> Array:
    """Return which combinations (q,) of members' features a model of the inputs explains; one at least.

    By trigonometric features of the places and ridge regression, leave-one-out: a cheap relative of Kriging.
    """
    frequency = rng.standard_normal((places.shape[1], 60)) * 2.0
    phase = rng.uniform(0.0, 2.0 * np.pi, 60)
    terms = np.column_stack([np.ones(len(places)), places, np.cos(places @ frequency + phase)])
    hat = terms @ np.linalg.solve(terms.T @ terms + 0.3 * np.eye(terms.shape[1]), terms.T)
    left = (scores - hat @ scores) / (1.0 - np.diag(hat))[:, None]
    explained = 1.0 - left.var(axis=0) / scores.var(axis=0)
    kept = explained > PREDICTABLE
    kept[int(np.argmax(explained))] = True
    return np.asarray(kept)
