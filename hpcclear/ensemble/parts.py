"""Statistics summed up where the samples are made: ranks get parts of blocks and send back one summary for each.

A part is a run of sample numbers that is a node of its block's tree (`statistics.summarise`), so that it does not matter
to a single bit how long parts are, who sums them up and in which order they come in.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.outcome import Flag, Status
from hpcclear.ranks.progress import Progress, Style
from hpcclear.statistics.streams.accumulator import Accumulator
from hpcclear.statistics.streams.summary import BINS, BLOCK, LEAF, Summary, rows_of, summarise

if TYPE_CHECKING:
    from hpcclear.ranks.schedule import Points, Worker
    from hpcclear.ranks.team import Ranks

PARTS_A_RANK = 32
"""A rank gets at least so many parts while they can be short enough, so that none is busy long after the others."""


def partial_of(record: np.dtype) -> np.dtype:
    """Type of one part's summary as a record, for the way from rank to root; `record`: of its samples."""
    rows = len(rows_of(record["mean_gap"].shape[0]))
    return np.dtype(
        [
            ("sample", np.int64),  # which part
            ("first", np.int64),  # its first sample
            (
                "length",
                np.int64,
            ),  # of the node of the tree; the last part of a design may hold less
            ("samples", np.int64),
            ("count", np.int64, (rows,)),
            ("mean", float, (rows,)),
            ("squares", float, (rows,)),
            ("minimum", float, (rows,)),
            ("maximum", float, (rows,)),
            ("histogram", np.uint32, (rows, BINS + 2)),
            ("status", np.int64, (len(Status),)),
            ("flags", np.int64, (len(Flag),)),
        ]
    )


def is_partial(records: np.ndarray) -> bool:
    """Whether records are summaries of parts, not samples."""
    return "histogram" in (records.dtype.names or ())


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


def packed(
    kind: np.dtype, part: int, first: int, length: int, samples: int, summary: Summary
) -> np.ndarray:
    """One summary as a record of `partial_of`, the `kind`, shape (1,)."""
    record = np.zeros(1, kind)
    record["sample"], record["first"], record["length"], record["samples"] = (
        part, first, length, samples,
    )  # fmt: skip
    for field in fields(Summary):
        record[field.name] = getattr(summary, field.name)
    return record


def unpacked(record: np.void) -> Summary:
    """The summary in one record of `partial_of`."""
    row = {field.name: record[field.name] for field in fields(Summary)}
    row["histogram"] = row["histogram"].astype(np.int64)
    return Summary(**row)


def take_parts(sums: Accumulator, records: np.ndarray) -> None:
    """Let an accumulator take summaries, records of `partial_of` (m,)."""
    for record in records:
        sums.add_part(int(record["first"]), int(record["length"]), unpacked(record))


class Parts:
    """What is left of a design, as parts: rows of first sample and length, made when they are requested.

    Parameters
    ----------
    sums : Accumulator
        Knows what was taken already.
    length : int
        Samples a part, as `part_length`.
    """

    def __init__(self, sums: Accumulator, length: int) -> None:
        self._rows = sums.parts_left(length)

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, index: Integers) -> Array:
        return self._rows[np.asarray(index, np.int64)].astype(float)


