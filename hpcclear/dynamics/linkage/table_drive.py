"""The motion that a table of angles prescribes, as a function for numpy: the same pieces that the kernel reads."""

from collections.abc import Callable

from hpcclear.base.arrays import Array
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
    angle, spin, turn = drive.pieces
    return lambda time: (angle.at(time), spin.at(time), turn.at(time))
