"""Where a step must end, in scalar code for few lanes: at impacts, at kinks of a force, with a free crank's turn.

Within a step a gap is the cubic through its values and rates at both ends.
"""

import math

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.stepping.control import FIRST_PART, SHRINK

OK = int(Status.OK)
STALLED = int(Status.STALLED)

LONG_AT_REST = 1e3  # periods after which a body that starts from rest and does not turn has stalled

KINK_REACH = 1e-3
"""Part of a step that a gap's zero may stand from either end: a kink of the force there does no harm, as its effect falls with
the 2.5th power, and what the gap does between the two is straight."""


@lane_event
def gap_in_step(lane, W, work, p):
    """Joint p's gap at both ends of a lane's step, and its rates there times the step: d0, m0, d1, m1, of a cubic."""
    h = work[at.STEP * W + lane]
    gap, rate = (at.GAP + p) * W + lane, (at.GAP_RATE + p) * W + lane
    old, now = at.RATE_OLD * W, at.RATE_NOW * W
    return work[old + gap], h * work[old + rate], work[now + gap], h * work[now + rate]


@lane_event
def hermite(d0, m0, d1, m1, s):
    """Cubic on [0, 1] with values d0, d1 and slopes m0, m1 at its ends, at s."""
    return d0 + s * (m0 + s * ((3.0 * (d1 - d0) - 2.0 * m0 - m1) + s * (2.0 * (d0 - d1) + m0 + m1)))


@lane_event
def hermite_integral(d0, m0, d1, m1, s):
    """Integral of that cubic from 0 to s."""
    c2 = 3.0 * (d1 - d0) - 2.0 * m0 - m1
    c3 = 2.0 * (d0 - d1) + m0 + m1
    return s * (d0 + s * (0.5 * m0 + s * (c2 / 3.0 + s * 0.25 * c3)))


@lane_event
def interior_peak(d0, m0, d1, m1):
    """Where in (0, 1) the cubic, rising at 0 and falling at 1, is largest."""
    a = 3.0 * (2.0 * (d0 - d1) + m0 + m1)
    b = 2.0 * (3.0 * (d1 - d0) - 2.0 * m0 - m1)
    discriminant = math.sqrt(max(b * b - 4.0 * a * m0, 0.0))
    # the root of a s^2 + b s + m0 at which the slope changes from + to -
    return min(max(2.0 * m0 / (discriminant - b), 0.0), 1.0) if discriminant > b else 0.5


@lane_event
def root(d0, m0, d1, m1, end):
    """Where the cubic changes sign between 0 and `end`: Halley's iteration from the chord on, kept inside a shrinking bracket.

    With derivatives f1, f2 and f3 a change e leaves an error of some ((f2/2f1)**2 + |f3/6f1|) e**3, which shows whether
    another would matter.
    """
    low, high = 0.0, end
    c2 = 3.0 * (d1 - d0) - 2.0 * m0 - m1
    c3 = 2.0 * (d0 - d1) + m0 + m1
    after = hermite(d0, m0, d1, m1, end)
    rising = after > d0
    s = end * (d0 / (d0 - after))
    if not (low < s < high):
        s = 0.5 * end
    for _ in range(60):
        value = d0 + s * (m0 + s * (c2 + s * c3))
        if (value > 0.0) == rising:
            high = s
        else:
            low = s
        inverse = 1.0 / (m0 + s * (2.0 * c2 + s * 3.0 * c3))
        bend = (c2 + 3.0 * s * c3) * inverse
        step = value * inverse
        change = step / (1.0 - step * bend)
        new = s - change
        if low <= new <= high and abs(step * bend) < 0.5:  # beyond, it would settle on an extremum
            # of the change, if it is small
            left = change * change * (bend * bend + abs(c3 * inverse))
            if left <= 1e-6 and left * abs(change) <= 1e-16 * end:
                return new
        else:
            new = 0.5 * (low + high)
            if high - low <= 1e-14 * end:
                return new
        s = new
    return s


