"""Step-size control, acceptance and commit of a step over all lanes, without branches in the lane loop.

Proportional-integral control after Gustafsson 1991 (doi:10.1145/210232.210242) with the exponents of Hairer, Norsett
and Wanner's DOPRI5 (Solving ODEs I, II.4), scaled to the order of the pair available.
"""

import math
from functools import partial

from hpcclear.base.bits import no_less
from hpcclear.base.exponentials import rough_exp2, rough_log2
from hpcclear.base.jit import FASTMATH, apart, lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import RunSettings

SHRINK = 0.2  # what a rejected step shrinks to at most

_LOG_SAFETY = -0.152003  # log2(0.9)
_LOG_SHRINK = math.log2(SHRINK)
_LOG_GROW = 3.321928  # and grows tenfold

FIRST_PART = 0.1  # depth at the start of a step over that at its end below which it is a contact's first step


@apart
@partial(lane_function, fastmath=FASTMATH | {"reassoc"})
def count_up(count, flag):
    """count + flag, a sum of zeros and ones: exact in any order, so the compiler may reorder it."""
    return count + flag


@lane_function
def choose_step(rules, work, par, W):
    """Take the step requested, or what is left to a row of a table, or of the revolution (prescribed speed)."""
    for i in range(W):
        work[at.STEP * W + i] = work[at.NEXT_STEP * W + i]
    if rules.curves > 0:
        shorten_to_rows(rules, work, W)
    if not rules.free:
        for i in range(W):
            h = work[at.STEP * W + i]
            left = par[at.PERIOD * W + i] - work[at.TIME * W + i]
            # Stretched by round-off at most: a step cut to end at an impact must stay cut, or is tried for ever.
            ending = 1.0 if h * (1.0 + 1e-8) >= left else 0.0
            h = left if h * (1.0 + 1e-8) >= left else h
            work[at.ENDING * W + i] = ending
            work[at.STEP * W + i] = h


ROW_REACH = 1e-7  # part of a step that a row of a table may stand from its end: a corner of the load there does no harm
ROUNDED = 1e-15  # of a place, which is a number of lengths before whole ones are taken off


@lane_function
def shorten_to_rows(rules, work, W):
    """End steps at the next row of each table where a step ends, as far off as the rate of its place says."""
    for curve in range(rules.curves):
        c = curve & at.CURVE_MASK
        for i in range(W):
            rate = work[(at.RATE_OLD + at.PLACE_RATES + c) * W + i]
            place = work[(at.RATE_OLD + at.PLACES + c) * W + i]
            ahead, behind = work[(at.NEXT_ROW + c) * W + i], work[(at.LAST_ROW + c) * W + i]
            left = ((ahead if rate > 0.0 else behind) - place) / (rate + 1e-300)
            h, asked = work[at.STEP * W + i], work[at.NEXT_STEP * W + i]
            h = left if (left > 0.0) & (left < h) else h
            work[at.STEP * W + i] = h
            work[at.RESUMED * W + i] = asked if h < asked else 0.0


@lane_function
def row_reach(work, c, i, W):
    """How near the end of a step a row is taken to be there: no nearer than places are rounded."""
    rate = abs(work[(at.RATE_NOW + at.PLACE_RATES + c) * W + i])
    time = work[at.BEGAN * W + i] + work[at.TIME * W + i]
    place = abs(work[(at.RATE_NOW + at.PLACES + c) * W + i])
    return rate * (ROW_REACH * work[at.STEP * W + i] + ROUNDED * time) + ROUNDED * (100.0 + place)


@lane_function
def flag_rows(rules, work, W):
    """Mark accepted lanes whose step ends at or beyond such a row."""
    for curve in range(rules.curves):
        c = curve & at.CURVE_MASK
        for i in range(W):
            place = work[(at.RATE_NOW + at.PLACES + c) * W + i]
            ahead = work[(at.NEXT_ROW + c) * W + i] - place
            behind = place - work[(at.LAST_ROW + c) * W + i]
            on = 1.0 if min(ahead, behind) <= row_reach(work, c, i, W) else 0.0
            flag_accepted(work, on, i, W)


@lane_function
def commit_rows(rules, work, W):
    """Places of tables and their rates after a step."""
    for curve in range(rules.curves):
        c = curve & at.CURVE_MASK
        for i in range(W):
            yes = work[at.ACCEPT * W + i] == 1.0
            place, rate = at.PLACES + c, at.PLACE_RATES + c
            keep(work, at.RATE_OLD + place, work[(at.RATE_NOW + place) * W + i], yes, i, W)
            keep(work, at.RATE_OLD + rate, work[(at.RATE_NOW + rate) * W + i], yes, i, W)