class Summariser:
    """A rank's worker that simulates parts and sums them up; see `schedule.Worker`.

    Parameters
    ----------
    worker : Worker
        Simulates samples.
    points : Points
        Makes the design's points by sample number.
    record : dtype
        Type of the records of samples.
    edges : ndarray, shape (rows, bins + 1)
        Of the histograms.
    on_block : callable, optional
        Gets number and records (in index order) of every part, which is a block then; it may keep raw samples.
    """

    lanes = 1  # parts at once: one is worked on while the next fills lanes that it leaves

    def __init__(
        self,
        worker: "Worker",
        points: "Points",
        record: np.dtype,
        edges: Array,
        on_block: Callable[[int, np.ndarray], object] | None = None,
    ) -> None:
        self._worker, self._points, self._edges = worker, points, edges
        self._on_block = on_block
        self._record, self._kind = record, partial_of(record)
        self._waiting: list[
            tuple[int, int, int]
        ] = []  # number, first sample and length of parts not begun
        self._open: dict[int, np.ndarray] = {}  # records by part; sample -1: not here yet
        self._places: dict[int, tuple[int, int]] = {}  # first sample and length of each part
        self._missing: dict[int, int] = {}

    @property
    def pending(self) -> int:
        """Parts not finished."""
        return len(self._waiting) + len(self._open)

    @property
    def samples_in_hand(self) -> list[int]:
        """Samples of parts in hand that have not finished, ascending."""
        begun = (
            self._places[part][0] + k
            for part, records in self._open.items()
            for k in np.flatnonzero(records["sample"] < 0).tolist()
        )
        waiting = (k for _, *place in self._waiting for k in self._samples(*place).tolist())
        return sorted([*begun, *waiting])

    def _samples(self, first: int, length: int) -> Integers:
        return np.arange(first, min(first + length, len(self._points)))

    def submit(self, index: Integers, points: Array) -> None:
        """Queue parts: numbers (m,), rows of first sample and length (m, 2)."""
        places = points.astype(np.int64).tolist()
        self._waiting += [
            (part, *place) for part, place in zip(index.tolist(), places, strict=True)
        ]
        self._begin()

    def _begin(self) -> None:
        """Begin as many parts as fill a block: memory of records does not grow with the parts in hand."""
        while self._waiting and self._worker.pending < BLOCK:
            part, first, length = self._waiting.pop(0)
            samples = self._samples(first, length)
            records = np.zeros(samples.size, self._record)
            records["sample"] = -1
            self._open[part], self._places[part] = records, (first, length)
            self._missing[part] = samples.size
            self._worker.submit(samples, self._points[samples])

    def advance(self, seconds: float) -> np.ndarray:
        """Work for about `seconds`; summaries (`partial_of`) of the parts finished meanwhile."""
        records = self._worker.advance(seconds)
        done = []
        if records.size:
            for part in list(self._open):
                first, length = self._places[part]
                slots = records["sample"] - first
                mine = (slots >= 0) & (slots < length)
                self._open[part][slots[mine]] = records[mine]
                self._missing[part] -= int(np.count_nonzero(mine))
                if self._missing[part] == 0:
                    done.append(self._finish(part))
            self._begin()
        return np.concatenate(done) if done else np.zeros(0, self._kind)

    def _finish(self, part: int) -> np.ndarray:
        records = self._open.pop(part)
        first, length = self._places.pop(part)
        del self._missing[part]
        if self._on_block is not None:
            self._on_block(first // length, records)
        summary = summarise(records, self._edges, length)
        return packed(self._kind, part, first, length, records.size, summary)


def make_summariser(payload: Mapping[str, Any], ranks: "Ranks") -> Summariser:
    """A rank's worker: what `payload["make"]` makes of `payload["samples"]`, summed up where it is simulated, and written
    there if `payload["raw"]` says where (`hpcclear.ensemble.raw.raw_files`)."""
    from hpcclear.ensemble.raw import raw_files
    from hpcclear.scene import load_scene
    from hpcclear.scene.pages import MonteCarloPoints
    from hpcclear.scene.record import record_of

    worker = payload["make"](payload["samples"], ranks)
    scene = load_scene(payload["design"], trust=True)
    points = MonteCarloPoints(scene, payload["total"])
    files = raw_files(payload["raw"], scene, points)
    write = None if files is None else files.write
    return Summariser(worker, points, record_of(scene), payload["edges"], write)


class PartsProgress(Progress):
    """Progress of a stage of parts, reported in samples."""

    def __init__(self, label: str, style: Style, samples: int, done: int) -> None:
        super().__init__(label, style)
        self._samples, self._before = samples, done

    def start(self, total: int, completed: np.ndarray) -> None:
        """Begin with records `completed` (m,) there already; the number of parts says nothing to a reader."""
        super().start(self._samples, completed)
        self._done = self._before
        self._origin = (self._began, self._done)
        self._history.clear()
        self._history.append(self._origin)

    def add(self, records: np.ndarray) -> None:
        """Count the samples of finished parts, records of `partial_of` (m,), or samples that came on their own."""
        if not is_partial(records):
            super().add(records)
            return
        self._done += int(records["samples"].sum())
        self._failed += int(records["status"][:, 1:].sum())
