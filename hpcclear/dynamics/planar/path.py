"""The followed point of a linkage: where it is, its acceleration, and how far clearance takes it off its path."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.assembly import assemble, placed
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.prescribed import passed_through
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.planar.turning import without_clearance
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of

Path = Callable[[Array], Array]

INSTANTS = 720
"""Of a turn at which the linkage without clearance is put together; cubic between them, which is off by 1e-11 of its size."""


def followed(
    scene: Scene,
    phase: Array,
    points: Mapping[str, Array],
    acceleration: Array,
    clearance: bool = True,
) -> dict[str, Array]:
    """Series of the followed point, none where none is followed: place, acceleration (t,) and `path_error`.

    `phase` (t,): progress of the drive since the start, 2 pi a turn of its body, rad; `points`: ``point_x`` and ``point_y``
    (t, points); `acceleration` (t,): of the point, x + iy. Without `clearance` no path is off.
    """
    place, mechanism = scene.linkage.followed, linkage_of(scene).mechanism
    if place is None:
        return {}
    names = [f"{body.name}.{point}" for body in mechanism.bodies for point in body.points]
    x, y = (points[f"point_{axis}"][:, names.index(place)] for axis in "xy")
    found = {
        "followed_x": x,
        "followed_y": y,
        "followed_acceleration_x": acceleration.real,
        "followed_acceleration_y": acceleration.imag,
    }
    path = _path_of(scene) if clearance else None
    if path is not None:
        cycle = at.TURN * turns_of(scene.linkage)
        ideal = path(np.mod(phase, cycle) / cycle)
        found["path_error"] = np.abs(x + 1j * y - ideal)
    return found


@lru_cache(maxsize=16)
def _path_of(scene: Scene) -> Path | None:
    place = scene.linkage.followed
    return None if place is None else ideal_path(linkage_of(scene).mechanism, place)


def _path(ideal: Mechanism, place: str) -> Path:
    from scipy.interpolate import CubicHermiteSpline  # a third of a second, for these alone

    drive = ideal.period
    share = np.linspace(0.0, 1.0, INSTANTS * drive.turns + 1)
    assembly = assemble(ideal)
    times = share * drive.seconds
    q, v = np.moveaxis(passed_through(assembly, times), 0, -1)
    where, speed, *_ = placed(replace(assembly, q=q, v=v), place)
    return CubicHermiteSpline(share, where, speed * drive.seconds)


def ideal_path(mechanism: Mechanism, place: str) -> Path | None:
    """Where a place of the linkage is without clearance: complex m of the share of a revolution (t,); None where its drives
    leave something free then or do not repeat, or it cannot pass a dead centre."""
    try:
        ideal = without_clearance(mechanism)
        return None if freedom(ideal) else _path(ideal, place)
    except InputError:
        return None
