"""Samples themselves of a run of statistics, kept in files by root, a block each."""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hpcclear.ensemble.samples import samples_of
from hpcclear.results import collection, dataset
from hpcclear.scene.sampling import MonteCarloPoints
from hpcclear.statistics.streams import BLOCK

if TYPE_CHECKING:
    from hpcclear.base.objectives import Objective


NAMES = re.compile(r"samples-\d{8}\.nc")
"""Names of the files, a block each."""


class RawFiles:
    """Samples themselves, kept in a directory: a file of kind ``samples`` for each block, and one that shows all as one.

    Parameters
    ----------
    attributes : mapping
        Global attributes of the files.
    joints : sequence of str
        Labels of the joints of the records.
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

    def finish(self) -> str:
        """All blocks are written: write the file that shows them as one; a line for the user if they are too many for that."""
        blocks = -(-len(self._points) // BLOCK)
        if blocks <= collection.LISTED:
            collection.write(self._folder, [self._name(number) for number in range(blocks)])
            return ""
        (self._folder / collection.NAME).unlink(missing_ok=True)  # of an earlier run
        return (
            f"{blocks} files of samples are in {self._folder}, sample k in number k // {BLOCK}; "
            f"{collection.NAME} shows at most {collection.LISTED} as one and was not written"
        )

    @staticmethod
    def missing(folder: Path, blocks: Iterable[int]) -> list[str]:
        """Names of the files of some blocks that are not in a directory."""
        return [name for name in map(RawFiles._name, blocks) if not (folder / name).is_file()]

    @staticmethod
    def _name(number: int) -> str:
        return f"samples-{number:08d}.nc"
