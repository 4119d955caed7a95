"""`identify`: an ensemble on all ranks, then what each measured signal says of the unknowns, in one file."""

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics.response import simulate
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Finished, Options, Place, Session
from hpcclear.identify.advice import (
    NOISE,
    REVOLUTIONS,
    Advice,
    advice,
    largest_correlation,
    noise_of,
)
from hpcclear.identify.features import Layout
from hpcclear.identify.history import history, seconds_of
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.judgement import Prepared, Verdict, features_of, judged, prepare
from hpcclear.identify.measured import Measured, loaded, read_measured
from hpcclear.identify.settings import Settings
from hpcclear.identify.signals import names_of, revolutions_of
from hpcclear.identify.training import Ensemble, prepared_scene, simulated, units_of
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.identified import with_units
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of


def run_identify(
    scene: Scene, output: Path, ranks: Ranks, settings: Settings, options: Options = DEFAULT_OPTIONS
) -> Finished:
    """Identify unknowns on all ranks and write what was found; on root.

    Parameters
    ----------
    scene : Scene
        Random inputs of its study are nuisance inputs.
    output : Path
        NetCDF file of kind ``identify``.
    ranks : Ranks
    settings : Settings
    options : Options

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    began = time.perf_counter()
    if not settings.signals and not settings.advise:
        remedy = "Give --signal measured.csv, or --advise"
        raise InputError("--signal", "", "there is nothing to identify from", remedy)
    times = seconds_of(settings.dates, len(settings.signals)) if settings.signals else np.zeros(0)
    inputs = Inputs.of(scene, settings.unknowns)
    settings.limit_in(inputs.unknowns[0].unit)  # refuses before anything is simulated
    place = Place.of_file(output, options.fresh)
    with Session(
        place, {**run_key(scene, "identify"), **settings.key()}, ranks, options
    ) as session:
        content = session.found("identify")
        if content is None:
            session.describe(scene)
            content = session.write(_identified(scene, inputs, times, session, settings))
        session.close()
    return session.finished(content, began)


def _identified(
    scene: Scene, inputs: Inputs, times: Array, session: Session, settings: Settings
) -> xr.Dataset:
    """The dataset of what was found."""
    if settings.pressure and settings.signals:
        scene = loaded(scene, settings.signals[0], settings.pressure)
    plain, seed = prepared_scene(scene), 0 if scene.study is None else scene.study.seed
    frequency, sense, names = _driven(plain)
    every = tuple(dict.fromkeys((*settings.names, *(names if settings.advise else ()))))
    units = dict(zip(every, units_of(plain, every), strict=True))
    turns = turns_of(plain.linkage)
    tables = [
        [read_measured(path, name, units[name], frequency, turns, sense) for name in settings.names]
        for path in settings.signals
    ]
    layouts = _layouts(tables, settings) if tables else []  # refuses before anything is simulated
    quiet = session.options.style == "quiet"
    ensemble = simulated(
        plain, inputs, every, settings.size(), seed, session.ranks, session.opened(), quiet
    )
    with session.ranks.stage("posterior"):
        found = _verdicts(ensemble, tables, layouts, settings, seed) if tables else None
        gains = None
        if settings.advise:
            share = settings.noise or NOISE
            gains = advice(ensemble, every, settings.sensor, frequency, share, seed)
    return identified(ensemble, found, times, gains, settings, seed, session.attributes)


def _driven(scene: Scene) -> tuple[float, int, list[str]]:
    """Frequency of a revolution of the drive, Hz, the sense of the crank, and the usual signals."""
    short = {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}
    response = simulate(scene.with_(short), checked=False)
    turns, seconds = revolutions_of(scene, response), response["time"].to_numpy()
    angle = response["crank_angle"].to_numpy()
    frequency = float((turns[-1] - turns[0]) / (seconds[-1] - seconds[0]))
    return frequency, -1 if angle[-1] < angle[0] else 1, names_of(response)


Found = tuple[Prepared, list[Verdict]]


def _layouts(tables: Sequence[Sequence[Measured]], settings: Settings) -> list[Layout]:
    """The features that all tables have."""
    return [
        Layout.of(one, settings.sensor, _noise(one, settings.noise)) for one in _narrowest(tables)
    ]


def _verdicts(
    ensemble: Ensemble, tables: Sequence[Sequence[Measured]], layouts: Sequence[Layout], settings: Settings,
    seed: int,
) -> Found:  # fmt: skip
    """What each table says, by models for the noisiest of them."""
    pairs = [features_of(row, layouts) for row in tables]
    variance: Array = np.max(np.array([own for _, own in pairs]), axis=0)
    made = prepare(ensemble, layouts, settings.sensor, tables[0][0].frequency, variance, seed)
    return made, [judged(made, values, seed) for values, _ in pairs]


def _narrowest(tables: Sequence[Sequence[Measured]]) -> list[Measured]:
    """Of each signal the record with the fewest harmonics; all are read as not synchronised if one is."""
    found = [min(column, key=lambda one: one.highest) for column in zip(*tables, strict=True)]
    alike = all(one.synchronised for row in tables for one in row)
    return [Measured(one.name, one.spectrum, alike, one.frequency, one.highest) for one in found]


def _noise(measured: Measured, share: float | None) -> float | None:
    """Standard deviation of noise in a harmonic, where it is known."""
    if share is None:
        return None
    samples = measured.samples
    return float(np.sqrt(noise_of(measured.spectrum, share, samples)[1]))


def identified(
    ensemble: Ensemble, found: Found | None, times: Array, gains: Advice | None, settings: Settings, seed: int,
    attributes: Mapping[str, object],
) -> xr.Dataset:  # fmt: skip
    """Return the dataset of kind ``identify``; `times` (records,), s."""
    inputs = ensemble.inputs
    units = [one.unit for one in inputs.unknowns]
    limit = settings.limit_in(units[0])
    coords: dict[str, Any] = {
        "unknown": np.array([one.name for one in inputs.unknowns], str),
        "input": np.array(inputs.names, str),
        "end": np.array(["lower", "median", "upper"], str),
    }
    data: dict[str, Any] = {
        "unit": np.array(units, str),
        "prior_lower": np.array([one.lower for one in inputs.unknowns]),
        "prior_upper": np.array([one.upper for one in inputs.unknowns]),
    }
    if found is not None:
        prepared, verdicts = found
        names = [str(path) for path in settings.signals]
        coords |= {
            "record": np.array(names, str),
            "particle": np.arange(len(verdicts[0].particles)),
            "feature": np.array(prepared.labels, str),
        }
        particles = np.stack([one.particles for one in verdicts])
        data |= _of_verdicts(verdicts, particles, len(units))
        data |= {
            "elapsed": times,
            "widening": prepared.calibration.widening,
            "coverage": prepared.calibration.coverage,
        }
        grown = history(
            times,
            particles[:, :, : len(units)],
            limit,
            np.random.default_rng([seed, 0x6869]),
        )
        if grown is not None:
            data |= {"rate": grown.rate, "time_to_limit": grown.time}
    if gains is not None:
        coords |= {"candidate": np.array(gains.names, str), "revolutions": np.array(REVOLUTIONS)}
        data |= {"expected_half_width": gains.half_width, "expected_correlation": gains.correlation}
    further = {
        **attributes, "members": len(ensemble.places), "failed_members": ensemble.failed,
        **({} if limit is None else {"limit": limit}),
    }  # fmt: skip
    return with_units(dataset.dataset("identify", coords, data, further), units)


def _of_verdicts(verdicts: Sequence[Verdict], particles: Array, unknowns: int) -> dict[str, Any]:
    """Variables over the records."""
    return {
        "posterior": particles,
        "interval": np.stack([one.interval.T for one in verdicts]),
        "correlation": np.array([largest_correlation(one[:, :unknowns]) for one in particles]),
        "explained": np.array([one.explained for one in verdicts], np.int8),
        "doubt": np.array([one.doubt for one in verdicts]),
        "worst_feature": np.array([one.worst for one in verdicts]),
        "measured": np.stack([one.measured for one in verdicts]),
        "predicted": np.stack([one.predicted for one in verdicts]),
        "predicted_deviation": np.stack([one.deviation for one in verdicts]),
    }
