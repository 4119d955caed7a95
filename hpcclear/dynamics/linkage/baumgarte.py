"""Equations of motion in nine coordinates with multipliers and Baumgarte feedback (paper eq. 11), one lane at a time.

Every constraint c obeys ``c'' = -2 alpha c' - beta^2 c``: the crank's bearing (2), the guide (y3, theta3), the
prescribed crank angle where there is one, and two for each ideal joint. Since most constraints name one body only,
the system [M, -J'; J, 0] is eliminated block by block by hand, multipliers included; what is left is one or two
equations in the angular accelerations, never a dense 14 x 14 solve.

Coordinates: x1, y1, x2, y2, theta2, x3, y3, theta3 and, last as in every topology, the crank angle phi1; bodies
by their mass centres. At prescribed speed the crank angle restarts every revolution, as the time in it does.
"""

from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.motion import (
    drive_moment_of,
    either_product,
    gravity_of,
    guide_friction,
    guide_ratio,
    guided_crank,
    joint_force,
    load_of,
    product,
    reaction_slope,
    sliding_pair,
    store_power,
    torque_of,
)
from hpcclear.dynamics.linkage.roundness import turns_if
from hpcclear.dynamics.physics.angles import sincos

(X1, Y1, X2, Y2, THETA2, X3, Y3, THETA3, PHI1) = range(9)


class Here(NamedTuple):
    """What is known of a state before the bodies' accelerations are."""

    crank: Any  # sine, cosine, angle, speed, time in this revolution
    rod: Any  # sine, cosine, speed
    slider: Any  # speed, acceleration across the guide
    pin: Any  # acceleration of the crank pin but for that of the crank angle
    first: Any  # journal relative to bearing at O12, and its velocity
    second: Any  # likewise at O23
    force_1: Any  # as `open_joint` returns them
    force_2: Any
    gravity: Any
    load: Any
    torque: Any
    rest: Any  # moment on the crank about its bearing, from everything but the rod


@lane_function
def feedback(par, c, dc, i, W):
    """Second derivative that a constraint is given: -2 alpha c' - beta^2 c."""
    return -par[at.BAUMGARTE_ALPHA2 * W + i] * dc - par[at.BAUMGARTE_BETA2 * W + i] * c


@lane_function
def open_joint(flag, effects, work, par, joint, relative, turns, i, W):
    """Contact and friction of a joint with clearance (see `motion.joint_force`); nothing for an ideal one."""
    if flag is not None:
        return joint_force(
            effects, work, par, joint, relative, turns_if(effects.waves, turns), i, W
        )
    else:
        return 0.0, 0.0, 0.0, 0.0, 0.0


@lane_function
def crank_acceleration(torque, par, inertia, force, crank, i, W):
    """Angular acceleration of the crank: from the forces, or from the driving constraint.

    `crank`: sine, cosine, angle, speed and the time in this revolution.
    """
    if torque is not None:
        return force / inertia
    else:
        _, _, phi, omega, time = crank
        speed = par[at.SPEED * W + i]
        return feedback(par, phi - speed * time, omega - speed, i, W)


