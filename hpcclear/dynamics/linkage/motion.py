"""The laws that motions call, one lane at a time, and the one motion in minimal coordinates that is written by hand.

A motion reads the stage's coordinates and velocities of lane ``i``, adds up the forces that are on, and writes
accelerations and gaps, forces and powers to their rows of `work`. With a joint open its text is generated (`generator`).

Conventions: crank pin and slider pin are the journals, the rod carries both bearings; e = journal centre -
bearing centre; the contact point lies half-way through the overlap, so the pair of contact forces exerts no
net couple; angles counter-clockwise; gravity towards -y.

With both joints ideal a torque drive leaves one coordinate, the crank angle.
"""

import math

from hpcclear.base.bits import no_less
from hpcclear.base.jit import apart, lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.friction import ratio_of, sides_of
from hpcclear.dynamics.linkage.lubrication import film_of, pressed
from hpcclear.dynamics.linkage.roundness import (
    less,
    store_angles,
    tilted,
    waves_here,
)
from hpcclear.dynamics.physics.angles import sincos
from hpcclear.dynamics.physics.friction import saturated, share_of

_TINY = 1e-300  # keeps the normal of a centred journal defined (and zero)


@lane_function
def table_value(table, first, cells, angle):
    """Value of a periodic table at an angle in rad: cubic cells on a uniform grid, 4 coefficients a cell, from `first` on."""
    turns = angle * (0.5 / math.pi)
    x = (turns - math.floor(turns)) * cells
    cell = min(int(x), cells - 1)
    s = x - cell
    k = first + 4 * cell
    return table[k] + s * (table[k + 1] + s * (table[k + 2] + s * table[k + 3]))


@lane_function
def product(flag, a, b):
    """a b, or 0 with the effect off: a product with 0 is not dropped by the compiler, since b may be infinite."""
    if flag is not None:
        return a * b
    else:
        return 0.0


@lane_function
def either_product(flag, other, a, b):
    """`product` for an effect with two forms: constant and tabulated loads."""
    if flag is not None:
        return a * b
    else:
        return product(other, a, b)


@lane_function
def swept(spin, arm):
    """Speed at the end of an arm, 0 of what never turns (None)."""
    return product(spin, spin, arm)


@lane_function
def gravity_of(gravity, par, i, W):
    """Gravity, m/s^2 against y."""
    if gravity is not None:
        return par[at.GRAVITY * W + i]
    else:
        return 0.0


@lane_function
def load_of(load, load_table, par, looked_up, i, W):
    """Force on the slider along +x in N; `looked_up`: what its table says, where it has one."""
    if load is not None:
        return par[at.LOAD * W + i]
    elif load_table is not None:
        return par[at.LOAD * W + i] * looked_up
    else:
        return 0.0


@lane_function
def torque_of(torque_table, torque_falls, work, par, omega, i, W):
    """Drive torque on the crank in N m."""
    torque = par[at.TORQUE * W + i]
    if torque_table is not None:
        torque = torque * work[at.TORQUE_VALUE * W + i]
    if torque_falls is not None:
        torque = torque * (1.0 - par[at.TORQUE_FALL * W + i] * omega)
    return torque


@lane_function
def guide_ratio(guide, par, speed, i, W):
    """Guide friction over guide reaction, signed like the slider's speed."""
    if guide is not None:
        ramp = saturated(speed * par[at.GUIDE_INVERSE_RAMP * W + i])
        return par[at.GUIDE_COEFFICIENT * W + i] * ramp
    else:
        return 0.0


@lane_function
def guide_friction(guide, par, speed, reaction, i, W):
    """Friction of the guide on the slider, against +x, in N, for a reaction that does not depend on it."""
    if guide is not None:
        return guide_ratio(guide, par, speed, i, W) * abs(reaction)
    else:
        return 0.0


