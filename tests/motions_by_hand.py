"""The slider-crank's motions with one joint open, and with both, as they were written by hand: oracles of generated texts.

Coordinates (free crank angle last, only with a torque drive):

- both joints open: rod x, rod y, rod angle, slider x;
- one joint open: rod angle, slider x (the ideal joint removes two).
"""

from hpcclear.base.jit import apart, lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.motion import (
    drive_moment_of,
    gravity_of,
    guide_friction,
    joint_force,
    load_of,
    product,
    sliding_pair,
    store_power,
    torque_of,
)
from hpcclear.dynamics.physics.angles import sincos


@lane_function
def store_crank(torque, work, last, acceleration, i, W):
    """Write down the crank's angular acceleration where it is a coordinate."""
    if torque is not None:
        work[(at.ACC + last) * W + i] = acceleration


@lane_function
def given(effects, work, par, omega, i, W):
    """Gravity, the load on the slider and the torque on the crank."""
    g = gravity_of(effects.gravity, par, i, W)
    load = load_of(effects.load, effects.load_table, par, work[at.LOAD_VALUE * W + i], i, W)
    torque = torque_of(effects.torque_table, effects.torque_falls, work, par, omega, i, W)
    return g, load, torque


@lane_function
def rod_and_slider(work, phi, i, W):
    """With one joint open: sines and cosines of crank and rod, the rod's spin, the slider's place and speed."""
    crank = sincos(phi)
    rod = sincos(work[(at.QS + 0) * W + i])
    spin = work[(at.VS + 0) * W + i]
    return (
        crank[0],
        crank[1],
        rod[0],
        rod[1],
        spin,
        work[(at.QS + 1) * W + i],
        work[(at.VS + 1) * W + i],
    )


@lane_function
def two_open(effects, work, par, phi, omega, i, W):
    """Both joints open: every body moves under forces alone."""
    cphi_s = sincos(phi)
    sphi, cphi = cphi_s[0], cphi_s[1]
    theta = work[(at.QS + 2) * W + i]
    st_ct = sincos(theta)
    st, ct = st_ct[0], st_ct[1]
    vx2 = work[(at.VS + 0) * W + i]
    vy2 = work[(at.VS + 1) * W + i]
    spin = work[(at.VS + 2) * W + i]
    v3 = work[(at.VS + 3) * W + i]
    near = par[at.ROD_NEAR * W + i]
    far = par[at.ROD_FAR * W + i]
    crank = par[at.CRANK_LENGTH * W + i]
    x2 = work[(at.QS + 0) * W + i]
    y2 = work[(at.QS + 1) * W + i]
    fx1, fy1, mb1, mj1, loss1 = joint_force(
        effects,
        work,
        par,
        at.O12,
        (
            crank * cphi - (x2 - near * ct),
            crank * sphi - (y2 - near * st),
            -crank * omega * sphi - (vx2 + near * spin * st),
            crank * omega * cphi - (vy2 - near * spin * ct),
            omega,
            spin,
        ),
        None,
        i,
        W,
    )
    fx2, fy2, mb2, _, loss2 = joint_force(
        effects,
        work,
        par,
        at.O23,
        (
            work[(at.QS + 3) * W + i] - (x2 + far * ct),
            -(y2 + far * st),
            v3 - (vx2 - far * spin * st),
            -(vy2 + far * spin * ct),
            0.0,
            spin,
        ),
        None,
        i,
        W,
    )
    g, load, torque = given(effects, work, par, omega, i, W)
    guide = guide_friction(effects.guide, par, v3, fy2 + par[at.SLIDER_MASS * W + i] * g, i, W)
    crank_load = (
        crank * (sphi * fx1 - cphi * fy1)
        + mj1
        - product(effects.gravity, par[at.CRANK_MOMENT * W + i] * cphi, g)
    )
    inverse_mass = par[at.INV_ROD_MASS * W + i]
    moment = near * (st * fx1 - ct * fy1) + far * (ct * fy2 - st * fx2) + mb1 + mb2
    work[at.ACC * W + i] = (fx1 + fx2) * inverse_mass
    work[(at.ACC + 1) * W + i] = (fy1 + fy2) * inverse_mass - g
    work[(at.ACC + 2) * W + i] = moment * par[at.INV_ROD_INERTIA * W + i]
    work[(at.ACC + 3) * W + i] = (load - fx2 - guide) * par[at.INV_SLIDER_MASS * W + i]
    store_crank(
        effects.torque, work, 4, (torque + crank_load) / par[at.CRANK_INERTIA * W + i], i, W
    )
    store_power(
        effects,
        work,
        (drive_moment_of(effects.torque, torque, -crank_load), omega),
        loss1 + loss2 + guide * v3,
        load * v3,
        work[(at.ACC + 3) * W + i],
        i,
        W,
    )


