"""Implicit steps where the motion is stiff (see `explicit.steps`): batches of eight stiff samples, one to a SIMD lane.

A stiff lane takes one step of Radau IIA where the others take an explicit one. Everything around the step (impacts, ends of
revolutions, sums, outcome) is the block stepper's: the implicit step leaves its result in the lane's rows as an explicit
step would. A sample keeps its column of the eight for as long as it is stiff, and none depends on what its neighbours hold.
"""

import math
from functools import cache

from hpcclear.base.bits import call_at, carray
from hpcclear.base.eight import above, fetch, put, size, spread
from hpcclear.base.jit import FASTMATH, lane_function, scalar_function
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import COUNTS, DOUBLES
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import NUMBERS, Asking, Stepped, block_at, rules_in
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.stepping.implicit import columns, control, kinks, memory as mem, newton
from hpcclear.dynamics.stepping.implicit.memory import ALL_KINKS, COLUMNS, STAGES, Moved, N


@lane_function
def begin_function(latched, m, f):
    """Keep one kink function where steps begin: as evaluated there, or at the end of the step before, but for contacts that
    have ended with that; mem.NOW counts what changed its sign, or came or went."""
    before, nothing = fetch(m, mem.START_KINKS + f), spread(0.0)
    last = fetch(m, mem.STAGE_KINKS + (STAGES - 1) * ALL_KINKS + f)
    if latched:
        last = above(fetch(m, at.ACTIVE + f // mem.KINKS_A_JOINT), last, nothing)
    known, follows = fetch(m, mem.KNOWN), fetch(m, mem.FOLLOWS)
    kept = above(follows, last, before)
    now = above(known, kept, fetch(m, mem.STAGE_KINKS + f))
    put(m, mem.START_KINKS + f, now)
    both = above(size(before) + size(now), spread(1.0), nothing)
    changed = above(before * now, nothing, both)
    put(m, mem.NOW, fetch(m, mem.NOW) + changed)


@scalar_function
def begin_kinks(rules, m):
    """Keep the kink functions where steps begin; what was learnt before one has changed its sign is forgotten."""
    put(m, mem.NOW, spread(0.0))
    for f in range(mem.KINKS_A_JOINT * rules.begin, mem.KINKS_A_JOINT * rules.end):
        begin_function(rules.latched, m, f)
    for i in range(COLUMNS):
        if m[mem.NOW * COLUMNS + i] > 0.0:
            control.forget_kinks(m, i)


@scalar_function
def begin_steps(effects, moved, W, block, m, settings):
    """Bring the starts of all columns' steps into them."""
    unknown = False
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        if lane >= 0 and columns.begin_column(effects, moved, lane, W, block, m, i, settings):
            unknown = True
    if unknown:
        newton.start_of_step(moved, m)
        kinks.kink_functions(effects.rules, m, mem.STAGE_KINKS)
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        if lane >= 0 and not columns.holds(m, mem.KNOWN, i):
            columns.adopt_start(moved.n, lane, W, block, m, i)
    follows = fetch(m, mem.FOLLOWS)
    for s in range(STAGES):
        for k in range(moved.n):  # polynomials of the steps before, where those were accepted
            old, kept = mem.Z + s * N + k, mem.KEPT + s * N + k
            put(m, kept, above(follows, fetch(m, old), fetch(m, kept)))
    begin_kinks(effects.rules, m)
    tolerance = newton.number(m, mem.TOLERANCE)
    for k in range(moved.n):
        for row, unit in ((at.Q + k, k), (at.V + k, N + k)):
            there = fetch(m, mem.LEAST + unit) + size(fetch(m, row))
            put(m, mem.INVERSE_SCALE + unit, 1.0 / (tolerance * there))


@scalar_function
def first_guess(moved, W, work, m):
    """First guess of all columns' stages."""
    news = False
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        new = lane >= 0 and columns.is_new(work, W, lane)
        columns.flag(m, mem.ASKED, i, new)
        news = news or new
    if news:
        newton.guess_from_start(moved.n, m)
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        if lane >= 0:
            if columns.holds(m, mem.ASKED, i):
                m[mem.POLYNOMIAL_STEP + i] = m[mem.STEP + i]
                m[mem.CONTINUES + i] = 0.0
            work[at.STIFF_STEPS_HERE * W + lane] += 1.0
        columns.flag(m, mem.ASKED, i, lane >= 0 and not columns.holds(m, mem.ASKED, i))
    newton.guess(moved.n, m)


@scalar_function
def show_kinks(rules, m):
    """Where one of the stages lies beyond a kink, to mem.SHOWN: below 0."""
    shown = spread(1.0)
    for f in range(mem.KINKS_A_JOINT * rules.begin, mem.KINKS_A_JOINT * rules.end):
        start = fetch(m, mem.START_KINKS + f)
        for s in range(STAGES):
            shown = newton.least(shown, start * fetch(m, mem.STAGE_KINKS + s * ALL_KINKS + f))
    put(m, mem.SHOWN, shown)


@scalar_function
def kink_fraction(rules, m, i, beyond):
    """Fraction of a column's step at which the first kink lies behind, by the cubics through the evaluated stages; 2 where
    `show_kinks` has seen none.

    `beyond`: how far, in units of the kink's function, a stage must be for it to count.
    """
    first = 2.0
    if not m[mem.SHOWN * COLUMNS + i] < 0.0:
        return first
    for f in range(mem.KINKS_A_JOINT * rules.begin, mem.KINKS_A_JOINT * rules.end):
        start = m[(mem.START_KINKS + f) * COLUMNS + i]
        one = m[(mem.STAGE_KINKS + f) * COLUMNS + i]
        two = m[(mem.STAGE_KINKS + ALL_KINKS + f) * COLUMNS + i]
        three = m[(mem.STAGE_KINKS + 2 * ALL_KINKS + f) * COLUMNS + i]
        first = min(first, kinks.crossing(start, one, two, three, beyond))
    return first


@scalar_function
def cut_at_kinks(effects, moved, W, work, m):
    """Evaluate the guessed stages, and cut the steps that show a kink."""
    newton.observe_stages(effects, moved, m, False)
    show_kinks(effects.rules, m)
    any_cut = False
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        columns.flag(m, mem.ASKED, i, False)
        if lane >= 0:
            work[at.EVALUATIONS * W + lane] += 3.0
            guessed = m[mem.POLYNOMIAL_STEP + i] > 0.0
            fraction = kink_fraction(effects.rules, m, i, kinks.GUESSED_BEYOND) if guessed else 2.0
            if fraction < 1.0:
                h = m[mem.STEP + i]
                m[mem.POLYNOMIAL_STEP + i] = h
                h *= max(fraction, control.LEAST_CUT)
                m[mem.STEP + i] = h
                work[at.STEP * W + lane] = h
                work[at.ENDING * W + lane] = 0.0
                work[at.RESUMED * W + lane] = 0.0
                m[mem.CONTINUES + i] = 0.0
                work[at.EVALUATIONS * W + lane] += 3.0
                columns.flag(m, mem.ASKED, i, True)
                any_cut = True
    if any_cut:
        newton.guess(moved.n, m)
        newton.evaluate_stages(moved, m)


@scalar_function
def norms_of_jacobians(n, m):
    """Estimates of the largest eigenvalues in 1/s from row sums, in units that make angles and lengths comparable."""
    by_q, by_v = spread(0.0), spread(0.0)
    for r in range(n):
        row_q, row_v = spread(0.0), spread(0.0)
        for k in range(n):
            unit = fetch(m, mem.LEAST + N + k)
            row_q = row_q + unit * size(fetch(m, mem.BY_Q + r * N + k))
            row_v = row_v + unit * size(fetch(m, mem.BY_V + r * N + k))
        inverse = 1.0 / fetch(m, mem.LEAST + N + r)
        by_q, by_v = newton.most(by_q, row_q * inverse), newton.most(by_v, row_v * inverse)
    put(m, mem.NORM // COLUMNS, by_v)
    put(m, mem.NOW, by_q)
    for i in range(COLUMNS):
        m[mem.NORM + i] += math.sqrt(m[mem.NOW * COLUMNS + i])


@scalar_function
def solve_steps(effects, moved, W, work, m):
    """Solve for the stages of all columns: the outcome is in mem.ITERATIONS."""
    cut_at_kinks(effects, moved, W, work, m)
    newton.new_jacobian(moved, m)
    norms_of_jacobians(moved.n, m)
    newton.make_inverses(moved.n, m)
    for i in range(COLUMNS):
        columns.flag(m, mem.ASKED, i, columns.owner(m, i) >= 0)
    newton.newton(moved, m)
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        if lane >= 0:
            again = abs(m[mem.ITERATIONS * COLUMNS + i]) - 1.0
            work[at.EVALUATIONS * W + lane] += 2.0 * moved.n + 3.0 * again


@scalar_function
def estimate_errors(moved, W, work, m):
    """Sums of the squares of all columns' scaled errors, to mem.NOW."""
    for k in range(moved.n):
        put(m, mem.SHIFTED + k, fetch(m, mem.START + k))
        put(m, mem.SHIFTED + N + k, spread(0.0))
    newton.filtered_error(moved.n, m)
    again = False
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        columns.flag(m, mem.ASKED, i, False)
        if lane >= 0:
            uneasy = work[at.REJECTED * W + lane] == 1.0 or m[mem.ACCEPTED_STEP + i] == 0.0
            if m[mem.NOW * COLUMNS + i] > 2.0 * moved.n and uneasy:
                work[at.EVALUATIONS * W + lane] += 1.0
                columns.flag(m, mem.ASKED, i, True)
                again = True
    if again:
        newton.refilter_error(moved, m)


@scalar_function
def end_column(effects, moved, lane, W, work, m, i):
    """What a column's step has come to: its end, its error and the step to try next."""
    iterations = m[mem.ITERATIONS * COLUMNS + i]
    if iterations < 0.0:
        columns.bring_back(moved.n, m, i)
        control.give_up(lane, W, work, m, i)
        return
    work[at.EVALUATIONS * W + lane] += 3.0
    m[mem.POLYNOMIAL_STEP + i] = m[mem.STEP + i]
    m[mem.CONTINUES + i] = 0.0
    fraction = kink_fraction(effects.rules, m, i, kinks.BEYOND)
    if fraction < 1.0 - control.KINK_REACH and m[mem.KINK_CUTS + i] < control.MOST_CUTS:
        control.cut_again(lane, W, work, m, i, fraction)
        return
    m[mem.KINK_CUTS + i] = 0.0
    total = m[mem.NOW * COLUMNS + i] + columns.gap_errors(effects.rules, lane, W, work, m, i)
    columns.leave(effects, moved.n, lane, W, work, m, i)
    mean = total * (0.5 / moved.n)
    m[mem.TRIED_ERROR + i] = math.sqrt(mean)
    work[at.ERROR * W + lane] = mean
    control.propose(lane, W, work, m, i, iterations)


@scalar_function
def eight_steps(effects, moved, W, block, m, settings):
    """Try one step of `work[STEP]` on the lanes of eight columns; what comes of it goes into their rows."""
    begin_steps(effects, moved, W, block, m, settings)
    first_guess(moved, W, block.work, m)
    solve_steps(effects, moved, W, block.work, m)
    estimate_errors(moved, W, block.work, m)
    # as the last correction left them: integrals and kinks fit the end of the step
    newton.observe_stages(effects, moved, m, True)
    show_kinks(effects.rules, m)
    for i in range(COLUMNS):
        lane = columns.owner(m, i)
        if lane >= 0:
            end_column(effects, moved, lane, W, block.work, m, i)


@scalar_function
def is_held(m):
    """Whether a lane is in one of the columns."""
    held = False
    for i in range(COLUMNS):
        held = held or columns.owner(m, i) >= 0
    return held


@scalar_function
def batch_steps(numbers, work, stages, par, settings, tables, measures, memory):
    """`eight_steps` of all stiff lanes, with arrays at addresses."""
    of = carray(numbers, NUMBERS)
    W = of[Asking.WIDTH]
    block = block_at(W, work, stages, par, None)
    effects = Stepped(rules_in(of), carray(measures, of[Asking.MEASURES]))
    observing, motion = of[Asking.OBSERVING_EIGHT], of[Asking.MOTION_OF_EIGHT]
    moved = Moved(observing, motion, of[Asking.COORDINATES], carray(tables, at.MAX_CURVES))
    eights = carray(memory, ((W + COLUMNS - 1) // COLUMNS, mem.MEMORY))
    columns.settle_columns(block.work, W, eights)
    for e in range(len(eights)):
        if is_held(eights[e]):
            eight_steps(effects, moved, W, block, eights[e], carray(settings, RunSettings.size))


@cache
def batch_code() -> Compiled:
    """The compiled implicit steps of any lanes, joints and coordinates; steppers take their ``address``."""
    return Compiled(batch_steps, (COUNTS, *[DOUBLES] * 5, COUNTS, DOUBLES), FASTMATH)


@lane_function
def ask_implicit(address, numbers, block, method, memory):
    """One step of Radau IIA on every stiff lane, over whatever the explicit method left in its rows."""
    if memory is not None:
        arrays = (
            numbers, block.work, block.stages, block.par, method.settings, method.tables, method.measures, memory
        )  # fmt: skip
        call_at(address, arrays)
