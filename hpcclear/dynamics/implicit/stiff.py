"""Implicit steps of a single response where its motion is stiff (where that is: `switching`); those of ensembles: `abreast`.

A stiff lane takes one step of Radau IIA where the others take an explicit one. Everything around the step (impacts, ends of
revolutions, books, outcome) is the block stepper's: the implicit step leaves its result in the lane's rows as an explicit
step would.
"""

import math
from functools import cache
from typing import Any

from numba import carray, cfunc, types

from hpcclear.base.bits import call_at
from hpcclear.base.eight import column, fetch, largest_of, put, size, spread
from hpcclear.base.jit import FASTMATH, lane_function, scalar_function
from hpcclear.base.one_text import one_text
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.control import (
    CHEAP_CONTRACTION,
    KINK_REACH,
    LEAST_CUT,
    MOST_CUTS,
    cut_again,
    fit_to_ramp,
    forget,
    forget_kinks,
    give_up,
    go_on,
    propose,
)
from hpcclear.dynamics.implicit.jacobian import difference_jacobian, evaluate_bank
from hpcclear.dynamics.implicit.kinks import (
    BEYOND,
    GUESSED_BEYOND,
    kink_fraction,
    kinks_of_start,
)
from hpcclear.dynamics.implicit.memory import BLOCKS, END, LANES, Moved
from hpcclear.dynamics.implicit.radau import (
    copy_polynomial,
    evaluate_stages,
    filtered_error,
    gap_errors,
    guess_from_start,
    guess_stages,
    make_inverses,
    means_of_step,
    newton,
    refilter_error,
    start_of_step,
)
from hpcclear.dynamics.stepping.control import leave_rates
from hpcclear.dynamics.stepping.settings import (
    ATOL,
    COORDINATES,
    MEASURES,
    MOTION_OF_EIGHT,
    NUMBERS,
    PARAMETER_ROWS,
    RTOL,
    SETTINGS,
    WIDTH,
    rules_in,
)


@scalar_function
def take_over(n, lane, W, par, m, settings):
    """Forget what is known of an earlier stretch: the lane comes from the explicit method or is new."""
    for k in range(int(settings[PARAMETER_ROWS])):
        value = spread(par[k * W + lane])
        put(m, mem.PAR + k, value)
        put(m, mem.SECOND + mem.PAR + k, value)
    for k in range(n):
        by_v = settings[ATOL + at.MAX_COORDINATES + k]
        m[mem.LEAST * LANES + k] = settings[ATOL + k] / settings[RTOL]
        m[(mem.LEAST + BLOCKS) * LANES + k] = by_v / settings[RTOL]
    forget(m, 0)
    fit_to_ramp(par, lane, W, m, 0, settings)


@scalar_function
def fetch_contacts(rules, lane, W, work, m):
    """Contact states of the open joints, in both banks."""
    for p in range(rules.begin, rules.end):
        for row in (at.ACTIVE + p, at.INVERSE_IMPACT + p):
            value = spread(work[row * W + lane])
            put(m, row, value)
            put(m, mem.SECOND + row, value)


@scalar_function
def fetch_start(effects, moved, lane, W, block, m):
    """Bring the start of the step into the lane's memory."""
    work, stages = block.work, block.stages
    follows = work[at.ACCEPT * W + lane] == 1.0  # it is where the lane's last implicit step ended
    m[mem.TIME] = work[at.TIME * W + lane]
    m[mem.STEP] = work[at.STEP * W + lane]
    fetch_contacts(effects.rules, lane, W, work, m)
    for k in range(moved.n):
        m[mem.Q * LANES + k] = work[(at.Q + k) * W + lane]
        m[mem.V * LANES + k] = work[(at.V + k) * W + lane]
    fresh = work[at.FRESH * W + lane] == 1.0
    unknown = fresh or work[at.STIFF_STEPS_HERE * W + lane] == 0.0
    if unknown:
        start_of_step(moved.n, m)
        evaluate_bank(moved.motion, m, moved.tables)
        work[at.EVALUATIONS * W + lane] += 1.0
    if fresh:
        m[mem.NEW_JACOBIAN] = 0.0
        for k in range(moved.n):
            stages[k * W + lane] = m[(at.ACC + k) * LANES + END]
        for r in range(at.RATES):
            work[(at.RATE_OLD + r) * W + lane] = m[(at.RATE_NOW + r) * LANES + END]
        work[at.FRESH * W + lane] = 0.0
    if (unknown or follows) and kinks_of_start(effects.rules, m):
        forget_kinks(m, 0)
    for k in range(moved.n):
        m[mem.START * LANES + k] = stages[k * W + lane]
    for b in range(moved.blocks):
        for row in (0, BLOCKS):  # coordinates, then velocities
            there = fetch(m, mem.LEAST + row + b) + size(fetch(m, mem.Q + row + b))
            put(m, mem.INVERSE_SCALE + row + b, 1.0 / (m[mem.TOLERANCE] * there))


