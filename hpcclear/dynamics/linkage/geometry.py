"""From the coordinates of a topology to the positions and velocities of all bodies, and the energies of these."""

from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at


@dataclass(frozen=True)
class Motion:
    """Positions and velocities of all bodies at each instant, shape (t,), SI; eccentricities (t, 2 joints)."""

    crank_angle: Array
    crank_speed: Array
    rod_x: Array
    rod_y: Array
    rod_angle: Array
    rod_vx: Array
    rod_vy: Array
    rod_spin: Array
    slider: Array
    slider_speed: Array
    eccentricity_x: Array
    eccentricity_y: Array


def motion(
    open_joints: tuple[bool, bool], par: Array, phi: Array, omega: Array, q: Array, v: Array,
    shorter: tuple[Array, Array] | None = None,
) -> Motion:  # fmt: skip
    """All bodies from minimal coordinates.

    Parameters
    ----------
    open_joints : pair of bool
        Whether O12 and O23 are open.
    par : ndarray, shape (PARAMETERS,)
    phi, omega : ndarray, shape (t,)
        Crank angle in this revolution (rad) and speed (rad/s).
    q, v : ndarray, shape (n, t)
        Coordinates and velocities, the crank's left out.
    shorter : tuple of ndarray, shape (t,), optional
        By how much a rod that bends is shorter, m, and how fast it gets so, m/s; its angle and the slider are coordinates
        then, without play too.
    """
    crank, length, near = par[at.CRANK_LENGTH], par[at.ROD_LENGTH], par[at.ROD_NEAR]
    pin = np.array([crank * np.cos(phi), crank * np.sin(phi)])
    pin_v = omega * np.array([-pin[1], pin[0]])
    first, second = open_joints
    less, rate = (0.0, 0.0) if shorter is None else shorter
    far = length - near - less
    if first and second:
        theta, spin, slider, slider_v = q[2], v[2], q[3], v[3]
    elif first or second or shorter is not None:
        theta, spin, slider, slider_v = q[0], v[0], q[1], v[1]
    else:
        theta = np.arcsin(-pin[1] / length)
        spin = -pin_v[1] / (length * np.cos(theta))
    along = np.array([np.cos(theta), np.sin(theta)])
    across = spin * np.array([-along[1], along[0]])
    if first and second:
        centre, centre_v = q[:2], v[:2]
    elif first:
        back = far
        centre = np.array([slider, np.zeros_like(slider)]) - back * along
        centre_v = np.array([slider_v, np.zeros_like(slider)]) - back * across + rate * along
    else:
        centre, centre_v = pin + near * along, pin_v + near * across
    if not (first or second or shorter is not None):
        slider = (pin + length * along)[0]
        slider_v = (pin_v + length * across)[0]
    near_end, far_end = centre - near * along, centre + far * along
    gap_1 = pin - near_end if first else np.zeros_like(pin)
    gap_2 = np.array([slider, np.zeros_like(slider)]) - far_end if second else np.zeros_like(pin)
    return Motion(
        phi, omega, centre[0], centre[1], theta, centre_v[0], centre_v[1], spin, slider, slider_v,
        np.array([gap_1[0], gap_2[0]]).T, np.array([gap_1[1], gap_2[1]]).T,
    )  # fmt: skip


def kinetic_energy(m: Motion, par: Array) -> Array:
    """Kinetic energy in J of crank (flywheel included), rod and slider, shape (t,)."""
    rod = par[at.ROD_MASS] * (m.rod_vx**2 + m.rod_vy**2) + par[at.ROD_INERTIA] * m.rod_spin**2
    crank = par[at.CRANK_INERTIA] * m.crank_speed**2
    return 0.5 * (rod + crank + par[at.SLIDER_MASS] * m.slider_speed**2)


def potential_energy(m: Motion, par: Array, gravity: float) -> Array:
    """Potential energy in J against y = 0, shape (t,)."""
    return gravity * (par[at.CRANK_MOMENT] * np.sin(m.crank_angle) + par[at.ROD_MASS] * m.rod_y)