@apart
@lane_function
def crank_rod_open(effects, work, par, phi, omega, i, W):
    """O12 open, O23 ideal: coordinates rod angle and slider x, coupled by the rod's mass."""
    sphi, cphi, st, ct, spin, x3, v3 = rod_and_slider(work, phi, i, W)
    length = par[at.ROD_LENGTH * W + i]
    far = par[at.ROD_FAR * W + i]
    crank = par[at.CRANK_LENGTH * W + i]
    fx, fy, mb, mj, loss = joint_force(
        effects,
        work,
        par,
        at.O12,
        (
            crank * cphi - (x3 - length * ct),
            crank * sphi + length * st,
            -crank * omega * sphi - (v3 + length * spin * st),
            crank * omega * cphi + length * spin * ct,
            omega,
            spin,
        ),
        None,
        i,
        W,
    )
    g, load, torque = given(effects, work, par, omega, i, W)
    m2 = par[at.ROD_MASS * W + i]
    m3 = par[at.SLIDER_MASS * W + i]
    a11 = par[at.ROD_INERTIA * W + i] + m2 * far * far
    a12 = m2 * far * st
    a22 = m2 + m3
    b1 = length * (st * fx - ct * fy) + mb + product(effects.gravity, m2 * far * ct, g)
    b2 = fx + load - m2 * far * ct * spin * spin
    alpha, a3, friction = sliding_pair(
        effects.guide, par, (a11, a12, a22), (b1, b2), (m2 * far, st, ct, spin),
        (v3, (m2 + m3) * g - fy), i, W,
    )  # fmt: skip
    work[at.ACC * W + i] = alpha
    work[(at.ACC + 1) * W + i] = a3
    crank_load = (
        crank * (sphi * fx - cphi * fy)
        + mj
        - product(effects.gravity, par[at.CRANK_MOMENT * W + i] * cphi, g)
    )
    store_crank(
        effects.torque, work, 2, (torque + crank_load) / par[at.CRANK_INERTIA * W + i], i, W
    )
    store_power(
        effects,
        work,
        (drive_moment_of(effects.torque, torque, -crank_load), omega),
        loss + friction * v3,
        load * v3,
        a3,
        i,
        W,
    )


@apart
@lane_function
def rod_slider_open(effects, work, par, phi, omega, i, W):
    """O12 ideal, O23 open: coordinates rod angle, slider x (and the crank angle, coupled by the rod's mass)."""
    sphi, cphi, st, ct, spin, x3, v3 = rod_and_slider(work, phi, i, W)
    length = par[at.ROD_LENGTH * W + i]
    near = par[at.ROD_NEAR * W + i]
    crank = par[at.CRANK_LENGTH * W + i]
    fx, fy, mb, _, loss = joint_force(
        effects,
        work,
        par,
        at.O23,
        (
            x3 - (crank * cphi + length * ct),
            -(crank * sphi + length * st),
            v3 + crank * omega * sphi + length * spin * st,
            -(crank * omega * cphi + length * spin * ct),
            0.0,
            spin,
        ),
        None,
        i,
        W,
    )
    g, load, torque = given(effects, work, par, omega, i, W)
    guide = guide_friction(effects.guide, par, v3, fy + par[at.SLIDER_MASS * W + i] * g, i, W)
    m2 = par[at.ROD_MASS * W + i]
    a11 = par[at.ROD_INERTIA * W + i] + m2 * near * near
    coupling = m2 * near * crank
    cos_d = cphi * ct + sphi * st
    sin_d = sphi * ct - cphi * st  # sin(phi - theta)
    b1 = (
        length * (ct * fy - st * fx)
        + mb
        - product(effects.gravity, m2 * near * ct, g)
        + coupling * omega * omega * sin_d
    )
    # moment about the crank's bearing from everything but the drive and the angular accelerations
    b3 = (
        crank * (cphi * fy - sphi * fx)
        - product(effects.gravity, (par[at.CRANK_MOMENT * W + i] + m2 * crank) * cphi, g)
        - coupling * spin * spin * sin_d
    )
    alpha, crank_alpha = crank_pair(
        effects.torque,
        a11,
        coupling * cos_d,
        par[at.CRANK_INERTIA * W + i] + m2 * crank * crank,
        b1,
        b3 + torque,
    )
    work[at.ACC * W + i] = alpha
    work[(at.ACC + 1) * W + i] = (load - fx - guide) * par[at.INV_SLIDER_MASS * W + i]
    store_crank(effects.torque, work, 2, crank_alpha, i, W)
    store_power(
        effects,
        work,
        (drive_moment_of(effects.torque, torque, coupling * cos_d * alpha - b3), omega),
        loss + guide * v3,
        load * v3,
        work[(at.ACC + 1) * W + i],
        i,
        W,
    )


@lane_function
def crank_pair(torque, a11, a13, a33, b1, b3):
    """Angular accelerations of rod and crank (the latter 0 at prescribed speed)."""
    if torque is not None:
        inverse = 1.0 / (a11 * a33 - a13 * a13)
        return (b1 * a33 - a13 * b3) * inverse, (a11 * b3 - a13 * b1) * inverse
    else:
        return b1 / a11, 0.0


@lane_function
def lane_motion(effects, crank_rod, rod_slider, work, par, i, W):
    """Accelerations and rates of lane i, by open joints."""
    if effects.torque is not None:
        last = 4 if crank_rod is not None and rod_slider is not None else 2
        phi, omega = work[(at.QS + last) * W + i], work[(at.VS + last) * W + i]
    else:
        omega = par[at.SPEED * W + i]
        phi = omega * work[at.STAGE_TIME * W + i]
    if crank_rod is not None:
        if rod_slider is not None:
            two_open(effects, work, par, phi, omega, i, W)
        else:
            crank_rod_open(effects, work, par, phi, omega, i, W)
    else:
        rod_slider_open(effects, work, par, phi, omega, i, W)


@lane_function
def all_by_hand(effects, work, par, W):
    """`lane_motion` of each of W lanes."""
    for i in range(W):
        lane_motion(effects, effects.crank_rod, effects.rod_slider, work, par, i, W)
