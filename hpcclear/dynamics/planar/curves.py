"""Tabulated curves as the kernel reads them: cubic cells on a uniform grid, 4 coefficients each."""

from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.scene.fields import Curve

Rows = tuple[tuple[float, float], ...]


def periodic_cells(
    curve: Rows, cells: int = at.CELLS, turns: int = 1, interpolation: str = "smooth"
) -> Array:
    """A tabulated curve over one turn, or several, as cubic cells (flat).

    "smooth": monotone cubic between the given pairs (Fritsch and Carlson 1980, doi:10.1137/0717021), through every pair,
    no overshoot, and smooth enough not to stop the integrator at each of them. "linear": straight between them; a kink
    within a cell is rounded over that cell, a 2048th of the period, so that there is nothing to stop at either.
    """
    angles = np.array([a for a, _ in curve]) / turns
    values = np.array([v for _, v in curve])
    if angles[-1] - angles[0] > at.TURN * (1.0 - 1e-12):
        angles, values = angles[:-1], values[:-1]
    # three turns side by side, so that the middle one sees its neighbours
    three = np.concatenate([angles - at.TURN, angles, angles + at.TURN])
    values = np.tile(values, 3)
    grid = angles[0] + np.mod(np.arange(cells + 1) * (at.TURN / cells) - angles[0], at.TURN)
    if interpolation == "linear":
        return np.column_stack(_straight(three, values, grid[:-1], at.TURN / cells)).ravel()
    value, slope = _monotone(three, values, grid)
    return np.column_stack(_cubics(value, slope * (at.TURN / cells))).ravel()


