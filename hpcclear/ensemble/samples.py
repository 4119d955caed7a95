"""The `sample` command: points -> ranks -> one dataset, checkpointed on the way."""

import hashlib
import os
import shlex
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.dynamics.target import recorded, resolve
from hpcclear.ensemble.session import Finished
from hpcclear.ensemble.simulate import run_key, sample_points
from hpcclear.ranks.progress import Progress, Style
from hpcclear.ranks.team import COLUMNS, Ranks
from hpcclear.results import dataset, files
from hpcclear.results.checkpoint import INTERVAL, Checkpoint, check_key, discard, key_attribute
from hpcclear.results.lock import Lock
from hpcclear.results.places import fresh_sibling, parts_of
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import latin_hypercube, monte_carlo, read_points


def design(scene: Scene, table: Path | None) -> Points:
    """The points to simulate: a user's table, or the study's sampling.

    Raises
    ------
    InputError
        If there is neither, or a point makes no mechanism.
    """
    if table is not None:
        return read_points(table, scene)
    if scene.study is None:
        raise InputError(
            "study",
            None,
            "the scene says nothing about sampling",
            "Add a [study] table, or give --points designs.csv",
        )
    return latin_hypercube(scene) if scene.study.method == "lhs" else monte_carlo(scene)


def sample_key(scene: Scene, points: Points) -> dict[str, str]:
    """What makes a run what it is: see `hpcclear.ensemble.simulate.run_key`; and the points themselves."""
    digest = hashlib.sha256(points.values.tobytes() + repr((points.names, points.paths)).encode())
    return {**run_key(scene, "sample"), "points": digest.hexdigest()[:16]}


def finished(path: Path, key: dict[str, str]) -> xr.Dataset | None:
    """The result of the same command from an earlier run, if it is there; another run's is refused."""
    if not path.exists():
        return None
    content = dataset.read(path, "samples")
    check_key(content, key, path)
    return content


def run_sample(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    *,
    table: Path | None = None,
    fresh: bool = False,
    interval: float = INTERVAL,
    style: Style = "auto",
) -> Finished:
    """Simulate a design on all ranks and write it; on root.

    Parameters
    ----------
    scene : Scene
    output : Path
        NetCDF file; timing.nc goes beside it, finished samples into a hidden directory until it is written.
    ranks : Ranks
    table : Path, optional
        CSV of designs.
    fresh : bool
        Start anew beside an earlier result.
    interval : float
        Seconds between two checkpoints.
    style : str
        How progress is shown.

    Returns
    -------
    Finished
        The samples.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    start = time.perf_counter()
    files.probe(output)
    if fresh and (os.path.lexists(output) or os.path.lexists(parts_of(output))):
        output = fresh_sibling(output)
    points = design(scene, table)
    key = sample_key(scene, points)
    with Lock(output.parent, f".{output.name}.lock"):
        files.remove_leftovers(output.parent)
        samples = finished(output, key)
        if samples is None:
            samples = _simulate(scene, points, output, key, ranks, interval, style)
        discard(parts_of(output))  # the run that finished may have been killed before it could
    timing = output.parent / "timing.nc"
    if ranks.stage_seconds or not timing.exists():  # who finds all done keeps what was measured
        dataset.write(timing_of(ranks), timing)
    return Finished(samples, output, timing, time.perf_counter() - start, spent_by(ranks))


def run_summary(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    *,
    raw: Path | None = None,
    fresh: bool = False,
    interval: float = INTERVAL,
    style: Style = "auto",
) -> Finished:
    """Simulate the study's Monte Carlo points and keep their statistics only; on root.

    Parameters as for `run_sample`; `raw`: directory for the samples themselves, if they are wanted. Returns the statistics.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    from hpcclear.ensemble.statistics import run_statistics

    start = time.perf_counter()
    content = run_statistics(
        scene, output, ranks, raw=raw, fresh=fresh, interval=interval, style=style
    )
    timing = output.parent / "timing.nc"
    if ranks.stage_seconds or not timing.exists():
        dataset.write(timing_of(ranks), timing)
    return Finished(content, output, timing, time.perf_counter() - start, spent_by(ranks))


def _simulate(
    scene: Scene,
    points: Points,
    output: Path,
    key: dict[str, str],
    ranks: Ranks,
    interval: float,
    style: Style,
) -> xr.Dataset:
    """Simulate what is not finished yet, and write the dataset."""
    units = dict(zip(points.names, points.units, strict=True))
    chosen, reason = scene, ""
    if scene.numerics.target_error is not None:
        with ranks.stage("settings"):
            chosen, reason = resolve(scene, points)
    attributes: dict[str, Any] = dataset.provenance(scene.text or scene.to_toml(), scene.hash)
    attributes.update(recorded(reason))
    with ranks.stage("files"), ranks.writing():
        checkpoint = Checkpoint(
            parts_of(output),
            key,
            interval=interval,
            names=points.names,
            units=units,
            attributes=attributes,
        )
    for problem in checkpoint.problems:
        sys.stderr.write(f"{problem}\n")
    records = sample_points(chosen, points, ranks, checkpoint, Progress("samples", style))
    samples = dataset.samples_dataset(
        points.names, points.values, units, records, {**attributes, **key_attribute(key)}
    )
    with ranks.stage("files"), ranks.writing():
        dataset.write(samples, output)
    return samples


def spent_by(ranks: Ranks) -> np.ndarray:
    """Seconds of every rank in all stages of this job, shape (ranks, 4)."""
    return sum(ranks.stage_seconds.values(), np.zeros((ranks.size, len(COLUMNS))))


def timing_of(ranks: Ranks) -> xr.Dataset:
    """Where the time of this job went, by rank and stage."""
    stages = list(ranks.stage_seconds) or ["none"]
    empty = np.zeros((ranks.size, len(COLUMNS)))
    seconds = np.stack([ranks.stage_seconds.get(stage, empty) for stage in stages], axis=1)
    data = {name: seconds[:, :, k] for k, name in enumerate(COLUMNS)}
    return dataset.timing_dataset(stages, data, shlex.join(sys.argv))
