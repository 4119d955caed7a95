"""What an oil film does in one open joint of a lane: its force, its moments and its losses, from the joint's parameters."""

import math

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.physics.film import (
    along_and_across,
    film_thickness,
    finite_scales,
    long_force,
    short_force,
    short_impedance,
)


@lane_function
def polynomial(par, row, y, i, W):
    """Of degree 14, from coefficients in the rows from `row` on."""
    p = par[(row + 14) * W + i]
    p = p * y + par[(row + 13) * W + i]
    p = p * y + par[(row + 12) * W + i]
    p = p * y + par[(row + 11) * W + i]
    p = p * y + par[(row + 10) * W + i]
    p = p * y + par[(row + 9) * W + i]
    p = p * y + par[(row + 8) * W + i]
    p = p * y + par[(row + 7) * W + i]
    p = p * y + par[(row + 6) * W + i]
    p = p * y + par[(row + 5) * W + i]
    p = p * y + par[(row + 4) * W + i]
    p = p * y + par[(row + 3) * W + i]
    p = p * y + par[(row + 2) * W + i]
    p = p * y + par[(row + 1) * W + i]
    p = p * y + par[(row + 0) * W + i]
    return p


@lane_function
def corrected(par, row, s2, x, y, i, W):
    """Force of a finite film over that of a short one, by 6 times 15 coefficients from `row` on (`dynamics.bearing`)."""
    p = polynomial(par, row + 75, y, i, W)
    p = p * x + polynomial(par, row + 60, y, i, W)
    p = p * x + polynomial(par, row + 45, y, i, W)
    p = p * x + polynomial(par, row + 30, y, i, W)
    p = p * x + polynomial(par, row + 15, y, i, W)
    p = p * x + polynomial(par, row, y, i, W)
    return s2 / p


@lane_function
def finite_force(flag, par, joint, eccentricity, w, s2, i, W):
    """Force on the journal, N, of a film in a bearing of finite length; arguments as of `short_force`, 0 with it off."""
    if flag is not None:
        wx, wy = w
        a, b = along_and_across(eccentricity, w)
        along, across = short_impedance(a, b, s2)
        x, y = finite_scales(a, s2)
        along = along * corrected(par, joint.finite, s2, x, y, i, W)
        across = across * corrected(par, joint.finite + 90, s2, x, y, i, W)
        scale = par[(joint.block + at.FILM_FINITE) * W + i]
        return -scale * (along * wx - across * wy), -scale * (along * wy + across * wx)
    else:
        return 0.0, 0.0


@lane_function
def film_of(effects, par, joint, relative, contact, i, W):
    """Force of the film on the bearing, its moments on bearing and journal about their own centres, and its losses; 0 without.

    `relative` as `motion.joint_force` takes it; `contact`: the direction from the bearing's to the journal's centre, and the
    gap |e| - c.

    The film is as thick as the journal's place says until that comes near the `at.FILM_FLOOR`; where surfaces touch it stays
    that thin, and goes on damping. Its losses F.w of the squeezed film and of shear are never negative: the moments are
    those that make the power of all that it does to both bodies just that.
    """
    film, short, long, finite = (
        effects.film,
        effects.short_film,
        effects.long_film,
        effects.finite_film,
    )
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
        sx, sy = short_force(short, par[(block + at.FILM_SHORT) * W + i], place, w, s2)
        lx, ly = long_force(long, par[(block + at.FILM_LONG) * W + i], place, w, s2)
        ux, uy = finite_force(finite, par, joint, place, w, s2, i, W)
        fx, fy = sx + lx + ux, sy + ly + uy  # on the journal
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
