"""Direct Monte Carlo of any size: points made on demand, statistics kept, samples only if asked for."""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import JOINTS, OUTCOME, Flag, Status
from hpcclear.dynamics.target import recorded, resolve
from hpcclear.ensemble.parts import PARTIAL, Parts, PartsProgress, part_length, unpacked
from hpcclear.ensemble.simulate import KIND, PARTS, payload_of, saving
from hpcclear.ranks.progress import Progress, Style
from hpcclear.ranks.team import COLUMNS, Ranks
from hpcclear.results import dataset, files
from hpcclear.results.checkpoint import INTERVAL, Checkpoint, check_key, key_attribute
from hpcclear.results.lock import Lock
from hpcclear.results.places import fresh_sibling, parts_of
from hpcclear.scene import Scene
from hpcclear.scene.paths import flatten
from hpcclear.scene.sampling import MonteCarloPoints
from hpcclear.statistics.streams.accumulator import Accumulator, Remaining
from hpcclear.statistics.streams.summary import BINS, BLOCK, LEAF, ROWS, Summary

STAGE = "statistics"


class _Left:
    """The points that are left, in the order they are handed out."""

    def __init__(self, points: MonteCarloPoints, remaining: Remaining) -> None:
        self._points, self._remaining = points, remaining

    def __len__(self) -> int:
        return len(self._remaining)

    def __getitem__(self, index: Integers) -> Array:
        return self._points[self._remaining.samples(index)]


def run_statistics(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    *,
    samples: int | None = None,
    raw: Path | None = None,
    fresh: bool = False,
    interval: float = INTERVAL,
    style: Style = "auto",
) -> xr.Dataset:
    """Simulate Monte Carlo samples on all ranks and write their statistics; on root.

    Parameters
    ----------
    scene : Scene
        With a study that samples by Monte Carlo.
    output : Path
        NetCDF file of kind ``statistics``; what is unfinished goes into a hidden directory beside it.
    ranks : Ranks
        Made with `hpcclear.ensemble.simulate.MAKERS`.
    samples : int, optional
        Number of samples, the study's by default.
    raw : Path, optional
        Directory for the samples themselves, a file of kind ``samples`` for every 4096.
    fresh : bool
        Start anew beside an earlier result.
    interval : float
        Seconds between two checkpoints.
    style : str
        How progress is shown.

    Raises
    ------
    InputError, StorageError, Stopped, RankFailed
    """
    if scene.study is None or scene.study.method == "lhs":
        method = None if scene.study is None else scene.study.method
        raise InputError(
            "study.method",
            method,
            "statistics are streamed for Monte Carlo samples only",
            'Set method = "monte-carlo" in [study]',
        )
    files.probe(output)
    output = fresh_sibling(output) if fresh else output
    points = MonteCarloPoints(scene, scene.study.samples if samples is None else samples)
    entries = {name: repr(value) for name, value in flatten(scene.resolved())}
    layout = f"{len(points)} in blocks of {BLOCK} and leaves of {LEAF}, {BINS} bins"
    version = dataset.provenance(scene.text, scene.hash)["hpcclear_version"]
    key = {**entries, "hpcclear version": version, "statistics": layout}
    with Lock(output.parent, f".{output.name}.lock"):
        files.remove_leftovers(output.parent)
        if output.exists():
            content = dataset.read(output, "statistics")
            check_key(content, key, output)
            return content
        return _accumulate(scene, points, output, key, ranks, raw, interval, style)


def _accumulate(
    scene: Scene,
    points: MonteCarloPoints,
    output: Path,
    key: dict[str, str],
    ranks: Ranks,
    raw: Path | None,
    interval: float,
    style: Style,
) -> xr.Dataset:
    """Simulate what is left, with the statistics so far on disk every few seconds."""
    chosen, reason = scene, ""
    if scene.numerics.target_error is not None:
        with ranks.stage("settings"):
            chosen, reason = resolve(scene, points.page(0))
    attributes = {
        **dataset.provenance(scene.text or scene.to_toml(), scene.hash),
        **recorded(reason),
        **key_attribute(key),
    }
    checkpoint = Checkpoint(parts_of(output), key, interval=interval, attributes=attributes)
    if raw is not None:
        files.make_directory(raw)

    def keep_raw(number: int, records: np.ndarray) -> None:
        if raw is not None:
            page = points.page(number)
            units = dict(zip(page.names, page.units, strict=True))
            content = dataset.samples_dataset(page.names, page.values, units, records, attributes)
            dataset.write(content, raw / f"samples-{number:08d}.nc")

    sums = Accumulator(len(points), on_block=keep_raw)
    earlier = checkpoint.load_stage(STAGE)
    for problem in checkpoint.problems:
        sys.stderr.write(f"{problem}\n")
    if earlier is not None:
        sums.restore(earlier)
    saved = time.monotonic()

    def save() -> None:
        nonlocal saved
        with ranks.writing():
            checkpoint.save_stage(STAGE, sums.state())
        saved = time.monotonic()

    def save_when_due() -> None:
        if time.monotonic() - saved > checkpoint.interval:
            save()

    how: dict[str, Any] = {"stage": STAGE, "save": save_when_due, "keep": False}
    with saving(save):
        seconds = _run_samples(
            chosen, points, sums, ranks, whole=raw is not None, style=style, **how
        )
        if not sums.complete:
            _run_parts(chosen, points, sums, ranks, seconds, style=style, **how)
    content = statistics_dataset(sums, attributes)
    with ranks.writing():
        dataset.write(content, output)
        checkpoint.finish()
    return content


