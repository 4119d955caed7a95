"""A journal in a round bearing larger than itself: circle in circle, with an oil film and surfaces out of round.

Conventions: e = journal centre - bearing centre; the contact point lies half-way through the overlap, so the pair of contact
forces exerts no net couple; angles counter-clockwise; gravity towards -y.
"""

import math

from hpcclear.base.bits import no_less
from hpcclear.base.jit import apart, lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts import forces
from hpcclear.dynamics.contacts.roundness import less, store_angles, tilted, waves_here
from hpcclear.laws import laws
from hpcclear.laws.reynolds import film_thickness

_TINY = 1e-300  # keeps the normal of a centred journal defined (and zero)
FORCES = {name: law.force for name, law in laws("film").items()}


@lane_function
def film_of(effects, par, joint, relative, contact, i, W):
    """Force of the film on the bearing, its moments on bearing and journal about their own centres, and its losses; 0 without.

    `relative` as `joint_force` takes it; `contact`: the direction from the bearing's to the journal's centre, and the
    gap |e| - c.

    The film is as thick as the journal's place says until that comes near the `at.FILM_FLOOR`; where surfaces touch it stays
    that thin, and goes on damping. Its losses F.w of the squeezed film and of shear are never negative: the moments are
    those that make the power of all that it does to both bodies just that.
    """
    film = effects.film_at[joint.place]
    if film is not None:
        block = joint.block
        ex, ey, vx, vy, spin_journal, spin_bearing = relative
        nx, ny, gap = contact
        floor = par[(block + at.FILM_FLOOR) * W + i]
        thickness = film_thickness(gap, par[(block + at.CLEARANCE) * W + i], floor)
        eccentricity = 1.0 - thickness
        s2 = thickness * (1.0 + eccentricity)
        mean = 0.5 * (spin_journal + spin_bearing)
        w = (vx + mean * ey, vy - mean * ex)
        place = (eccentricity * nx, eccentricity * ny)
        scale = par[(block + at.FILM_SCALE) * W + i]
        fx, fy = FORCES[film](par, joint.further, scale, place, w, s2, i, W)  # on the journal
        turning = spin_journal - spin_bearing
        # one reciprocal, as the film's: of quotients by the same number the compiler makes products in lanes, and not alone
        shear = par[(block + at.FILM_SHEAR) * W + i] * math.sqrt(s2) * (1.0 / s2) * turning
        half = 0.5 * (ex * fy - ey * fx)
        return -fx, -fy, shear - half, -shear - half, shear * turning - fx * w[0] - fy * w[1]
    return 0.0, 0.0, 0.0, 0.0, 0.0


@lane_function
def pressed(film, normal, nx, ny, fx, fy):
    """What counts as a joint's force, N: the contact's normal force, with a film the size of both together."""
    if film is not None:
        x = normal * nx + fx
        y = normal * ny + fy
        return math.sqrt(x * x + y * y)
    return normal


@apart
@lane_function
def joint_force(effects, work, par, joint, relative, turns, i, W):
    """Contact, friction and film in one open joint.

    `relative`: the journal's position and velocity relative to the bearing's centre (ex, ey, vx, vy), and the angular
    velocities of journal and bearing, None for what never turns; `turns`: cosines and sines of the angles of bearing and
    journal, for surfaces that are out of round. Gap (|e| - c of round ones), normal force (with a film: the size of both
    forces) and gap rate go to their rows.
    Returns the force on the bearing (the journal gets the opposite), the moments of friction force, waves and film on
    bearing and journal about their own centres, and the dissipated power.
    """
    ex, ey, vx, vy, spin_journal, spin_bearing = relative
    moving = ex, ey, vx, vy, forces.swept(spin_journal, 1.0), forces.swept(spin_bearing, 1.0)
    block = joint.block
    square = ex * ex + ey * ey + _TINY
    distance = math.sqrt(square)
    inverse = 1.0 / distance
    nx = ex * inverse
    ny = ey * inverse
    round_gap = distance - par[(block + at.CLEARANCE) * W + i]
    here = waves_here(effects, par, joint, moving, (nx, ny, inverse), turns, i, W)
    gap = less(effects.waves, round_gap, here.bearing + here.journal)
    rate = less(effects.waves, vx * nx + vy * ny, here.widening)
    depth = no_less(gap, 0.0)
    normal = forces.normal_force(effects, work, par, joint, depth, rate, i, W)
    radius = less(effects.waves, par[(block + at.BEARING_RADIUS) * W + i], -here.bearing)
    arm_bearing = radius + 0.5 * depth
    radius = less(effects.waves, par[(block + at.JOURNAL_RADIUS) * W + i], here.journal)
    arm_journal = radius - 0.5 * depth
    across = vy * nx - vx * ny
    ahead = across + forces.swept(spin_journal, arm_journal)
    sliding = ahead - forces.swept(spin_bearing, arm_bearing)
    rubs = effects.friction
    tangential = forces.tangential_force(effects, work, par, joint, sliding, normal, i, W)
    fx = normal * nx - forces.product(rubs, tangential, ny)
    fy = normal * ny + forces.product(rubs, tangential, nx)
    moment_bearing = forces.product(rubs, tangential, arm_bearing)
    moment_journal = forces.product(rubs, tangential, arm_journal)
    side = tilted(effects.waves, here, (nx, ny, inverse), normal)
    touch, pushes = (depth, rate, sliding), (normal, tangential)
    loss = forces.lost(effects, work, par, joint, touch, pushes, i, W)
    oil = film_of(effects, par, joint, moving, (nx, ny, gap), i, W)
    work[(at.RATE_NOW + joint.gap) * W + i] = gap
    whole = pressed(effects.film_at[joint.place], normal, nx, ny, oil[0], oil[1])
    work[(at.RATE_NOW + joint.force) * W + i] = whole
    forces.store_contact(effects, work, par, joint, (touch, pushes, (nx, ny)), i, W)
    store_angles(effects, work, joint, here, i, W)
    return (
        fx + oil[0] + side[0],
        fy + oil[1] + side[1],
        moment_bearing + oil[2] + side[2],
        oil[3] - moment_journal + side[3],
        loss + oil[4],
    )
