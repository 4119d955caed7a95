"""A lane's life, in scalar code for few lanes at a time: take a sample, stop at impacts, end revolutions, finish."""

import math

from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.stepping.events import absolute_integral, impact_fraction, root

OK = int(Status.OK)
STEP_CAP = int(Status.STEP_CAP)
STEP_TOO_SMALL = int(Status.STEP_TOO_SMALL)
NOT_FINITE = int(Status.NOT_FINITE)
STALLED = int(Status.STALLED)
AVERAGE_CAP = int(Status.AVERAGE_CAP)
UNFINISHED = -1

KINK_REACH = 1e-3
"""Part of a step that a kink of the force may stand from either end: its effect falls with the 2.5th power."""

# ---- settings shared by all lanes
(
    RTOL,
    GAP_TOLERANCE,  # m: an impact is located this well
    ANGLE_TOLERANCE,  # rad, likewise for the end of a revolution of a free crank
    IMPACT_FLOOR,  # m/s, least latched impact speed
    TRANSIENT,  # revolutions
    AVERAGED,  # revolutions; at least so many if OBJECTIVE_TOLERANCE > 0
    AVERAGED_CAP,  # and at most so many
    OBJECTIVE_TOLERANCE,  # relative standard error of the objective to reach; 0: a fixed number
    MAX_STEPS,
    SMALLEST_STEP,  # relative to the time
    EXPONENT,
    BETA,
    IMPLICIT,  # 0 never, 1 where the motion is stiff, 2 always
    ATOL,  # first of 2 * MAX_COORDINATES
) = range(14)
SETTINGS = ATOL + 2 * at.MAX_COORDINATES

# ---- counters shared by all lanes
(NEXT_SLOT, SLOTS, FINISHED, RECORDED) = range(4)
COUNTERS = 4

STATE = (
    2 * at.MAX_COORDINATES + 4
)  # of a queued sample: coordinates, velocities, active flags, 1/d'_0


@lane_event
def load(lane, W, n, work, par, book, queue_par, queue_state, counters, settings):
    """Give a lane the next sample of the queue, or let it rest."""
    slot = counters[NEXT_SLOT]
    for k in range(at.TIME, at.WORK):
        work[k * W + lane] = 0.0
    for k in range(at.RATE_OLD, at.TIME):
        work[k * W + lane] = 0.0
    for k in range(at.BOOK):
        book[k * W + lane] = 0.0
    if slot >= counters[SLOTS]:
        return  # the step stays 0: a resting lane repeats its last state
    counters[NEXT_SLOT] = slot + 1
    for k in range(at.PARAMETERS):
        par[k * W + lane] = queue_par[slot, k]
    for k in range(n):
        work[(at.Q + k) * W + lane] = queue_state[slot, k]
        work[(at.V + k) * W + lane] = queue_state[slot, at.MAX_COORDINATES + k]
    last = 2 * at.MAX_COORDINATES
    work[at.ACTIVE_12 * W + lane] = queue_state[slot, last]
    work[at.ACTIVE_23 * W + lane] = queue_state[slot, last + 1]
    work[at.INVERSE_IMPACT_12 * W + lane] = queue_state[slot, last + 2]
    work[at.INVERSE_IMPACT_23 * W + lane] = queue_state[slot, last + 3]
    work[at.NEXT_STEP * W + lane] = par[at.FIRST_STEP * W + lane]
    work[at.FRESH * W + lane] = 1.0
    work[at.RUNNING * W + lane] = 1.0
    work[at.AVERAGING * W + lane] = 1.0 if settings[TRANSIENT] == 0.0 else 0.0
    book[at.SAMPLE * W + lane] = slot


