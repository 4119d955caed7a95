"""Statistics summed up where the samples are made: ranks get parts of blocks and send back one summary for each.

A part is a run of sample numbers that is a node of its block's tree (`statistics.summarise`), so that it does not matter
to a single bit how long parts are, who sums them up and in which order they come in.
"""

from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.ranks.progress import Progress, Style
from hpcclear.statistics.streams.summary import BLOCK, LEAF, Summary, empty, rows_of, summarise

if TYPE_CHECKING:
    from hpcclear.ranks.schedule import PointSource, Worker
    from hpcclear.ranks.team import Ranks

PARTS_A_RANK = 32
"""A rank gets at least so many parts while they can be short enough, so that none is busy long after the others."""

LONGEST = 2.0
"""Seconds of work that a part holds at most, if samples allow: what a rank that is killed has not reported."""

LONGEST_UNKNOWN = 256
"""Samples of a part at most while nobody knows what they cost."""


def part_length(samples: int, ranks: int, block: int, seconds: float = 0.0) -> int:
    """Samples a part: a leaf times a power of two, a block at most; `seconds`: of one sample, 0 if not known."""
    most = min(block, LONGEST / seconds if seconds > 0.0 else LONGEST_UNKNOWN)
    length = LEAF
    while 2 * length <= min(most, samples // (PARTS_A_RANK * ranks)):
        length *= 2
    return length


def partial_of(record: np.dtype) -> np.dtype:
    """Type of one part's summary as a record, for the way from rank to root; `record`: of its samples."""
    like = vars(empty(len(rows_of(record["mean_gap"].shape[0]))))
    return np.dtype(
        [("sample", np.int64), *((name, one.dtype, one.shape) for name, one in like.items())]
    )


def packed(kind: np.dtype, part: int, summary: Summary) -> np.ndarray:
    """The summary of the part of this number as a record of `partial_of`, the `kind`, shape (1,)."""
    record = np.zeros(1, kind)
    record["sample"] = part
    for name, values in vars(summary).items():
        record[name] = values
    return record


def unpacked(record: np.void) -> Summary:
    """The summary in one record of `partial_of`."""
    return Summary(*(record[field.name] for field in fields(Summary)))


class Summariser:
    """A rank's worker that simulates parts and sums them up; see `schedule.Worker`.

    Parameters
    ----------
    worker : Worker
        Simulates samples.
    points : PointSource
        Makes the design's points by sample number.
    record : dtype
        Type of the records of samples.
    edges : ndarray, shape (rows, bins + 1)
        Of the histograms.
    length : int
        Samples of a part.
    """

    lanes = 1  # parts at once: one is worked on while the next fills lanes that it leaves

    def __init__(
        self, worker: "Worker", points: "PointSource", record: np.dtype, edges: Array, length: int
    ) -> None:
        self._worker, self._points, self._edges, self._length = worker, points, edges, length
        self._record, self._kind = record, partial_of(record)
        self._waiting: list[tuple[int, int]] = []  # number and first sample of parts not begun
        # first sample and records of parts begun; sample -1: not here yet
        self._open: dict[int, tuple[int, np.ndarray]] = {}

    @property
    def pending(self) -> int:
        """Parts not finished."""
        return len(self._waiting) + len(self._open)

    @property
    def samples_in_hand(self) -> list[int]:
        """Samples of parts in hand that have not finished, ascending."""
        begun = [np.flatnonzero(r["sample"] < 0) + first for first, r in self._open.values()]
        waiting = [self._samples(first) for _, first in self._waiting]
        return sorted(int(k) for part in (*begun, *waiting) for k in part)

    def _samples(self, first: int) -> Integers:
        return np.arange(first, min(first + self._length, len(self._points)))

    def submit(self, index: Integers, points: Array) -> None:
        """Queue parts: numbers (m,), their first samples (m, 1)."""
        self._waiting += zip(index.tolist(), points[:, 0].astype(int).tolist(), strict=True)
        self._begin()

    def _begin(self) -> None:
        """Begin as many parts as fill a block: memory of records does not grow with the parts in hand."""
        while self._waiting and self._worker.pending < BLOCK:
            part, first = self._waiting.pop(0)
            samples = self._samples(first)
            records = np.zeros(samples.size, self._record)
            records["sample"] = -1
            self._open[part] = first, records
            self._worker.submit(samples, self._points[samples])

    def advance(self, seconds: float) -> np.ndarray:
        """Work for about `seconds`; summaries (`partial_of`) of the parts finished meanwhile."""
        records = self._worker.advance(seconds)
        done = [np.zeros(0, self._kind)]
        for part, (first, held) in list(self._open.items()) if records.size else ():
            slots = records["sample"] - first
            mine = (slots >= 0) & (slots < held.size)
            held[slots[mine]] = records[mine]
            if (held["sample"] >= 0).all():
                del self._open[part]
                summary = summarise(held, self._edges, self._length)
                done.append(packed(self._kind, part, summary))
        self._begin()
        return np.concatenate(done)


def make_summariser(payload: Mapping[str, Any], ranks: "Ranks") -> Summariser:
    """A rank's worker: what `payload["make"]` makes of `payload["samples"]`, summed up where it is simulated."""
    from hpcclear.scene import load_scene
    from hpcclear.scene.sampling import MonteCarloPoints
    from hpcclear.scene.scene import record_of

    worker = payload["make"](payload["samples"], ranks)
    scene = load_scene(payload["design"], trust=True)
    points = MonteCarloPoints(scene, payload["total"])
    return Summariser(worker, points, record_of(scene), payload["edges"], payload["length"])


class PartsProgress(Progress):
    """Progress over the samples of a whole design, of which a stage makes some, as samples or as parts."""

    def __init__(self, label: str, style: Style, samples: int, done: int) -> None:
        super().__init__(label, style)
        self._samples, self._before = samples, done

    def start(self, total: int, completed: np.ndarray) -> None:
        """Begin with the design as far as it is there; the numbers of a stage say nothing to a reader."""
        super().start(self._samples, completed)
        self._done = self._before
        self._origin = (self._began, self._done)
        self._history.clear()
        self._history.append(self._origin)

    def add(self, records: np.ndarray) -> None:
        """Count finished samples, or those of finished parts, records of `partial_of` (m,)."""
        status = records["status"]
        if status.ndim == 1:
            super().add(records)
            return
        self._done += int(status.sum())
        self._failed += int(status[:, 1:].sum())
