"""Both joints ideal: closed-form kinematics and inverse dynamics of the slider-crank, no integration.

Textbook relations (e.g. Norton, Design of Machinery, ch. 6 and 11): the rod's angle follows from the crank's, its
derivatives from the loop's, and each body's balance gives one joint's reaction after the other, slider first.
"""

import math

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.motion import (
    gravity_of,
    guide_ratio,
    load_of,
    reaction_slope,
    table_value,
)
from hpcclear.dynamics.physics.angles import sincos

(
    SLIDER_X,
    SLIDER_V,
    SLIDER_A,
    ROD_X,
    ROD_Y,
    ROD_ANGLE,
    ROD_VX,
    ROD_VY,
    ROD_SPIN,
    ROD_AX,
    ROD_AY,
    ROD_SPIN_RATE,
    FORCE_12_X,  # on the rod, from the crank
    FORCE_12_Y,
    FORCE_23_X,  # on the rod, from the slider
    FORCE_23_Y,
    BEARING_X,  # on the crank, from the frame
    BEARING_Y,
    GUIDE_FORCE,  # on the slider, along +y
    GUIDE_FRICTION,  # on the slider, against +x
    LOAD_FORCE,  # on the slider, along +x
    CRANK_MOMENT,  # on the crank, from the drive
) = range(22)
ROWS = 22
BLOCK = 64
"""Instants side by side, so that the compiler vectorises over them."""

_PANELS = 8  # between two instants
_PER_TURN = 3600  # instants of a revolution for peak and deviation
# nodes and weights on [0, 1] of Gauss's rule with five points, for works between instants
_NODES, _WEIGHTS = (
    0.5 * (np.polynomial.legendre.leggauss(5)[0] + 1.0),
    0.5 * np.polynomial.legendre.leggauss(5)[1],
)


