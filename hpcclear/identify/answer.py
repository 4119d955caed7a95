"""`identify`: an ensemble on all ranks, then what each measured signal says of the unknowns, in one file."""

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics.response import simulate
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Finished, Options, Place, Session
from hpcclear.identify.advice import NOISE, REVOLUTIONS, Advice, advice, noise_of
from hpcclear.identify.features import Layout
from hpcclear.identify.history import history, seconds_of
from hpcclear.identify.inputs import Inputs
from hpcclear.identify.judgement import Prepared, Verdict, features_of, judged, prepare
from hpcclear.identify.measured import Measured, loaded, read_measured
from hpcclear.identify.signals import Sensor, names_of, revolutions_of
from hpcclear.identify.training import Ensemble, prepared_scene, simulated, units_of
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.identified import with_units
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of

MEMBERS = 256
"""Members for one unknown; each further one doubles them, to `MOST` at most."""

MOST = 1024


@dataclass(frozen=True)
class Wanted:
    """What is to be identified, and from what.

    Parameters
    ----------
    unknowns : sequence of str
        ``PATH=LO:HI``.
    signals : sequence of Path
        Tables, one for each date; none for advice alone.
    names : sequence of str
        Signals that are used together.
    dates : sequence of str
    limit : float, optional
        Of the unknowns, SI.
    sensor : Sensor
    noise : float, optional
        Standard deviation of the sensor's noise over the RMS of the signal.
    pressure : str
        ``COLUMN=AREA`` of a measured pressure on the slider, in the first table; a known input.
    advise : bool
        Whether further signals are compared.
    members : int, optional
    """

    unknowns: tuple[str, ...]
    signals: tuple[Path, ...] = ()
    names: tuple[str, ...] = ("crank_moment",)
    dates: tuple[str, ...] = ()
    limit: float | None = None
    sensor: Sensor = field(default_factory=Sensor)
    noise: float | None = None
    pressure: str = ""
    advise: bool = False
    members: int | None = None

    def size(self) -> int:
        """Return the number of members, a power of two."""
        asked = self.members or min(MEMBERS * 2 ** (len(self.unknowns) - 1), MOST)
        return 2 ** int(np.ceil(np.log2(max(asked, 32))))

    def key(self) -> dict[str, str]:
        """Return what makes its result, for the key of a run."""
        digests = [hashlib.sha256(read_bytes(one)).hexdigest()[:16] for one in self.signals]
        return {
            "unknowns": "; ".join(self.unknowns), "signals": ", ".join(self.names), "tables": ", ".join(digests),
            "dates": ", ".join(self.dates), "limit": repr(self.limit), "sensor": repr(self.sensor),
            "noise": repr(self.noise), "pressure": self.pressure, "advise": repr(self.advise), "members": repr(self.size()),
        }  # fmt: skip


def read_bytes(path: Path) -> bytes:
    """Return the content of a table; raises InputError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        reason = f"cannot be read: {error.strerror}"
        raise InputError("--signal", str(path), reason, "Name a table of the signal") from None


def run_identify(
    scene: Scene, output: Path, ranks: Ranks, wanted: Wanted, options: Options = DEFAULT_OPTIONS
) -> Finished:
    """Identify unknowns on all ranks and write what was found; on root.

    Parameters
    ----------
    scene : Scene
        Random inputs of its study are nuisance inputs.
    output : Path
        NetCDF file of kind ``identify``.
    ranks : Ranks
    wanted : Wanted
    options : Options

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    began = time.perf_counter()
    if not wanted.signals and not wanted.advise:
        remedy = "Give --signal measured.csv, or --advise"
        raise InputError("--signal", "", "there is nothing to identify from", remedy)
    times = seconds_of(wanted.dates, len(wanted.signals)) if wanted.signals else np.zeros(0)
    inputs = Inputs.of(scene, wanted.unknowns)
    place = Place.of_file(output, options.fresh)
    with Session(place, {**run_key(scene, "identify"), **wanted.key()}, ranks, options) as session:
        content = session.found("identify")
        if content is None:
            session.describe(scene)
            content = session.write(_identified(scene, inputs, times, session, wanted))
        session.close()
    return session.finished(content, began)


