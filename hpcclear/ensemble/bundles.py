"""Bundles of samples: what the leader of a node gets from root, shares out, sums up and writes, so that root sees nodes.

A bundle is a node of the tree over the design's samples (`hpcclear.statistics.streams`), so that it changes no bit who made it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.ensemble.parts import packed, part_length, partial_of, take_parts
from hpcclear.ensemble.raw import raw_files
from hpcclear.scene import load_scene
from hpcclear.scene.pages import MonteCarloPoints
from hpcclear.scene.record import record_of
from hpcclear.statistics.streams.accumulator import Accumulator
from hpcclear.statistics.streams.summary import BLOCK

if TYPE_CHECKING:
    from hpcclear.ranks.schedule import Points, Worker
    from hpcclear.ranks.team import Ranks


def bundle_length(
    samples: int, leaders: int, ranks: int, seconds: float, whole_blocks: bool
) -> int:
    """Samples a bundle, a node of the tree: a part of each rank of a leader.

    Parameters
    ----------
    samples, leaders, ranks : int
        What is left, and among how many.
    seconds : float
        Of one rank for a sample; 0 if not known.
    whole_blocks : bool
        Whether a bundle is a block at least: who writes a file has all of it.
    """
    length = part_length(samples, ranks, BLOCK, seconds)
    length *= 2 ** int(math.log2(ranks // leaders))
    return max(length, BLOCK) if whole_blocks else length


class Bundles:
    """A leader's bundles, shared out as samples; see `hpcclear.ranks.leading.Sharing`.

    Parameters
    ----------
    payload : mapping
        ``design`` and ``total``: a scene's content and its samples; ``edges``: of the histograms; ``block``: samples that are
        summed up at once; ``raw``: as `raw_files` has it.
    """

    def __init__(self, payload: Mapping[str, Any]) -> None:
        scene = load_scene(payload["design"], trust=True)
        points = MonteCarloPoints(scene, payload["total"])
        self.points: Points = points
        files = raw_files(payload["raw"], scene, points)
        self._keeps = files is not None
        record = record_of(scene)
        self._kind = partial_of(record)
        self._sums = Accumulator(
            payload["total"],
            record,
            block=payload["block"],
            edges=payload["edges"],
            whole=set(),
            on_block=None if files is None else files.write,
        )
        self._numbers: dict[int, int] = {}  # of bundles, by their first samples

    def open(self, index: Integers, rows: Array) -> list[Integers]:
        """Begin bundles: numbers (m,), rows of first sample and length (m, 2); the numbers of the samples of each."""
        total = self._sums.total
        return [np.arange(a, min(a + n, total)) for a, n in self._begin(index, rows)]

    def _begin(self, index: Integers, rows: Array) -> list[tuple[int, int]]:
        """Begin bundles; first sample and length of each."""
        spans = [(first, length) for first, length in rows.astype(np.int64).tolist()]
        self._numbers |= {first: k for k, (first, _) in zip(index.tolist(), spans, strict=True)}
        self._sums.whole |= set(spans)
        return spans

    def take(self, records: np.ndarray) -> None:
        """Take finished samples, records (m,)."""
        self._sums.add(records)

    def finished(self) -> np.ndarray:
        """Summaries (`partial_of`, (m,)) of the bundles that are complete, once."""
        return self._packed(self._sums.hand_on())

    def unfinished(self) -> list[np.ndarray]:
        """Summaries of what is complete of others, and where samples are kept, those that no file has; shape (m,) each."""
        loose = [self._sums.loose()] if self._keeps else []
        return [self._packed(self._sums.parts()), *loose]

    def _packed(self, nodes: Sequence[tuple[int, int, Any]]) -> np.ndarray:
        total = self._sums.total
        found = [
            packed(
                self._kind,
                self._numbers.get(first, 0),
                first,
                length,
                min(length, total - first),
                summary,
            )
            for first, length, summary in nodes
        ]
        return np.concatenate(found) if found else np.zeros(0, self._kind)


class BlockBundles(Bundles):
    """A leader's bundles, shared out block by block: ranks sum these up, and write them where samples are kept."""

    def __init__(self, payload: Mapping[str, Any]) -> None:
        super().__init__({**payload, "raw": None})
        self.points = BlockRows()

    def open(self, index: Integers, rows: Array) -> list[Integers]:
        """Begin bundles: numbers (m,), rows of first sample and length (m, 2); the numbers of the blocks of each."""
        total, block = self._sums.total, self._sums.block
        return [
            np.arange(a // block, -(-min(a + n, total) // block))
            for a, n in self._begin(index, rows)
        ]

    def take(self, records: np.ndarray) -> None:
        """Take the summaries of blocks, records of `partial_of` (m,)."""
        take_parts(self._sums, records)


class BlockRows:
    """Blocks by their numbers, as rows of first sample and length: all that there may be."""

    def __len__(self) -> int:
        return np.iinfo(np.int64).max // BLOCK

    def __getitem__(self, index: Integers) -> Array:
        return np.column_stack([index * BLOCK, np.full(len(index), BLOCK)]).astype(float)


def make_simulator(payload: Mapping[str, Any], ranks: "Ranks") -> "Worker":
    """A rank's worker: what `payload["make"]` makes of `payload["samples"]`."""
    worker: Worker = payload["make"](payload["samples"], ranks)
    return worker
