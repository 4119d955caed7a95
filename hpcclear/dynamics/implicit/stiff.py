"""Implicit steps for lanes whose motion is stiff (which those are: `switching`).

A stiff lane takes one step of Radau IIA where the others take an explicit one. Everything around the step (impacts, ends of
revolutions, books, outcome) is the block stepper's: the implicit step leaves its result in the lane's rows as an explicit
step would.
"""

import math
from functools import cache
from typing import Any, NamedTuple

from numba import carray, cfunc, types

from hpcclear.base.arrays import Array
from hpcclear.base.bits import call_at
from hpcclear.base.eight import column, fetch, largest_of, put, size, spread
from hpcclear.base.jit import FASTMATH, lane_function, scalar_function
from hpcclear.base.one_text import one_text
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.jacobian import difference_jacobian, evaluate_bank
from hpcclear.dynamics.implicit.kinks import (
    BEYOND,
    GUESSED_BEYOND,
    LEAST_CUT,
    kink_fraction,
    kinks_of_start,
)
from hpcclear.dynamics.implicit.memory import BLOCKS, END, LANES
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
    next_step,
    refilter_error,
    start_of_step,
)
from hpcclear.dynamics.stepping.control import leave_rates
from hpcclear.dynamics.stepping.settings import (
    ATOL,
    COORDINATES,
    LANE,
    MEASURES,
    MOTION_OF_EIGHT,
    NUMBERS,
    PARAMETER_ROWS,
    RTOL,
    SETTINGS,
    WIDTH,
    rules_in,
)

CHEAP_CONTRACTION = 0.002
"""While Newton's iteration converges faster than this, and the step stays what it is, the Jacobian is kept."""

KEPT_TO = 1.2
"""A step that would grow by less keeps its size, and the inverses."""

BEST_RATE = 0.3
"""Of the iteration's convergence. Where friction sticks it goes with the step: the normal force changes, so does the slope."""

SLOPE_MEMORY = 0.5
"""How much of that rate is still believed after a step that one iteration solved."""

FAILED_SHRINK = 0.1
"""At most, after the iteration failed."""

CEILING, CEILING_GROWTH = 0.6, 1.05
"""Of the failed step, for those after it; and how that is forgotten, step by step."""

CALM_STIFFNESS = 2.0
"""h |J| below which the explicit method would do."""

STEEP = 100.0
"""s/m, friction coefficient over ramp speed, from which kinks decide how long implicit steps are."""

ERROR_IN_RAMP, DIFFERENCE_IN_RAMP = 0.03, 1e-3
"""Of a step, and of the Jacobian's differences, at most: as a part of friction's ramp."""

ERROR_IN_FILM, FILM_AT, LEAST_IN_FILM = 2e-3, 1e-6, 2e-11
"""Of a step at most, as a part of the speed at which a film is squeezed by the forces of inertia, where `rtol` is at least the
second number, and in proportion below; and the least that this comes to."""

KINK_REACH, MOST_CUTS = 0.005, 12.0
"""A kink so near the end of a step, as a part of it, is left there; and how often a step is cut."""


class Moved(NamedTuple):
    """What is stepped: the address of its motion of eight lanes, coordinates, rows of a vector over them, tables."""

    motion: int
    n: int
    blocks: int
    tables: Array


@scalar_function
def loosened(rtol, strictness, steep, smooth):
    """Relative tolerance for an error estimate of order 3 that makes the fifth-order result as good as rtol asks.

    Where the motion is smooth an exponent of 2/3 would do, as in RADAU5; but stiff stretches are full of kinks, where
    the result is no better than the estimate, most of all where a steep friction ramp sticks and tears loose. There the
    energy balance closes as well as elsewhere only with an exponent of 1, which costs next to nothing: kinks hold the
    steps down anyway.
    `strictness`: square of how many times tighter this sample's tolerances are.
    """
    asked = rtol / math.sqrt(strictness)
    return 0.05 * asked if steep else 0.1 * asked ** (2.0 / 3.0 if smooth else 0.9)


