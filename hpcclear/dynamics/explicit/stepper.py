"""The block stepper: W samples in lockstep, each with its own time, step, contact state and outcome.

A lane whose sample ends takes the next one from the queue. The stepper returns after a budget of steps with
its whole state in the arrays it was given, and goes on from there bit for bit.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit

from hpcclear.base.bits import beyond, borrowed
from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.one_text import one_text
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit import tableau as tab
from hpcclear.dynamics.explicit.combine import Step, any_stage_state, step_error
from hpcclear.dynamics.explicit.switching import sense_stiffness, settle_methods
from hpcclear.dynamics.implicit.stiff import ask_implicit
from hpcclear.dynamics.linkage.rhs import run_motion
from hpcclear.dynamics.stepping.control import (
    choose_step,
    commit,
    coordinate,
    flag_gaps,
    judge_step,
    measure,
    place,
)
from hpcclear.dynamics.stepping.record import record_step
from hpcclear.dynamics.stepping.settings import ATOL, CYCLE, GAP_TOLERANCE, RTOL, WIDTH
from hpcclear.dynamics.stepping.special import END_OF_REVOLUTION, END_OF_STEP, NEXT_SAMPLE, ask


@lane_function
def begin_stage(work, free, c, W):
    """Time of this stage within the revolution."""
    if not free:
        for i in range(W):
            work[at.STAGE_TIME * W + i] = work[at.TIME * W + i] + c * work[at.STEP * W + i]


@lane_function
def start_state(work, n, W):
    """The start of the step as a stage, for lanes whose accelerations there are not known yet."""
    for number in range(n):
        k = coordinate(number)
        for i in range(W):
            work[(at.QS + k) * W + i] = work[(at.Q + k) * W + i]
            work[(at.VS + k) * W + i] = work[(at.V + k) * W + i]


@lane_function
def adopt_fresh(work, stages, n, W):
    """Take over accelerations and rates at the start of the step on fresh lanes of the explicit method only."""
    for i in range(W):
        if work[at.FRESH * W + i] > work[at.STIFF * W + i]:
            for k in range(n):
                stages[k * W + i] = work[(at.ACC + k) * W + i]
            for r in range(at.RATES):
                work[(at.RATE_OLD + r) * W + i] = work[(at.RATE_NOW + r) * W + i]
            work[at.FRESH * W + i] = 0.0
            work[at.EVALUATIONS * W + i] += 1.0


@lane_function
def weigh_rate(work, rate, first, row, b, i, W):
    """Add a stage's rate to the sum that becomes its integral over the step."""
    before = work[(at.RATE_SUM + rate) * W + i]
    before = 0.0 if first else before
    work[(at.RATE_SUM + rate) * W + i] = before + b * work[(row + rate) * W + i]


@lane_function
def weigh_error(work, first, row, e, i, W):
    """Add a stage's gap to the sum that becomes the error of its integral."""
    before = work[(at.RATE_ERROR + at.GAP) * W + i]
    before = 0.0 if first else before
    work[(at.RATE_ERROR + at.GAP) * W + i] = before + e * work[(row + at.GAP) * W + i]


@lane_function
def weigh_rates(effects, work, first, row, b, e, lanes, W):
    """Add a stage's rates, times the weights b and e of its method, to the sums over the step.

    One loop over all gaps of all lanes, whose rows stand side by side: shorter ones the compiler unrolls instead of
    vectorising. One product a sum: of two it might fuse either, and lanes would differ from a single response in the last bit.
    """
    begin = place(effects.rules.begin)
    for k in range(place(effects.rules.end - 1 - begin) * W + W):
        i = begin * W + k
        weigh_rate(work, at.GAP, first, row, b, i, W)
        weigh_error(work, first, row, e, i, W)
    for r in range(len(effects.measures)):
        rate = measure(effects, r)
        for i in range(lanes):
            weigh_rate(work, rate, first, row, b, i, W)


@lane_function
def weigh_stage(effects, step, s, W):
    """Weigh the rates of stage s; those of the first stage are known from the step before."""
    work, weights, lanes = step.work, step.weights, step.lanes
    b, e = tab.WEIGHTS, tab.ERROR
    if s == 1:
        weigh_rates(effects, work, True, at.RATE_OLD, weights[b], weights[e], lanes, W)
    weigh_rates(effects, work, False, at.RATE_NOW, weights[b + s], weights[e + s], lanes, W)


@lane_function
def any_fresh(work, W):
    """Whether a lane of the explicit method does not know the accelerations at the start of its step."""
    fresh = 0.0
    for i in range(W):
        fresh += max(work[at.FRESH * W + i] - work[at.STIFF * W + i], 0.0)
    return fresh > 0.0


