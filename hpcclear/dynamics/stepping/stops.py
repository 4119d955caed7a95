"""Where a step must end, in scalar code for few lanes: at impacts, at kinks of a force, with a free crank's turn."""

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.stepping.control import FIRST_PART, SHRINK
from hpcclear.dynamics.stepping.events import (
    KINK_REACH,
    absolute_integral,
    gap_in_step,
    impact_fraction,
    root,
    zero_at_end,
    zero_at_start,
)

OK = int(Status.OK)
STALLED = int(Status.STALLED)

LONG_AT_REST = 1e3
"""Periods after which a body that starts from rest and does not turn has stalled."""


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
    if fraction == 0.0:
        latch_at_start(lane, W, work, settings, p)
    return fraction


@lane_event
def latch_at_start(lane, W, work, settings, p):
    """Start joint p's contact at the start of this step, which is tried again."""
    speed = max(
        work[(at.RATE_OLD + at.GAP_RATE + p) * W + lane], settings[RunSettings.impact_floor]
    )
    work[(at.ACTIVE + p) * W + lane] = 1.0
    work[(at.INVERSE_IMPACT + p) * W + lane] = 1.0 / speed
    work[at.FRESH * W + lane] = 1.0


@lane_event
def latch(lane, W, work, settings, p):
    """Start joint p's contact at the end of this step: its approach speed is kept until the contact ends."""
    speed = max(
        work[(at.RATE_NOW + at.GAP_RATE + p) * W + lane], settings[RunSettings.impact_floor]
    )
    work[(at.ACTIVE + p) * W + lane] = 1.0
    work[(at.INVERSE_IMPACT + p) * W + lane] = 1.0 / speed
    # within the tolerance of zero: a value just below would end the contact at once
    work[(at.RATE_NOW + at.GAP + p) * W + lane] = max(
        work[(at.RATE_NOW + at.GAP + p) * W + lane], 0.0
    )


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
            if (
                meet_impact(lane, W, work, settings, p) == 1.0
            ):  # none at the start: nothing is latched by asking
                latch(lane, W, work, settings, p)


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


@lane_event
def wrap_angles(lane, W, n, work, settings):
    """Count angles that go round with the revolutions anew with each, so that they keep their precision."""
    for k in range(n):
        work[(at.Q + k) * W + lane] -= settings[RunSettings.wraps + k]
