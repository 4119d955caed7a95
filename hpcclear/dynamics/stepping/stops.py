"""Where a step must end, in scalar code for few lanes: at impacts, at kinks of a force, with a free crank's turn."""

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.base.outcome import Status
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.stepping.events import absolute_integral, impact_fraction, root
from hpcclear.dynamics.stepping.settings import ANGLE_TOLERANCE, CYCLE, GAP_TOLERANCE, IMPACT_FLOOR

OK = int(Status.OK)
STALLED = int(Status.STALLED)

KINK_REACH = 1e-3
"""Part of a step that a kink of the force may stand from either end: its effect falls with the 2.5th power."""


@lane_event
def meet_impact(flag, lane, W, work, settings, joint):
    """Where in this step a joint in flight strikes, as a fraction; 2 if it does not or if it strikes at the end.

    At the end of the step, or at its start, the contact is latched here.
    """
    if flag is None:
        return 2.0
    if work[joint.active * W + lane] == 1.0:
        return 2.0
    h = work[at.STEP * W + lane]
    tolerance = settings[GAP_TOLERANCE]
    d0 = work[(at.RATE_OLD + joint.gap) * W + lane]
    d1 = work[(at.RATE_NOW + joint.gap) * W + lane]
    m0 = h * work[(at.RATE_OLD + joint.rate) * W + lane]
    m1 = h * work[(at.RATE_NOW + joint.rate) * W + lane]
    if abs(d1) <= tolerance and m1 > 0.0:
        return 1.0
    fraction = impact_fraction(d0, m0, d1, m1, 0.5 * tolerance)
    if 1.0 - 1e-7 < fraction < 1.0 and m1 > 0.0:
        return 1.0  # as good as the end of the step, which may be stretched by round-off to end a revolution
    if fraction == 0.0:
        latch_at_start(lane, W, work, settings, joint)
    return fraction


@lane_event
def latch_at_start(lane, W, work, settings, joint):
    """Start a contact at the start of this step, which is tried again."""
    speed = max(work[(at.RATE_OLD + joint.rate) * W + lane], settings[IMPACT_FLOOR])
    work[joint.active * W + lane] = 1.0
    work[joint.inverse_impact * W + lane] = 1.0 / speed
    work[at.FRESH * W + lane] = 1.0


@lane_event
def latch(lane, W, work, settings, joint):
    """Start a contact at the end of this step: its approach speed is kept until the contact ends."""
    speed = max(work[(at.RATE_NOW + joint.rate) * W + lane], settings[IMPACT_FLOOR])
    work[joint.active * W + lane] = 1.0
    work[joint.inverse_impact * W + lane] = 1.0 / speed
    # within the tolerance of zero: a hair below it would end the contact at once
    work[(at.RATE_NOW + joint.gap) * W + lane] = max(
        work[(at.RATE_NOW + joint.gap) * W + lane], 0.0
    )


@lane_event
@unrolled
def stop_at_impacts(effects, lane, W, work, settings):
    """Shorten the step to the first impact inside it, or latch the contacts that begin at its end."""
    first = 2.0
    fraction: dict = {}
    for joint in written_out(at.JOINTS):
        flag = getattr(effects.open, joint.flag)
        fraction[joint] = meet_impact(flag, lane, W, work, settings, joint)
        first = min(first, fraction[joint])
    if first < 1.0:
        cut(lane, W, work, first)
    elif first == 1.0:
        for joint in written_out(at.JOINTS):
            latch_if(
                getattr(effects.open, joint.flag), fraction[joint], lane, W, work, settings, joint
            )


@lane_event
def latch_if(flag, fraction, lane, W, work, settings, joint):
    """Start the contact of an open joint whose fraction is 1, the end of the step."""
    if flag is not None and fraction == 1.0:
        latch(lane, W, work, settings, joint)


@lane_event
def cut(lane, W, work, fraction):
    """Reject the step and ask for a part of it; all of it where an impact stands at its start."""
    h = work[at.STEP * W + lane]
    work[at.ACCEPT * W + lane] = 0.0
    work[at.NEXT_STEP * W + lane] = fraction * h if fraction > 0.0 else h


