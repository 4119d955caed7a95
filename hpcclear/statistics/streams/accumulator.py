"""Statistics of direct Monte Carlo as the samples finish, without keeping them.

A block of samples that is complete is summed up, blocks are merged in their own order: so the numbers are the same
bit for bit whichever rank made which sample, and whenever, and whether root got samples or sums of some. Only
blocks that are still incomplete are held in memory.
"""

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
    summarise,
    tree_length,
)


class Accumulator:
    """Takes the samples of a design as they finish, in any order, and keeps their statistics.

    Parameters
    ----------
    total : int
        Samples of the design, at least 1.
    block, bins : int
        Samples a block, bins of each histogram.
    on_block : callable, optional
        Gets number and records (in index order) of every block that is complete; it may keep raw samples.
    """

    def __init__(
        self,
        total: int,
        *,
        block: int = BLOCK,
        bins: int = BINS,
        on_block: Callable[[int, np.ndarray], object] | None = None,
    ) -> None:
        if total < 1 or block < 1 or bins < 1:
            raise ValueError("samples, length of a block and bins must be positive")
        self.total, self.block, self.bins = total, block, bins
        self.blocks = -(-total // block)
        self._tree = tree_length(block)
        self.edges: Array | None = (
            None  # chosen from block 0, so that they are the same in every run
        )
        self._on_block = on_block
        self._open: dict[int, np.ndarray] = {}  # records by block; sample -1: not here yet
        self._missing: dict[int, int] = {}
        self._parts: dict[
            int, dict[tuple[int, int], Summary]
        ] = {}  # by block, then place and length
        self._ready: dict[int, Summary] = {}  # complete, waiting for an earlier block
        self._merged = empty(bins)
        self._next = 0  # first block that is not merged

    @property
    def complete(self) -> bool:
        """Whether every sample was taken."""
        return self._next == self.blocks

    @property
    def taken(self) -> int:
        """Samples taken so far."""
        parts = sum(length for nodes in self._parts.values() for _, length in nodes)
        held = sum(self._length(n) - self._missing[n] for n in self._open)
        ready = sum(map(self._length, self._ready))
        return min(self._next * self.block, self.total) + ready + held + parts

    @property
    def held(self) -> int:
        """Blocks held in memory because they, or block 0, are incomplete."""
        return len(self._open) + len(self._parts)

    def _length(self, number: int) -> int:
        return min(self.block, self.total - number * self.block)

    def add(self, records: np.ndarray) -> None:
        """Take finished samples, records of `OUTCOME` (m,).

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
        """Take the summary of the samples from `first` on, a node of `length` samples of their block's tree.

        Raises
        ------
        ValueError
            If it is no such node, or some of its samples were taken before.
        """
        number, place = divmod(first, self.block)
        if self.edges is None or place % length or tree_length(length) != length:
            raise ValueError(f"{length} samples from {first} on are no part of a block")
        if number < self._next or number in self._ready or number in self._open:
            raise ValueError(f"samples of block {number} were taken before")
        nodes = self._parts.setdefault(number, {})
        if any(at < place + length and place < at + size for at, size in nodes):
            raise ValueError(f"a sample of block {number} was taken before")
        while length < self._tree:
            sibling = place ^ length
            if sibling >= self._length(number):
                other: Summary | None = empty(
                    self.bins
                )  # beyond the end of the design or the block
            else:
                other = nodes.pop((sibling, length), None)
            if other is None:
                nodes[(place, length)] = summary
                return
            summary = merge(summary, other) if place < sibling else merge(other, summary)
            place, length = min(place, sibling), 2 * length
        del self._parts[number]
        self._ready[number] = summary
        self._reduce()

    def parts_left(self, length: int) -> Integers:
        """First sample and length (n, 2) of parts of at most `length` samples that make up all that was not taken.

        Blocks of which single samples were taken are left out: they are `remaining`.
        """
        untouched = self._untouched()
        starts = np.arange(0, self.block, length)
        whole = (untouched[:, None] * self.block + starts).ravel()
        rows = [np.column_stack([whole, np.full(whole.size, length)])]
        rows += [
            np.array(self._gaps(number, 0, self._tree, length)) for number in sorted(self._parts)
        ]
        found = np.concatenate([row for row in rows if row.size] or rows[:1])
        found = found[found[:, 0] < self.total]
        return found[np.argsort(found[:, 0], kind="stable")]

    def _gaps(self, number: int, place: int, size: int, length: int) -> list[tuple[int, int]]:
        """What is missing of a block under one node of its tree."""
        nodes = self._parts[number]
        if (place, size) in nodes or place >= self._length(number):
            return []
        if size <= length and not any(place <= at < place + size for at, _ in nodes):
            return [(number * self.block + place, size)]
        half = size // 2
        return self._gaps(number, place, half, length) + self._gaps(
            number, place + half, half, length
        )

    def forget_parts(self) -> None:
        """Drop the sums of blocks that are incomplete, for a run that wants their samples."""
        self._parts.clear()

    def _put(self, number: int, records: np.ndarray) -> None:
        if number < self._next or number in self._ready or number in self._parts:
            raise ValueError(f"samples of block {number} were taken before")
        if number not in self._open:
            self._open[number] = np.zeros(self._length(number), OUTCOME)
            self._open[number]["sample"] = -1
            self._missing[number] = self._length(number)
        slots = records["sample"] - number * self.block
        if np.unique(slots).size != slots.size or (self._open[number]["sample"][slots] >= 0).any():
            raise ValueError(f"a sample of block {number} was taken before")
        self._open[number][slots] = records
        self._missing[number] -= slots.size

    def _reduce(self) -> None:
        """Summarise complete blocks and merge those whose turn it is."""
        if self.edges is None:
            if self._missing.get(0) != 0:
                return
            self.edges = histogram_edges(self._open[0], self.bins)
        for number in sorted(n for n, missing in self._missing.items() if missing == 0):
            if self._on_block is not None:
                self._on_block(number, self._open[number])
            self._ready[number] = summarise(self._open.pop(number), self.edges, self._tree)
            del self._missing[number]
        while self._next in self._ready:
            self._merged = merge(self._merged, self._ready.pop(self._next))
            self._next += 1

    def result(self) -> Summary:
        """Statistics of the whole design.

        Raises
        ------
        RuntimeError
            If samples are missing.
        """
        if not self.complete:
            raise RuntimeError("statistics are asked for before every sample has finished")
        return self._merged

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
        done = np.zeros(self.blocks, bool)
        done[: self._next] = True
        for begun in (self._ready, self._open, self._parts):
            done[list(begun)] = True
        return np.flatnonzero(~done)

    def state(self) -> dict[str, np.ndarray]:
        """All of it as plain arrays, for a checkpoint; see `restore`."""
        ready = sorted(self._ready)
        held = [part[part["sample"] >= 0] for _, part in sorted(self._open.items())]
        records = np.concatenate(held) if held else np.empty(0, OUTCOME)
        data = {"layout": np.array([self.total, self.block, self.bins, self._next])}
        data["ready"] = np.array(ready, np.int64)
        nodes = {
            (number * self.block + place, length): summary
            for number, held_nodes in sorted(self._parts.items())
            for (place, length), summary in sorted(held_nodes.items(), key=lambda item: item[0])
        }
        data["parts"] = np.array(list(nodes), np.int64).reshape(-1, 2)
        if self.edges is not None:
            data["edges"] = self.edges
        for field in fields(Summary):
            rows = [self._merged, *(self._ready[number] for number in ready), *nodes.values()]
            data[f"summary_{field.name}"] = np.stack([getattr(row, field.name) for row in rows])
        return {**data, **{f"record_{name}": records[name] for name in OUTCOME.names or ()}}

    def restore(self, data: Mapping[str, ArrayLike]) -> None:
        """Go on from a `state` of an accumulator of the same layout; this one is new.

        Raises
        ------
        ValueError
            If the layout differs.
        """
        arrays = {name: np.asarray(values) for name, values in data.items()}
        if arrays["layout"][:3].tolist() != [self.total, self.block, self.bins]:
            raise ValueError("the state is of other statistics")
        self.edges = arrays.get("edges")
        rows = [
            Summary(*(arrays[f"summary_{field.name}"][k] for field in fields(Summary)))
            for k in range(1 + len(arrays["ready"]) + len(arrays["parts"]))
        ]
        self._merged, self._next = rows[0], int(arrays["layout"][3])
        waiting = 1 + len(arrays["ready"])
        self._ready = dict(zip(arrays["ready"].tolist(), rows[1:waiting], strict=True))
        for (first, length), summary in zip(arrays["parts"].tolist(), rows[waiting:], strict=True):
            self.add_part(first, length, summary)
        records = np.empty(len(arrays["record_sample"]), OUTCOME)
        for name in OUTCOME.names or ():
            records[name] = arrays[f"record_{name}"]
        self.add(records)


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
