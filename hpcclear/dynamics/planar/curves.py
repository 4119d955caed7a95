"""Tabulated curves of a scene as pieces (`base.pieces`): motions of drives and their derivatives, loads."""

from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import Pieces, Rows, level, periodic
from hpcclear.dynamics import layout as at
from hpcclear.scene.curves import Curve


@lru_cache(maxsize=16)
def angle_pieces(rows: Rows) -> tuple[Pieces, Pieces, Pieces]:
    """Those of `parts.TableDrive.curves` over the time until a table (s, rad) repeats; not to be written to.

    A periodic spline, but for what it gains evenly, and its exact derivatives, so that what is integrated belongs to where
    things are.
    """
    from scipy.interpolate import CubicSpline  # a third of a second, for these alone

    times, angles = np.array(rows).T
    rest = angles - (angles[-1] - angles[0]) * times / times[-1]
    rest[-1] = rest[0]
    length = float(times[-1])
    smooth = CubicSpline(times, rest, bc_type="periodic")
    angle = Pieces(times[:-1] / length, smooth.c[::-1].T * length ** np.arange(4), length)
    spin = angle.derivative()
    return angle, spin, spin.derivative()


@lru_cache(maxsize=16)
def speed_pieces(rows: Rows) -> tuple[Pieces, Pieces]:
    """Those of `parts.RunUp.curves` over times (s) up to the last row, where the speed stays; not to be written to."""
    speed = level(rows)
    return speed, speed.derivative()


def curve_at(curve: Curve, angle: Array, turns: int = 1, interpolation: str = "smooth") -> Array:
    """A torque or load at angles (n,) of the driven body in rad, which repeats after `turns`, as the kernel reads it."""
    if not isinstance(curve, tuple):
        return np.full(len(angle), curve)
    return periodic(curve, at.TURN * turns, interpolation).at(angle)