@apart
@lane_function
def joint_force(effects, work, par, joint, relative, turns, i, W):
    """Contact, friction and film in one open joint.

    `relative`: the journal's position and velocity relative to the bearing's centre (ex, ey, vx, vy), and the angular
    velocities of journal and bearing, None of what never turns; `turns`: cosines and sines of the angles of bearing and
    journal, for surfaces that are out of round. Gap (|e| - c of round ones), normal force (with a film: the size of both
    forces) and gap rate go to their rows.
    Returns the force on the bearing (the journal gets the opposite), the moments of friction force, waves and film on
    bearing and journal about their own centres, and the dissipated power.
    """
    ex, ey, vx, vy, spin_journal, spin_bearing = relative
    moving = ex, ey, vx, vy, swept(spin_journal, 1.0), swept(spin_bearing, 1.0)
    block = joint.block
    active = work[joint.active * W + i]
    inverse_impact = work[joint.inverse_impact * W + i]
    square = ex * ex + ey * ey + _TINY
    distance = math.sqrt(square)
    inverse = 1.0 / distance
    nx = ex * inverse
    ny = ey * inverse
    round_gap = distance - par[(block + at.CLEARANCE) * W + i]
    here = waves_here(effects.waves, effects, par, joint, moving, (nx, ny, inverse), turns, i, W)
    gap = less(effects.waves, round_gap, here.bearing + here.journal)
    rate = less(effects.waves, vx * nx + vy * ny, here.widening)
    depth = no_less(gap, 0.0)
    law, row = effects.contact, block + at.CONTACT_NUMBERS
    normal = law.force(par, row, depth, rate, inverse_impact, active, i, W)
    normal = switched(effects.latched, normal, active)
    radius = less(effects.waves, par[(block + at.BEARING_RADIUS) * W + i], -here.bearing)
    arm_bearing = radius + 0.5 * depth
    radius = less(effects.waves, par[(block + at.JOURNAL_RADIUS) * W + i], here.journal)
    arm_journal = radius - 0.5 * depth
    across = vy * nx - vx * ny
    sliding = across + swept(spin_journal, arm_journal) - swept(spin_bearing, arm_bearing)
    rubs = effects.friction
    ratio = ratio_of(effects, work, par, joint, sliding, normal, i, W)
    tangential = product(rubs, normal, ratio)
    fx = normal * nx - product(rubs, tangential, ny)
    fy = normal * ny + product(rubs, tangential, nx)
    moment_bearing = product(rubs, tangential, arm_bearing)
    moment_journal = product(rubs, tangential, arm_journal)
    side = tilted(effects.waves, here, (nx, ny, inverse), normal)
    elastic = law.elastic(par, row, depth, rate, inverse_impact, active, i, W)
    elastic = switched(effects.latched, elastic, active)
    loss = (normal - elastic) * rate + product(rubs, tangential, sliding)
    oil = film_of(effects, par, joint, moving, (nx, ny, gap), i, W)
    work[(at.RATE_NOW + joint.gap) * W + i] = gap
    work[(at.RATE_NOW + joint.force) * W + i] = pressed(
        effects.film, normal, nx, ny, oil[0], oil[1]
    )
    work[(at.RATE_NOW + joint.rate) * W + i] = rate
    store_rate(effects.series, work, joint.friction, tangential, i, W)
    store_rate(effects.objective, work, joint.friction, tangential, i, W)
    store_rate(effects.objective, work, joint.sliding_speed, sliding, i, W)
    store_rate(effects.objective, work, joint.normal_x, nx, i, W)
    store_rate(effects.objective, work, joint.normal_y, ny, i, W)
    store_kinks(effects, work, par, joint, (depth, rate, inverse_impact, active), sliding, i, W)
    wearing = force_that_wears(effects.threshold, par, joint, normal, i, W)
    store_rate(effects.wear, work, joint.sliding_power, wearing * abs(sliding), i, W)
    store_angles(effects, work, joint, here, i, W)
    return (
        fx + oil[0] + side[0],
        fy + oil[1] + side[1],
        moment_bearing + oil[2] + side[2],
        oil[3] - moment_journal + side[3],
        loss + oil[4],
    )


@lane_function
def store_kinks(effects, work, par, joint, contact, sliding, i, W):
    """Write down the functions that change their signs where the laws' forces have kinks, for the implicit method."""
    if effects.sliding is not None:
        depth, rate, inverse_impact, active = contact
        row = joint.block + at.CONTACT_NUMBERS
        cut = effects.contact.kink(par, row, depth, rate, inverse_impact, active, i, W)
        work[(at.RATE_NOW + joint.force_kink) * W + i] = cut
        row = joint.block + at.FRICTION_NUMBERS
        low, high = sides_of(effects.friction, par, row, sliding, i, W)
        work[(at.RATE_NOW + joint.low_kink) * W + i] = low
        work[(at.RATE_NOW + joint.high_kink) * W + i] = high