def _monotone(x: Array, y: Array, at_x: Array) -> tuple[Array, Array]:
    """Value and slope of the monotone cubic through pairs (n,) at places (m,) not within its first or last piece.

    As scipy's PchipInterpolator, whose import alone takes a third of a second of a first result.
    """
    width = np.diff(x)
    rise = np.diff(y) / width
    first, second = rise[:-1], rise[1:]
    near, far = width[:-1] + 2 * width[1:], 2 * width[:-1] + width[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        harmonic = (near + far) / (near / first + far / second)
    slope = np.zeros(len(x))  # those of the two ends are not asked for
    slope[1:-1] = np.where(np.sign(first) * np.sign(second) > 0, harmonic, 0.0)
    piece = np.clip(np.searchsorted(x, at_x, side="right") - 1, 1, len(x) - 3)
    h = width[piece]
    c0, c1, c2, c3 = _hermite(y[piece], y[piece + 1], slope[piece] * h, slope[piece + 1] * h)
    s = (at_x - x[piece]) / h
    return c0 + s * (c1 + s * (c2 + s * c3)), (c1 + s * (2 * c2 + s * 3 * c3)) / h


def _cubics(height: Array, slope: Array) -> tuple[Array, Array, Array, Array]:
    """Coefficients of cells (n,) between values and slopes a cell (n + 1,), of which the last are the first again."""
    height[-1], slope[-1] = height[0], slope[0]
    return _hermite(height[:-1], height[1:], slope[:-1], slope[1:])


def _hermite(d0: Array, d1: Array, m0: Array, m1: Array) -> tuple[Array, Array, Array, Array]:
    """Coefficients of cells (n,) from values and slopes a cell at their beginnings and ends."""
    return d0, m0, 3 * (d1 - d0) - 2 * m0 - m1, 2 * (d0 - d1) + m0 + m1


def _straight(
    angles: Array, values: Array, begin: Array, width: float
) -> tuple[Array, Array, Array, Array]:
    """Coefficients of cells that begin at angles (n,), straight wherever no pair lies within the cell."""
    inside = 1e-6 * width  # a pair at the border belongs to neither cell, whatever rounding says
    rise = np.diff(values) / np.diff(angles) * width

    def slope(where: Array) -> Array:
        return np.asarray(rise[np.searchsorted(angles, where) - 1])

    height = np.interp(begin, angles, values)
    return _hermite(
        height, np.roll(height, -1), slope(begin + inside), slope(begin + width - inside)
    )


@lru_cache(maxsize=16)
def angle_cells(rows: Rows) -> Array:
    """Cells of `parts.TableDrive.curves` over the time until a table (s, rad) repeats, shape (3, 4 CELLS).

    Not to be written to.

    A periodic spline, but for what it gains evenly, and its exact derivatives, so that what is integrated belongs to where
    things are.
    """
    from scipy.interpolate import CubicSpline  # a third of a second, for these alone

    times, angles = np.array(rows).T
    rest = angles - (angles[-1] - angles[0]) * times / times[-1]
    rest[-1] = rest[0]
    smooth = CubicSpline(times, rest, bc_type="periodic")
    length = times[-1] / at.CELLS
    grid = np.linspace(0.0, times[-1], at.CELLS + 1)
    c0, c1, c2, c3 = _cubics(smooth(grid), smooth(grid, 1) * length)
    none = np.zeros(at.CELLS)
    angle = np.column_stack([c0, c1, c2, c3])
    spin = np.column_stack([c1, 2 * c2, 3 * c3, none]) / length
    turn = np.column_stack([2 * c2, 6 * c3, none, none]) / length**2
    return np.stack([angle.ravel(), spin.ravel(), turn.ravel()])


@lru_cache(maxsize=16)
def level_cells(rows: Rows, interpolation: str = "smooth") -> tuple[Array, Array]:
    """Cells (flat) of a table over times from 0 to its last, and of its derivative by the time; not to be written to.

    As `periodic_cells`, but level before the first and behind the last pair, which it leaves and meets without a kink.
    """
    times, values = np.array(rows).T
    length = times[-1]
    grid = np.linspace(0.0, length, at.CELLS + 1)
    beside = length * np.array([1.0, 2.0])
    if interpolation == "linear":
        value = np.interp(grid, times, values)
        step = np.diff(value)
        c0, c1, c2, c3 = value[:-1], step, 0.0 * step, 0.0 * step
    else:
        x = np.concatenate([times[0] - beside[::-1], times, length + beside])
        y = np.concatenate([values[[0, 0]], values, values[[-1, -1]]])
        value, slope = _monotone(x, y, grid)
        m = slope * (length / at.CELLS)
        c0, c1, c2, c3 = _hermite(value[:-1], value[1:], m[:-1], m[1:])
    rise = np.column_stack([c1, 2 * c2, 3 * c3, 0.0 * c3]) * (at.CELLS / length)
    return np.column_stack([c0, c1, c2, c3]).ravel(), rise.ravel()


def level_at(rows: Rows, time: Array, interpolation: str = "smooth") -> Array:
    """A table at times (n,) from 0 on, as the kernel reads it."""
    place = np.minimum(time / rows[-1][0], 1.0) * at.CELLS
    cell = np.minimum(place.astype(int), at.CELLS - 1)
    s = place - cell
    c0, c1, c2, c3 = level_cells(rows, interpolation)[0].reshape(-1, 4)[cell].T
    return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)))


def as_angles(rows: Rows) -> Rows:
    """A table over times that repeats at its last one, over the angle of a turn in place of the time."""
    return tuple((at.TURN * time / rows[-1][0], value) for time, value in rows)


def curve_at(curve: Curve, angle: Array, turns: int = 1, interpolation: str = "smooth") -> Array:
    """A torque or load at angles (n,) of the driven body in rad, which repeats after `turns`, as the kernel reads it."""
    if not isinstance(curve, tuple):
        return np.full(len(angle), curve)
    place = np.mod(angle / turns, at.TURN) * (at.CELLS / at.TURN)
    cell = np.minimum(place.astype(int), at.CELLS - 1)
    s = place - cell
    c0, c1, c2, c3 = (
        periodic_cells(curve, turns=turns, interpolation=interpolation).reshape(-1, 4)[cell].T
    )
    return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)))