@lane_function
def nine_coordinates(effects, crank_rod, rod_slider, work, par, i, W):
    """Write accelerations of all nine coordinates, and gaps, forces and powers."""
    phi = work[(at.QS + PHI1) * W + i]
    omega = work[(at.VS + PHI1) * W + i]
    spin = work[(at.VS + THETA2) * W + i]
    v3 = work[(at.VS + X3) * W + i]
    s, c = sincos(phi)
    st, ct = sincos(work[(at.QS + THETA2) * W + i])
    crank = par[at.CRANK_LENGTH * W + i]
    u1 = par[at.CRANK_NEAR * W + i]
    near = par[at.ROD_NEAR * W + i]
    far = par[at.ROD_FAR * W + i]
    x1 = work[(at.QS + X1) * W + i]
    y1 = work[(at.QS + Y1) * W + i]
    vx1 = work[(at.VS + X1) * W + i]
    vy1 = work[(at.VS + Y1) * W + i]
    x2 = work[(at.QS + X2) * W + i]
    y2 = work[(at.QS + Y2) * W + i]
    vx2 = work[(at.VS + X2) * W + i]
    vy2 = work[(at.VS + Y2) * W + i]
    # constraints that name one body
    rx = feedback(par, x1 - u1 * c, vx1 + u1 * omega * s, i, W)
    ry = feedback(par, y1 - u1 * s, vy1 - u1 * omega * c, i, W)
    ay3 = feedback(par, work[(at.QS + Y3) * W + i], work[(at.VS + Y3) * W + i], i, W)
    work[(at.ACC + Y3) * W + i] = ay3
    work[(at.ACC + THETA3) * W + i] = feedback(
        par, work[(at.QS + THETA3) * W + i], work[(at.VS + THETA3) * W + i], i, W
    )
    arm = crank - u1
    e12 = (x1 + arm * c - (x2 - near * ct), y1 + arm * s - (y2 - near * st))
    de12 = (
        vx1 - arm * omega * s - (vx2 + near * spin * st),
        vy1 + arm * omega * c - (vy2 - near * spin * ct),
    )
    e23 = (
        work[(at.QS + X3) * W + i] - (x2 + far * ct),
        work[(at.QS + Y3) * W + i] - (y2 + far * st),
    )
    de23 = (v3 - (vx2 - far * spin * st), work[(at.VS + Y3) * W + i] - (vy2 + far * spin * ct))
    spin3 = work[(at.VS + THETA3) * W + i]
    force_1 = open_joint(
        crank_rod, effects, work, par, at.O12, (*e12, *de12, omega, spin), (ct, st, c, s), i, W
    )  # fmt: skip
    force_2 = open_joint(
        rod_slider, effects, work, par, at.O23, (*e23, *de23, spin3, spin), (ct, st, 1.0, 0.0), i, W
    )  # fmt: skip
    # acceleration of the crank pin but for that of the crank angle
    pin = (rx - crank * c * omega * omega, ry - crank * s * omega * omega)
    g = gravity_of(effects.gravity, par, i, W)
    moment = par[at.CRANK_MOMENT * W + i]
    load = load_of(effects.load, effects.load_table, par, work[at.LOAD_VALUE * W + i], i, W)
    torque = torque_of(effects.torque_table, effects.torque_falls, work, par, omega, i, W)
    # on the crank about its bearing, from everything but the rod
    rest = moment * (s * rx - c * ry) - product(effects.gravity, moment * c, g)
    here = Here(
        (s, c, phi, omega, work[at.STAGE_TIME * W + i]), (st, ct, spin), (v3, ay3), pin,
        (e12, de12), (e23, de23), force_1, force_2, g, load, torque, rest,
    )  # fmt: skip
    alpha1, drive, friction = bodies(effects, crank_rod, rod_slider, work, par, here, i, W)
    work[(at.ACC + PHI1) * W + i] = alpha1
    work[(at.ACC + X1) * W + i] = rx - u1 * (s * alpha1 + c * omega * omega)
    work[(at.ACC + Y1) * W + i] = ry + u1 * (c * alpha1 - s * omega * omega)
    store_power(
        effects, work, (drive_moment_of(effects.torque, torque, drive), omega),
        force_1[4] + force_2[4] + friction * v3, load * v3, work[(at.ACC + X3) * W + i], i, W,
    )  # fmt: skip