@lane_event
def before_kink(flag, lane, W, work, settings, joint):
    """Fraction of this step at which a gap changes sign; 2 if it does not, or so near an end that it does no harm."""
    if flag is None:
        return 2.0
    d0 = work[(at.RATE_OLD + joint.gap) * W + lane]
    d1 = work[(at.RATE_NOW + joint.gap) * W + lane]
    if d0 * d1 >= 0.0 or min(abs(d0), abs(d1)) <= settings[GAP_TOLERANCE]:
        return 2.0
    h = work[at.STEP * W + lane]
    m0 = h * work[(at.RATE_OLD + joint.rate) * W + lane]
    m1 = h * work[(at.RATE_NOW + joint.rate) * W + lane]
    fraction = root(d0, m0, d1, m1, 1.0)
    return fraction if KINK_REACH < fraction < 1.0 - KINK_REACH else 2.0


@lane_event
@unrolled
def stop_at_kinks(effects, lane, W, work, settings):
    """Shorten an explicit step to the first instant at which a contact begins or ends.

    The force is K d^1.5 on one side and 0 on the other: across this kink the pair has neither its order nor an
    error estimate that can be trusted.
    """
    if work[at.STIFF * W + lane] == 0.0:
        fraction = 2.0
        for joint in written_out(at.JOINTS):
            flag = getattr(effects.open, joint.flag)
            fraction = min(fraction, before_kink(flag, lane, W, work, settings, joint))
        if fraction < 1.0:
            work[at.ACCEPT * W + lane] = 0.0
            work[at.NEXT_STEP * W + lane] = fraction * work[at.STEP * W + lane]


@lane_event
def integrate_gap(flag, lane, W, work, joint):
    """Integral of |gap| over a step in which the gap changes sign."""
    if flag is not None:
        h = work[at.STEP * W + lane]
        d0 = work[(at.RATE_OLD + joint.gap) * W + lane]
        d1 = work[(at.RATE_NOW + joint.gap) * W + lane]
        if d0 * d1 < 0.0:
            m0 = h * work[(at.RATE_OLD + joint.rate) * W + lane]
            m1 = h * work[(at.RATE_NOW + joint.rate) * W + lane]
            mean = work[(at.RATE_SUM + joint.gap) * W + lane]
            work[(at.RATE_SUM + joint.gap) * W + lane] = absolute_integral(mean, d0, m0, d1, m1)


@lane_event
def stop_free_crank(lane, W, work, settings, last):
    """End a step where a free crank has made its turn. Returns OK or STALLED."""
    if work[(at.VS + last) * W + lane] <= 0.0:
        return STALLED
    beyond = work[(at.QS + last) * W + lane] - settings[CYCLE]
    tolerance = settings[ANGLE_TOLERANCE]
    work[at.ENDING * W + lane] = 1.0 if abs(beyond) <= tolerance else 0.0
    if beyond > tolerance:
        h = work[at.STEP * W + lane]
        before = work[(at.Q + last) * W + lane] - settings[CYCLE]
        fraction = impact_fraction(
            before,
            h * work[(at.V + last) * W + lane],
            beyond,
            h * work[(at.VS + last) * W + lane],
            0.0,
        )
        work[at.ACCEPT * W + lane] = 0.0
        work[at.NEXT_STEP * W + lane] = fraction * h
    return OK


@lane_event
def turn_of_free_crank(free, lane, W, work, settings, last):
    """End the step where a crank that is a coordinate ends its revolution; the status if it never will."""
    if free:
        return stop_free_crank(lane, W, work, settings, last)
    else:
        return OK


@lane_event
def impacts(effects, lane, W, work, settings):
    """End the step at the first impact inside it, under laws that need the impact speed."""
    if effects.rules.latched:
        stop_at_impacts(effects, lane, W, work, settings)


@lane_event
def wrap_crank(turning, lane, W, work, last, settings):
    """Count a crank angle that is a coordinate anew each turn, so that it keeps its precision."""
    if turning:
        work[(at.Q + last) * W + lane] -= settings[CYCLE]