@lane_event
def finish(lane, W, n, status, work, book, out, finished, counters):
    """Write down a sample that ended, whatever its status, and free the lane."""
    slot = int(book[at.SAMPLE * W + lane])
    time = book[at.TIME_SUM * W + lane]
    gap_12 = book[at.GAP_SUM_12 * W + lane] / time if time > 0.0 else math.nan
    gap_23 = book[at.GAP_SUM_23 * W + lane] / time if time > 0.0 else math.nan
    count = book[at.COUNT_F * W + lane]
    out[slot, at.OUT_STATUS] = status
    out[slot, at.OUT_OBJECTIVE] = math.sqrt(gap_12 * gap_12 + gap_23 * gap_23)
    spread = math.sqrt(book[at.M2_F * W + lane] / (count - 1.0)) if count > 1.0 else math.nan
    out[slot, at.OUT_SPREAD] = spread
    out[slot, at.OUT_GAP_12] = gap_12
    out[slot, at.OUT_GAP_23] = gap_23
    out[slot, at.OUT_PEAK_12] = work[at.PEAK_12 * W + lane]
    out[slot, at.OUT_PEAK_23] = work[at.PEAK_23 * W + lane]
    out[slot, at.OUT_LATCHED_12] = book[at.LATCHED_12 * W + lane]
    out[slot, at.OUT_LATCHED_23] = book[at.LATCHED_23 * W + lane]
    out[slot, at.OUT_DEEPEST_12] = work[at.DEEPEST_12 * W + lane]
    out[slot, at.OUT_DEEPEST_23] = work[at.DEEPEST_23 * W + lane]
    out[slot, at.OUT_EVALUATIONS] = work[at.EVALUATIONS * W + lane]
    out[slot, at.OUT_REVOLUTIONS] = book[at.REVOLUTION * W + lane]
    out[slot, at.OUT_DRIVE_WORK] = book[at.DRIVE_WORK * W + lane]
    out[slot, at.OUT_ABS_DRIVE_WORK] = book[at.ABS_DRIVE_WORK * W + lane]
    out[slot, at.OUT_DISSIPATED] = book[at.DISSIPATED * W + lane]
    out[slot, at.OUT_LOAD_WORK] = book[at.LOAD_WORK * W + lane]
    out[slot, at.OUT_TIME] = book[at.ELAPSED * W + lane]
    out[slot, at.OUT_ACTIVE_12] = work[at.ACTIVE_12 * W + lane]
    out[slot, at.OUT_ACTIVE_23] = work[at.ACTIVE_23 * W + lane]
    out[slot, at.OUT_INVERSE_IMPACT_12] = work[at.INVERSE_IMPACT_12 * W + lane]
    out[slot, at.OUT_INVERSE_IMPACT_23] = work[at.INVERSE_IMPACT_23 * W + lane]
    out[slot, at.OUT_ATTEMPTS] = work[at.ATTEMPTS * W + lane]
    out[slot, at.OUT_STIFF_STEPS] = work[at.STIFF_STEPS * W + lane]
    finish_responses(lane, W, time, work, book, out, slot)
    for k in range(n):
        out[slot, at.OUT_STATE + k] = work[(at.Q + k) * W + lane]
        out[slot, at.OUT_STATE + at.MAX_COORDINATES + k] = work[(at.V + k) * W + lane]
    finished[counters[FINISHED]] = slot
    counters[FINISHED] += 1
    work[at.RUNNING * W + lane] = 0.0


@lane_event
def finish_responses(lane, W, time, work, book, out, slot):
    """Means, peak and deviation over the averaged revolutions; they mean nothing unless `Effects.responses` is on."""
    if time > 0.0:
        out[slot, at.OUT_FORCE_12] = book[at.FORCE_SUM_12 * W + lane] / time
        out[slot, at.OUT_FORCE_23] = book[at.FORCE_SUM_23 * W + lane] / time
        out[slot, at.OUT_MOMENT] = work[at.PEAK_MOMENT * W + lane]
        mean = book[at.ACCELERATION_SUM * W + lane] / time
        square = book[at.SQUARE_SUM * W + lane] / time
        out[slot, at.OUT_ACCELERATION] = math.sqrt(max(square - mean * mean, 0.0))