@lane_function
def take_explicit_steps(effects, motion, step, tables, memory, W):
    """One step of the pair on every lane, with its integrals and its error, and the scores of its stiffness."""
    work, weights = step.work, step.weights
    for s in range(0 if any_fresh(work, W) else 1, tab.STAGES):
        if s == 0:
            start_state(work, step.n, W)
        else:
            any_stage_state(step, s, W)
        begin_stage(work, effects.rules.free, weights[tab.NODES + s], W)
        run_motion(motion, work, tables)
        if s == 0:
            adopt_fresh(work, step.stages, step.n, W)
        else:
            weigh_stage(effects, step, s, W)
    step_error(effects, step, W)
    sense_stiffness(memory, step, W)
    for i in range(W):
        evaluations = (tab.STAGES - 1.0) * (1.0 - work[at.STIFF * W + i])
        work[at.EVALUATIONS * W + i] += evaluations


@lane_function
def load_lanes(special, numbers, block, queue, settings, W):
    """Give samples to lanes that rest. Returns how many run."""
    running = 0.0
    for i in range(W):
        if block.work[at.RUNNING * W + i] == 0.0:
            ask(special, NEXT_SAMPLE, i, numbers, block, queue, settings)
        running += block.work[at.RUNNING * W + i]
    return running


@lane_function
def judge_steps(special, rules, n, numbers, block, queue, settings, W):
    """Accept, cut or reject every lane's step. Returns the change of the number of running lanes."""
    work = block.work
    change = 0.0
    judge_step(work, settings, W)
    if flag_gaps(rules, work, n - 1, settings[GAP_TOLERANCE], settings[CYCLE], W) > 0.0:
        for i in range(W):
            if work[at.SPECIAL * W + i] == 1.0:
                change += ask(special, END_OF_STEP, i, numbers, block, queue, settings)
    return change


@lane_function
def end_revolutions(special, numbers, block, queue, settings, W):
    """Close the revolutions that ended. Returns the change of the number of running lanes."""
    work = block.work
    change = 0.0
    for i in range(W):
        ends = work[at.ACCEPT * W + i] * work[at.ENDING * W + i] * work[at.RUNNING * W + i]
        if ends == 1.0:
            change += ask(special, END_OF_REVOLUTION, i, numbers, block, queue, settings)
    return change


@lane_function
def borrowed_all(block, queue, method, W):
    """The same arrays without their counts of references, which functions that are not inlined would keep; what stands behind
    `work` at distances from it."""
    lent: Any = borrowed
    work = lent(block.work)
    return (
        at.Block(work, beyond(work, at.STAGES * W), beyond(work, at.WORK * W), lent(block.book)),  # type: ignore[call-arg]
        at.Queue(
            lent(queue.par), lent(queue.start), lent(queue.out),
            lent(queue.finished), lent(queue.counters),
        ),
        at.Method(
            lent(method.settings), lent(method.weights), lent(method.tables), lent(method.measures),
            lent(method.numbers),
        ),
    )  # fmt: skip


@lane_function
def advance(W, n, motion, special, implicit, rules, block, queue, method, record, memory, budget):
    """Take at most `budget` block steps. Returns whether lanes are running."""
    block, queue, method = borrowed_all(block, queue, method, W)
    effects = at.Stepped(rules, method.measures)
    settings, tables, numbers, work = method.settings, method.tables, method.numbers, block.work
    atol = settings[ATOL : ATOL + 2 * at.MAX_COORDINATES]
    lanes = numbers[WIDTH] & 127
    step = Step(work, block.stages, block.par, method.weights, n, settings[RTOL], atol, lanes)
    running = load_lanes(special, numbers, block, queue, settings, W)
    while budget > 0 and running > 0.0:
        budget -= 1
        choose_step(work, block.par, rules.free, W)
        stiff = settle_methods(memory, settings, work, W)
        if stiff < running:
            take_explicit_steps(effects, motion, step, tables, memory, W)
        if stiff > 0.0:
            ask_implicit(implicit, numbers, block, method, memory, W)
        running += judge_steps(special, rules, n, numbers, block, queue, settings, W)
        ended = commit(effects, work, block.stages, n, W)
        full = record_step(record, queue.counters, work, block.stages, block.book, n, W)
        if ended > 0.0:
            running += end_revolutions(special, numbers, block, queue, settings, W)
        if full:
            break
    return running > 0.0


@cache
def make_stepper(W: int, *, recorded: bool = False, implicit: bool = False) -> Callable[..., Any]:
    """Return the compiled stepper for W lanes, of any number of coordinates and any joints.

    Its arguments: the number of coordinates; the addresses of the motion of W lanes (`rhs.motion_of`), of
    `special.special_code` and of the implicit steps (`stiff.implicit_code`; 0 without); `layout.Rules`, `layout.Block`, `layout.Queue`, `layout.Method`; if `recorded` an array for the steps of lane 0;
    if `implicit` the memory of the implicit method (see `radau.new_memory`); and the budget: how many block steps to take at
    most. It returns True while lanes are running. W = 1 is the single response; ensembles want at least twice the
    vector length.
    """
    known: dict[str, Any] = {"W": W}
    if not recorded:
        known["record"] = None
    if not implicit:
        known["memory"] = None
    text = one_text(advance, f"stepper_{W}", **known)
    return njit(error_model="numpy", fastmath=FASTMATH, cache=True)(text)  # type: ignore[no-any-return]