@lane_function
def judge_step(work, settings, W):
    """Accept or reject by the error, propose the next step; mark lanes that cannot go on for the scalar code."""
    expo, beta = settings[RunSettings.exponent], settings[RunSettings.beta]
    max_steps, smallest = settings[RunSettings.max_steps], settings[RunSettings.smallest_step]
    for i in range(W):
        error = work[at.ERROR * W + i]
        # not a number has a sign too, and a negative one would pass for a tiny error below
        error = error if error <= 1e300 else 1e300
        running = work[at.RUNNING * W + i]
        h = work[at.STEP * W + i]
        log = 0.5 * rough_log2(error)
        accept = 1.0 if error <= 1.0 else 0.0
        gain = _LOG_SAFETY - (expo - 0.75 * beta) * log + beta * work[at.LOG_ERROR * W + i]
        loss = _LOG_SAFETY - expo * log
        log_factor = gain if accept == 1.0 else loss
        top = 0.0 if (work[at.REJECTED * W + i] == 1.0) | (accept == 0.0) else _LOG_GROW
        log_factor = min(max(log_factor, _LOG_SHRINK), top)
        proposal = h * rough_exp2(log_factor)
        # a step cut short by the end of the revolution says little about the next one
        asked = work[at.NEXT_STEP * W + i]
        cut = accept * work[at.ENDING * W + i]
        proposal = max(proposal, asked) if cut == 1.0 else proposal
        # nor does one that ends at a row of a table
        proposal = max(proposal, accept * work[at.RESUMED * W + i])
        # the implicit method has its own control
        proposal = asked if work[at.STIFF * W + i] == 1.0 else proposal
        attempts = work[at.ATTEMPTS * W + i] + running
        work[at.ATTEMPTS * W + i] = attempts
        work[at.ACCEPT * W + i] = accept
        work[at.NEXT_STEP * W + i] = proposal
        stuck = 1.0 if (accept == 0.0) & (h <= smallest * (h + work[at.TIME * W + i])) else 0.0
        over = 1.0 if attempts >= max_steps else 0.0
        work[at.SPECIAL * W + i] = running * max(stuck, over)


@lane_function
def place(joint):
    """The place of a joint: not below 0, which spares the compiler a question for every lane."""
    return joint & at.JOINT_MASK


@lane_function
def coordinate(number):
    """The number of a coordinate: not below 0, likewise."""
    return number & at.COORDINATE_MASK


@lane_function
def gap_flag(latched, work, p, i, W, tolerance):
    """1 where joint p's gap needs the scalar code: an impact inside the step, a change of sign, or a contact's turning point
    in its first step (see `stops.too_far_in`)."""
    d0 = work[(at.RATE_OLD + at.GAP + p) * W + i]
    d1 = work[(at.RATE_NOW + at.GAP + p) * W + i]
    sign = 1.0 if d0 * d1 < 0.0 else 0.0
    h = work[at.STEP * W + i]
    m0 = h * work[(at.RATE_OLD + at.GAP_RATE + p) * W + i]
    m1 = h * work[(at.RATE_NOW + at.GAP_RATE + p) * W + i]
    flight = latched * (1.0 - work[(at.ACTIVE + p) * W + i])
    hit = 1.0 if d1 > -tolerance else 0.0
    bump = 1.0 if (m0 > 0.0) & (m1 < 0.0) & (min(d0 + m0, d1 - m1) > 0.0) else 0.0
    turned = 1.0 if (m0 > 0.0) & (m1 < 0.0) & (d1 > 0.0) & (FIRST_PART * d1 > d0) else 0.0
    return max(max(sign, turned), flight * max(hit, bump))


@lane_function
def flag_accepted(work, flag, i, W):
    """Mark a lane whose step was accepted for the scalar code, where `flag` is 1."""
    flag = flag * work[at.ACCEPT * W + i] * work[at.RUNNING * W + i]
    work[at.SPECIAL * W + i] = max(work[at.SPECIAL * W + i], flag)


