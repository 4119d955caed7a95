"""The motion that a table of angles prescribes, as a function for numpy: the same cells that the kernel reads."""

from collections.abc import Callable

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import TableDrive

Given = Callable[[Array], tuple[Array, Array, Array]]


def words_of(mechanism: Mechanism) -> dict[str, Given]:
    """What texts for numpy call for each table: ``table_of_NAME(time)``, its `curves` at times of any shape."""
    return {
        f"table_of_{drive.name}": _given(drive)
        for drive in mechanism.drives
        if isinstance(drive, TableDrive)
    }


def _given(drive: TableDrive) -> Given:
    cells = drive.cells.reshape(3, at.CELLS, 4)

    def given(time: Array) -> tuple[Array, Array, Array]:
        place = np.mod(time, drive.seconds) * (at.CELLS / drive.seconds)
        cell = np.minimum(np.asarray(place).astype(int), at.CELLS - 1)
        s = place - cell
        found = []
        for part in cells:
            c0, c1, c2, c3 = np.moveaxis(part[cell], -1, 0)
            found.append(c0 + s * (c1 + s * (c2 + s * c3)))
        return found[0], found[1], found[2]

    return given
