"""Bundles of samples: what the leader of a node gets from root, shares out, sums up and writes, so that root sees nodes.

A bundle is a node of the tree over the design's samples (`hpcclear.statistics.streams`), so that it changes no bit who made it.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.outcome import OUTCOME
from hpcclear.ensemble.parts import PARTIAL, packed, part_length
from hpcclear.ensemble.session import samples_of
from hpcclear.results import collection, dataset
from hpcclear.scene import load_scene
from hpcclear.scene.sampling import MonteCarloPoints
from hpcclear.statistics.streams.accumulator import Accumulator
from hpcclear.statistics.streams.summary import BLOCK

if TYPE_CHECKING:
    from hpcclear.base.objectives import Objective
    from hpcclear.ranks.schedule import Worker
    from hpcclear.ranks.team import Ranks


class RawFiles:
    """Samples themselves, kept in a directory: a file of kind ``samples`` for each block, and one that shows all as one.

    Parameters
    ----------
    folder : Path
    points : MonteCarloPoints
    attributes : mapping
        Global attributes of the files.
    objective : Objective
    joints : sequence of str
        Labels of the joints that records tell of.
    """

    def __init__(
        self,
        folder: Path,
        points: MonteCarloPoints,
        attributes: Mapping[str, str],
        objective: "Objective",
        joints: Sequence[str],
    ) -> None:
        self._folder, self._points, self._attributes = folder, points, attributes
        self._objective, self._joints = objective, joints

    def write(self, number: int, records: np.ndarray) -> None:
        """Write block `number`, all of its records in order, shape (m,)."""
        content = samples_of(
            self._points.page(number), records, self._attributes, self._objective, self._joints
        )
        dataset.write(content, self._folder / self._name(number))

    def finish(self) -> None:
        """All blocks are written: write the file that shows them as one."""
        blocks = -(-len(self._points) // BLOCK)
        collection.write(self._folder, [self._name(number) for number in range(blocks)])

    @staticmethod
    def _name(number: int) -> str:
        return f"samples-{number:08d}.nc"


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
    """A leader's bundles; see `hpcclear.ranks.leading.Sharing`.

    Parameters
    ----------
    payload : mapping
        ``design`` and ``total``: a scene's content and its samples; ``edges``: of the histograms; ``block``: samples that are
        summed up at once; ``raw``: None, or what `RawFiles` takes besides the points, by name.
    """

    def __init__(self, payload: Mapping[str, Any]) -> None:
        scene = load_scene(payload["design"])
        self.points = MonteCarloPoints(scene, payload["total"])
        raw = payload["raw"]
        self._keeps = raw is not None
        files = None
        if raw is not None:
            objective = scene.objective_named(raw["objective"])
            files = RawFiles(
                Path(raw["folder"]), self.points, raw["attributes"], objective, raw["joints"]
            )
        self._sums = Accumulator(
            payload["total"],
            block=payload["block"],
            edges=payload["edges"],
            whole=set(),
            on_block=None if files is None else files.write,
        )
        self._numbers: dict[int, int] = {}  # of bundles, by their first samples

    def open(self, index: Integers, rows: Array) -> list[Integers]:
        """Begin bundles: numbers (m,), rows of first sample and length (m, 2); the numbers of the samples of each."""
        spans = rows.astype(np.int64).tolist()
        self._numbers |= {first: k for k, (first, _) in zip(index.tolist(), spans, strict=True)}
        self._sums.whole |= {(first, length) for first, length in spans}
        total = self._sums.total
        return [np.arange(a, min(a + length, total)) for a, length in spans]

    def take(self, records: np.ndarray) -> None:
        """Take finished samples, records of `OUTCOME` (m,)."""
        self._sums.add(records.astype(OUTCOME))

    def finished(self) -> np.ndarray:
        """Summaries (`PARTIAL`, (m,)) of the bundles that are complete, once."""
        return self._packed(self._sums.hand_on())

    def unfinished(self) -> list[np.ndarray]:
        """Summaries of what is complete of others, and where samples are kept, those that no file has; shape (m,) each."""
        loose = [self._sums.loose()] if self._keeps else []
        return [self._packed(self._sums.parts()), *loose]

    def _packed(self, nodes: Sequence[tuple[int, int, Any]]) -> np.ndarray:
        total = self._sums.total
        found = [
            packed(self._numbers.get(first, 0), first, length, min(length, total - first), summary)
            for first, length, summary in nodes
        ]
        return np.concatenate(found) if found else np.zeros(0, PARTIAL)


def make_simulator(payload: Mapping[str, Any], ranks: "Ranks") -> "Worker":
    """A rank's worker: what `payload["make"]` makes of `payload["samples"]`."""
    worker: Worker = payload["make"](payload["samples"], ranks)
    return worker
