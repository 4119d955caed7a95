"""The stepper of `numerics.method = "lobatto"`: one sample after the other, one step of Lobatto collocation after the other.

State, books and outcome are those of the block stepper with one lane, and so are the functions around a step; what
differs is the step itself, and that contacts which begin or end inside it are found at its nodes.
"""

import math
from functools import cache
from typing import Any

from numba import njit

from hpcclear.base.bits import borrowed, rough_exp2, rough_log2
from hpcclear.base.eight import fetch, largest_of, put, spread, total_of
from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.one_text import one_text
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.collocation import lobatto as lob
from hpcclear.dynamics.collocation.crossings import gap_before, stop_at_contacts
from hpcclear.dynamics.collocation.lobatto import STAGES
from hpcclear.dynamics.linkage.rhs import run_motion
from hpcclear.dynamics.stepping.borrowing import borrowed_all
from hpcclear.dynamics.stepping.control import choose_step, commit, leave_rates
from hpcclear.dynamics.stepping.peaks import NEAR, keep_peak, shape
from hpcclear.dynamics.stepping.record import no_room, record_nodes, record_step
from hpcclear.dynamics.stepping.sample import OK, failure
from hpcclear.dynamics.stepping.settings import (
    ATOL,
    COORDINATES,
    FINISHED,
    FOUND,
    MAX_STEPS,
    MOTION_OF_EIGHT,
    PARAMETER_ROWS,
    PROFILE,
    RTOL,
)
from hpcclear.dynamics.stepping.special import (
    END_OF_REVOLUTION,
    END_OF_SAMPLE,
    NEXT_SAMPLE,
    ask,
)
from hpcclear.dynamics.stepping.stops import integrate_gap, stop_free_crank

NOTHING = -1  # is asked of `special`
SWEEP_TOLERANCE = 0.05  # of the tolerance on a step's error
LOG_TOLERANCE = -4.1  # log2 of a little more
EXPONENT = (
    -0.5 / 11.0
)  # of the square of the error: the last coefficients over the step go with h^9, their fall with h^2
LOG_SAFETY = -0.32  # log2(0.8)
LARGEST_SHRINK, LARGEST_GROWTH = 0.1, 4.0
FAILED_SHRINK = 0.7  # after the sweeps did not converge
UNTESTED = 0.5  # what one sweep leaves unmeasured is taken to have fallen so far, or steps might stay small for ever
PATIENCE = (
    2.0  # sweeps before which no step counts as not converging: acceleration begins with the second
)
BEST_CONTRACTION = 0.15  # of a sweep: longer steps need more of them than they save


@lane_function
def replicate(par, m, settings):
    """Give every stage the sample's parameters."""
    for r in range(int(settings[PARAMETER_ROWS])):
        put(m, lob.PAR + r, spread(par[r]))
    for s in range(lob.SCALARS * STAGES, lob.MEMORY):
        m[s] = 0.0
    m[lob.CONTRACTION] = 0.1
    m[lob.CONTRACTION_STEP] = par[at.FIRST_STEP]
    m[lob.KINK] = lob.KINK_AT_START
    m[lob.AFTER_KINK] = par[at.FIRST_STEP]


@lane_function
def begin_contacts(rules, work, m):
    """Contact states and impact speeds of the step, for every stage."""
    for p in range(rules.begin, rules.end):
        put(m, at.ACTIVE + p, spread(work[at.ACTIVE + p]))
        put(m, at.INVERSE_IMPACT + p, spread(work[at.INVERSE_IMPACT + p]))


@lane_function
def evaluate_start(motion, work, stages, m, tables, n):
    """Accelerations and rates at the start of the step, where they are not known."""
    put(m, at.STAGE_TIME, spread(work[at.TIME]))
    for k in range(n):
        put(m, at.QS + k, spread(work[at.Q + k]))
        put(m, at.VS + k, spread(work[at.V + k]))
    lob.accelerations_of_stages(motion, m, tables)
    for k in range(n):
        stages[k] = m[(at.ACC + k) * STAGES]
    for r in range(at.RATES):
        work[at.RATE_OLD + r] = m[(at.RATE_NOW + r) * STAGES]
    work[at.FRESH] = 0.0
    work[at.EVALUATIONS] += 1.0