@lane_event
def impact_fraction(d0, m0, d1, m1, target):
    """Fraction of the step at which a gap in flight first reaches `target`; 2 if it does not, 0 if it starts there."""
    d0 -= target
    d1 -= target
    if d0 >= 0.0:
        return 0.0 if d1 > 0.0 else 2.0
    if d1 > 0.0:
        return root(d0, m0, d1, m1, 1.0)
    if m0 > 0.0 and m1 < 0.0:
        peak = interior_peak(d0, m0, d1, m1)
        if hermite(d0, m0, d1, m1, peak) > 0.0:
            return root(d0, m0, d1, m1, peak)
    return 2.0


@lane_event
def zero_at_start(d0, m0):
    """Whether the gap becomes 0 within `KINK_REACH` of the start of the step."""
    return d0 * d0 <= -KINK_REACH * m0 * d0


@lane_event
def zero_at_end(d1, m1):
    """Whether it became 0 within `KINK_REACH` of the end."""
    return d1 * d1 <= KINK_REACH * m1 * d1


@lane_event
def absolute_integral(integral, d0, m0, d1, m1):
    """Integral of |d| over a step in which d changes sign once, from the integral of d.

    The shorter side comes from the cubic, or a triangle, the rest from the method's own quadrature, so that the kink of |d|
    does not cost its order.
    """
    if zero_at_end(d1, m1):
        part = 0.5 * d1 * d1 / m1
    elif zero_at_start(d0, m0):
        part = -0.5 * d0 * d0 / m0
    else:
        part = hermite_integral(d0, m0, d1, m1, root(d0, m0, d1, m1, 1.0))
    return abs(part) + abs(integral - part)


@lane_event
def meet_impact(lane, W, work, settings, p):
    """Where in this step joint p, in flight, strikes, as a fraction; 2 if it does not or is in contact, 1 if at the end.

    At the start of the step the contact is `latched` here.
    """
    if work[(at.ACTIVE + p) * W + lane] == 1.0:
        return 2.0
    tolerance = settings[RunSettings.gap_tolerance]
    d0, m0, d1, m1 = gap_in_step(lane, W, work, p)
    if abs(d1) <= tolerance and m1 > 0.0:
        return 1.0
    fraction = impact_fraction(d0, m0, d1, m1, 0.5 * tolerance)
    if 1.0 - 1e-7 < fraction < 1.0 and m1 > 0.0:
        return 1.0  # as good as the end of the step, which may be stretched by round-off to end a revolution
    if fraction == 0.0:  # the step is tried again
        latch(lane, W, work, settings, p, at.RATE_OLD)
        work[at.FRESH * W + lane] = 1.0
    return fraction


@lane_event
def latch(lane, W, work, settings, p, rates):
    """Start joint p's contact where its rates stand in the rows from `rates` on: its approach speed is kept until it ends."""
    speed = work[(rates + at.GAP_RATE + p) * W + lane]
    work[(at.ACTIVE + p) * W + lane] = 1.0
    work[(at.INVERSE_IMPACT + p) * W + lane] = 1.0 / max(speed, settings[RunSettings.impact_floor])


@lane_event
def stop_at_impacts(rules, lane, W, work, settings):
    """Shorten the step to the first impact inside it, or latch the contacts that begin at its end."""
    first = 2.0
    for p in range(rules.begin, rules.end):
        first = min(first, meet_impact(lane, W, work, settings, p))
    if first < 1.0:
        cut(lane, W, work, first)
    elif first == 1.0:
        for p in range(rules.begin, rules.end):
            # none is at the start, where asking would latch it
            if meet_impact(lane, W, work, settings, p) == 1.0:
                latch(lane, W, work, settings, p, at.RATE_NOW)
                # within the tolerance of zero: a value just below would end the contact at once
                gap = (at.RATE_NOW + at.GAP + p) * W + lane
                work[gap] = max(work[gap], 0.0)


