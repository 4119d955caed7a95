"""Direct Monte Carlo of any size: points made on demand, statistics kept, samples only on request."""

import re
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.base.outcome import FIELDS, JOINTS, Flag, Status
from hpcclear.ensemble.identity import run_key
from hpcclear.ensemble.session import Finished, Options, Session, samples_of, saving
from hpcclear.ensemble.simulate import make_evaluator, payload_of
from hpcclear.ranks import leading
from hpcclear.ranks.progress import LongProgress
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.content import Results
from hpcclear.results.places import Place
from hpcclear.scene import Scene
from hpcclear.scene.sampling import MonteCarloPoints
from hpcclear.statistics.streams import BINS, BLOCK, QUANTITIES, Accumulator, Summary, rows_of

STAGE = "statistics"

TOGETHER = 256
"""Blocks of samples that are handed out in one stage."""

RAW = re.compile(r"samples-\d{8}\.nc")
"""Names of files of samples that are kept, a block each."""


class _Left:
    """The points of some samples, in the order they are handed out."""

    def __init__(self, points: MonteCarloPoints, samples: Integers) -> None:
        self._points, self._samples = points, samples

    def __len__(self) -> int:
        return len(self._samples)

    def __getitem__(self, index: Integers) -> Array:
        return self._points[self._samples[index]]