def _run_samples(
    scene: Scene,
    points: MonteCarloPoints,
    sums: Accumulator,
    ranks: Ranks,
    *,
    whole: bool,
    style: Style,
    **how: Any,
) -> float:
    """Let ranks send samples: all of them if they are kept, else those of the first block, which decides the
    histograms, and of blocks that an earlier run left with samples. Returns seconds of a rank for one; 0: none was made."""
    if whole:
        sums.forget_parts()
    left = sums.remaining()
    if not whole:
        left = left.begun(sums.edges is None)
    if len(left) == 0:
        return 0.0

    def take(records: np.ndarray) -> None:
        numbered = records.astype(OUTCOME)
        numbered["sample"] = left.samples(records["sample"])
        sums.add(numbered)

    ranks.run_points(
        KIND, payload_of(scene, points.page(0)), _Left(points, left),
        on_records=take, progress=Progress("samples", style), **how,
    )  # fmt: skip
    busy = ranks.stage_seconds[STAGE][:, COLUMNS.index("busy")].sum()
    return float(busy) / len(left)


def _run_parts(
    scene: Scene,
    points: MonteCarloPoints,
    sums: Accumulator,
    ranks: Ranks,
    seconds: float,
    *,
    style: Style,
    **how: Any,
) -> None:
    """Let ranks sum up what they simulate, so that root's work does not grow with the samples."""
    left = int(sums.total - sums.taken)
    parts = Parts(sums, part_length(left, ranks.size, sums.block, seconds))

    def take(records: np.ndarray) -> None:
        for record in records:
            sums.add_part(int(record["first"]), int(record["length"]), unpacked(record))

    payload = {
        "samples": payload_of(scene, points.page(0)),
        "design": scene.resolved(),
        "total": len(points),
        "edges": sums.edges,
    }
    ranks.run_points(
        PARTS, payload, parts, dtype=PARTIAL, on_records=take,
        progress=PartsProgress("samples", style, sums.total, sums.taken), **how,
    )  # fmt: skip


def statistics_dataset(sums: Accumulator, attributes: dict[str, str] | None = None) -> xr.Dataset:
    """A complete accumulator as a dataset of kind ``statistics``."""
    summary, edges = sums.result(), sums.edges
    assert edges is not None  # it is complete
    coords = {
        "joint": np.array(JOINTS),
        "bin": np.arange(sums.bins + 2),
        "edge": np.arange(sums.bins + 1),
        "outcome": np.array([int(status) for status in Status]),
        "flags": np.array([int(flag) for flag in Flag]),
    }
    data: dict[str, np.ndarray] = {
        "samples_by_status": summary.status,
        "samples_by_flag": summary.flags,
    }
    for name in dict(ROWS):
        data |= _of_quantity(name, summary, edges)
    return dataset.dataset("statistics", coords, data, attributes)


def _of_quantity(name: str, summary: Summary, edges: Array) -> dict[str, np.ndarray]:
    """Variables of one quantity; scalars lose the axis of joints."""
    rows = [k for k, (quantity, _) in enumerate(ROWS) if quantity == name]
    chosen = rows if len(rows) > 1 else rows[0]
    known = summary.count > 0
    return {
        f"{name}_count": summary.count[chosen],
        f"{name}_mean": np.where(known, summary.mean, np.nan)[chosen],
        f"{name}_deviation": summary.deviation[chosen],
        f"{name}_minimum": np.where(known, summary.minimum, np.nan)[chosen],
        f"{name}_maximum": np.where(known, summary.maximum, np.nan)[chosen],
        f"{name}_histogram": summary.histogram[chosen],
        f"{name}_edges": edges[chosen],
    }