@lane_function
def _instant(effects, par, load_table, angle, w, alpha, out, i):
    """Rows of `ideal_response` but the rod's angle for one instant of a block; `out` is flat, (ROWS, BLOCK)."""
    crank, length = par[at.CRANK_LENGTH], par[at.ROD_LENGTH]
    near, m2, m3 = par[at.ROD_NEAR], par[at.ROD_MASS], par[at.SLIDER_MASS]
    m1, u1 = par[at.CRANK_MASS], par[at.CRANK_NEAR]
    g = gravity_of(effects.gravity, par, 0, 1)
    s, c = sincos(angle)
    st = -crank * s / length
    ct = math.sqrt(1.0 - st * st)
    inverse = 1.0 / (length * ct)
    spin = -crank * c * w * inverse
    pin_ax = -crank * (s * alpha + c * w * w)
    pin_ay = crank * (c * alpha - s * w * w)
    alpha2 = (length * st * spin * spin - pin_ay) * inverse
    swing_x = -st * alpha2 - ct * spin * spin
    swing_y = ct * alpha2 - st * spin * spin
    v3 = -crank * s * w - length * st * spin
    a3 = pin_ax + length * swing_x
    ax = pin_ax + near * swing_x
    ay = pin_ay + near * swing_y
    load = load_of(
        effects.load,
        effects.load_table,
        par,
        table_value(load_table, 0, load_table.size // 4, angle),
        0,
        1,
    )
    # guide reaction N = free - slope f with f = ratio |N|, one balance of rod and slider
    slope = length * st * inverse
    free = reaction_slope(par, (st, ct), (alpha2, ax, ay + g, a3), 0, 1) + load * slope + m3 * g
    ratio = guide_ratio(effects.guide, par, v3, 0, 1)
    ratio = ratio if free >= 0.0 else -ratio
    push = free / (1.0 + slope * ratio)
    friction = ratio * push
    rx = load - friction - m3 * a3
    ry = push - m3 * g
    px = m2 * ax - rx
    py = m2 * (ay + g) - ry
    out[SLIDER_X * BLOCK + i] = crank * c + length * ct
    out[SLIDER_V * BLOCK + i] = v3
    out[SLIDER_A * BLOCK + i] = a3
    out[ROD_X * BLOCK + i] = crank * c + near * ct
    out[ROD_Y * BLOCK + i] = crank * s + near * st
    out[ROD_ANGLE * BLOCK + i] = st
    out[ROD_VX * BLOCK + i] = -crank * s * w - near * st * spin
    out[ROD_VY * BLOCK + i] = crank * c * w + near * ct * spin
    out[ROD_SPIN * BLOCK + i] = spin
    out[ROD_AX * BLOCK + i] = ax
    out[ROD_AY * BLOCK + i] = ay
    out[ROD_SPIN_RATE * BLOCK + i] = alpha2
    out[FORCE_12_X * BLOCK + i] = px
    out[FORCE_12_Y * BLOCK + i] = py
    out[FORCE_23_X * BLOCK + i] = rx
    out[FORCE_23_Y * BLOCK + i] = ry
    out[BEARING_X * BLOCK + i] = px - m1 * u1 * (s * alpha + c * w * w)
    out[BEARING_Y * BLOCK + i] = py + m1 * (g + u1 * (c * alpha - s * w * w))
    out[GUIDE_FORCE * BLOCK + i] = push
    out[GUIDE_FRICTION * BLOCK + i] = friction
    out[LOAD_FORCE * BLOCK + i] = load
    moment = (
        crank * (c * py - s * px) + par[at.CRANK_MOMENT] * g * c + par[at.CRANK_INERTIA] * alpha
    )
    out[CRANK_MOMENT * BLOCK + i] = moment


@scalar_function
def _fill(effects, par, load_table, angle, speed, acceleration, out):
    """All instants, BLOCK at a time; `out` (ROWS, instants), instants a multiple of BLOCK."""
    rows = np.empty(ROWS * BLOCK)
    for start in range(0, len(angle), BLOCK):
        phi = angle[start : start + BLOCK]
        w = speed[start : start + BLOCK]
        alpha = acceleration[start : start + BLOCK]
        for i in range(BLOCK):
            _instant(effects, par, load_table, phi[i], w[i], alpha[i], rows, i)
        for row in range(ROWS):
            for i in range(BLOCK):
                out[row, start + i] = rows[row * BLOCK + i]


def ideal_response(
    effects: at.Effects,
    par: Array,
    load_table: Array | None,
    angle: Array,
    speed: Array | None = None,
    acceleration: Array | None = None,
) -> Array:
    """Motion, joint reactions and crank moment of the mechanism without clearance, shape (ROWS, instants).

    Parameters
    ----------
    effects : layout.Effects
    par : ndarray, shape (PARAMETERS,)
        Parameters of one sample.
    load_table : ndarray or None
        Cubic cells of the slider load, as the kernel reads them.
    angle : ndarray, shape (instants,)
        Crank angle, rad, below 1e4.
    speed, acceleration : ndarray, shape (instants,), optional
        Crank speed (rad/s) and angular acceleration of a torque-driven crank; the prescribed speed and 0 otherwise.

    Returns
    -------
    ndarray
        Rows SLIDER_X to CRANK_MOMENT of this module, SI.
    """
    count = len(angle)
    padded = -count % BLOCK
    inputs = []
    for values, default in ((angle, 0.0), (speed, par[at.SPEED]), (acceleration, 0.0)):
        column = np.full(count + padded, default)
        if values is not None:
            column[:count] = values
        inputs.append(column)
    out = np.empty((ROWS, count + padded))
    table = np.zeros(4) if load_table is None else load_table
    _fill(effects, np.ascontiguousarray(par), table, *inputs, out)
    out = out[:, :count]
    out[ROD_ANGLE] = np.arcsin(out[ROD_ANGLE])
    return out


def ideal_works(effects: at.Effects, par: Array, load_table: Array | None, angle: Array) -> Array:
    """Works since the first instant at prescribed speed, shape (4, instants), J.

    Rows: work of the drive, integral of the size of its power, energy dissipated in the guide, work of the load.
    `angle` rises. Gauss's rule with five points in each of `_PANELS` panels between instants: with a rod hardly
    longer than the crank the powers peak sharply near the dead centres.
    """
    step = np.diff(angle)
    inside = ((np.arange(_PANELS)[:, None] + _NODES) / _PANELS).ravel()
    weights = np.tile(_WEIGHTS, _PANELS) / _PANELS
    nodes = (angle[:-1, None] + step[:, None] * inside).ravel()
    seen = ideal_response(effects, par, load_table, nodes)
    drive = seen[CRANK_MOMENT] * par[at.SPEED]
    powers = [
        drive,
        np.abs(drive),
        seen[GUIDE_FRICTION] * seen[SLIDER_V],
        seen[LOAD_FORCE] * seen[SLIDER_V],
    ]
    during = np.array([p.reshape(-1, len(inside)) @ weights for p in powers]) * step / par[at.SPEED]
    return np.concatenate([np.zeros((4, 1)), during.cumsum(axis=1)], axis=1)


def ideal_outcomes(
    effects: at.Effects, par: Array, load_table: Array | None, transient: int, averaged: int
) -> Array:
    """Outcome rows (samples, OUT) of mechanisms without clearance: no gap, hence an objective of 0, nothing integrated.

    Parameters
    ----------
    effects : layout.Effects
        With `responses`, the crank moment's peak and the deviation of the slider acceleration, from `_PER_TURN`
        instants; there is no contact force.
    par : ndarray, shape (samples, PARAMETERS)
    load_table : ndarray or None
        As for `ideal_response`.
    transient, averaged : int
        Revolutions.
    """
    rows = np.zeros((len(par), at.OUT))
    rows[:, at.OUT_SPREAD] = 0.0 if averaged > 1 else np.nan
    rows[:, at.OUT_REVOLUTIONS] = transient + averaged
    rows[:, at.OUT_TIME] = (transient + averaged) * par[:, at.PERIOD]
    # works are not part of an ensemble's record; `ideal_works` has them for one response
    works = at.OUT_TOTAL + at.WORKS
    rows[:, works : works + 4] = np.nan
    if effects.responses:
        angle = np.linspace(0.0, at.TURN, _PER_TURN, endpoint=False)
        for row, own in zip(rows, par, strict=True):
            seen = ideal_response(effects, own, load_table, angle)
            row[at.OUT_MOMENT] = np.abs(seen[CRANK_MOMENT]).max()
            row[at.OUT_ACCELERATION] = seen[SLIDER_A].std()
    return rows
