"""Statistics of samples as they finish, without keeping them: mean, standard deviation, extremes and histogram of every number.

Samples are summed up by fixed blocks of indices, each sum correctly rounded, and blocks are merged in their order: so the
results are the same bit for bit whichever rank made which sample, and whenever. Only blocks that are incomplete are held.
"""

import math
from collections.abc import Callable, Mapping
from itertools import islice
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.outcome import FIELDS, OUTCOME, Flag, Status

BLOCK = 4096
"""Samples in a block. Part of what makes results reproducible: another length merges in another order."""

BINS = 200
"""Bins of a histogram, besides one below and one above."""

QUANTITIES = ("objective", "objective_spread", "mean_gap", "peak_contact_force", "rhs_evaluations")
"""Fields of a record that are summarised."""


def rows_of(joints: int) -> list[tuple[str, int]]:
    """Every summarised number of records with so many joints: field, joint (0 for scalars)."""
    return [(n, k) for n in QUANTITIES for k in range(joints if FIELDS[n].per == "joint" else 1)]


class Summary(NamedTuple):
    """Statistics of some samples; of none, when made by `empty`."""

    number: Integers
    """Shape (rows,): finite numbers, for each of `rows_of`."""
    mean: Array
    squares: Array
    minimum: Array
    maximum: Array
    """mean, squares, minimum and maximum, shape (rows,): mean, sum of squared differences from it, extremes; SI."""
    histogram: Integers
    """Shape (rows, bins + 2): numbers below the edges, between each two, and at or above the last."""
    status: Integers
    """Shape (outcomes,): samples by `hpcclear.base.outcome.Status`."""
    flags: Integers
    """Shape (flags,): samples by `hpcclear.base.outcome.Flag`."""

    @property
    def deviation(self) -> Array:
        """Sample standard deviation, shape (rows,); NaN for fewer than two numbers."""
        freedom = np.where(self.number > 1, self.number - 1, 1)
        return np.where(self.number > 1, np.sqrt(self.squares / freedom), np.nan)


def empty(rows: int, bins: int = BINS) -> Summary:
    """The summary of no samples, with so many numbers each."""
    return Summary(
        np.zeros(rows, np.int64),
        np.zeros(rows),
        np.zeros(rows),
        np.full(rows, np.inf),
        np.full(rows, -np.inf),
        np.zeros((rows, bins + 2), np.int64),
        np.zeros(len(Status), np.int64),
        np.zeros(len(Flag), np.int64),
    )


def columns(records: np.ndarray) -> Array:
    """The summarised numbers of records (m,), shape (rows, m); NaN where a sample failed."""
    values = np.concatenate([np.atleast_2d(records[n].T).astype(float) for n in QUANTITIES])
    values[:, records["status"] != Status.OK] = np.nan
    return values


def histogram_edges(records: np.ndarray, bins: int = BINS) -> Array:
    """Edges that suit some first samples, shape (rows, bins + 1): their range and half as much on both sides."""
    numbers = columns(records)
    edges = np.empty((len(numbers), bins + 1))
    for row, values in enumerate(numbers):
        known = values[np.isfinite(values)]
        low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
        margin = max(0.5 * (high - low), 1e-6 * max(abs(low), abs(high)), 1e-300)
        edges[row] = np.linspace(low - margin, high + margin, bins + 1)
    return edges


def summarise(records: np.ndarray, edges: Array) -> Summary:
    """Summary of records, shape (m,), with the edges of `histogram_edges`."""
    result = empty(len(edges), edges.shape[1] - 1)
    for row, numbers in enumerate(columns(records)):
        known = numbers[np.isfinite(numbers)]
        if known.size:
            result.number[row] = known.size
            result.mean[row] = math.fsum(known.tolist()) / known.size
            result.squares[row] = math.fsum(np.square(known - result.mean[row]).tolist())
            result.minimum[row], result.maximum[row] = known.min(), known.max()
            cells = np.searchsorted(edges[row], known, side="right")
            result.histogram[row] = np.bincount(cells, minlength=edges.shape[1] + 1)
    result.status[:] = np.bincount(records["status"], minlength=len(Status))
    result.flags[:] = [np.count_nonzero(records["flags"] & int(flag)) for flag in Flag]
    return result


def merge(first: Summary, second: Summary) -> Summary:
    """Summary of both (Chan, Golub and LeVeque 1983, doi:10.1080/00031305.1983.10483115)."""
    number, apart = first.number + second.number, second.mean - first.mean
    share = second.number / np.maximum(number, 1)
    return Summary(
        number,
        first.mean + apart * share,
        first.squares + second.squares + np.square(apart) * first.number * share,
        np.minimum(first.minimum, second.minimum),
        np.maximum(first.maximum, second.maximum),
        first.histogram + second.histogram,
        first.status + second.status,
        first.flags + second.flags,
    )