@lane_event
def failure(lane, W, n, work, stages, settings):
    """Why a lane cannot go on: a status, or OK if it can."""
    if work[at.ATTEMPTS * W + lane] >= settings[MAX_STEPS]:
        return STEP_CAP
    h = work[at.STEP * W + lane]
    shortest = settings[SMALLEST_STEP] * (h + work[at.TIME * W + lane])
    if work[at.ACCEPT * W + lane] == 0.0 and h <= shortest:
        for k in range(n):
            state = work[(at.Q + k) * W + lane] + work[(at.V + k) * W + lane]
            if not math.isfinite(state + stages[k * W + lane]):
                return NOT_FINITE
        return STEP_TOO_SMALL
    return OK


@lane_event
def meet_impact(lane, W, work, settings, gap, active, inverse):
    """Where in this step a joint in flight strikes, as a fraction; 2 if it does not or if it strikes at the end.

    At the end of the step, or at its start, the contact is latched here.
    """
    h = work[at.STEP * W + lane]
    if work[active * W + lane] == 1.0:
        return 2.0
    tolerance = settings[GAP_TOLERANCE]
    d0 = work[(at.RATE_OLD + gap) * W + lane]
    d1 = work[(at.RATE_NOW + gap) * W + lane]
    m0 = h * work[(at.RATE_OLD + gap + 2) * W + lane]
    m1 = h * work[(at.RATE_NOW + gap + 2) * W + lane]
    if abs(d1) <= tolerance and m1 > 0.0:
        return 1.0
    fraction = impact_fraction(d0, m0, d1, m1, 0.5 * tolerance)
    if 1.0 - 1e-7 < fraction < 1.0 and m1 > 0.0:
        return 1.0  # as good as the end of the step, which may be stretched by round-off to end a revolution
    if fraction == 0.0:
        latch_at_start(lane, W, work, settings, gap, active, inverse)
    return fraction


@lane_event
def latch_at_start(lane, W, work, settings, gap, active, inverse):
    """Start a contact at the start of this step, which is tried again."""
    speed = max(work[(at.RATE_OLD + gap + 2) * W + lane], settings[IMPACT_FLOOR])
    work[active * W + lane] = 1.0
    work[inverse * W + lane] = 1.0 / speed
    work[at.FRESH * W + lane] = 1.0


@lane_event
def latch(lane, W, work, settings, gap, active, inverse):
    """Start a contact at the end of this step: its approach speed is kept until the contact ends."""
    speed = max(work[(at.RATE_NOW + gap + 2) * W + lane], settings[IMPACT_FLOOR])
    work[active * W + lane] = 1.0
    work[inverse * W + lane] = 1.0 / speed
    # within the tolerance of zero: a hair below it would end the contact at once
    work[(at.RATE_NOW + gap) * W + lane] = max(work[(at.RATE_NOW + gap) * W + lane], 0.0)


@lane_event
def stop_at_impacts(lane, W, work, settings):
    """Shorten the step to the first impact inside it, or latch the contacts that begin at its end."""
    first = meet_impact(lane, W, work, settings, at.GAP_12, at.ACTIVE_12, at.INVERSE_IMPACT_12)
    second = meet_impact(lane, W, work, settings, at.GAP_23, at.ACTIVE_23, at.INVERSE_IMPACT_23)
    cut_or_latch(lane, W, work, settings, first, second)


@lane_event
def cut_or_latch(lane, W, work, settings, first, second):
    """Cut the step to the smaller of two fractions below 1, or start the contacts whose fraction is 1, its end.

    Returns whether it did either.
    """
    fraction = min(first, second)
    if fraction < 1.0:
        h = work[at.STEP * W + lane]
        work[at.ACCEPT * W + lane] = 0.0
        work[at.NEXT_STEP * W + lane] = fraction * h if fraction > 0.0 else h
        return True
    if first == 1.0:
        latch(lane, W, work, settings, at.GAP_12, at.ACTIVE_12, at.INVERSE_IMPACT_12)
    if second == 1.0:
        latch(lane, W, work, settings, at.GAP_23, at.ACTIVE_23, at.INVERSE_IMPACT_23)
    return fraction == 1.0


