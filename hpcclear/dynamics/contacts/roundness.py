"""Surfaces of joints that are out of round: how much wider the clearance is where they touch, and where sliding work is done.

By its angle in its own body a surface lies h(angle) deeper than when it was round, a sum of a few waves; slopes are its
derivatives. The gap of an eccentricity e at the direction a is |e| - c - h_B(a - b_B) - h_J(a - b_J), b the angles of the
bodies. The contact's force is derived from it as from a potential, so that nothing of the energy is lost: along e as
before, across it by h'/|e| of that, and moments h' on both bodies. That is the tilt of the contact, too: the gap is smallest
not along e but by h'/|e| aside, to first order in h/c.
"""

from typing import NamedTuple

from hpcclear.base.jit import lane_function
from hpcclear.base.unrolled import written_out
from hpcclear.dynamics import layout as at

HIGHER = range(1, at.WAVE_ROWS // 2)


class Here(NamedTuple):
    """What waves come to where journal and bearing touch."""

    bearing: float  # depth, m
    journal: float
    slope: float  # of the bearing's depth, m/rad
    rise: float  # of the journal's
    widening: float  # rate of both depths there, m/s
    own: tuple[float, float]  # cosine and sine of the contact's angle in the bearing
    other: tuple[float, float]  # in the journal


@lane_function
def less(flag, a, b):
    """a - b, or a with the effect off."""
    return a - b if flag is not None else a


@lane_function
def counted(waves):
    """How many waves a surface has."""
    return waves if waves is not None else 0


@lane_function
def depth_and_slope(count, par, row, cosine, sine, i, W):
    """Sum of `count` waves at an angle, m, and its derivative, m/rad; 0 of a round surface.

    From `row` on of each wave the factors of its cosine and sine, then those of the derivative's. By
    cos (n+1) x = 2 cos x cos n x - cos (n-1) x, and likewise of sines.
    """
    if count is not None:
        c, c_before = cosine, 1.0
        s, s_before = sine, 0.0
        twice = cosine + cosine
        depth = par[row * W + i] * c + par[(row + 1) * W + i] * s
        slope = par[(row + 2) * W + i] * c + par[(row + 3) * W + i] * s
        for n in written_out(HIGHER):
            if n < count:
                c, c_before = twice * c - c_before, c
                s, s_before = twice * s - s_before, s
                wave = row + 4 * n
                depth += par[wave * W + i] * c + par[(wave + 1) * W + i] * s
                slope += par[(wave + 2) * W + i] * c + par[(wave + 3) * W + i] * s
        return depth, slope
    return 0.0, 0.0


@lane_function
def waves_here(effects, par, joint, relative, normal, turns, i, W):
    """What waves come to where journal and bearing touch; `normal`: its direction, and 1/|e|; 0 of round ones."""
    if effects.waves is not None:
        _, _, vx, vy, spin_journal, spin_bearing = relative
        nx, ny, inverse = normal
        cb, sb, cj, sj = turns
        own = (nx * cb + ny * sb, ny * cb - nx * sb)
        other = (nx * cj + ny * sj, ny * cj - nx * sj)
        bearing, journal = counted(effects.bearing_waves), counted(effects.journal_waves)
        first = at.WAVES + 4 * (bearing + journal) * joint.place
        deep, slope = depth_and_slope(effects.bearing_waves, par, first, own[0], own[1], i, W)
        first = first + 4 * bearing
        shallow, rise = depth_and_slope(effects.journal_waves, par, first, other[0], other[1], i, W)
        turning = (vy * nx - vx * ny) * inverse
        widening = slope * (turning - spin_bearing) + rise * (turning - spin_journal)
        return Here(deep, shallow, slope, rise, widening, own, other)
    return Here(0.0, 0.0, 0.0, 0.0, 0.0, (0.0, 0.0), (0.0, 0.0))


@lane_function
def tilted(flag, here, normal, force):
    """What a normal force does beside pushing along the eccentricity: force on the bearing, moments on bearing and journal."""
    if flag is not None:
        nx, ny, inverse = normal
        across = force * (here.slope + here.rise) * inverse
        return across * ny, -across * nx, -force * here.slope, -force * here.rise
    return 0.0, 0.0, 0.0, 0.0


@lane_function
def store_angle(flag, work, row, angle, i, W):
    """Write down cosine and sine of the contact's angle in a surface that has waves."""
    if flag is not None:
        work[row * W + i] = angle[0]
        work[(row + 1) * W + i] = angle[1]


@lane_function
def store_angles(effects, work, joint, here, i, W):
    """Write down where surfaces touch, for profiles of wear."""
    if effects.profile is not None:
        row = at.RATE_NOW + at.ANGLES + 4 * joint.place
        store_angle(effects.bearing_waves, work, row, here.own, i, W)
        store_angle(effects.journal_waves, work, row + 2, here.other, i, W)