def run_statistics(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    *,
    samples: int | None = None,
    raw: Path | None = None,
    options: Options = Options(),
) -> Finished:
    """Simulate Monte Carlo samples of a study on all ranks and write their statistics; on root.

    NAME.timing.nc goes beside the output, what is unfinished into a hidden directory, the samples themselves to the directory
    `raw`, if there is one, a file of kind ``samples`` for every 4096. Raises InputError, StorageError, Stopped, RankFailed.
    """
    if scene.study is None or scene.study.method != "monte-carlo":
        method = None if scene.study is None else scene.study.method
        reason = "statistics are streamed for Monte Carlo samples only"
        raise InputError("study.method", method, reason, 'Set method = "monte-carlo" in [study]')
    for name in [one.name for one in scene.study.variables if one.rows]:
        reason = "statistics are not streamed over the rows of a table"
        remedy = "Use `sample` without --statistics, or leave the variable out"
        raise InputError(f"study.variables.{name}", None, reason, remedy)
    place = Place.of_file(output, options.fresh)
    points = MonteCarloPoints(scene, scene.study.samples if samples is None else samples)
    layout = f"{len(points)} in blocks of {BLOCK}, {BINS} bins"
    key = {**run_key(scene, "sample --statistics"), "statistics": layout}
    with Session(place, key, ranks, options) as session, _keeping(raw, session) as folder:
        content = session.found()
        blocks = range(-(-len(points) // BLOCK))
        if content is not None and folder is not None and (gone := _missing(folder, blocks)):
            reason = f"the statistics exist, in {place.output}, but the samples were not kept ({gone[0]} is missing)"
            raise InputError("--raw", str(folder), reason, "Choose another output, or add --fresh")
        if content is None:
            content = _Streaming(scene, points, session, folder).run()
        session.close()
    return Finished(content, place.output, place.timing)


@contextmanager
def _keeping(raw: Path | None, session: Session) -> Iterator[Path | None]:
    """The directory for samples themselves, locked and without those of another run; another one beside it with ``--fresh``.

    Raises InputError, StorageError.
    """
    if raw is None:
        yield None
        return
    place = Place.of_directory(raw, session.options.fresh, needed=RAW)
    if place.output != raw:
        session.notify(f"The samples themselves go to {place.output}.")
    with Session(place, session.key, session.ranks, session.options):
        yield place.output


def _kept(folder: Path, number: int) -> Path:
    """The file of the samples of block `number`."""
    return folder / f"samples-{number:08d}.nc"


def _missing(folder: Path, blocks: Iterable[int]) -> list[str]:
    """Names of the files of some blocks that are not in a directory."""
    return [path.name for number in blocks if not (path := _kept(folder, number)).is_file()]


class _Streaming:
    """Simulates what is left of a design, with the statistics so far on disk every few seconds; the session is entered."""

    def __init__(
        self, scene: Scene, points: MonteCarloPoints, session: Session, raw: Path | None
    ) -> None:
        self._payload, self._scene = payload_of(scene, points.page(0)), scene
        self._points, self._session, self._raw = points, session, raw
        self._checkpoint = session.opened(scene)
        self._sums = self._new_sums()
        earlier = self._checkpoint.load_stage(STAGE)
        session.notify_problems()
        if earlier is not None and raw is not None and not earlier["kept"]:
            session.notify("what was summed up without keeping the samples is simulated again")
        elif earlier is not None:
            self._sums.restore(earlier)
            if raw is not None and (gone := _missing(raw, self._sums.summed_blocks())):
                text = f"{gone[0]} is missing in {raw}: what was summed up is simulated again"
                session.notify(text)
                self._sums = self._new_sums()
        self._saved = time.monotonic()

    def _new_sums(self) -> Accumulator:
        keep = None if self._raw is None else self._keep
        return Accumulator(len(self._points), self._session.record, on_block=keep)

    def _keep(self, number: int, records: np.ndarray) -> None:
        """Write block `number`, all of its records in order, shape (m,)."""
        assert self._raw is not None
        page, about = self._points.page(number), self._session.attributes
        content = samples_of(self._scene, page, records, about)
        dataset.write(content, _kept(self._raw, number))

    def run(self) -> Results:
        """Simulate, and write the statistics; at first the block that decides the histograms."""
        sums = self._sums
        style = self._session.options.style
        with saving(self._save), LongProgress("samples", style, sums.total, sums.taken) as progress:
            while (left := sums.remaining(1 if sums.edges is None else TOGETHER)).size:
                self._simulate(left, progress)
        about = self._session.attributes, self._scene.objective, self._session.joints
        return self._session.write(statistics_dataset(self._sums, *about))

    def _save(self) -> None:
        with self._session.ranks.writing():
            kept = {"kept": np.array(self._raw is not None)}
            self._checkpoint.save_stage(STAGE, self._sums.state() | kept)
        self._saved = time.monotonic()

    def _save_when_due(self) -> None:
        if time.monotonic() - self._saved > self._checkpoint.interval:
            self._save()

    def _simulate(self, left: Integers, progress: LongProgress) -> None:
        """Simulate the samples of these numbers (n,)."""

        def take(records: np.ndarray) -> None:
            numbered = records.copy()
            numbered["sample"] = left[records["sample"]]
            self._sums.add(numbered)

        task = Task(STAGE, make_evaluator, self._payload, self._session.record)
        run = partial(leading.run_points, self._session.ranks, task, _Left(self._points, left))
        run(on_records=take, save=self._save_when_due, progress=progress, keep=False)


def statistics_dataset(
    sums: Accumulator,
    attributes: dict[str, str] | None = None,
    objective: Objective = MEAN_GAP,
    joints: Sequence[str] = JOINTS,
) -> Results:
    """A complete accumulator as a dataset of kind ``statistics``."""
    summary, edges = sums.result(), sums.edges
    assert edges is not None  # it is complete
    coords = {
        "joint": np.array(joints, dtype=str),
        "bin": np.arange(sums.bins + 2),
        "edge": np.arange(sums.bins + 1),
        "outcome": np.array([int(status) for status in Status]),
        "flags": np.array([int(flag) for flag in Flag]),
    }
    data: dict[str, np.ndarray] = {
        "samples_by_status": summary.status,
        "samples_by_flag": summary.flags,
    }
    for name in QUANTITIES:
        data |= _of_quantity(name, summary, edges, len(joints))
    return dataset.dataset("statistics", coords, data, attributes, objective=objective)


def _of_quantity(name: str, summary: Summary, edges: Array, joints: int) -> dict[str, np.ndarray]:
    """Variables of one quantity; scalars lose the axis of joints."""
    rows = [k for k, (quantity, _) in enumerate(rows_of(joints)) if quantity == name]
    chosen = rows if FIELDS[name].per else rows[0]
    known = summary.number > 0
    return {
        f"{name}_count": summary.number[chosen],
        f"{name}_mean": np.where(known, summary.mean, np.nan)[chosen],
        f"{name}_deviation": summary.deviation[chosen],
        f"{name}_minimum": np.where(known, summary.minimum, np.nan)[chosen],
        f"{name}_maximum": np.where(known, summary.maximum, np.nan)[chosen],
        f"{name}_histogram": summary.histogram[chosen],
        f"{name}_edges": edges[chosen],
    }