@scalar_function
def fit_to_ramp(m, settings):
    """Relative tolerance of implicit steps and reach of the Jacobian's differences: both keep well within friction's ramp.

    Where joints stick, the sliding speed lies within the ramp: an error as wide as the ramp would throw it to and fro,
    and every step would begin off the slow motion and end at a kink. Looser than this is dearer. A difference taken across the
    ramp's end would hide its slope. A film is squeezed as slowly where it carries: an error of that speed would be one of all
    forces, and the energy balance would not close.
    """
    steepest = 1e-300
    film = 1e-300
    slope = 0.0
    for k in range(at.MAX_JOINTS):
        block = mem.PAR + at.JOINT_BLOCKS + k * at.JOINT_ROWS
        inverse = m[(block + at.INVERSE_RAMP) * LANES]
        steepest = max(steepest, inverse)
        slope = max(slope, m[(block + at.FRICTION) * LANES] * inverse)
        film = max(film, m[(block + at.FILM_STEEPNESS) * LANES])
    ramp = 1.0 / steepest
    speed = m[(mem.PAR + at.SPEED) * LANES] * m[(mem.PAR + at.CRANK_LENGTH) * LANES]
    strictness = m[(mem.PAR + at.STRICTNESS) * LANES]
    asked = min(settings[RTOL] / (FILM_AT * math.sqrt(strictness)), 1.0) ** 0.9
    squeezed = max(ERROR_IN_FILM / film * asked / (1.0 + speed), LEAST_IN_FILM)
    within = min(ERROR_IN_RAMP * ramp / (1.0 + speed), squeezed)
    smooth = film > 1e-300
    m[mem.TOLERANCE] = min(loosened(settings[RTOL], strictness, slope >= STEEP, smooth), within)
    m[mem.REACH] = DIFFERENCE_IN_RAMP * ramp


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
    m[mem.POLYNOMIAL_STEP] = 0.0
    m[mem.KEPT_STEP] = 0.0
    m[mem.CONTINUES] = 1.0
    m[mem.ACCEPTED_STEP] = 0.0
    m[mem.CONTRACTION] = 1.0
    m[mem.RATE] = 1.0
    m[mem.RATE_SLOPE] = 0.0
    m[mem.CEILING] = math.inf
    m[mem.FACTORED_STEP] = 0.0
    m[mem.NEW_JACOBIAN] = 0.0
    m[mem.TRIED_ERROR] = 0.0
    m[mem.KINK_CUTS] = 0.0
    fit_to_ramp(m, settings)


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
        m[mem.RATE] = 1.0
        m[mem.RATE_SLOPE] = 0.0
        m[mem.CEILING] = math.inf
        m[mem.KEPT_STEP] = 0.0
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
        m[mem.ACCEPTED_STEP] = m[mem.STEP]
        m[mem.ACCEPTED_ERROR] = max(m[mem.TRIED_ERROR], 1e-2)
        m[mem.NEW_JACOBIAN] = 0.0
        copy_polynomial(m, mem.Z, mem.KEPT)
        m[mem.KEPT_STEP] = m[mem.POLYNOMIAL_STEP]
        m[mem.CONTINUES] = 1.0
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
def give_up(lane, W, work, m):
    """The iteration failed: a shorter step by the polynomial of the step before, with a Jacobian that is nearer."""
    h = m[mem.STEP]
    copy_polynomial(m, mem.KEPT, mem.Z)
    m[mem.POLYNOMIAL_STEP] = m[mem.KEPT_STEP]
    m[mem.CONTINUES] = 1.0
    m[mem.NEW_JACOBIAN] = 0.0
    shrink = BEST_RATE / m[mem.RATE] if m[mem.RATE] > 0.0 else 0.0
    m[mem.RATE] = 1.0
    m[mem.CONTRACTION] = 1.0
    m[mem.CEILING] = CEILING * h
    work[at.ERROR * W + lane] = 1e6
    work[at.NEXT_STEP * W + lane] = min(max(shrink, FAILED_SHRINK), 0.5) * h


