"""Statistics of direct Monte Carlo as the samples finish, without keeping them.

A block of samples that is complete is summed up, and what is summed up is merged along one binary tree over the numbers
of the samples: so the results are the same bit for bit whichever rank made which sample, and whenever, and whether
root got samples or sums of some. Only blocks that are still incomplete are held in memory.
"""

from bisect import bisect_left, insort
from collections.abc import Callable, Mapping
from dataclasses import fields

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Integers
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
    edges : ndarray, optional
        Of the histograms; by default chosen from block 0, so that they are the same in every run.
    whole : set of (int, int), optional
        First sample and length of the nodes of the tree that are to be made, by default that of the whole design; nodes
        may be added on the way.
    on_block : callable, optional
        Gets number and records (in index order) of every block that is complete; it may keep raw samples.
    """

    def __init__(
        self,
        total: int,
        record: np.dtype = OUTCOME,
        *,
        block: int = BLOCK,
        bins: int = BINS,
        edges: Array | None = None,
        whole: set[tuple[int, int]] | None = None,
        on_block: Callable[[int, np.ndarray], object] | None = None,
    ) -> None:
        if total < 1 or bins < 1 or block < 1 or tree_length(block) != block:
            raise ValueError(
                "samples and bins must be positive, a block a leaf times a power of two"
            )
        self.total, self.block, self.bins, self.edges = total, block, bins, edges
        self.whole = {(0, max(tree_length(total), block))} if whole is None else whole
        self._record, self._on_block = record, on_block
        self._rows = len(rows_of(record["mean_gap"].shape[0]))
        self._open: dict[int, np.ndarray] = {}  # records by block; sample -1: not here yet
        self._missing: dict[int, int] = {}
        # of the tree over the design, apart from each other, none beside its sibling: by their first samples
        self._nodes: dict[int, tuple[int, Summary]] = {}
        self._firsts: list[int] = []  # the same, sorted

    @property
    def complete(self) -> bool:
        """Whether every sample was taken."""
        return all(self._length_at(first) == length for first, length in self.whole)

    @property
    def taken(self) -> int:
        """Samples taken so far."""
        summed = sum(self._inside(first, length) for first, (length, _) in self._nodes.items())
        return summed + sum(self._length(n) - self._missing[n] for n in self._open)

    @property
    def held(self) -> int:
        """Blocks held in memory because they, or block 0, are incomplete."""
        return len(self._open)

    def _inside(self, first: int, length: int) -> int:
        """Samples of a node that are in the design."""
        return min(length, self.total - first)

    def _length(self, number: int) -> int:
        return self._inside(number * self.block, self.block)

    def _length_at(self, first: int) -> int:
        """Length of the node that begins there; 0: none does."""
        return self._nodes[first][0] if first in self._nodes else 0

    def _refuse_taken(self, first: int, length: int) -> None:
        """Raise ValueError if a node covers one of these samples."""
        place = bisect_left(self._firsts, first + length)
        before = self._firsts[place - 1] if place else -1
        if place and before + self._length_at(before) > first:
            raise ValueError(f"a sample of {first} to {first + length - 1} was taken before")

    def add(self, records: np.ndarray) -> None:
        """Take finished samples, records (m,).

        Raises
        ------
        ValueError
            If a sample is not of this design, or was taken before.
        """
        sample = records["sample"]
        if sample.size and not (sample.min() >= 0 and sample.max() < self.total):
            raise ValueError(f"a sample lies outside 0..{self.total - 1}")
        numbers = sample // self.block
        for number in np.unique(numbers).tolist():
            self._put(number, records[numbers == number])
        self._reduce()

    def add_part(self, first: int, length: int, summary: Summary) -> None:
        """Take the summary of the samples from `first` on, a node of `length` samples of the design's tree.

        Raises
        ------
        ValueError
            If it is no such node, or some of its samples were taken before.
        """
        if self.edges is None or first % length or tree_length(length) != length:
            raise ValueError(f"{length} samples from {first} on are no part of a design")
        self._refuse_taken(first, length)
        if any(
            n * self.block < first + length and first < (n + 1) * self.block for n in self._open
        ):
            raise ValueError(f"a sample of {first} to {first + length - 1} was taken before")
        while (first, length) not in self.whole:
            sibling = first ^ length
            if sibling >= self.total:
                other = empty(self._rows, self.bins)
            elif self._length_at(sibling) == length:
                other = self._nodes.pop(sibling)[1]
                del self._firsts[bisect_left(self._firsts, sibling)]
            else:
                break
            summary = merge(summary, other) if first < sibling else merge(other, summary)
            first, length = min(first, sibling), 2 * length
        self._nodes[first] = (length, summary)
        insort(self._firsts, first)

    def parts(self) -> list[tuple[int, int, Summary]]:
        """First sample, length and summary of the nodes that were taken or summed up, in order."""
        return [(first, *self._nodes[first]) for first in self._firsts]

    def hand_on(self) -> list[tuple[int, int, Summary]]:
        """The nodes that were to be made and are complete, as `parts` has them; this forgets them."""
        done = [row for row in self.parts() if row[:2] in self.whole]
        self.whole -= {row[:2] for row in done}
        for first, _, _ in done:
            del self._nodes[first]
        self._firsts = sorted(self._nodes)
        return done

    def parts_left(self, length: int) -> Integers:
        """First sample and length (n, 2) of parts of at most `length` samples that make up all that was not taken.

        Blocks of which single samples were taken are left out: they are `remaining`.
        """
        taken = [(first, first + size) for first, (size, _) in self._nodes.items()]
        taken += [(n * self.block, (n + 1) * self.block) for n in self._open]
        end = -(-self.total // length) * length  # the last part may reach beyond the design
        rows, reached = [], 0
        for first, last in (*sorted(taken), (end, end)):
            rows.append(nodes_between(reached, first, length))
            reached = max(reached, last)
        found = np.concatenate(rows)
        return found[found[:, 0] < self.total]

    def forget_parts(self, length: int | None = None) -> None:
        """Drop the sums of fewer samples than `length`, by default a block, for a run that wants their samples."""
        least = self.block if length is None else length
        self._nodes = {n: node for n, node in self._nodes.items() if node[0] >= least}
        self._firsts = sorted(self._nodes)

    def _put(self, number: int, records: np.ndarray) -> None:
        if number not in self._open:
            self._refuse_taken(number * self.block, self.block)
            self._open[number] = np.zeros(self._length(number), self._record)
            self._open[number]["sample"] = -1
            self._missing[number] = self._length(number)
        slots = records["sample"] - number * self.block
        if np.unique(slots).size != slots.size or (self._open[number]["sample"][slots] >= 0).any():
            raise ValueError(f"a sample of block {number} was taken before")
        self._open[number][slots] = records
        self._missing[number] -= slots.size

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

    def loose(self) -> np.ndarray:
        """Samples taken of blocks that are incomplete, by growing number: records (m,)."""
        held = [block[block["sample"] >= 0] for _, block in sorted(self._open.items())]
        return np.concatenate(held) if held else np.empty(0, self._record)

    def remaining(self) -> "Remaining":
        """The samples that were not taken yet."""
        loose = [
            np.flatnonzero(held["sample"] < 0) + number * self.block
            for number, held in sorted(self._open.items())
        ]
        scattered = np.concatenate(loose) if loose else np.empty(0, np.int64)
        return Remaining(scattered, self._untouched(), self.block, self.total)

    def _untouched(self) -> Integers:
        """Blocks of which nothing was taken."""
        done = np.zeros(-(-self.total // self.block), bool)
        done[list(self._open)] = True
        for first, (length, _) in self._nodes.items():
            done[first // self.block : -(-(first + length) // self.block)] = True
        return np.flatnonzero(~done)

    def state(self) -> dict[str, np.ndarray]:
        """All of it as plain arrays, for a checkpoint; see `restore`."""
        parts, records = self.parts(), self.loose()
        data = {"layout": np.array([self.total, self.block, self.bins])}
        data["parts"] = np.array([row[:2] for row in parts], np.int64).reshape(-1, 2)
        if self.edges is not None:
            data["edges"] = self.edges
        rows = [empty(self._rows, self.bins), *(summary for _, _, summary in parts)]
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
        if arrays["layout"].tolist() != [self.total, self.block, self.bins]:
            raise ValueError("the state is of other statistics")
        self.edges = arrays.get("edges")
        for k, (first, length) in enumerate(arrays["parts"].tolist()):
            row = (arrays[f"summary_{field.name}"][k] for field in fields(Summary))
            self.add_part(first, length, Summary(*row))
        records = np.empty(len(arrays["record_sample"]), self._record)
        for name in self._record.names or ():
            records[name] = arrays[f"record_{name}"]
        self.add(records)


def nodes_between(first: int, last: int, length: int) -> Integers:
    """First sample and length (n, 2) of nodes of the tree, at most `length` samples each, from `first` up to `last`."""
    head, tail = [], []
    while first < last and first % length:
        size = first & -first
        while first + size > last:
            size //= 2
        head.append((first, size))
        first += size
    whole = max(last - first, 0) // length
    middle = first + length * np.arange(whole, dtype=np.int64)
    first, size = first + length * whole, length
    while first < last:
        if first + size <= last:
            tail.append((first, size))
            first += size
        size //= 2
    rows = (head, np.column_stack([middle, np.full(whole, length)]), tail)
    return np.concatenate([np.array(row, np.int64).reshape(-1, 2) for row in rows])


class Remaining:
    """Numbers of the samples still to be made, without a list of them all.

    Position k of this sequence is the k-th sample to be handed out: first what is missing of blocks begun, then
    whole blocks in order.
    """

    def __init__(self, scattered: Integers, whole: Integers, block: int, total: int) -> None:
        self._scattered, self._whole = scattered.astype(np.int64), whole.astype(np.int64)
        self._block, self._total = block, total
        size = self._whole.size * block
        if self._whole.size and self._whole[-1] == (total - 1) // block:
            size -= (self._whole[-1] + 1) * block - total  # the last block may be short
        self._size = int(self._scattered.size + size)

    def __len__(self) -> int:
        return self._size

    def begun(self, first_block: bool) -> "Remaining":
        """The same without whole blocks, but for the first one if `first_block` and if it is among them."""
        kept = self._whole[self._whole == 0] if first_block else self._whole[:0]
        return Remaining(self._scattered, kept, self._block, self._total)

    def samples(self, position: Integers) -> Integers:
        """Sample numbers at some positions, shape (m,)."""
        place = np.asarray(position, np.int64) - self._scattered.size
        found = np.empty(place.shape, np.int64)
        loose = place < 0
        found[loose] = self._scattered[place[loose] + self._scattered.size]
        found[~loose] = self._whole[place[~loose] // self._block] * self._block
        found[~loose] += place[~loose] % self._block
        return found
