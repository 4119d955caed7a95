"""What an oil film does in one open joint of a lane: its force, its moments and its losses, from the joint's parameters."""

import math

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.laws import laws
from hpcclear.laws.reynolds import film_thickness

FORCES = {name: law.force for name, law in laws("film").items()}


@lane_function
def film_of(effects, par, joint, relative, contact, i, W):
    """Force of the film on the bearing, its moments on bearing and journal about their own centres, and its losses; 0 without.

    `relative` as `motion.joint_force` takes it; `contact`: the direction from the bearing's to the journal's centre, and the
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
    else:
        return 0.0, 0.0, 0.0, 0.0, 0.0


@lane_function
def pressed(film, normal, nx, ny, fx, fy):
    """What counts as a joint's force, N: the contact's normal force, with a film the size of both together."""
    if film is not None:
        x = normal * nx + fx
        y = normal * ny + fy
        return math.sqrt(x * x + y * y)
    else:
        return normal
