"""The mechanical energy of whole states, and how well a run closed its balance."""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage import baumgarte, geometry
from hpcclear.dynamics.lowering import topology
from hpcclear.dynamics.stepping.lifecycle import STATE
from hpcclear.scene import Scene

_ACTIVE = 2 * at.MAX_COORDINATES


def energies(
    scene: Scene, par: Array, q: Array, v: Array, active: Array, turn_time: Array | float = 0.0
) -> tuple[Array, Array]:
    """Kinetic energy, and all energy: kinetic, potential and stored in the contacts.

    Parameters
    ----------
    scene : Scene
    par : ndarray, shape (PARAMETERS,) or (PARAMETERS, m)
        Kernel parameters, of one sample or a column for each state.
    q, v : ndarray, shape (n, m)
        The kernel's coordinates and velocities in any formulation.
    active : ndarray, shape (m, 2)
        Contact flags of both joints.
    turn_time : ndarray, shape (m,), optional
        s, since the start of the revolution: tells the crank angle where it is no coordinate.

    Returns
    -------
    tuple of ndarray, shape (m,)
        J.
    """
    first, second, free = topology(scene)
    nine = scene.numerics.formulation == "baumgarte"
    rows = baumgarte.minimal_rows(first, second) if nine else list(range(len(q) - free))
    if free or nine:
        phi, omega = q[-1], v[-1]
    else:
        phi = par[at.SPEED] * turn_time + np.zeros(q.shape[1])
        omega = par[at.SPEED] + np.zeros(q.shape[1])
    m = geometry.motion((first, second), par, phi, omega, q[rows], v[rows])
    kinetic = geometry.kinetic_energy(m, par)
    total = kinetic + geometry.potential_energy(m, par, scene.effects.gravity)
    latched = scene.effects.contact is not None and scene.effects.contact.latched
    for k, (is_open, base) in enumerate(((first, at.JOINT_12), (second, at.JOINT_23))):
        if is_open:
            gap = np.hypot(m.eccentricity_x[:, k], m.eccentricity_y[:, k])
            gap = np.maximum(gap - par[base + at.CLEARANCE], 0.0)
            on = active[:, k] if latched else 1.0
            total = total + 0.4 * par[base + at.CONTACT_STIFFNESS] * on * gap**2.5
    return kinetic, total


def of_starts(scene: Scene, par: Array, state: Array, n: int) -> Array:
    """Energy of start states, J, shape (m,); parameters (m, PARAMETERS), states (m, STATE), n coordinates."""
    assert state.shape[1] == STATE
    q, v = state[:, :n].T, state[:, at.MAX_COORDINATES : at.MAX_COORDINATES + n].T
    return energies(scene, par.T, q, v, state[:, _ACTIVE : _ACTIVE + 2])[1]


def errors(scene: Scene, par: Array, before: Array, rows: Array, n: int) -> Array:
    """What the balance leaves unexplained at the end, over max(kinetic energy, integral of |driving power|).

    Parameters
    ----------
    scene : Scene
    par : ndarray, shape (m, PARAMETERS)
    before : ndarray, shape (m,)
        Energy at the start, J.
    rows : ndarray, shape (m, OUT)
        Outcome rows of the kernel, with the ledger on.
    n : int
        Coordinates.

    Returns
    -------
    ndarray, shape (m,)
    """
    start = at.OUT_STATE
    q, v = rows[:, start : start + n].T, rows[:, start + at.MAX_COORDINATES :][:, :n].T
    active = rows[:, [at.OUT_ACTIVE_12, at.OUT_ACTIVE_23]]
    kinetic, after = energies(scene, par.T, q, v, active)
    works = rows[:, at.OUT_DRIVE_WORK] + rows[:, at.OUT_LOAD_WORK] - rows[:, at.OUT_DISSIPATED]
    return np.abs(after - before - works) / np.maximum(kinetic, rows[:, at.OUT_ABS_DRIVE_WORK])