@lane_event
def cut(lane, W, work, fraction):
    """Reject the step and request a part of it; all of it where an impact stands at its start."""
    h = work[at.STEP * W + lane]
    work[at.ACCEPT * W + lane] = 0.0
    work[at.NEXT_STEP * W + lane] = fraction * h if fraction > 0.0 else h


@lane_event
def before_kink(lane, W, work, settings, p):
    """Fraction of this step at which joint p's gap changes sign; 2 if it does not, or so near an end that it does no harm."""
    d0, m0, d1, m1 = gap_in_step(lane, W, work, p)
    if d0 * d1 >= 0.0 or min(abs(d0), abs(d1)) <= settings[RunSettings.gap_tolerance]:
        return 2.0
    if zero_at_start(d0, m0) or zero_at_end(d1, m1):
        return 2.0
    fraction = root(d0, m0, d1, m1, 1.0)
    return fraction if KINK_REACH < fraction < 1.0 - KINK_REACH else 2.0


@lane_event
def too_far_in(lane, W, work, p):
    """Whether this step took joint p from its contact's beginning beyond the deepest point.

    It comes out of flight, where errors are tiny and steps grow tenfold, and estimates its error by one velocity's: as a
    function of the step that has zeros beyond the range where it means anything. One impact in a million was passed like that,
    with an error a thousand times what was allowed.
    """
    d0, m0, d1, m1 = gap_in_step(lane, W, work, p)
    return m0 > 0.0 and m1 < 0.0 and d1 > 0.0 and FIRST_PART * d1 > d0


@lane_event
def stop_at_kinks(rules, lane, W, work, settings):
    """Shorten an explicit step to the first instant at which a contact begins or ends, or where it went too far into one.

    The force is K d^1.5 on one side and 0 on the other: across this kink the pair has neither its order nor an
    error estimate that can be trusted.
    """
    if work[at.STIFF * W + lane] == 0.0:
        fraction = 2.0
        for p in range(rules.begin, rules.end):
            fraction = min(fraction, before_kink(lane, W, work, settings, p))
            if too_far_in(lane, W, work, p):
                fraction = min(fraction, SHRINK)
        if fraction < 1.0:
            cut(lane, W, work, fraction)


@lane_event
def integrate_gap(lane, W, work, p):
    """Integral of joint p's |gap| over a step in which the gap changes sign."""
    d0, m0, d1, m1 = gap_in_step(lane, W, work, p)
    if d0 * d1 < 0.0:
        mean = work[(at.RATE_SUM + at.GAP + p) * W + lane]
        work[(at.RATE_SUM + at.GAP + p) * W + lane] = absolute_integral(mean, d0, m0, d1, m1)


@lane_event
def stop_free_crank(lane, W, block, settings, last):
    """End a step where a free crank has made its turn, counted from its start. Returns OK or STALLED.

    One that starts from rest may be thrown back by the first impacts, so there it stalls only away from its start, or
    after `LONG_AT_REST` periods.
    """
    work = block.work
    end = block.par[at.TURN_END * W + lane]
    if work[(at.VS + last) * W + lane] <= 0.0:
        starting = block.book[at.REVOLUTION * W + lane] == 0.0
        starting &= work[at.TIME * W + lane] < LONG_AT_REST * block.par[at.PERIOD * W + lane]
        margin = settings[RunSettings.at_rest] if starting else 0.0
        if abs(work[(at.QS + last) * W + lane] - (end - settings[RunSettings.cycle])) >= margin:
            return STALLED
    beyond = work[(at.QS + last) * W + lane] - end
    tolerance = settings[RunSettings.angle_tolerance]
    work[at.ENDING * W + lane] = 1.0 if abs(beyond) <= tolerance else 0.0
    if beyond > tolerance:
        h = work[at.STEP * W + lane]
        before = work[(at.Q + last) * W + lane] - end
        m0, m1 = h * work[(at.V + last) * W + lane], h * work[(at.VS + last) * W + lane]
        fraction = impact_fraction(before, m0, beyond, m1, 0.0)
        cut(lane, W, work, fraction)
    return OK