@lane_function
def weigh(work, stages, m, settings, strictness, n):
    """What an error of each coordinate's acceleration, kept up over the step, counts."""
    h = work[at.STEP]
    rtol = settings[RTOL]
    for k in range(n):
        a = stages[k]
        m[lob.START_ACC * STAGES + k] = a
        v = max(abs(work[at.V + k]), abs(work[at.V + k] + h * a))
        by_v = h / (settings[ATOL + at.MAX_COORDINATES + k] + rtol * v)
        by_q = h * h / (settings[ATOL + k] + rtol * abs(work[at.Q + k]))
        m[lob.WEIGHT * STAGES + k] = strictness * (0.5 / n) * (by_v * by_v + by_q * by_q)


@lane_function
def converged(rate, change):
    """Whether all changes to come are small, if each is the last times a rate."""
    return rate < 1.0 and rate * change < SWEEP_TOLERANCE * (1.0 - rate)


@lane_function
def sweep(motion, work, m, tables, n):
    """Iterate the stages of the step until they have converged. Returns False when they will not in `MOST_SWEEPS`."""
    h = work[at.STEP]
    ratio = h / m[lob.CONTRACTION_STEP]
    # of forces that depend on positions it goes with the square of the step, of damping with the step
    rate = min(m[lob.CONTRACTION] * ratio * max(ratio, 1.0), 0.9)
    log_first = 0.0
    done = 0.0
    left = lob.MOST_SWEEPS
    lob.set_times(m, work, h)
    lob.set_stages(m, work, n, h, lob.NODE_ACC, 0.0)
    predicted = rate
    while left > 0.0:
        lob.accelerations_of_stages(motion, m, tables)
        change, back = lob.compare(m, n)
        lob.set_stages(m, work, n, h, at.ACC, back if done > 0.0 else 0.0)
        log_change = rough_log2(change)
        if done > 0.0:
            rate = rough_exp2((log_change - log_first) / done)
        else:
            log_first = log_change
        done += 1.0
        left -= 1.0
        if converged(rate, change):
            left = -1.0
        elif done > PATIENCE and not rough_log2(rate) * left + log_change < 0.0:
            left = 0.0
    work[at.EVALUATIONS] += STAGES * done
    found = rate if done > 1.0 else UNTESTED * predicted
    m[lob.CONTRACTION] = min(max(found, 1e-4), 1e4)
    m[lob.CONTRACTION_STEP] = h
    return left < 0.0


@lane_function
def gap_tail(work, m, p, rtol):
    """Squares of the last two coefficients of joint p's gap and of the two before, scaled as its integral's error is."""
    row = lob.GAP_COEFFICIENT
    lob.coefficients_of(m, at.RATE_NOW + at.GAP + p, work[at.RATE_OLD + at.GAP + p], row)
    clearance = lob.PAR + at.JOINT_BLOCKS + at.JOINT_ROWS * p + at.CLEARANCE
    scale = work[at.STEP] / (rtol * m[clearance * STAGES] * m[(lob.PAR + at.PERIOD) * STAGES])
    last, before = lob.tail(m, row)
    weight = m[(lob.PAR + at.STRICTNESS) * STAGES] * scale * scale
    return weight * last, weight * before


@lane_function
def error_of(effects, work, m, rtol, n):
    """Square of the scaled error of a converged step.

    The last two coefficients bound the error of the polynomial. At the end of the step the method is far better, and
    the faster they fall the more: the bound is taken to fall once more by as much as from the two before to the last.
    """
    high = 0.0
    low = 0.0
    for k in range(n):
        last, before = lob.tail(m, lob.COEFFICIENT + k)
        high += m[lob.WEIGHT * STAGES + k] * last
        low += m[lob.WEIGHT * STAGES + k] * before
    for p in range(effects.rules.begin, effects.rules.end):
        last, before = gap_tail(work, m, p, rtol)
        high += last
        low += before
    return high * min(high / (low + 1e-300), 1.0)


@lane_function
def quadrature(work, m, rate):
    """Integral of a rate over the step, over h."""
    inner = total_of(fetch(m, lob.LAST_NODE) * fetch(m, at.RATE_NOW + rate))
    start = work[at.RATE_OLD + rate]
    work[at.RATE_SUM + rate] = m[lob.MATRIX * STAGES + STAGES - 1] * start + inner


