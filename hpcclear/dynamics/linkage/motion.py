"""The laws that motions call, one lane at a time.

A motion reads the stage's coordinates and velocities of lane ``i``, adds up the forces that are on, and writes
accelerations and gaps, forces and powers to their rows of `work`. Its text is generated (`generator`).

Conventions: e = journal centre - bearing centre; the contact point lies half-way through the overlap, so the pair of contact
forces exerts no net couple; angles counter-clockwise; gravity towards -y.
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
from hpcclear.dynamics.physics.friction import share_of

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
def swept(spin, arm):
    """Speed at the end of an arm, 0 of what never turns (None)."""
    return product(spin, spin, arm)


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
    whole = pressed(effects.films[joint.place], normal, nx, ny, oil[0], oil[1])
    work[(at.RATE_NOW + joint.force) * W + i] = whole
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