@lane_function
def bodies(effects, crank_rod, rod_slider, work, par, here, i, W):
    """Rod, slider and crank, by which joints are open. Returns crank acceleration, drive moment, guide friction."""
    if crank_rod is not None:
        fx1, fy1, _, mj1, _ = here.force_1
        s, c, _, _, _ = here.crank
        rest = here.rest + par[at.CRANK_LENGTH * W + i] * (s * fx1 - c * fy1) + mj1
        inertia = par[at.CRANK_INERTIA * W + i]
        alpha1 = crank_acceleration(
            effects.torque, par, inertia, here.torque + rest, here.crank, i, W
        )
        if rod_slider is not None:
            friction = free_rod(effects, work, par, here, i, W)
        else:
            friction = rod_on_slider(effects, work, par, here, i, W)
        return alpha1, inertia * alpha1 - rest, friction
    else:
        # the rod's first bearing follows the crank pin
        e12, de12 = here.first
        fx = here.pin[0] - feedback(par, e12[0], de12[0], i, W)
        fy = here.pin[1] - feedback(par, e12[1], de12[1], i, W)
        if rod_slider is not None:
            return rod_on_crank(effects, work, par, here, (fx, fy), i, W)
        else:
            return closed_chain(effects, work, par, here, (fx, fy), i, W)


@lane_function
def store_rod(work, ax, ay, alpha, i, W):
    """Accelerations of the rod."""
    work[(at.ACC + X2) * W + i] = ax
    work[(at.ACC + Y2) * W + i] = ay
    work[(at.ACC + THETA2) * W + i] = alpha


@lane_function
def free_rod(effects, work, par, here, i, W):
    """Both joints open. Returns the guide's friction on the slider, against +x."""
    st, ct, _ = here.rod
    force_2 = here.force_2
    fx1, fy1, mb1, _, _ = here.force_1
    near = par[at.ROD_NEAR * W + i]
    far = par[at.ROD_FAR * W + i]
    inverse = par[at.INV_ROD_MASS * W + i]
    moment = (
        near * (st * fx1 - ct * fy1) + far * (ct * force_2[1] - st * force_2[0]) + mb1 + force_2[2]
    )
    store_rod(
        work,
        (fx1 + force_2[0]) * inverse,
        (fy1 + force_2[1]) * inverse - here.gravity,
        moment * par[at.INV_ROD_INERTIA * W + i],
        i,
        W,
    )
    return free_slider(effects, work, par, here, i, W)


@lane_function
def free_slider(effects, work, par, here, i, W):
    """Slider with an open joint. Returns the guide's friction."""
    v3, ay3 = here.slider
    fx, fy, _, _, _ = here.force_2  # on the rod
    friction = guide_friction(
        effects.guide, par, v3, par[at.SLIDER_MASS * W + i] * (ay3 + here.gravity) + fy, i, W
    )
    work[(at.ACC + X3) * W + i] = (here.load - fx - friction) * par[at.INV_SLIDER_MASS * W + i]
    return friction


@lane_function
def rod_on_slider(effects, work, par, here, i, W):
    """O12 open, O23 ideal: rod angle and slider are coupled by the rod's mass."""
    st, ct, spin = here.rod
    v3, ay3 = here.slider
    e23, de23 = here.second
    g, load = here.gravity, here.load
    fx1, fy1, mb1, _, _ = here.force_1
    length = par[at.ROD_LENGTH * W + i]
    far = par[at.ROD_FAR * W + i]
    m2 = par[at.ROD_MASS * W + i]
    m3 = par[at.SLIDER_MASS * W + i]
    # the rod's second bearing: the slider's acceleration and the feedback of the joint
    fx = -feedback(par, e23[0], de23[0], i, W)
    fy = ay3 - feedback(par, e23[1], de23[1], i, W)
    b1 = length * (st * fx1 - ct * fy1) + mb1 + m2 * far * (ct * (g + fy) - st * fx)
    b2 = fx1 + load - m2 * (fx + far * ct * spin * spin)
    weight = m2 * (g + fy) + m3 * (g + ay3) - fy1
    inertia = par[at.ROD_INERTIA * W + i] + m2 * far * far
    alpha, a3, friction = sliding_pair(
        effects.guide, par, (inertia, m2 * far * st, m2 + m3), (b1, b2), (m2 * far, st, ct, spin),
        (v3, weight), i, W,
    )  # fmt: skip
    work[(at.ACC + X3) * W + i] = a3
    ax = a3 + fx + far * (st * alpha + ct * spin * spin)
    store_rod(work, ax, fy + far * (st * spin * spin - ct * alpha), alpha, i, W)
    return friction