@lane_function
def quadratures(effects, work, m):
    """Integrals of all that is integrated over the step, over h."""
    for p in range(effects.rules.begin, effects.rules.end):
        quadrature(work, m, at.GAP + p)
    for r in range(len(effects.measures)):
        quadrature(work, m, effects.measures[r])


@lane_function
def end_of_step(effects, work, m, n):
    """Put the end of the step where the block stepper would leave it."""
    last = STAGES - 1
    for k in range(n):
        work[at.QS + k] = m[(at.QS + k) * STAGES + last]
        work[at.VS + k] = m[(at.VS + k) * STAGES + last]
        work[at.ACC + k] = m[(lob.NODE_ACC + k) * STAGES + last]
    leave_rates(effects, work, 0, 1, m, STAGES, last)


@lane_function
def may_hold_peaks(work, m, p):
    """Whether joint p's force or penetration in this step may be the largest so far: mostly it is in flight."""
    force = max(largest_of(fetch(m, at.RATE_NOW + at.FORCE + p)), work[at.RATE_OLD + at.FORCE + p])
    depth = max(largest_of(fetch(m, at.RATE_NOW + at.GAP + p)), work[at.RATE_OLD + at.GAP + p])
    return NEAR * force > work[at.PEAK + p] or NEAR * depth > work[at.DEEPEST + p]


@lane_function
def peaks_between(rules, work, par, m, p):
    """Extremes of joint p at the nodes of an accepted step and between them, its end left to `commit`."""
    if work[at.AVERAGING] == 1.0 and may_hold_peaks(work, m, p):
        exponent, c = shape(rules, work, par, p, 0, 1)
        force = work[at.RATE_OLD + at.FORCE + p]
        for i in range(STAGES):
            before, force = force, m[(at.RATE_NOW + at.FORCE + p) * STAGES + i]
            depth = m[(at.RATE_NOW + at.GAP + p) * STAGES + i]
            work[at.PEAK + p] = max(work[at.PEAK + p], force)
            work[at.DEEPEST + p] = max(work[at.DEEPEST + p], depth)
            _, length, d0, m0, d1, m1 = gap_before(work, m, p, i)
            high = NEAR * max(before, force) > work[at.PEAK + p]
            if high or NEAR * max(d0, d1) > work[at.DEEPEST + p]:
                h = length * work[at.STEP]
                keep_peak(work, p, 0, 1, d0, m0 / h, d1, m1 / h, 0.0, exponent, c, h, before, force)


@lane_function
def propose(work, m, error):
    """The step to try next after one that was tried to its end, and whether it is accepted."""
    h = work[at.STEP]
    factor = rough_exp2(LOG_SAFETY + EXPONENT * rough_log2(error + 1e-60))
    factor = min(factor, math.sqrt(BEST_CONTRACTION / m[lob.CONTRACTION]))
    if error <= 1.0:
        work[at.ACCEPT] = 1.0
        proposal = h * min(max(factor, 0.3), LARGEST_GROWTH)
        # a step cut short by the end of the revolution says little about the next one
        work[at.NEXT_STEP] = (
            max(proposal, work[at.NEXT_STEP]) if work[at.ENDING] == 1.0 else proposal
        )
    else:
        work[at.ACCEPT] = 0.0
        work[at.NEXT_STEP] = h * min(max(factor, LARGEST_SHRINK), 0.7)


@lane_function
def after_step(work, m):
    """Where the next step begins, and how long it is after a kink."""
    m[lob.FOLLOWS] = 1.0
    if m[lob.KINK] == lob.KINK_AT_START:
        m[lob.AFTER_KINK] = work[at.STEP]
        m[lob.KINK] = lob.KINK_BEHIND
    elif m[lob.KINK] == lob.KINK_AT_END:
        m[lob.KINK] = lob.KINK_AT_START
        m[lob.POLYNOMIAL_STEP] = 0.0
        work[at.NEXT_STEP] = m[lob.AFTER_KINK]


