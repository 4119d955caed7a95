"""Where around bearing and journal sliding work is done, summed up at the ends of steps.

A step's sliding work is known to the order of its method. It is booked at one angle, that between the directions of the
contact at both ends, each weighted by the sliding power there: within a step the angle hardly changes, and what is made of it
is off by the square of that change. Taken at every stage, as all else is integrated, it would cost as much as the motion.

It is compiled for the joints and waves there are, and steppers call it by its address after a step.
"""

import math
from functools import cache

from hpcclear.base.bits import carray
from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import DOUBLES
from hpcclear.base.unrolled import written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.stepping.control import keep

_NO_POWER = 1e-30  # W, so that a step with power inside alone has a direction


@lane_function
def work_at(work, p, angle, i, W):
    """Sliding work of joint p in the step, and cosine and sine of the angle that it is booked at; 0 where it was refused."""
    yes = work[at.ACCEPT * W + i] == 1.0
    power = at.SLIDING_POWERS + p
    before = work[(at.RATE_OLD + power) * W + i] + _NO_POWER
    after = work[(at.RATE_NOW + power) * W + i] + _NO_POWER
    old, now = at.RATE_OLD + angle, at.RATE_NOW + angle
    x = before * work[old * W + i] + after * work[now * W + i]
    y = before * work[(old + 1) * W + i] + after * work[(now + 1) * W + i]
    inverse = 1.0 / math.sqrt(x * x + y * y + 1e-300)
    done = work[at.STEP * W + i] * work[(at.RATE_SUM + power) * W + i]
    cosine, sine = x * inverse, y * inverse
    return done if yes else 0.0, cosine if yes else 0.0, sine if yes else 0.0


@lane_function
def add_waves(work, p, angle, first, count, i, W):
    """Add a step's sliding work to `count` waves of a profile, from rate `first` on.

    By cos (n+1) x = 2 cos x cos n x - cos (n-1) x, and likewise of sines.
    """
    done, cosine, sine = work_at(work, p, angle, i, W)
    c: dict = {}
    s: dict = {}
    c[0] = done
    s[0] = 0.0
    c[1] = done * cosine
    s[1] = done * sine
    twice = cosine + cosine
    row = at.INTEGRAL + first
    work[row * W + i] += c[1]
    work[(row + 1) * W + i] += s[1]
    for n in written_out(range(2, count + 1)):
        c[n] = twice * c[n - 1] - c[n - 2]
        s[n] = twice * s[n - 1] - s[n - 2]
        work[(row + 2 * n - 2) * W + i] += c[n]
        work[(row + 2 * n - 1) * W + i] += s[n]


@lane_function
def add_surface(work, p, angle, first, count, W):
    """Integrals of a surface's profile after a step."""
    if count > 0:
        for i in range(W):
            add_waves(work, p, angle, first, count, i, W)
        for i in range(W):  # the angle that the next step starts at
            yes = work[at.ACCEPT * W + i] == 1.0
            for row in (angle, angle + 1):
                keep(work, at.RATE_OLD + row, work[(at.RATE_NOW + row) * W + i], yes, i, W)


@lane_function
def profiles(places, bearing, journal, lanes, tables, W):
    """Integrals of the profiles of the joints at these places, of so many waves, after a step of W lanes."""
    work = carray(lanes, at.BANK * W)
    for p in written_out(places):
        first = at.PROFILES + 2 * (bearing + journal) * p
        add_surface(work, p, at.ANGLES + 4 * p, first, bearing, W)
        add_surface(work, p, at.ANGLES + 4 * p + 2, first + 2 * bearing, journal, W)


@cache
def profile_code(effects: at.Effects, W: int) -> Compiled:
    """The compiled `profiles` of these effects for W lanes; its ``address`` is what steppers take, as that of a motion."""
    places = tuple(at.places_of(effects))
    counts = {"bearing": effects.bearing_waves or 0, "journal": effects.journal_waves or 0}
    return Compiled(profiles, (DOUBLES, DOUBLES), FASTMATH, places=places, W=W, **counts)
