"""A table of angles as cubic cells: a spline that is smooth where it repeats."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at


def angle_cells(rows: tuple[tuple[float, float], ...]) -> Array:
    """Cubic cells of `table_drive.PARTS` over the time until a table (s, rad) repeats, shape (3, 4 CELLS).

    Angle, and its exact derivatives, so that what is integrated belongs to where things are.
    """
    from scipy.interpolate import CubicSpline  # a third of a second, for these alone

    times, angles = np.array(rows).T
    seconds = times[-1]
    rest = angles - (angles[-1] - angles[0]) * times / seconds
    rest[-1] = rest[0]
    smooth = CubicSpline(times, rest, bc_type="periodic")
    length = seconds / at.CELLS
    grid = length * np.arange(at.CELLS + 1)
    grid[-1] = seconds
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
