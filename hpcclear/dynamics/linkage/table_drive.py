"""The motion that a table of angles prescribes, as cubic cells for the kernel and as a function for numpy."""

from collections.abc import Callable

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import TableDrive

PARTS = ("angle", "spin", "turn")
"""Angle but for what it gains evenly (rad), and its first and second derivative (rad/s, rad/s2)."""

Given = Callable[[Array], tuple[Array, Array, Array]]


def cells_of(drive: TableDrive) -> Array:
    """Cubic cells of `PARTS` over the time until it repeats, shape (3, 4 CELLS).

    Angle, and its exact derivatives, so that what is integrated belongs to where things are.
    """
    from scipy.interpolate import CubicSpline  # a third of a second, for these alone

    times, angles = np.array(drive.rows).T
    rest = angles - drive.advance * times / drive.seconds
    rest[-1] = rest[0]
    smooth = CubicSpline(times, rest, bc_type="periodic")
    length = drive.seconds / at.CELLS
    grid = length * np.arange(at.CELLS + 1)
    grid[-1] = drive.seconds
    height, slope = smooth(grid), smooth(grid, 1) * length
    height[-1], slope[-1] = height[0], slope[0]
    rise = np.diff(height)
    m0, m1 = slope[:-1], slope[1:]
    c0, c1, c2, c3 = height[:-1], m0, 3 * rise - 2 * m0 - m1, m0 + m1 - 2 * rise
    none = np.zeros(at.CELLS)
    angle = np.column_stack([c0, c1, c2, c3])
    spin = np.column_stack([c1, 2 * c2, 3 * c3, none]) / length
    turn = np.column_stack([2 * c2, 6 * c3, none, none]) / length**2
    return np.stack([angle.ravel(), spin.ravel(), turn.ravel()])


def words_of(mechanism: Mechanism) -> dict[str, Given]:
    """What texts for numpy call for each table: ``table_of_NAME(time)``, the three `PARTS` at times of any shape."""
    return {
        f"table_of_{drive.name}": _given(drive)
        for drive in mechanism.drives
        if isinstance(drive, TableDrive)
    }


def _given(drive: TableDrive) -> Given:
    cells = cells_of(drive).reshape(3, at.CELLS, 4)

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
