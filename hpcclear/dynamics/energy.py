"""The mechanical energy of whole states, and how well a run closed its balance."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.bending import bent_motion
from hpcclear.dynamics.joint_laws import stored_energy
from hpcclear.dynamics.linkage import baumgarte, geometry
from hpcclear.dynamics.linkage.parts import split
from hpcclear.dynamics.parameters import topology
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.views import Outcome, Parameters, Start
from hpcclear.scene import Scene


def energies(
    scene: Scene, par: Array, q: Array, v: Array, active: Array, turn_time: Array | float = 0.0
) -> tuple[Array, Array]:
    """Kinetic energy, and all energy: kinetic, potential and stored in the contacts.

    Parameters
    ----------
    scene : Scene
    par : ndarray, shape (PARAMETERS,) or (m, PARAMETERS)
        Kernel parameters, of one sample or a row for each state.
    q, v : ndarray, shape (n, m)
        The kernel's coordinates and velocities in any formulation.
    active : ndarray, shape (m, MAX_JOINTS)
        Contact flags of the joints.
    turn_time : ndarray, shape (m,), optional
        s, since the start of the revolution: tells the crank angle where it is no coordinate.

    Returns
    -------
    tuple of ndarray, shape (m,)
        J.
    """
    q, v = q[scene.bristles :], v[scene.bristles :]
    if scene.is_planar:
        return _of_linkage(scene, par, q, v, active, turn_time)
    first, second, free = topology(scene)
    p = Parameters(par)
    nine = scene.numerics.formulation == "baumgarte"
    rows = baumgarte.minimal_rows(first, second) if nine else list(range(len(q) - free))
    if free or nine:
        phi, omega = q[-1], v[-1]
    else:
        phi = p.speed * turn_time + np.zeros(q.shape[1])
        omega = p.speed + np.zeros(q.shape[1])
    m, bar = bent_motion(scene, par, (phi, omega), q[rows], v[rows])
    kinetic = geometry.kinetic_energy(m, par.T) + (0.0 if bar is None else bar.kinetic)
    total = kinetic + geometry.potential_energy(m, par.T, scene.effects.gravity)
    if bar is not None:
        total = total + bar.strain + scene.effects.gravity * bar.raised(m.rod_angle)
    for k, is_open in enumerate((first, second)):
        if is_open:
            gap = np.hypot(m.eccentricity_x[:, k], m.eccentricity_y[:, k])
            direction = np.arctan2(m.eccentricity_y[:, k], m.eccentricity_x[:, k])
            turns = (m.rod_angle, m.crank_angle if k == 0 else 0.0)
            gap = gap - p.clearance[..., k] - _depth(scene, par, k, direction, turns)
            on = active[:, [k]]
            total = total + stored_energy(scene, par, gap[:, None], on, [k])
    return kinetic, total


def _depth(scene: Scene, par: Array, place: int, direction: Array, turns: Any) -> Array | float:
    """How much wider than round a joint is in a direction (m,), m; `turns`: angles of bearing and journal, rad."""
    counts = scene.waves()
    row = at.WAVES + 4 * sum(counts.values()) * place
    depth: Array | float = 0.0
    for count, turn in zip(counts.values(), turns, strict=True):
        for n in range(1, count + 1):
            angle = n * (direction - turn)
            depth = depth + par[..., row] * np.cos(angle) + par[..., row + 1] * np.sin(angle)
            row += 4
    return depth


def _of_linkage(
    scene: Scene, par: Array, q: Array, v: Array, active: Array, time: Array | float
) -> tuple[Array, Array]:
    """`energies` of a linkage."""
    linkage = linkage_of(scene)
    kinetic, potential, eccentricity = linkage.energies(par, q, v, time, scene.effects.gravity)
    p, count = Parameters(par), len(eccentricity)
    gaps = np.hypot(eccentricity[:, 0], eccentricity[:, 1]).T - p.clearance[..., :count]
    if any(scene.waves().values()):
        pose = linkage.poses.at(par, q, v, time)[0]
        angles = {body.name: pose.angle[k] for k, body in enumerate(linkage.mechanism.bodies)}
        for k, joint in enumerate(linkage.mechanism.clearances):
            turns = tuple(angles.get(split(one)[0], 0.0) for one in (joint.bearing, joint.journal))
            direction = np.arctan2(eccentricity[k, 1], eccentricity[k, 0])
            gaps[:, k] -= _depth(scene, par, k, direction, turns)
    elastic = stored_energy(scene, par, gaps, active[:, :count], range(count))
    return kinetic, kinetic + potential + elastic


def of_starts(scene: Scene, par: Array, start: Start, n: int) -> Array:
    """Energy of m starts, J, shape (m,); parameters (m, PARAMETERS), n coordinates."""
    q, v = start.coordinates(n).T, start.velocities(n).T
    with np.errstate(invalid="ignore"):  # starts that failed are not finite
        return energies(scene, par, q, v, start.active)[1]


def errors(scene: Scene, par: Array, before: Array, outcome: Outcome, n: int) -> Array:
    """What the balance leaves unexplained at the end, over max(kinetic energy, integral of |driving power|).

    Parameters
    ----------
    scene : Scene
    par : ndarray, shape (m, PARAMETERS)
    before : ndarray, shape (m,)
        Energy at the start, J.
    outcome : Outcome
        Of m samples, with the ledger on.
    n : int
        Coordinates.

    Returns
    -------
    ndarray, shape (m,)
    """
    q, v = outcome.coordinates(n).T, outcome.velocities(n).T
    kinetic, after = energies(scene, par, q, v, outcome.active)
    works = outcome.drive_work + outcome.load_work - outcome.dissipated
    return np.abs(after - before - works) / np.maximum(kinetic, outcome.absolute_drive_work)