def _identified(
    scene: Scene, inputs: Inputs, times: Array, session: Session, wanted: Wanted
) -> xr.Dataset:
    """The dataset of what was found."""
    if wanted.pressure and wanted.signals:
        scene = loaded(scene, wanted.signals[0], wanted.pressure)
    plain, seed = prepared_scene(scene), 0 if scene.study is None else scene.study.seed
    frequency, sense, names = _driven(plain)
    every = tuple(dict.fromkeys((*wanted.names, *(names if wanted.advise else ()))))
    units = dict(zip(every, units_of(plain, every), strict=True))
    turns = turns_of(plain.linkage)
    tables = [
        [read_measured(path, name, units[name], frequency, turns, sense) for name in wanted.names]
        for path in wanted.signals
    ]
    layouts = _layouts(tables, wanted) if tables else []  # refuses before anything is simulated
    quiet = session.options.style == "quiet"
    ensemble = simulated(
        plain, inputs, every, wanted.size(), seed, session.ranks, session.opened(), quiet
    )
    with session.ranks.stage("posterior"):
        found = _verdicts(ensemble, tables, layouts, wanted, seed) if tables else None
        gains = None
        if wanted.advise:
            share = wanted.noise or NOISE
            gains = advice(ensemble, every, wanted.sensor, frequency, share, seed)
    return identified(ensemble, found, times, gains, wanted, seed, session.attributes)


def _driven(scene: Scene) -> tuple[float, int, list[str]]:
    """Frequency of a revolution of the drive, Hz, the sense of the crank, and the usual signals."""
    short = {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}
    response = simulate(scene.with_(short), checked=False)
    turns, seconds = revolutions_of(scene, response), response["time"].to_numpy()
    angle = response["crank_angle"].to_numpy()
    frequency = float((turns[-1] - turns[0]) / (seconds[-1] - seconds[0]))
    return frequency, -1 if angle[-1] < angle[0] else 1, names_of(response)


Found = tuple[Prepared, list[Verdict]]


def _layouts(tables: Sequence[Sequence[Measured]], wanted: Wanted) -> list[Layout]:
    """The features that all tables have."""
    return [Layout.of(one, wanted.sensor, _noise(one, wanted.noise)) for one in _narrowest(tables)]


def _verdicts(
    ensemble: Ensemble, tables: Sequence[Sequence[Measured]], layouts: Sequence[Layout], wanted: Wanted,
    seed: int,
) -> Found:  # fmt: skip
    """What each table says, by models for the noisiest of them."""
    pairs = [features_of(row, layouts) for row in tables]
    variance: Array = np.max(np.array([own for _, own in pairs]), axis=0)
    made = prepare(ensemble, layouts, wanted.sensor, tables[0][0].frequency, variance, seed)
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
    ensemble: Ensemble, found: Found | None, times: Array, gains: Advice | None, wanted: Wanted, seed: int,
    attributes: Mapping[str, object],
) -> xr.Dataset:  # fmt: skip
    """Return the dataset of kind ``identify``; `times` (records,), s."""
    inputs = ensemble.inputs
    units = [one.unit for one in inputs.unknowns]
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
        names = [str(path) for path in wanted.signals]
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
            wanted.limit,
            np.random.default_rng([seed, 0x6869]),
        )
        if grown is not None:
            data |= {"rate": grown.rate, "time_to_limit": grown.time}
    if gains is not None:
        coords |= {"candidate": np.array(gains.names, str), "revolutions": np.array(REVOLUTIONS)}
        data |= {"expected_half_width": gains.half_width, "expected_correlation": gains.correlation}
    further = {
        **attributes, "members": len(ensemble.places), "failed_members": ensemble.failed,
        **({} if wanted.limit is None else {"limit": wanted.limit}),
    }  # fmt: skip
    return with_units(dataset.dataset("identify", coords, data, further), units)


def _of_verdicts(verdicts: Sequence[Verdict], particles: Array, unknowns: int) -> dict[str, Any]:
    """Variables over the records."""
    related = np.stack([np.atleast_2d(np.corrcoef(one[:, :unknowns].T)) for one in particles])
    return {
        "posterior": particles,
        "interval": np.stack([one.interval.T for one in verdicts]),
        "correlation": related[:, 0, 1] if unknowns > 1 else np.full(len(verdicts), np.nan),
        "explained": np.array([one.explained for one in verdicts], np.int8),
        "doubt": np.array([one.doubt.max() for one in verdicts]),
        "worst_feature": np.array([one.worst for one in verdicts]),
        "measured": np.stack([one.measured for one in verdicts]),
        "predicted": np.stack([one.predicted for one in verdicts]),
        "predicted_deviation": np.stack([one.deviation for one in verdicts]),
    }