@scalar_function
def norm_of_jacobian(n, blocks, m):
    """Estimate of the largest eigenvalue in 1/s from row sums, in units that make angles and lengths comparable."""
    by_q, by_v = 0.0, 0.0
    for b in range(blocks):
        rows_q, rows_v = spread(0.0), spread(0.0)
        for k in range(n):
            unit = m[(mem.LEAST + BLOCKS) * LANES + k]
            rows_q = rows_q + unit * size(fetch(m, mem.JACOBIAN + k * BLOCKS + b))
            rows_v = rows_v + unit * size(fetch(m, mem.JACOBIAN + (n + k) * BLOCKS + b))
        own = fetch(m, mem.LEAST + BLOCKS + b)
        by_q = max(by_q, largest_of(rows_q / own))
        by_v = max(by_v, largest_of(rows_v / own))
    return by_v + math.sqrt(by_q)


@scalar_function
def cut_at_kink(effects, moved, lane, W, work, m):
    """Evaluate the guessed stages, and cut the step if they show a kink."""
    h = m[mem.STEP]
    evaluate_stages(moved.motion, moved.n, m, moved.tables, h)
    work[at.EVALUATIONS * W + lane] += 3.0
    fraction = kink_fraction(effects.rules, m, GUESSED_BEYOND)
    if fraction < 1.0:
        m[mem.POLYNOMIAL_STEP] = h
        h *= max(fraction, LEAST_CUT)
        m[mem.STEP] = h
        work[at.STEP * W + lane] = h
        work[at.ENDING * W + lane] = 0.0
        m[mem.CONTINUES] = 0.0
        guess_stages(moved.blocks, m, h)
        evaluate_stages(moved.motion, moved.n, m, moved.tables, h)
        work[at.EVALUATIONS * W + lane] += 3.0


@scalar_function
def new_jacobian(moved, m, guessed):
    """Jacobian at the second guessed stage, or at the start where there is no guess."""
    if not guessed:
        start_of_step(moved.n, m)
    for b in range(moved.blocks):
        here = column(m, at.ACC + LANES * b, mem.MIDDLE) if guessed else fetch(m, mem.START + b)
        put(m, mem.BASE + b, here)
    difference_jacobian(moved.motion, moved.n, moved.blocks, m, moved.tables)
    m[mem.NORM] = norm_of_jacobian(moved.n, moved.blocks, m)
    m[mem.NEW_JACOBIAN] = 1.0
    m[mem.FACTORED_STEP] = 0.0


@scalar_function
def begin_step(effects, moved, lane, W, block, m, settings):
    """Bring the lane's step into its memory, and guess its stages. Returns whether there is a guess."""
    work = block.work
    first = work[at.STIFF_STEPS_HERE * W + lane] == 0.0
    if first:
        take_over(moved.n, lane, W, block.par, m, settings)
    elif work[at.ACCEPT * W + lane] == 1.0:
        go_on(m, 0)
        copy_polynomial(m, mem.Z, mem.KEPT)
    fetch_start(effects, moved, lane, W, block, m)
    work[at.STIFF_STEPS_HERE * W + lane] += 1.0
    work[at.STIFF_STEPS * W + lane] += 1.0
    if first:
        guess_from_start(moved.blocks, m, m[mem.STEP])
    else:
        guess_stages(moved.blocks, m, m[mem.STEP])
    return m[mem.POLYNOMIAL_STEP] > 0.0


@scalar_function
def solve_step(effects, moved, lane, W, work, m, guessed):
    """Cut the step where its guess shows a kink, and solve for its stages. Returns what `newton` does."""
    if guessed:
        cut_at_kink(effects, moved, lane, W, work, m)
    h = m[mem.STEP]
    stale = m[mem.RATE] > CHEAP_CONTRACTION or m[mem.FACTORED_STEP] != h
    if stale and m[mem.NEW_JACOBIAN] == 0.0:
        new_jacobian(moved, m, guessed)
        work[at.EVALUATIONS * W + lane] += 2.0 * moved.n
    if m[mem.FACTORED_STEP] != h and not make_inverses(moved.n, moved.blocks, m, h):
        return -1
    iterations = newton(moved.motion, moved.n, moved.blocks, m, moved.tables, h, guessed)
    evaluated = abs(iterations) - 1 if guessed else abs(iterations)
    work[at.EVALUATIONS * W + lane] += 3.0 * evaluated
    return iterations