@lane_function
def flag_gaps(rules, work, par, last, tolerance, W):
    """Mark accepted lanes that need the scalar code before the step is committed. Returns how many lanes are marked."""
    latched = 1.0 * rules.latched
    for joint in range(rules.begin, rules.end):
        p = place(joint)
        for i in range(W):
            flag_accepted(work, gap_flag(latched, work, p, i, W, tolerance), i, W)
    if rules.free:
        for i in range(W):
            end = par[at.TURN_END * W + i] - 1e-6
            turned = 1.0 if work[(at.QS + last) * W + i] > end else 0.0
            stalled = 1.0 if work[(at.VS + last) * W + i] <= 0.0 else 0.0
            flag_accepted(work, max(turned, stalled), i, W)
    if rules.curves > 0:
        flag_rows(rules, work, W)
    special = 0.0
    for i in range(W):
        special = count_up(special, work[at.SPECIAL * W + i])
    return special


@lane_function
def keep(work, row, new, yes, i, W):
    """Store a new value where the step was accepted.

    Both are read before one is chosen: else the compiler chooses between two addresses, and vectorises no loop with that.
    """
    old = work[row * W + i]
    work[row * W + i] = new if yes else old


@lane_function
def add_integral(work, rate, mean, yes, i, W):
    """Add the mean of a rate over the step, times the step, where it was accepted.

    The sum is chosen, not the product: else the compiler fuses the two in a single response and not in lanes.
    """
    added = work[(at.INTEGRAL + rate) * W + i] + work[at.STEP * W + i] * mean
    keep(work, at.INTEGRAL + rate, added, yes, i, W)


@lane_function
def count_contact(work, p, i, W):
    """Add the time that joint p was without contact in the step, and a contact that began.

    Explicit steps end at either end of a contact; within implicit ones the gap is taken as linear.
    """
    yes = work[at.ACCEPT * W + i] == 1.0
    d0 = work[(at.RATE_OLD + at.GAP + p) * W + i]
    d1 = work[(at.RATE_NOW + at.GAP + p) * W + i]
    inside = no_less(d0, 0.0) + no_less(d1, 0.0)
    share = 1.0 - inside / (abs(d0) + abs(d1) + 1e-300)
    add_integral(work, at.FLIGHTS + p, share, yes, i, W)
    touches = 1.0 if d1 > 0.0 else 0.0
    begins = touches if work[(at.TOUCHES + p) * W + i] == 0.0 else 0.0
    begun = work[(at.INTEGRAL + at.BEGUN + p) * W + i] + begins
    keep(work, at.INTEGRAL + at.BEGUN + p, begun, yes, i, W)
    keep(work, at.TOUCHES + p, touches, yes, i, W)


@lane_function
def commit_joint(latched, work, p, i, W):
    """Contact state, integral and extremes of joint p after a step."""
    accept = work[at.ACCEPT * W + i]
    yes = accept == 1.0
    counts = accept * work[at.AVERAGING * W + i] == 1.0
    d = work[(at.RATE_NOW + at.GAP + p) * W + i]
    force = work[(at.RATE_NOW + at.FORCE + p) * W + i]
    work[(at.PEAK + p) * W + i] = max(work[(at.PEAK + p) * W + i], force if counts else 0.0)
    work[(at.DEEPEST + p) * W + i] = max(work[(at.DEEPEST + p) * W + i], d if counts else 0.0)
    add_integral(work, at.GAP + p, abs(work[(at.RATE_SUM + at.GAP + p) * W + i]), yes, i, W)
    keep(work, at.RATE_OLD + at.GAP + p, d, yes, i, W)
    rate = work[(at.RATE_NOW + at.GAP_RATE + p) * W + i]
    keep(work, at.RATE_OLD + at.GAP_RATE + p, rate, yes, i, W)
    keep(work, at.RATE_OLD + at.FORCE + p, force, yes, i, W)
    on = work[(at.ACTIVE + p) * W + i]
    off = 1.0 if (latched * accept * on == 1.0) & (d < 0.0) else 0.0
    work[(at.ACTIVE + p) * W + i] = on - off
    work[(at.ENDED + p) * W + i] += off


@lane_function
def measure(effects, r):
    """Rate r of those that are measured: not below 0, which spares the compiler a question for every lane."""
    return effects.measures[r] & at.MEASURE_MASK


@lane_function
def commit_measures(effects, work, W):
    """Integrals of what is measured besides the gaps, and the peaks of drive moment and followed acceleration, after a step."""
    for r in range(len(effects.measures)):
        rate = measure(effects, r)
        for i in range(W):
            yes = work[at.ACCEPT * W + i] == 1.0
            add_integral(work, rate, work[(at.RATE_SUM + rate) * W + i], yes, i, W)
            keep(work, at.RATE_OLD + rate, work[(at.RATE_NOW + rate) * W + i], yes, i, W)
        if effects.rules.largest & (rate >= at.OBJECTIVE_RATES):
            p = place(rate - at.OBJECTIVE_RATES)
            for i in range(W):
                commit_largest(work, p, i, W)
    if effects.rules.responses:
        for i in range(W):
            commit_peak(work, i, W)