@scalar_function
def implicit_step(effects, moved, lane, W, block, memory, settings):
    """Try one step of `work[STEP]` on one lane: new state, rates, error and next step go into its rows."""
    m = memory[lane]
    work = block.work
    guessed = begin_step(effects, moved, lane, W, block, m, settings)
    iterations = solve_step(effects, moved, lane, W, work, m, guessed)
    if iterations < 0:
        give_up(lane, W, work, m)
        return
    h = m[mem.STEP]
    m[mem.POLYNOMIAL_STEP] = h
    m[mem.CONTINUES] = 0.0
    fraction = kink_fraction(effects.rules, m, BEYOND)
    if fraction < 1.0 - KINK_REACH and m[mem.KINK_CUTS] < MOST_CUTS:
        # the guess did not show it; the solution is a good guess for the part before it
        m[mem.KINK_CUTS] += 1.0
        m[mem.RATE] = 1.0
        work[at.ERROR * W + lane] = 2.0
        work[at.NEXT_STEP * W + lane] = h * max(fraction, LEAST_CUT)
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
    propose(lane, W, work, m, iterations)


@scalar_function
def propose(lane, W, work, m, iterations):
    """The step to try next, and whether the explicit method could have taken this one."""
    h = m[mem.STEP]
    proposal = next_step(m, h, m[mem.TRIED_ERROR], iterations)
    if iterations == 1:
        m[mem.RATE_SLOPE] *= SLOPE_MEMORY
    elif m[mem.NEW_JACOBIAN] == 1.0:
        m[mem.RATE_SLOPE] = m[mem.RATE] / h
    if m[mem.RATE_SLOPE] > 0.0:
        proposal = min(proposal, BEST_RATE / m[mem.RATE_SLOPE])
    proposal = min(proposal, m[mem.CEILING])
    m[mem.CEILING] *= CEILING_GROWTH
    if m[mem.TRIED_ERROR] <= 1.0:
        if work[at.REJECTED * W + lane] == 1.0:
            proposal = min(proposal, h)
        if work[at.ENDING * W + lane] == 1.0:
            proposal = max(proposal, work[at.NEXT_STEP * W + lane])
        if m[mem.RATE] <= CHEAP_CONTRACTION and h <= proposal <= KEPT_TO * h:
            proposal = h
        calm = h * m[mem.NORM] < CALM_STIFFNESS and proposal < 2.0 * h
        work[at.CALM * W + lane] = work[at.CALM * W + lane] + 1.0 if calm else 0.0
    work[at.NEXT_STEP * W + lane] = proposal


@scalar_function
def leave(effects, n, lane, W, work, m):
    """Put the end of the step where an explicit step would leave it."""
    for k in range(n):
        work[(at.QS + k) * W + lane] = m[(at.QS + k) * LANES + END]
        work[(at.VS + k) * W + lane] = m[(at.VS + k) * LANES + END]
        work[(at.ACC + k) * W + lane] = m[(at.ACC + k) * LANES + END]
    leave_rates(effects, work, lane, W, m, LANES, END)


@scalar_function
def implicit_steps(blocks, numbers, work, stages, par, settings, tables, measures, memory):
    """`implicit_step` of one lane, with arrays at addresses."""
    of = carray(numbers, NUMBERS)
    W = of[WIDTH]
    effects = at.Stepped(rules_in(of), carray(measures, of[MEASURES]))
    block = at.Block(
        carray(work, at.WORK * W),
        carray(stages, at.MAX_COORDINATES * W),
        carray(par, at.PARAMETERS * W),
        None,
    )
    moved = Moved(of[MOTION_OF_EIGHT], of[COORDINATES], blocks, carray(tables, at.TABLES))
    lanes = carray(memory, (W, mem.MEMORY))
    implicit_step(effects, moved, of[LANE], W, block, lanes, carray(settings, SETTINGS))


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
def ask_implicit(address, numbers, block, method, memory, W):
    """One step of Radau IIA on every stiff lane, over whatever the explicit method left in its rows."""
    if memory is not None:
        work = block.work
        arrays = (
            numbers, work, block.stages, block.par, method.settings, method.tables, method.measures, memory
        )  # fmt: skip
        for i in range(W):
            if work[at.STIFF * W + i] * work[at.RUNNING * W + i] == 1.0:
                numbers[LANE] = i
                call_at(address, arrays)  # type: ignore[call-arg]
