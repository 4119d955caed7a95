"""What to measure: how well each candidate signal would identify the unknowns, before a sensor is bought.

Members of the ensemble are measured with made noise, and the unknowns predicted by the regressions of `summaries`. The errors
for members that a regression was not fitted to give the half-width to expect; the posterior itself is as a rule narrower.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.threads import one_thread
from hpcclear.identify.features import Layout
from hpcclear.identify.judgement import as_measured, members_of
from hpcclear.identify.measured import Measured
from hpcclear.identify.signals import ORDERS, Sensor, Spectrum
from hpcclear.identify.summaries import regressions
from hpcclear.identify.training import Ensemble

REVOLUTIONS = (5, 20, 100)
"""Numbers of revolutions that are compared."""

NOISE = 0.1
"""Noise of a sample over the RMS of the signal, where none is given."""

SAMPLES = 512
"""Samples of a revolution."""


class Advice(NamedTuple):
    """Expected half-widths (signals, revolutions, unknowns), SI, and the largest correlation of errors of two unknowns
    (signals, revolutions); NaN with one unknown."""

    names: tuple[str, ...]
    half_width: Array
    correlation: Array


def noise_of(spectrum: Spectrum, share: float, samples: float) -> Array:
    """Return the variances (orders,) of harmonics for noise of a sample that is a share of the RMS of a signal."""
    power = 0.5 * (np.abs(np.atleast_2d(spectrum.mean)[:, 1:]) ** 2).sum(axis=1).mean()
    variance = np.full(spectrum.mean.shape[-1], 4.0 * share**2 * power / samples)
    variance[0] *= 0.25
    return variance


def advice(
    ensemble: Ensemble, names: Sequence[str], sensor: Sensor, frequency: float, share: float, seed: int
) -> Advice:  # fmt: skip
    """Return what each signal would give; `share`: its noise over its RMS."""
    expected = partial(_expected, ensemble, sensor, frequency, share, seed)
    found = [[expected(name, count) for count in REVOLUTIONS] for name in names]
    width, related = (np.array([[one[k] for one in row] for row in found]) for k in (0, 1))
    narrowest = np.minimum.accumulate(width, axis=1)  # more revolutions are no worse
    return Advice(tuple(names), narrowest, related)


def _expected(
    ensemble: Ensemble, sensor: Sensor, frequency: float, share: float, seed: int, name: str, count: int
) -> tuple[Array, float]:  # fmt: skip
    """Half-widths (unknowns,) and the largest correlation."""
    seen = ensemble.spectrum(name)
    variance = noise_of(seen, share, SAMPLES) + seen.variance.mean(axis=0)
    typical = Spectrum(seen.mean.mean(axis=0), variance, count)
    layout = Layout.of(Measured(name, typical, True, frequency, ORDERS), sensor)
    features, own = members_of(ensemble, [layout], sensor, frequency)
    noise = layout.values(typical, measured=True)[1]
    seen_features = as_measured(features, own, noise, np.random.default_rng([seed, 0x6164]))
    unknowns = ensemble.inputs.unknowns
    truth = ensemble.places[:, : len(unknowns)]
    with one_thread():
        made = regressions(seen_features, noise, layout.highest, truth)
    error = truth - np.clip(np.column_stack([one.left_out for one in made]), 0.0, 1.0)
    ranges = np.array([one.upper - one.lower for one in unknowns])
    return np.quantile(np.abs(error), 0.95, axis=0) * ranges, largest_correlation(error)


def largest_correlation(rows: Array) -> float:
    """Return the correlation of two of the columns (n, k) that is the largest in magnitude; NaN of one column."""
    related = np.atleast_2d(np.corrcoef(rows.T))[np.triu_indices(rows.shape[1], 1)]
    return float(related[np.argmax(np.abs(related))]) if related.size else np.nan