@lane_event
def before_kink(lane, W, work, settings, gap):
    """Fraction of this step at which a gap changes sign; 2 if it does not, or so near an end that it does no harm."""
    d0 = work[(at.RATE_OLD + gap) * W + lane]
    d1 = work[(at.RATE_NOW + gap) * W + lane]
    if d0 * d1 >= 0.0 or min(abs(d0), abs(d1)) <= settings[GAP_TOLERANCE]:
        return 2.0
    h = work[at.STEP * W + lane]
    m0 = h * work[(at.RATE_OLD + gap + 2) * W + lane]
    m1 = h * work[(at.RATE_NOW + gap + 2) * W + lane]
    fraction = root(d0, m0, d1, m1, 1.0)
    return fraction if KINK_REACH < fraction < 1.0 - KINK_REACH else 2.0


@lane_event
def stop_at_kinks(lane, W, work, settings):
    """Shorten an explicit step to the first instant at which a contact begins or ends.

    The force is K d^1.5 on one side and 0 on the other: across this kink the pair has neither its order nor an
    error estimate that can be trusted.
    """
    if work[at.STIFF * W + lane] == 0.0:
        fraction = min(
            before_kink(lane, W, work, settings, at.GAP_12),
            before_kink(lane, W, work, settings, at.GAP_23),
        )
        if fraction < 1.0:
            work[at.ACCEPT * W + lane] = 0.0
            work[at.NEXT_STEP * W + lane] = fraction * work[at.STEP * W + lane]


@lane_event
def integrate_gap(lane, W, work, gap):
    """Integral of |gap| over a step in which the gap changes sign."""
    h = work[at.STEP * W + lane]
    d0 = work[(at.RATE_OLD + gap) * W + lane]
    d1 = work[(at.RATE_NOW + gap) * W + lane]
    if d0 * d1 < 0.0:
        m0 = h * work[(at.RATE_OLD + gap + 2) * W + lane]
        m1 = h * work[(at.RATE_NOW + gap + 2) * W + lane]
        mean = work[(at.RATE_SUM + gap) * W + lane]
        work[(at.RATE_SUM + gap) * W + lane] = absolute_integral(mean, d0, m0, d1, m1)


@lane_event
def end_turn_of_free_crank(lane, W, work, settings, last):
    """Stop a free crank at a full turn. Returns OK or STALLED."""
    if work[(at.VS + last) * W + lane] <= 0.0:
        return STALLED
    beyond = work[(at.QS + last) * W + lane] - at.TURN
    tolerance = settings[ANGLE_TOLERANCE]
    work[at.ENDING * W + lane] = 1.0 if abs(beyond) <= tolerance else 0.0
    if beyond > tolerance:
        h = work[at.STEP * W + lane]
        before = work[(at.Q + last) * W + lane] - at.TURN
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
def standard_error(count, m2, lag):
    """Standard error of the mean of a revolution's objective, whose neighbours are correlated.

    First-order autocorrelation: s/sqrt(n) times sqrt((1 + rho)/(1 - rho)); a negative rho is not trusted to help.
    """
    if count < 3.0 or m2 <= 0.0:
        return 0.0 if count >= 3.0 else math.inf
    rho = min(max(lag / m2, 0.0), 0.99)
    return math.sqrt(m2 / (count - 1.0) / count * (1.0 + rho) / (1.0 - rho))


@lane_event
def verdict(lane, W, book, settings):
    """Whether the average may end: a status, or UNFINISHED."""
    averaged = book[at.COUNT_F * W + lane]
    if averaged < settings[AVERAGED]:
        return UNFINISHED
    if settings[OBJECTIVE_TOLERANCE] == 0.0:
        return OK
    # sum of (f_k - mean)(f_{k+1} - mean) from products about the first f
    mean = book[at.MEAN_F * W + lane]
    shift = mean - book[at.FIRST_F * W + lane]
    total = averaged * shift
    last = book[at.LAST_F * W + lane] - book[at.FIRST_F * W + lane]
    lag = (
        book[at.LAG_F * W + lane] - shift * (2.0 * total - last) + (averaged - 1.0) * shift * shift
    )
    error = standard_error(averaged, book[at.M2_F * W + lane], lag)
    if error <= settings[OBJECTIVE_TOLERANCE] * mean:
        return OK
    return AVERAGE_CAP if averaged >= settings[AVERAGED_CAP] else UNFINISHED