@lane_function
def try_step(effects, motion, block, m, tables, settings, n):
    """One step to its end: stages, error, the step to try next, and whether this one is accepted."""
    work, stages, par = block.work, block.stages, block.par
    choose_step(work, par, effects.rules.free, 1)
    begin_contacts(effects.rules, work, m)
    if work[at.FRESH] == 1.0:
        evaluate_start(motion, work, stages, m, tables, n)
    weigh(work, stages, m, settings, par[at.STRICTNESS], n)
    lob.guess(m, n, work[at.STEP])
    work[at.ATTEMPTS] += 1.0
    if sweep(motion, work, m, tables, n):
        lob.keep_polynomial(m, n, work[at.STEP])
        error = error_of(effects, work, m, settings[RTOL], n)
        work[at.ERROR] = error
        propose(work, m, error)
    else:
        work[at.ACCEPT] = 0.0
        factor = math.sqrt(BEST_CONTRACTION / m[lob.CONTRACTION])
        work[at.NEXT_STEP] = work[at.STEP] * min(max(factor, LARGEST_SHRINK), FAILED_SHRINK)


@lane_function
def judge_end(effects, block, m, settings, n):
    """What an accepted step shows of contacts, turns and integrals; it may yet be cut. Returns OK or why the lane ends."""
    status = OK
    rules, work, stages = effects.rules, block.work, block.stages
    if work[at.ACCEPT] == 0.0 or work[at.ATTEMPTS] >= settings[MAX_STEPS]:
        status = failure(0, 1, n, work, stages, settings)
    if status == OK and work[at.ACCEPT] == 1.0:
        end_of_step(effects, work, m, n)
        quadratures(effects, work, m)
        stop_at_contacts(rules, work, m, settings)
        if work[at.ACCEPT] == 1.0 and rules.free:
            status = stop_free_crank(0, 1, block, settings, n - 1)
        if work[at.ACCEPT] == 1.0:
            for p in range(rules.begin, rules.end):
                integrate_gap(0, 1, work, p)
                peaks_between(rules, work, block.par, m, p)
    return status


@lane_function
def change_sample(special, asked, block, queue, method, m):
    """Have a revolution or a sample ended, or one begun; the stages get the parameters of the next."""
    before = queue.counters[FINISHED]
    ask(special, asked, 0, method.numbers, block, queue, method.settings)
    if asked == NEXT_SAMPLE or queue.counters[FINISHED] > before:
        replicate(block.par, m, method.settings)


@lane_function
def advance(special, rules, block, queue, method, record, m, budget):
    """Take at most `budget` steps. Returns whether the lane holds a sample."""
    block, queue, method = borrowed_all(block, queue, method, 1)
    m = borrowed(m)
    effects = at.Stepped(rules, method.measures)
    settings, tables, counters = method.settings, method.tables, queue.counters
    work, stages, book, numbers = block.work, block.stages, block.book, method.numbers
    n = numbers[COORDINATES]
    if work[at.RUNNING] == 0.0:
        change_sample(special, NEXT_SAMPLE, block, queue, method, m)
    full = False
    while budget > 0 and work[at.RUNNING] > 0.0 and not full:
        budget -= 1
        asked = NOTHING
        try_step(effects, numbers[MOTION_OF_EIGHT], block, m, tables, settings, n)
        status = judge_end(effects, block, m, settings, n)
        if status != OK:
            numbers[FOUND] = status
            asked = END_OF_SAMPLE
        elif work[at.ACCEPT] == 1.0:
            record_nodes(record, counters, work, m, book, n)
            if rules.profile:
                run_motion(numbers[PROFILE], work, tables)
            if commit(effects, work, stages, n, 1) > 0.0:
                asked = END_OF_REVOLUTION
            record_step(record, counters, work, stages, book, n, 1)
            full = no_room(record, counters)
            after_step(work, m)
        if asked != NOTHING:
            change_sample(special, asked, block, queue, method, m)
    return work[at.RUNNING] > 0.0


@cache
def make_collocation_stepper() -> Any:
    """Return the compiled stepper of one sample at a time, whatever its coordinates and joints.

    Its arguments are those of `stepper.make_stepper` with an implicit method, but for its codes, of which it takes the address
    of `special.special_code` alone; the tableau is not read,
    and `memory` is what `lobatto.new_memory` makes.
    """
    text = one_text(advance, "collocation")
    return njit(error_model="numpy", fastmath=FASTMATH, cache=True)(text)  # type: ignore[no-any-return]
