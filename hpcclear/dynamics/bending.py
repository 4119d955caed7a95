"""Bars that bend as a scene asks for them: rows of a slider-crank's rod, its energy, and how fast modes swing."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage import geometry
from hpcclear.dynamics.linkage.bending import (
    Bar,
    Bent,
    bar_of,
    bent,
    entries,
    numbers,
    shortened,
)
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.scene import Scene

STIFF = 2e4
"""Radians that the fastest mode swings in a revolution, from which "auto" takes implicit steps.

Explicit ones are then limited to some 2 of these, and contacts need a thousand steps a revolution. Steps that switch are no
help: they come back too often."""


def fill(scene: Scene, get: Any, p: Array) -> None:
    """Write the rows of a slider-crank's rod into parameters (m, PARAMETERS); `get`: entries by their paths, (m,)."""
    if not scene.modes:
        return
    rod = "mechanism.rod"
    names = (
        *(f"{rod}.{entry}" for entry in ("mass", "inertia", "length", "mass_center")),
        *(f"{rod}.bending.{entry}" for entry in ("stiffness", "damping")),
    )
    found = numbers(Bar(*(get(name) for name in names)), scene.modes)
    for row, entry in enumerate(entries(scene.modes), at.BENDING):
        p[:, row] = found[entry]


def of_rod(scene: Scene, par: Array) -> dict[str, Any]:
    """The numbers of a slider-crank's rod by name, from parameters (PARAMETERS,) or (m, PARAMETERS)."""
    return {entry: par.T[row] for row, entry in enumerate(entries(scene.modes), at.BENDING)}


def bent_motion(
    scene: Scene, par: Array, crank: tuple[Array, Array], q: Array, v: Array
) -> tuple[geometry.Motion, Bent | None]:
    """All bodies of a slider-crank from minimal coordinates, the crank's left out, and what bending adds.

    Parameters
    ----------
    scene : Scene
    par : ndarray, shape (PARAMETERS,) or (m, PARAMETERS)
    crank : tuple of ndarray, shape (m,)
        Angle (rad) and speed (rad/s).
    q, v : ndarray, shape (n, m)
        Those of modes come first.
    """
    open_joints = scene.clearance_joints()
    first, second = (name in open_joints for name in ("crank_rod", "rod_slider"))
    k = scene.modes
    if not k:
        return geometry.motion((first, second), par.T, *crank, q, v), None
    found = of_rod(scene, par)
    shorter = shortened(found, q[:k], v[:k])
    m = geometry.motion((first, second), par.T, *crank, q[k:], v[k:], shorter)
    cosine, sine = np.cos(m.rod_angle), np.sin(m.rod_angle)
    along, across = cosine * m.rod_vx + sine * m.rod_vy, cosine * m.rod_vy - sine * m.rod_vx
    return m, bent(found, q[:k], v[:k], (along, across, m.rod_spin))


def swings(mechanism: Mechanism) -> tuple[float, ...]:
    """Angular frequencies of all modes, each of its bar held at both ends, rad/s, in the order of the coordinates."""
    found: list[float] = []
    for body in mechanism.bodies:
        if body.bending is not None:
            own = numbers(bar_of(body), body.bending.modes)
            modes = range(1, body.bending.modes + 1)
            found += [float(np.sqrt(own[f"stiffness_{k}"] / own["mass"])) for k in modes]
    return tuple(found)


def tolerances(mechanism: Mechanism, length: float, speed: float) -> tuple[float, ...]:
    """Absolute tolerances of amplitudes beside those of lengths (m) and velocities (m/s): however stiff a mode is, an error of
    its amplitude holds no more energy than one of its velocity."""
    return tuple(min(length, speed / rate) for rate in swings(mechanism))