@lane_function
def rod_on_crank(effects, work, par, here, bearing, i, W):
    """O12 ideal, O23 open: rod and crank are coupled by the rod's mass. `bearing`: the rod's first one's known acceleration."""
    s, c, _, _, _ = here.crank
    st, ct, spin = here.rod
    fx, fy = bearing
    g, torque, rest = here.gravity, here.torque, here.rest
    fx2, fy2, mb2, _, _ = here.force_2
    crank = par[at.CRANK_LENGTH * W + i]
    length = par[at.ROD_LENGTH * W + i]
    near = par[at.ROD_NEAR * W + i]
    m2 = par[at.ROD_MASS * W + i]
    a11 = par[at.ROD_INERTIA * W + i] + m2 * near * near
    a13 = m2 * near * crank * (c * ct + s * st)
    a33 = par[at.CRANK_INERTIA * W + i] + m2 * crank * crank
    b1 = length * (ct * fy2 - st * fx2) + mb2 - m2 * near * (ct * (g + fy) - st * fx)
    swing = near * spin * spin * (s * ct - c * st)
    b3 = rest + crank * (c * fy2 - s * fx2) + m2 * crank * (s * fx - c * (fy + g) - swing)
    alpha1 = crank_acceleration(
        effects.torque, par, a33 - a13 * a13 / a11, torque + b3 - a13 * b1 / a11,
        here.crank, i, W,
    )  # fmt: skip
    alpha = (b1 - a13 * alpha1) / a11
    ax = fx - crank * s * alpha1 - near * (st * alpha + ct * spin * spin)
    store_rod(
        work, ax, fy + crank * c * alpha1 + near * (ct * alpha - st * spin * spin), alpha, i, W
    )
    friction = free_slider(effects, work, par, here, i, W)
    return alpha1, a33 * alpha1 + a13 * alpha - b3, friction


@lane_function
def closed_chain(effects, work, par, here, bearing, i, W):
    """Both joints ideal: every acceleration is a multiple of the crank's plus a known part."""
    s, c, _, _, _ = here.crank
    st, ct, spin = here.rod
    v3, ay3 = here.slider
    fx, fy = bearing
    e23, de23 = here.second
    g, load, torque, rest = here.gravity, here.load, here.torque, here.rest
    crank = par[at.CRANK_LENGTH * W + i]
    length = par[at.ROD_LENGTH * W + i]
    far = par[at.ROD_FAR * W + i]
    m2 = par[at.ROD_MASS * W + i]
    i2 = par[at.ROD_INERTIA * W + i]
    m3 = par[at.SLIDER_MASS * W + i]
    w2 = spin * spin
    # multiples of the crank's acceleration, and known parts (0)
    k = -crank * c / (length * ct)
    k0 = (ay3 - feedback(par, e23[1], de23[1], i, W) - fy + length * st * w2) / (length * ct)
    x3 = -crank * s - length * st * k
    bx = fx - length * (st * k0 + ct * w2)  # the rod's second bearing
    by = fy + length * (ct * k0 - st * w2)
    x30 = bx + feedback(par, e23[0], de23[0], i, W)
    x2 = x3 + far * st * k
    x20 = bx + far * (st * k0 + ct * w2)
    y2 = -far * ct * k
    y20 = by - far * (ct * k0 - st * w2)
    inertia = par[at.CRANK_INERTIA * W + i] + m2 * (x2 * x2 + y2 * y2) + i2 * k * k + m3 * x3 * x3
    force = (
        torque
        + rest
        + either_product(effects.load, effects.load_table, load, x3)
        - m2 * (x2 * x20 + y2 * (y20 + g))
        - i2 * k * k0
        - m3 * x3 * x30
    )
    n1 = reaction_slope(par, (st, ct), (k, x2, y2, x3), i, W)
    n0 = reaction_slope(par, (st, ct), (k0, x20, y20 + g, x30), i, W)
    n0 = n0 + load * st / ct + m3 * (g + ay3)
    chain = ((inertia, force), (n0, n1, st / ct), (v3, x3))
    alpha1, friction = chain_acceleration(
        effects.torque, effects.guide, par, chain, here.crank, i, W
    )
    alpha = k * alpha1 + k0
    work[(at.ACC + X3) * W + i] = x3 * alpha1 + x30
    store_rod(work, x2 * alpha1 + x20, y2 * alpha1 + y20, alpha, i, W)
    return alpha1, inertia * alpha1 - (force - torque) + friction * x3, friction