@lane_function
def force_that_wears(threshold, par, joint, normal, i, W):
    """The normal force, or 0 where its pressure is below a threshold, with a ramp between."""
    if threshold is not None:
        row = at.THRESHOLDS + 2 * joint.place
        share = par[row * W + i] * normal + par[(row + 1) * W + i]
        return normal * share_of(share)
    else:
        return normal


@lane_function
def store_rate(flag, work, row, value, i, W):
    """Write down a rate that an effect asks for."""
    if flag is not None:
        work[(at.RATE_NOW + row) * W + i] = value


@lane_function
def switched(latched, force, active):
    """A latched contact is on or off for a whole step, so that a step ends exactly at an impact."""
    if latched is not None:
        return force * active
    else:
        return force


@lane_function
def store_power(effects, work, drive, loss, load_power, acceleration, i, W):
    """What the drive (its moment, the crank's speed), the contacts and the load do, and the slider's acceleration."""
    moment, speed = drive
    power = moment * speed
    store_rate(effects.series, work, at.DRIVE_MOMENT, moment, i, W)
    store_rate(effects.ledger, work, at.DRIVE_POWER, power, i, W)
    store_rate(effects.ledger, work, at.ABS_DRIVE_POWER, abs(power), i, W)
    store_rate(effects.ledger, work, at.DISSIPATION, loss, i, W)
    store_rate(effects.ledger, work, at.LOAD_POWER, load_power, i, W)
    store_rate(effects.responses, work, at.DRIVE_MOMENT, moment, i, W)
    store_rate(effects.responses, work, at.FOLLOWED_ACCELERATION, acceleration, i, W)
    store_rate(effects.responses, work, at.FOLLOWED_SQUARE, acceleration * acceleration, i, W)


@lane_function
def drive_moment_of(torque, given, reaction):
    """Moment of the drive: given with a torque drive, the reaction at prescribed speed."""
    if torque is not None:
        return given
    else:
        return reaction


@lane_function
def sliding_pair(guide, par, matrix, right, rod, slider, i, W):
    """Solve for rod angle and slider x with guide friction on an ideal slider pin.

    `matrix`: a11, a12, a22; `right`: its right-hand sides; `rod`: mass times the arm to the pin, sine and cosine of its
    angle, angular velocity; `slider`: its speed, and the guide's reaction but for the rod's vertical acceleration.

    The guide's reaction N = weight + m2 y2'' depends on the acceleration, and friction opposes the sliding
    whatever the sign of N: solve for N > 0, and for N < 0 where that sign does not hold.
    Returns angular acceleration, slider acceleration, friction force against +x.
    """
    a11, a12, a22 = matrix
    b1, b2 = right
    if guide is not None:
        moment, st, ct, spin = rod
        v3, weight = slider
        ratio = guide_ratio(guide, par, v3, i, W)
        y2_rest = moment * st * spin * spin  # the part of m2 y2'' without the angular acceleration
        rest = weight + y2_rest
        # N = rest - moment ct alpha; x row: a12 alpha + a22 a3 = b2 - ratio |N|
        c21 = a12 - ratio * moment * ct
        determinant = a11 * a22 - a12 * c21
        alpha = (b1 * a22 - a12 * (b2 - ratio * rest)) / determinant
        flip = 1.0 if rest - moment * ct * alpha >= 0.0 else -1.0
        ratio = ratio * flip
        c21 = a12 - ratio * moment * ct
        determinant = a11 * a22 - a12 * c21
        alpha = (b1 * a22 - a12 * (b2 - ratio * rest)) / determinant
        a3 = (a11 * (b2 - ratio * rest) - c21 * b1) / determinant
        return alpha, a3, ratio * (rest - moment * ct * alpha)
    else:
        inverse = 1.0 / (a11 * a22 - a12 * a12)
        return (b1 * a22 - a12 * b2) * inverse, (a11 * b2 - a12 * b1) * inverse, 0.0


