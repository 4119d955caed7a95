"""`identify`: an ensemble on all ranks, then what each measured signal says of the unknowns, in one file."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.response import simulated
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import Finished, Options, Session
from hpcclear.ensemble.single import SHORTEST
from hpcclear.identify import advice as advising
from hpcclear.identify.features import Layout
from hpcclear.identify.history import history, seconds_of
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.judgement import Judgement, Prepared, features_of, judged, prepare
from hpcclear.identify.measured import Measured, loaded, read_measured
from hpcclear.identify.settings import Settings
from hpcclear.identify.signals import Sensor, names_of, revolutions_of
from hpcclear.identify.training import Ensemble, ensemble_of, prepared_scene
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.places import Place
from hpcclear.results.signals import signal
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of


def run_identify(
    scene: Scene, output: Path, ranks: Ranks, settings: Settings, options: Options = Options()
) -> Finished:
    """Identify unknowns on all ranks and write what was found; on root. Random inputs of the scene's study are nuisance inputs.

    Raises InputError, StorageError, Stopped, RankFailed.
    """

    if not settings.signals and not settings.advise:
        remedy = "Give --signal measured.csv, or --advise"
        raise InputError("--signal", "", "there is nothing to identify from", remedy)
    times = seconds_of(settings.dates, len(settings.signals)) if settings.signals else np.zeros(0)
    inputs = Inputs.of(scene, settings.unknowns)
    if settings.limit_in(inputs.unknowns[0].unit) is not None and len(settings.dates) < 2:
        reason = "the time to it needs signals of two dates or more"
        raise InputError("--limit", str(settings.limit), reason, "Give --date for each --signal")
    place = Place.of_file(output, options.fresh)
    key = {**run_key(scene, "identify"), **settings.key()}
    session = Session(place, key, ranks, options)
    return session.finished(lambda here: _identified(scene, inputs, times, here, settings))


def _identified(
    scene: Scene, inputs: Inputs, times: Array, session: Session, settings: Settings
) -> Results:
    """Find out, and write it."""
    plain = scene
    if settings.pressure and settings.signals:
        plain = loaded(scene, settings.signals[0], settings.pressure)
    plain, seed = prepared_scene(plain), 0 if scene.study is None else scene.study.seed
    response = simulated(plain.with_(SHORTEST), checked=False)
    frequency, sense = _driven(plain, response)
    usual = names_of(response) if settings.advise else ()
    every = tuple(dict.fromkeys((*settings.names, *usual)))
    units = {name: signal(response, name, "--of").unit for name in every}
    turns = turns_of(plain.linkage)
    given = linkage_of(plain).mechanism.period.prescribed  # else its speed may be unknown as well
    how, names = (frequency, turns, sense, "--signal", given), settings.names
    tables = [[read_measured(path, n, units[n], *how) for n in names] for path in settings.signals]
    size, ranks, sensor = settings.size(), session.ranks, settings.sensor
    # refuses before anything is simulated
    layouts = [
        [Layout.of(one, sensor, _noise(one, settings.noise)) for one in row] for row in tables
    ]
    kept, style = session.opened(scene), session.options.style
    ensemble = ensemble_of(plain, inputs, every, size, seed, ranks, kept, style)
    with ranks.stage("posterior"):
        records = zip(tables, layouts, strict=True)
        found = [_verdict(ensemble, row, own, sensor, seed) for row, own in records]
        gains = None
        if settings.advise:
            share = settings.noise or advising.NOISE
            gains = advising.advice(ensemble, every, sensor, frequency, share, seed)
    about = settings, seed, session.attributes
    return session.write(identified(ensemble, found, times, gains, *about))


def _driven(scene: Scene, response: Results) -> tuple[float, int]:
    """Frequency of a revolution of the drive, Hz, and the sense of the crank, of a response."""
    turns, seconds = revolutions_of(scene, response), response["time"].to_numpy()
    angle = response["crank_angle"].to_numpy()
    frequency = float((turns[-1] - turns[0]) / (seconds[-1] - seconds[0]))
    return frequency, -1 if angle[-1] < angle[0] else 1


Found = Sequence[tuple[Prepared, Judgement]]
"""Of each record its models and what it says."""


def _verdict(
    ensemble: Ensemble, row: Sequence[Measured], layouts: Sequence[Layout], sensor: Sensor, seed: int
) -> tuple[Prepared, Judgement]:  # fmt: skip
    """What a record says, by models for its own features and noise: the same whatever the other records are."""
    values, variance = features_of(row, layouts)
    made = prepare(ensemble, layouts, sensor, row[0].frequency, variance, seed)
    return made, judged(made, values, seed)


def _noise(measured: Measured, share: float | None) -> float | None:
    """Standard deviation of noise in a harmonic, where it is known."""
    if share is None:
        return None
    return float(np.sqrt(advising.noise_of(measured.spectrum, share, measured.samples)[1]))


def identified(
    ensemble: Ensemble, found: Found, times: Array, gains: advising.Advice | None, settings: Settings, seed: int,
    attributes: Mapping[str, object],
) -> Results:  # fmt: skip
    """Return the dataset of kind ``identify``; `times` (records,), s."""
    inputs = ensemble.inputs
    units = [one.unit for one in inputs.unknowns]
    limit = settings.limit_in(units[0])
    names, lower, upper = zip(*((o.name, o.lower, o.upper) for o in inputs.unknowns), strict=True)
    ends = ("lower", "median", "upper")
    coords: dict[str, Any] = {"unknown": names, "input": inputs.names, "end": ends}
    data: dict[str, Any] = {"unit": units, "prior_lower": lower, "prior_upper": upper}
    if found:
        particles = np.stack([verdict.particles for _, verdict in found])
        features = list(dict.fromkeys(label for made, _ in found for label in made.labels))
        coords |= {"record": [str(path) for path in settings.signals], "feature": features}
        coords["particle"] = np.arange(particles.shape[1])
        data |= _of_records(found, particles, features, len(units)) | {"elapsed": times}
        explained = np.array([verdict.explained for _, verdict in found])
        rng = np.random.default_rng([seed, 0x6869])
        grown = history(times, particles[:, :, : len(units)], limit, rng, explained)
        if grown is not None:
            data |= {"rate": grown.rate, "time_to_limit": grown.time}
    if gains is not None:
        coords |= {"candidate": gains.names, "revolutions": advising.REVOLUTIONS}
        data |= {"expected_half_width": gains.half_width, "expected_correlation": gains.correlation}
    further = {
        **attributes, "members": len(ensemble.places), "failed_members": ensemble.failed,
        **({} if limit is None else {"limit": limit}),
    }  # fmt: skip
    content = dataset.dataset("identify", coords, data, further)
    common = units[0] if len(set(units)) == 1 else "1"  # as ``unit`` has them where they differ
    for name in ("prior_lower", "prior_upper", "interval", "expected_half_width"):
        if name in content:
            content[name].attrs["units"] = common
    if "rate" in content:
        content["rate"].attrs["units"] = "1/s" if common == "1" else f"{common}/s"
    return content


def _of_records(
    found: Found, particles: Array, features: Sequence[str], unknowns: int
) -> dict[str, np.ndarray]:
    """Variables over the records; NaN where a record lacks a feature of another."""
    verdicts = [verdict for _, verdict in found]
    places = [[features.index(label) for label in made.labels] for made, _ in found]
    fit = np.full((3, len(found), len(features)), np.nan)
    for row, (one, own) in enumerate(zip(verdicts, places, strict=True)):
        fit[:, row, own] = one.measured, one.predicted, one.deviation
    return {
        "posterior": particles,
        "interval": np.stack([one.interval.T for one in verdicts]),
        "widening": np.stack([made.calibration.widening for made, _ in found]),
        "coverage": np.stack([made.calibration.coverage for made, _ in found]),
        "correlation": np.array([advising.largest_correlation(p[:, :unknowns]) for p in particles]),
        "explained": np.array([one.explained for one in verdicts], np.int8),
        "doubt": np.array([one.doubt for one in verdicts]),
        "worst_feature": np.array([own[v.worst] for v, own in zip(verdicts, places, strict=True)]),
        **dict(zip(("measured", "predicted", "predicted_deviation"), fit, strict=True)),
    }