@lane_function
def chain_acceleration(torque, guide, par, chain, crank, i, W):
    """Crank acceleration and guide friction of the closed chain, whose guide reaction is n0 + n1 alpha1 - slope f.

    `chain`: balance, reaction and slider as of `motion.guided_crank`; `crank` as of `crank_acceleration`.
    """
    balance, reaction, slider = chain
    if torque is not None:
        return guided_crank(guide, par, balance, reaction, slider, i, W)
    else:
        alpha1 = crank_acceleration(None, par, balance[0], balance[1], crank, i, W)
        n0, n1, slope = reaction
        return alpha1, known_guide_friction(guide, par, n0 + n1 * alpha1, slope, slider[0], i, W)


@lane_function
def known_guide_friction(guide, par, free, slope, v3, i, W):
    """Guide friction f = ratio |N| where N = free - slope f."""
    if guide is not None:
        ratio = guide_ratio(guide, par, v3, i, W)
        ratio = ratio if free >= 0.0 else -ratio
        return ratio * free / (1.0 + slope * ratio)
    else:
        return 0.0


def constraint_violation(crank_rod: bool, rod_slider: bool, par: Array, q: Array) -> Array:
    """Largest position constraint that is not met, in m, at each instant.

    Parameters
    ----------
    crank_rod, rod_slider : bool
        Whether O12 and O23 have clearance (an ideal joint is a constraint).
    par : ndarray, shape (PARAMETERS,)
        Parameters of the sample.
    q : ndarray, shape (9, instants)
        Coordinates in the kernel's order. The slider's angle counts by the arc it makes at the rod's length, which
        makes it a length; the driving constraint is a matter of the angle and is not in here.
    """
    c, s = np.cos(q[PHI1]), np.sin(q[PHI1])
    ct, st = np.cos(q[THETA2]), np.sin(q[THETA2])
    crank, u1 = par[at.CRANK_LENGTH], par[at.CRANK_NEAR]
    near, far = par[at.ROD_NEAR], par[at.ROD_FAR]
    rows = [q[X1] - u1 * c, q[Y1] - u1 * s, q[Y3], q[THETA3] * par[at.ROD_LENGTH]]
    if not crank_rod:
        rows += [
            q[X1] + (crank - u1) * c - (q[X2] - near * ct),
            q[Y1] + (crank - u1) * s - (q[Y2] - near * st),
        ]
    if not rod_slider:
        rows += [q[X3] - (q[X2] + far * ct), q[Y3] - (q[Y2] + far * st)]
    return np.abs(rows).max(axis=0)


def minimal_rows(crank_rod: bool, rod_slider: bool) -> list[int]:
    """Which of the nine coordinates are the minimal ones of a topology, in their order (the crank angle left out)."""
    if crank_rod and rod_slider:
        return [X2, Y2, THETA2, X3]
    return [THETA2, X3] if crank_rod or rod_slider else []