@lane_event
def end_revolution(lane, W, work, book, settings):
    """Close the books of a revolution; the status of the sample when it was the last one, else UNFINISHED."""
    time = work[at.TIME * W + lane]
    book[at.ELAPSED * W + lane] += time
    revolution = book[at.REVOLUTION * W + lane] + 1.0
    book[at.REVOLUTION * W + lane] = revolution
    if work[at.AVERAGING * W + lane] == 1.0:
        gap_12 = work[(at.INTEGRAL + at.GAP_12) * W + lane]
        gap_23 = work[(at.INTEGRAL + at.GAP_23) * W + lane]
        book[at.GAP_SUM_12 * W + lane] += gap_12
        book[at.GAP_SUM_23 * W + lane] += gap_23
        book[at.TIME_SUM * W + lane] += time
        book[at.FORCE_SUM_12 * W + lane] += work[(at.INTEGRAL + at.FORCE_12) * W + lane]
        book[at.FORCE_SUM_23 * W + lane] += work[(at.INTEGRAL + at.FORCE_23) * W + lane]
        change = work[(at.INTEGRAL + at.SLIDER_ACCELERATION) * W + lane]
        book[at.ACCELERATION_SUM * W + lane] += change
        book[at.SQUARE_SUM * W + lane] += work[(at.INTEGRAL + at.SLIDER_SQUARE) * W + lane]
        f = math.sqrt(gap_12 * gap_12 + gap_23 * gap_23) / time
        count = book[at.COUNT_F * W + lane] + 1.0
        if count == 1.0:
            book[at.FIRST_F * W + lane] = f
        first = book[at.FIRST_F * W + lane]
        book[at.LAG_F * W + lane] += (
            (f - first) * (book[at.LAST_F * W + lane] - first) * (count > 1.0)
        )
        book[at.LAST_F * W + lane] = f
        step = f - book[at.MEAN_F * W + lane]
        mean = book[at.MEAN_F * W + lane] + step / count
        book[at.M2_F * W + lane] += step * (f - mean)
        book[at.MEAN_F * W + lane] = mean
        book[at.COUNT_F * W + lane] = count
        if work[at.ACTIVE_12 * W + lane] == 1.0 and work[at.ENDED_12 * W + lane] == 0.0:
            book[at.LATCHED_12 * W + lane] = 1.0
        if work[at.ACTIVE_23 * W + lane] == 1.0 and work[at.ENDED_23 * W + lane] == 0.0:
            book[at.LATCHED_23 * W + lane] = 1.0
    book[at.DRIVE_WORK * W + lane] += work[(at.INTEGRAL + at.DRIVE_POWER) * W + lane]
    book[at.ABS_DRIVE_WORK * W + lane] += work[(at.INTEGRAL + at.ABS_DRIVE_POWER) * W + lane]
    book[at.DISSIPATED * W + lane] += work[(at.INTEGRAL + at.DISSIPATION) * W + lane]
    book[at.LOAD_WORK * W + lane] += work[(at.INTEGRAL + at.LOAD_POWER) * W + lane]
    for r in range(at.RATES):
        work[(at.INTEGRAL + r) * W + lane] = 0.0
    work[at.TIME * W + lane] = 0.0
    work[at.ENDED_12 * W + lane] = 0.0
    work[at.ENDED_23 * W + lane] = 0.0
    work[at.ENDING * W + lane] = 0.0
    work[at.AVERAGING * W + lane] = 1.0 if revolution >= settings[TRANSIENT] else 0.0
    return verdict(lane, W, book, settings)
