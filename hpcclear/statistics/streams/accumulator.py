"""Statistics of direct Monte Carlo as the samples finish, without keeping them.

A block of samples that is complete is summed up, and what is summed up is merged along one binary tree over the numbers
of the samples: so the results are the same bit for bit whichever rank made which sample, and whenever, and whether
root got samples or sums of some. Only blocks that are still incomplete are held in memory.
"""

from collections.abc import Callable, Mapping
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.outcome import OUTCOME
from hpcclear.statistics.streams.summary import (
    BINS,
    BLOCK,
    Summary,
    empty,
    histogram_edges,
    merge,
    rows_of,
    summarise,
    tree_length,
)


class Accumulator:
    """Takes the samples of a design as they finish, in any order, and keeps their statistics.

    Parameters
    ----------
    total : int
        Samples of the design, at least 1.
    record : dtype
        Type of their records.
    block, bins : int
        Samples a block (a leaf times a power of two), bins of each histogram.
    on_block : callable, optional
        Gets number and records (in index order) of every block that is complete; it may keep raw samples.

    Attributes
    ----------
    edges : ndarray or None
        Of the histograms: chosen from block 0, so that they are the same in every run.
    part : int
        Samples of a part, a leaf times a power of two and a block at most; 0 while none was chosen. One design has parts of
        one length, whoever goes on with it.
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
        self.total, self.block, self.bins, self.part = total, block, bins, 0
        self.edges: Array | None = None
        self._record, self._on_block = record, on_block
        self._rows = len(rows_of(record["mean_gap"].shape[0]))
        self._open: dict[int, np.ndarray] = {}  # records by block; sample -1: not here yet
        self._missing: dict[int, int] = {}
        # of the tree over the design, apart from each other, none beside its sibling: by their first samples
        self._nodes: dict[int, tuple[int, Summary]] = {}
        self._whole = max(tree_length(total), block)

    @property
    def complete(self) -> bool:
        """Whether every sample was taken."""
        return self._length_at(0) == self._whole

    @property
    def taken(self) -> int:
        """Samples taken so far."""
        summed = sum(min(length, self.total - first) for first, (length, _) in self._nodes.items())
        return summed + sum(len(held) - self._missing[n] for n, held in self._open.items())

    def _length_at(self, first: int) -> int:
        """Length of the node that begins there; 0: none does."""
        return self._nodes[first][0] if first in self._nodes else 0

    def add(self, records: np.ndarray) -> None:
        """Take finished samples, records (m,), none of them twice."""
        numbers = records["sample"] // self.block
        for number in np.unique(numbers).tolist():
            self._put(number, records[numbers == number])
        self._reduce()

    def add_part(self, first: int, length: int, summary: Summary) -> None:
        """Take the summary of the samples from `first` on, a node of `length` samples of the design's tree."""
        while length < self._whole:
            sibling = first ^ length
            if sibling >= self.total:
                other = empty(self._rows, self.bins)
            elif self._length_at(sibling) == length:
                other = self._nodes.pop(sibling)[1]
            else:
                break
            summary = merge(summary, other) if first < sibling else merge(other, summary)
            first, length = min(first, sibling), 2 * length
        self._nodes[first] = (length, summary)

    def _put(self, number: int, records: np.ndarray) -> None:
        first = number * self.block
        if number not in self._open:
            self._open[number] = np.zeros(min(self.block, self.total - first), self._record)
            self._open[number]["sample"] = -1
            self._missing[number] = len(self._open[number])
        self._open[number][records["sample"] - first] = records
        self._missing[number] -= records.size

    def _reduce(self) -> None:
        """Summarise complete blocks."""
        if self.edges is None:
            if self._missing.get(0) != 0:
                return
            self.edges = histogram_edges(self._open[0], self.bins)
        for number in sorted(n for n, missing in self._missing.items() if missing == 0):
            if self._on_block is not None:
                self._on_block(number, self._open[number])
            del self._missing[number]
            summary = summarise(self._open.pop(number), self.edges, self.block)
            self.add_part(number * self.block, self.block, summary)

    def result(self) -> Summary:
        """Statistics of the whole design.

        Raises
        ------
        RuntimeError
            If samples are missing.
        """
        if not self.complete:
            raise RuntimeError("statistics were requested before every sample has finished")
        return self._nodes[0][1]

    def remaining(self, blocks: int) -> Integers:
        """Numbers (n,) of the samples that are missing of blocks begun, and of so many of the next blocks."""
        fresh = np.flatnonzero(~self._touched(self.block))[:blocks]
        missing = [
            np.flatnonzero(held["sample"] < 0) + number * self.block
            for number, held in sorted(self._open.items())
        ]
        missing += [
            np.arange(first, min(first + self.block, self.total)) for first in fresh * self.block
        ]
        return np.concatenate(missing) if missing else np.empty(0, np.int64)

    def parts_left(self) -> Integers:
        """First samples (n,) of the parts of which nothing was taken."""
        return np.flatnonzero(~self._touched(self.part)) * self.part

    def summed_blocks(self) -> Integers:
        """Numbers of the blocks of which all samples are summed up."""
        found = self._touched(self.block)
        found[list(self._open)] = False
        return np.flatnonzero(found)

    def _touched(self, length: int) -> Booleans:
        """Whether something was taken of each stretch of so many samples."""
        found = np.zeros(-(-self.total // length), bool)
        nodes = [(first, size) for first, (size, _) in self._nodes.items()]
        for first, size in [*nodes, *((number * self.block, self.block) for number in self._open)]:
            found[first // length : -(-(first + size) // length)] = True
        return found

    def state(self) -> dict[str, np.ndarray]:
        """All of it as plain arrays, for a checkpoint; see `restore`."""
        held = [block[block["sample"] >= 0] for _, block in sorted(self._open.items())]
        records = np.concatenate([np.empty(0, self._record), *held])
        nodes = sorted(self._nodes.items())
        data = {"layout": np.array([self.total, self.block, self.bins, self.part])}
        data["parts"] = np.array([(k, n) for k, (n, _) in nodes], np.int64).reshape(-1, 2)
        if self.edges is not None:
            data["edges"] = self.edges
        rows = [empty(self._rows, self.bins), *(summary for _, (_, summary) in nodes)]
        for field in fields(Summary):
            data[f"summary_{field.name}"] = np.stack([getattr(row, field.name) for row in rows])[1:]
        return {**data, **{f"record_{name}": records[name] for name in self._record.names or ()}}

    def restore(self, data: Mapping[str, ArrayLike]) -> None:
        """Go on from a `state` of an accumulator of the same layout; this one is new.

        Raises
        ------
        ValueError
            If the layout differs.
        """
        arrays = {name: np.asarray(values) for name, values in data.items()}
        *layout, self.part = arrays["layout"].tolist()
        if layout != [self.total, self.block, self.bins]:
            raise ValueError("the state is of other statistics")
        self.edges = arrays.get("edges")
        for k, (first, length) in enumerate(arrays["parts"].tolist()):
            row = (arrays[f"summary_{field.name}"][k] for field in fields(Summary))
            self.add_part(first, length, Summary(*row))
        records = np.empty(len(arrays["record_sample"]), self._record)
        for name in self._record.names or ():
            records[name] = arrays[f"record_{name}"]
        self.add(records)
