"""What measured spectra say, given an ensemble: posterior, calibrated intervals, and whether the model explains them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.threads import one_thread
from hpcclear.identify.features import Layout, sensed
from hpcclear.identify.measured import Measured
from hpcclear.identify.posterior import LEVELS, Calibration, Model
from hpcclear.identify.signals import Sensor
from hpcclear.identify.summaries import FLOOR, Expected, InputRegression, informative, regressions
from hpcclear.identify.training import Ensemble

REFUSED = 3.5
"""Standard score of a fit, among those of the ensemble's own members, from which on the model does not explain a signal."""

POOR = 1.0
"""Standard score from which on intervals are widened."""

PARTICLES = 3000
CALIBRATED = 96
"""Members that are treated as machines."""

PARTICLES_OF_A_MEMBER = 400


@dataclass(frozen=True)
class Prepared:
    """Models of an ensemble for signals of one kind and noise, and their calibration."""

    ensemble: Ensemble
    layouts: tuple[Layout, ...]
    summaries: tuple[InputRegression, ...]
    expected: Expected
    """Features, in units of their noise, that members with the same summaries have."""
    centre: Array
    unit: Array
    """Mean of the features over the ensemble, and their noise, shape (p,) each."""
    model: Model
    calibration: Calibration

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the features."""
        return tuple(label for one in self.layouts for label in one.labels)


@dataclass(frozen=True)
class Judgement:
    """What one measurement says.

    `particles` (n, inputs): of the posterior, SI, widened about the median as the intervals are; `interval` (3, unknowns):
    lower end, median and upper end, SI; `doubt`: standard score of the fit of all features, the `worst` of which fits least;
    `measured`, `predicted`, `deviation` (p,): features; mean and standard deviation of those of machines with the same
    summaries.
    """

    particles: Array
    interval: Array
    doubt: float
    explained: bool
    worst: int
    measured: Array
    predicted: Array
    deviation: Array


def features_of(measured: Sequence[Measured], layouts: Sequence[Layout]) -> tuple[Array, Array]:
    """Return the features (p,) of the signals of one measurement, and their variances (p,)."""
    each = zip(measured, layouts, strict=True)
    values, variances = zip(*(own.values(one.spectrum, True) for one, own in each), strict=True)
    return np.concatenate(values), np.concatenate(variances)


def members_of(
    ensemble: Ensemble, layouts: Sequence[Layout], sensor: Sensor, frequency: float
) -> tuple[Array, Array]:
    """Return the features (n, p) of the members as a sensor has them, and their variances (n, p)."""
    errors = ensemble.inputs.sensor_errors(ensemble.places, sensor)
    seen = (sensed(ensemble.spectrum(own.name), sensor, frequency, *errors) for own in layouts)
    pairs = (own.values(one) for own, one in zip(layouts, seen, strict=True))
    values, variances = zip(*pairs, strict=True)
    return np.concatenate(values, 1), np.concatenate(variances, 1)


@one_thread()
def prepare(
    ensemble: Ensemble, layouts: Sequence[Layout], sensor: Sensor, frequency: float, variance: Array,
    seed: int, members: int = CALIBRATED,
) -> Prepared:  # fmt: skip
    """Fit and calibrate models for signals with features of these variances (p,).

    Raises InputError: fewer members than the models need.
    """
    clean, own = members_of(ensemble, layouts, sensor, frequency)
    size, unknowns = ensemble.inputs.size, len(ensemble.inputs.unknowns)
    further = [size + k for k, error in enumerate((sensor.gain_error, sensor.angle_error)) if error]
    places = ensemble.places[:, [*range(size), *further]]
    rng = np.random.default_rng([seed, 0x6964])
    features = as_measured(clean, own, variance, rng)
    orders = np.concatenate([one.highest for one in layouts])
    summaries = informative(regressions(features, variance, orders, places), places)
    centre = features.mean(axis=0)
    unit = np.sqrt(variance + FLOOR**2 * features.var(axis=0))
    unit = np.maximum(unit, 1e-9 * unit.max() + 1e-300)  # of features that are always the same
    left_out = np.column_stack([one.left_out for one in summaries])
    expected = Expected.of(left_out, (features - centre) / unit, rng)
    model = Model.of(places, left_out, expected.left, unknowns, rng)
    calibration = Calibration.of(model, unknowns, members, PARTICLES_OF_A_MEMBER, (seed, 0x63616C))
    return Prepared(ensemble, tuple(layouts), summaries, expected, centre, unit, model, calibration)


def as_measured(features: Array, own: Array, variance: Array, rng: np.random.Generator) -> Array:
    """Return members' features (n, p) with noise: what their `own` variances (n, p) lack of those measured (p,)."""
    return features + rng.standard_normal(features.shape) * np.sqrt(np.maximum(variance - own, 0.0))


def judged(prepared: Prepared, values: Array, seed: int, particles: int = PARTICLES) -> Judgement:
    """Return what the features (p,) of a measurement say."""
    with one_thread():
        rng = np.random.default_rng([seed, 0x706F])
        summaries = np.array([float(one(values[None])[0]) for one in prepared.summaries])
        mean = prepared.centre + prepared.unit * prepared.expected(summaries)
        rest = (values - mean) / prepared.unit
        found = prepared.model.posterior(summaries, particles, rng)
        doubt = prepared.calibration.doubt(prepared.model.fit(rest))
        deviation = prepared.unit * np.sqrt((prepared.model.rest**2).mean(axis=0) + 1e-12)
    inputs, unknowns = prepared.ensemble.inputs, len(prepared.ensemble.inputs.unknowns)
    middle = np.median(found[:, :unknowns], axis=0)
    wide = found.copy()
    # a poor fit widens intervals: the model is off by about as much more than its own scatter
    factor = prepared.calibration.widening * float(np.exp(0.5 * max(0.0, doubt - POOR)))
    wide[:, :unknowns] = np.clip(middle + factor * (found[:, :unknowns] - middle), 0.0, 1.0)
    physical = inputs.values(wide[:, : inputs.size])
    interval = np.quantile(physical[:, :unknowns], LEVELS, axis=0)
    worst = int(np.argmax(np.abs(values - mean) / deviation))
    return Judgement(physical, interval, doubt, doubt < REFUSED, worst, values, mean, deviation)