@lane_function
def commit_largest(work, p, i, W):
    """The largest value of the objective's rate at place p after a step."""
    counts = work[at.ACCEPT * W + i] * work[at.AVERAGING * W + i] == 1.0
    rate = work[(at.RATE_NOW + at.OBJECTIVE_RATES + p) * W + i]
    largest = max(work[(at.LARGEST_RATE + p) * W + i], rate if counts else -1e300)
    work[(at.LARGEST_RATE + p) * W + i] = largest


@lane_function
def commit_peak(work, i, W):
    """Peaks of the drive's moment and of the square of the followed acceleration after a step."""
    counts = work[at.ACCEPT * W + i] * work[at.AVERAGING * W + i] == 1.0
    moment = abs(work[(at.RATE_NOW + at.DRIVE_MOMENT) * W + i])
    peak = max(work[at.PEAK_MOMENT * W + i], moment if counts else 0.0)
    work[at.PEAK_MOMENT * W + i] = peak
    square = work[(at.RATE_NOW + at.FOLLOWED_SQUARE) * W + i]
    peak = max(work[at.PEAK_FOLLOWED * W + i], square if counts else 0.0)
    work[at.PEAK_FOLLOWED * W + i] = peak


@lane_function
def commit(effects, work, stages, n, W):
    """Make the tried step the new state on the lanes that accepted it. Returns how many reached a revolution's end."""
    commit_measures(effects, work, W)
    if effects.rules.curves > 0:
        commit_rows(effects.rules, work, W)
    latched = 1.0 * effects.rules.latched
    for joint in range(effects.rules.begin, effects.rules.end):
        p = place(joint)
        if effects.rules.impacts:
            for i in range(W):
                count_contact(work, p, i, W)
        for i in range(W):
            commit_joint(latched, work, p, i, W)
    for number in range(n):
        k = coordinate(number)
        for i in range(W):
            yes = work[at.ACCEPT * W + i] == 1.0
            keep(work, at.Q + k, work[(at.QS + k) * W + i], yes, i, W)
            keep(work, at.V + k, work[(at.VS + k) * W + i], yes, i, W)
            keep(stages, k, work[(at.ACC + k) * W + i], yes, i, W)
    ended = 0.0
    for i in range(W):
        accept = work[at.ACCEPT * W + i]
        yes = accept == 1.0
        work[at.TIME * W + i] += accept * work[at.STEP * W + i]
        keep(work, at.LOG_ERROR, 0.5 * rough_log2(max(work[at.ERROR * W + i], 1e-8)), yes, i, W)
        rejected = 1.0 if work[at.ERROR * W + i] > 1.0 else 0.0
        work[at.REJECTED * W + i] = rejected * (1.0 - accept)
        ended = count_up(ended, accept * work[at.ENDING * W + i] * work[at.RUNNING * W + i])
    return ended


@lane_function
def leave_rate(work, rate, lane, W, bank, stride, column):
    """Put a rate where an explicit step would leave it."""
    work[(at.RATE_NOW + rate) * W + lane] = bank[(at.RATE_NOW + rate) * stride + column]


@lane_function
def leave_rates(effects, work, lane, W, bank, stride, column):
    """Put the rates in a column of a bank of so many lanes where an explicit step would leave them: those that are read after a
    step, as each stands in a line of the cache of its own."""
    for p in range(effects.rules.begin, effects.rules.end):
        leave_rate(work, at.GAP + p, lane, W, bank, stride, column)
        leave_rate(work, at.FORCE + p, lane, W, bank, stride, column)
        leave_rate(work, at.GAP_RATE + p, lane, W, bank, stride, column)
    for r in range(len(effects.measures)):
        leave_rate(work, measure(effects, r), lane, W, bank, stride, column)
    if effects.rules.responses:
        leave_rate(work, at.DRIVE_MOMENT, lane, W, bank, stride, column)
        leave_rate(work, at.FOLLOWED_SQUARE, lane, W, bank, stride, column)
    for curve in range(effects.rules.curves):
        leave_rate(work, at.PLACES + curve, lane, W, bank, stride, column)
        leave_rate(work, at.PLACE_RATES + curve, lane, W, bank, stride, column)
    if effects.rules.profile:
        for rate in range(at.RATES):
            leave_rate(work, rate, lane, W, bank, stride, column)