@scalar_function
def implicit_step(effects, moved, lane, W, block, memory, settings):
    """Try one step of `work[STEP]` on one lane: new state, rates, error and next step go into its rows."""
    m = memory[lane]
    work = block.work
    guessed = begin_step(effects, moved, lane, W, block, m, settings)
    iterations = solve_step(effects, moved, lane, W, work, m, guessed)
    if iterations < 0:
        copy_polynomial(m, mem.KEPT, mem.Z)
        give_up(lane, W, work, m, 0)
        return
    h = m[mem.STEP]
    m[mem.POLYNOMIAL_STEP] = h
    m[mem.CONTINUES] = 0.0
    fraction = kink_fraction(effects.rules, m, BEYOND)
    if fraction < 1.0 - KINK_REACH and m[mem.KINK_CUTS] < MOST_CUTS:
        cut_again(lane, W, work, m, 0, fraction)
    else:
        m[mem.KINK_CUTS] = 0.0
        judge(effects, moved, lane, W, work, m, iterations)


@scalar_function
def judge(effects, moved, lane, W, work, m, iterations):
    """Error of a converged step, its integrals, its end and the step to try next."""
    h = m[mem.STEP]
    for b in range(moved.blocks):
        put(m, mem.SHIFTED + b, fetch(m, mem.START + b))
        put(m, mem.SHIFTED + BLOCKS + b, spread(0.0))
    total = filtered_error(moved.n, moved.blocks, m, h)
    uneasy = work[at.REJECTED * W + lane] == 1.0 or m[mem.ACCEPTED_STEP] == 0.0
    if total > 2.0 * moved.n and uneasy:
        total = refilter_error(moved.motion, moved.n, moved.blocks, m, moved.tables, h)
        work[at.EVALUATIONS * W + lane] += 1.0
    # as the last correction left them: integrals fit the end of the step
    evaluate_stages(moved.motion, moved.n, m, moved.tables, h)
    work[at.EVALUATIONS * W + lane] += 1.0
    gaps = gap_errors(effects.rules, m, work, lane, W)
    means_of_step(effects, m, work, lane, W)
    leave(effects, moved.n, lane, W, work, m)
    mean = (total + gaps) * (0.5 / moved.n)
    m[mem.TRIED_ERROR] = math.sqrt(mean)
    work[at.ERROR * W + lane] = mean
    propose(lane, W, work, m, 0, iterations)


@scalar_function
def leave(effects, n, lane, W, work, m):
    """Put the end of the step where an explicit step would leave it."""
    for k in range(n):
        work[(at.QS + k) * W + lane] = m[(at.QS + k) * LANES + END]
        work[(at.VS + k) * W + lane] = m[(at.VS + k) * LANES + END]
        work[(at.ACC + k) * W + lane] = m[(at.ACC + k) * LANES + END]
    leave_rates(effects, work, lane, W, m, LANES, END)


@lane_function
def unpacked(numbers, work, stages, par, measures):
    """Numbers, effects and lanes from their addresses."""
    of = carray(numbers, NUMBERS)
    W = of[WIDTH]
    lanes = at.Block(
        carray(work, at.WORK * W),
        carray(stages, at.MAX_COORDINATES * W),
        carray(par, at.PARAMETERS * W),
        None,
    )
    return of, at.Stepped(rules_in(of), carray(measures, of[MEASURES])), lanes


@scalar_function
def implicit_steps(blocks, numbers, work, stages, par, settings, tables, measures, memory):
    """`implicit_step` of every stiff lane, with arrays at addresses."""
    of, effects, block = unpacked(numbers, work, stages, par, measures)
    W = of[WIDTH]
    moved = Moved(of[MOTION_OF_EIGHT], of[COORDINATES], blocks, carray(tables, at.TABLES))
    lanes = carray(memory, (W, mem.MEMORY))
    for lane in range(W):
        if block.work[at.STIFF * W + lane] * block.work[at.RUNNING * W + lane] == 1.0:
            implicit_step(effects, moved, lane, W, block, lanes, carray(settings, SETTINGS))


_DOUBLES, _COUNTS = types.CPointer(types.float64), types.CPointer(types.int64)
SIGNATURE = types.void(_COUNTS, *[_DOUBLES] * 5, _COUNTS, _DOUBLES)


def blocks_of(n: int) -> int:
    """Rows that a vector over n coordinates takes."""
    return -(-n // LANES)


@cache
def implicit_code(blocks: int) -> Any:
    """The compiled implicit step of any lanes and joints, and of as many coordinates as so many rows of eight hold, nearly
    always one; its ``address`` is what steppers take."""
    text = one_text(implicit_steps, f"implicit_{blocks}", blocks=blocks)
    return cfunc(SIGNATURE, cache=True, error_model="numpy", fastmath=FASTMATH)(text)


@lane_function
def ask_implicit(address, numbers, block, method, memory):
    """One step of Radau IIA on every stiff lane, over whatever the explicit method left in its rows."""
    if memory is not None:
        arrays = (
            numbers, block.work, block.stages, block.par, method.settings, method.tables, method.measures, memory
        )  # fmt: skip
        call_at(address, arrays)