class Accumulator:
    """Takes the samples of a design as they finish, in any order, and keeps their statistics.

    Of `total` samples `block` make one; `on_block` gets number and records (in index order) of every block that is complete,
    and may keep raw samples. `edges`: of the histograms of `bins` bins, chosen from block 0, so that they are the same in
    every run.
    """

    def __init__(
        self,
        total: int,
        record: np.dtype = OUTCOME,
        *,
        block: int = BLOCK,
        bins: int = BINS,
        on_block: Callable[[int, np.ndarray], object] | None = None,
    ) -> None:
        self.total, self.block, self.bins = total, block, bins
        self.edges: Array | None = None
        self._record, self._on_block = record, on_block
        self._open: dict[int, np.ndarray] = {}  # records by block; sample -1: not here yet
        # of all blocks before the next one, and of blocks that are ahead of it
        self._whole, self._next = empty(len(rows_of(record["mean_gap"].shape[0])), bins), 0
        self._ahead: dict[int, Summary] = {}

    @property
    def taken(self) -> int:
        """Samples taken so far."""
        summed = sum(int(one.status.sum()) for one in (self._whole, *self._ahead.values()))
        return summed + sum(int((held["sample"] >= 0).sum()) for held in self._open.values())

    def add(self, records: np.ndarray) -> None:
        """Take finished samples, records (m,), none of them twice."""
        numbers = records["sample"] // self.block
        for number in np.unique(numbers).tolist():
            first, its = number * self.block, records[numbers == number]
            if number not in self._open:
                self._open[number] = np.zeros(min(self.block, self.total - first), self._record)
                self._open[number]["sample"] = -1
            self._open[number][its["sample"] - first] = its
        whole = {n: held for n, held in self._open.items() if (held["sample"] >= 0).all()}
        if self.edges is None and 0 in whole:
            self.edges = histogram_edges(whole[0], self.bins)
        if self.edges is None:
            return
        for number, held in sorted(whole.items()):
            if self._on_block is not None:
                self._on_block(number, held)
            self._ahead[number] = summarise(self._open.pop(number), self.edges)
        while self._next in self._ahead:
            self._whole = merge(self._whole, self._ahead.pop(self._next))
            self._next += 1

    def result(self) -> Summary:
        """Statistics of the whole design. Raises RuntimeError if samples are missing."""
        if self._next * self.block < self.total:
            raise RuntimeError("statistics were requested before every sample has finished")
        return self._whole

    def remaining(self, blocks: int) -> Integers:
        """Numbers (n,) of the samples that are missing of blocks begun, and of so many of the next blocks."""
        held = ((number * self.block, one["sample"]) for number, one in sorted(self._open.items()))
        missing = [first + np.flatnonzero(samples < 0) for first, samples in held]
        later = range(self._next, -(-self.total // self.block))
        fresh = (n * self.block for n in later if n not in self._ahead and n not in self._open)
        for first in islice(fresh, blocks):
            missing.append(np.arange(first, min(first + self.block, self.total)))
        return np.concatenate([np.empty(0, np.int64), *missing])

    def summed_blocks(self) -> list[int]:
        """Numbers of the blocks of which all samples are summed up."""
        return [*range(self._next), *sorted(self._ahead)]

    def state(self) -> dict[str, np.ndarray]:
        """All of it as plain arrays, for a checkpoint; see `restore`."""
        held = [block[block["sample"] >= 0] for _, block in sorted(self._open.items())]
        records = np.concatenate([np.empty(0, self._record), *held])
        ahead = sorted(self._ahead)
        data = {"layout": np.array([self.total, self.block, self.bins, self._next])}
        data["ahead"] = np.array(ahead, np.int64)
        if self.edges is not None:
            data["edges"] = self.edges
        rows = (self._whole, *(self._ahead[number] for number in ahead))
        for name, values in zip(Summary._fields, zip(*rows, strict=True), strict=True):
            data[f"summary_{name}"] = np.stack(values)
        return {**data, **{f"record_{name}": records[name] for name in self._record.names or ()}}

    def restore(self, data: Mapping[str, ArrayLike]) -> None:
        """Go on from a `state` of an accumulator of the same layout; this one is new.

        Raises ValueError if the layout differs.
        """
        arrays = {name: np.asarray(values) for name, values in data.items()}
        *layout, self._next = arrays["layout"].tolist()
        if layout != [self.total, self.block, self.bins]:
            raise ValueError("the state is of other statistics")
        self.edges = arrays.get("edges")
        parts = (arrays[f"summary_{name}"] for name in Summary._fields)
        self._whole, *others = map(Summary._make, zip(*parts, strict=True))
        self._ahead = dict(zip(arrays["ahead"].tolist(), others, strict=True))
        records = np.empty(len(arrays["record_sample"]), self._record)
        for name in self._record.names or ():
            records[name] = arrays[f"record_{name}"]
        self.add(records)
