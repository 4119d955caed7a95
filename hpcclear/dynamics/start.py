"""Where a scene's samples start: crank and rod outstretched, velocities of the mechanism without clearance."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.parameters import Numbers, topology
from hpcclear.dynamics.planar.problem import start_states_of
from hpcclear.dynamics.views import Parameters, Start
from hpcclear.scene import Scene
from hpcclear.scene.driving import speed_entry
from hpcclear.scene.points import Points


def start_states(
    scene: Scene, par: Array, points: Points | None = None, walk: bool = True
) -> Start:
    """Start of each sample, of parameters (samples, PARAMETERS) and the points they were made from.

    Journals are centred, or where ``start_eccentricity`` puts them. Linkages that cannot turn fail at the start,
    unless `walk` is off.

    Raises
    ------
    InputError
        If a linkage cannot be put together.
    """
    if scene.is_planar:
        return start_states_of(scene, par, points, walk)
    p = Parameters(par)
    first, second, free = topology(scene)
    count = len(par)
    speed = p.speed
    if speed_entry(scene.drive) == "expected_speed":  # which is not what it starts with
        speed = np.broadcast_to(Numbers(scene, points)("drive.initial_speed"), count)
    q, v = _minimal(scene, p, speed)
    baumgarte = scene.numerics.formulation == "baumgarte"
    if baumgarte:
        zero = np.zeros(count)
        q = [p.crank_near, zero, *q, zero, zero]
        v = [zero, p.crank_near * speed, *v, zero, zero]
    elif not (first or second or scene.modes):
        q, v = [], []
    elif not (first and second):
        q, v = q[2:], v[2:]  # an ideal joint leaves the rod's angle and the slider
    if free or baumgarte:
        q, v = [*q, np.zeros(count)], [*v, speed]
    start = Start.at_rest(count)
    undeflected = [np.zeros(count)] * (scene.bristles + scene.modes)
    q, v = [*undeflected, *q], [*undeflected, *v]
    n = len(q)
    if n:
        start.coordinates(n)[:] = np.transpose(q)
        start.velocities(n)[:] = np.transpose(v)
    _start_contacts(scene, p, start)
    return start


def _minimal(scene: Scene, p: Parameters, omega: Array) -> tuple[list[Array], list[Array]]:
    """Rod x, rod y, rod angle and slider x, and their velocities."""
    crank, length = p.crank_length, p.rod_length
    e12, e23 = (_start_eccentricity(scene, joint) for joint in ("crank_rod", "rod_slider"))
    angle = np.arcsin((e12[1] - e23[1]) / length)
    spin = -crank * omega / (length * np.cos(angle))
    pin_x, pin_y = crank - e12[0], np.full(len(p), -e12[1])  # rod's first bearing centre
    slider = pin_x + length * np.cos(angle) + e23[0]
    slider_speed = -length * np.sin(angle) * spin
    near = p.rod_near
    q = [pin_x + near * np.cos(angle), pin_y + near * np.sin(angle), angle, slider]
    along = crank * omega + near * np.cos(angle) * spin
    return q, [-near * np.sin(angle) * spin, along, spin, slider_speed]


def _start_eccentricity(scene: Scene, joint: str) -> tuple[float, float]:
    return getattr(getattr(scene.joints, joint), "start_eccentricity", (0.0, 0.0))


def _start_contacts(scene: Scene, p: Parameters, start: Start) -> None:
    """A journal that starts on or beyond its contact circle starts in contact, at the least impact speed."""
    law = scene.effects.contact
    if law is None or not law.latched:
        return
    for k, joint in enumerate(("crank_rod", "rod_slider")):
        if joint in scene.clearance_joints():
            distance = np.hypot(*_start_eccentricity(scene, joint))
            touching = distance >= p.clearance[:, k]
            start.active[:, k] = touching
            start.inverse_impact[:, k] = touching / law.minimum_impact_speed