@lane_function
def both_ideal(effects, work, par, phi, omega, i, W):
    """Both joints ideal under a torque: one coordinate, the crank angle."""
    s_c = sincos(phi)
    sphi, cphi = s_c[0], s_c[1]
    crank = par[at.CRANK_LENGTH * W + i]
    length = par[at.ROD_LENGTH * W + i]
    far = par[at.ROD_FAR * W + i]
    m2 = par[at.ROD_MASS * W + i]
    m3 = par[at.SLIDER_MASS * W + i]
    st = -crank * sphi / length
    ct = math.sqrt(1.0 - st * st)
    # kinematic coefficients: first and second derivatives with respect to the crank angle
    k = -crank * cphi / (length * ct)
    dk = (crank * sphi + length * st * k * k) / (length * ct)
    x3 = -crank * sphi - length * st * k
    dx3 = -crank * cphi - length * (ct * k * k + st * dk)
    x2 = x3 + far * st * k
    dx2 = dx3 + far * (ct * k * k + st * dk)
    y2 = -far * ct * k
    dy2 = far * (st * k * k - ct * dk)
    g = gravity_of(effects.gravity, par, i, W)
    load = load_of(effects.load, effects.load_table, par, work[at.LOAD_VALUE * W + i], i, W)
    torque = torque_of(effects.torque_table, effects.torque_falls, work, par, omega, i, W)
    v3 = x3 * omega
    inertia = (
        par[at.CRANK_INERTIA * W + i]
        + m2 * (x2 * x2 + y2 * y2)
        + par[at.ROD_INERTIA * W + i] * k * k
        + m3 * x3 * x3
    )
    change = m2 * (x2 * dx2 + y2 * dy2) + par[at.ROD_INERTIA * W + i] * k * dk + m3 * x3 * dx3
    force = (
        torque
        + either_product(effects.load, effects.load_table, load, x3)
        - product(effects.gravity, par[at.CRANK_MOMENT * W + i] * cphi + m2 * y2, g)
        - change * omega * omega
    )
    w2 = omega * omega
    slope = st / ct
    # guide reaction n0 + n1 alpha - slope f
    n1 = reaction_slope(par, (st, ct), (k, x2, y2, x3), i, W)
    n0 = reaction_slope(par, (st, ct), (dk * w2, dx2 * w2, dy2 * w2 + g, dx3 * w2), i, W)
    n0 = n0 + load * slope + m3 * g
    alpha, friction = guided_crank(
        effects.guide, par, (inertia, force), (n0, n1, slope), (v3, x3), i, W
    )
    work[at.ACC * W + i] = alpha
    store_power(
        effects, work, (torque, omega), friction * v3, load * v3, x3 * alpha + dx3 * w2, i, W
    )


@lane_function
def reaction_slope(par, direction, accelerations, i, W):
    """Force Ry that a rod between ideal pins takes from the slider for given accelerations, without load and friction.

    Moments about the rod's first pin: I2 alpha2 + m2 near (ct ay2 - st ax2) = length (ct Ry - st Rx), and the
    slider's balance Rx = load - f - m3 ax3. Gravity counts as part of ay2. `direction`: st, ct of the rod;
    `accelerations`: alpha2, ax2, ay2, ax3.
    """
    st, ct = direction
    alpha2, ax2, ay2, ax3 = accelerations
    length = par[at.ROD_LENGTH * W + i]
    m2_near = par[at.ROD_MASS * W + i] * par[at.ROD_NEAR * W + i]
    moment = par[at.ROD_INERTIA * W + i] * alpha2 + m2_near * (ct * ay2 - st * ax2)
    return (moment - length * st * par[at.SLIDER_MASS * W + i] * ax3) / (length * ct)


@lane_function
def guided_crank(guide, par, balance, reaction, slider, i, W):
    """Crank acceleration with guide friction f = ratio |N|, whose reaction N = n0 + n1 alpha - slope f depends on it.

    Solve for N > 0, and for N < 0 where that sign does not hold. `balance`: inertia, force; `reaction`: n0, n1, slope;
    `slider`: its speed, and that over the crank's. Returns acceleration and f.
    """
    inertia, force = balance
    n0, n1, slope = reaction
    v3, x3 = slider
    if guide is not None:
        ratio = guide_ratio(guide, par, v3, i, W)
        scaled = ratio / (1.0 + slope * ratio)  # f = scaled (n0 + n1 alpha)
        alpha = (force - scaled * n0 * x3) / (inertia + scaled * n1 * x3)
        ratio = ratio if n0 + n1 * alpha >= 0.0 else -ratio
        scaled = ratio / (1.0 + slope * ratio)
        alpha = (force - scaled * n0 * x3) / (inertia + scaled * n1 * x3)
        return alpha, scaled * (n0 + n1 * alpha)
    else:
        return force / inertia, 0.0
