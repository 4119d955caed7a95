"""The block stepper: W samples in lockstep, each with its own time, step, contact state and outcome.

A lane whose sample ends takes the next one from the queue. The stepper returns after a budget of steps with
its whole state in the arrays it was given, and goes on from there bit for bit.
"""

from collections.abc import Callable
from functools import cache
from typing import Any

from numba import njit

from hpcclear.base.bits import borrowed
from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.jit import scalar_function as lane_event
from hpcclear.base.one_text import one_text
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit import tableau as tab
from hpcclear.dynamics.explicit.combine import Step, any_stage_state, step_error
from hpcclear.dynamics.explicit.switching import sense_stiffness, settle_methods
from hpcclear.dynamics.implicit.stiff import take_implicit_steps
from hpcclear.dynamics.linkage.rhs import run_motion
from hpcclear.dynamics.stepping.control import (
    choose_step,
    commit,
    flag_gaps,
    judge_step,
    measure,
)
from hpcclear.dynamics.stepping.record import record_step
from hpcclear.dynamics.stepping.sample import OK, UNFINISHED, end_revolution, failure, finish, load
from hpcclear.dynamics.stepping.settings import ATOL, CYCLE, GAP_TOLERANCE, RTOL
from hpcclear.dynamics.stepping.stops import (
    impacts,
    integrate_gap,
    stop_at_kinks,
    turn_of_free_crank,
    wrap_crank,
)


@lane_function
def begin_stage(work, free, c, W):
    """Time of this stage within the revolution."""
    if not free:
        for i in range(W):
            work[at.STAGE_TIME * W + i] = work[at.TIME * W + i] + c * work[at.STEP * W + i]


@lane_function
def start_state(work, n, W):
    """The start of the step as a stage, for lanes whose accelerations there are not known yet."""
    for k in range(n):
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
def weigh_gap(flag, work, gap, first, row, b, e, i, W):
    """Add a stage's gap to the sums that become its integral and the error of that."""
    if flag is not None:
        weigh_rate(work, gap, first, row, b, i, W)
        before = work[(at.RATE_ERROR + gap) * W + i]
        before = 0.0 if first else before
        work[(at.RATE_ERROR + gap) * W + i] = before + e * work[(row + gap) * W + i]


@lane_function
@unrolled
def weigh_rates(effects, work, first, row, b, e, W):
    """Add a stage's rates, times the weights b and e of its method, to the sums over the step.

    One loop for all gaps: shorter ones the compiler unrolls instead of vectorising. One product a sum: of two it might
    fuse either, and lanes would differ from a single response in the last bit.
    """
    for i in range(W):
        for gap in written_out(at.GAPS):
            weigh_gap(getattr(effects.open, gap.asked_by), work, gap.rate, first, row, b, e, i, W)
    for r in range(len(effects.measures)):
        rate = measure(effects, r)
        for i in range(W):
            weigh_rate(work, rate, first, row, b, i, W)


@lane_function
def weigh_stage(effects, work, weights, s, W):
    """Weigh the rates of stage s; those of the first stage are known from the step before."""
    b, e = tab.WEIGHTS, tab.ERROR
    if s == 1:
        weigh_rates(effects, work, True, at.RATE_OLD, weights[b], weights[e], W)
    weigh_rates(effects, work, False, at.RATE_NOW, weights[b + s], weights[e + s], W)


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
            weigh_stage(effects, work, weights, s, W)
    step_error(effects, step, W)
    sense_stiffness(memory, step, W)
    for i in range(W):
        evaluations = (tab.STAGES - 1.0) * (1.0 - work[at.STIFF * W + i])
        work[at.EVALUATIONS * W + i] += evaluations


@lane_event
@unrolled
def integrate_gaps(effects, i, W, work):
    """Integrals of the gaps of open joints that change sign in a special lane's step."""
    for joint in written_out(at.JOINTS):
        integrate_gap(getattr(effects.open, joint.flag), i, W, work, joint)


@lane_event
def end_of_step(effects, i, W, n, block, settings):
    """What the end of a special lane's step shows: it may be cut. Returns OK or why the lane ends."""
    work = block.work
    status = failure(i, W, n, work, block.stages, settings)
    if status == OK and work[at.ACCEPT * W + i] == 1.0:
        impacts(effects, i, W, work, settings)
        if work[at.ACCEPT * W + i] == 1.0:
            stop_at_kinks(effects, i, W, work, settings)
        if work[at.ACCEPT * W + i] == 1.0:
            status = turn_of_free_crank(effects.rules.free, i, W, work, settings, n - 1)
        integrate_gaps(effects, i, W, work)
    return status


@lane_event
def change_sample(i, W, n, status, block, queue, settings):
    """Write down a lane's sample, if its status is one, and give it the next. Returns whether there is one."""
    if status != UNFINISHED:
        finish(i, W, n, status, block, queue, settings)
    load(i, W, n, block, queue, settings)
    return block.work[at.RUNNING * W + i]


@lane_event
def close_revolution(effects, i, W, n, block, settings):
    """What the end of a lane's revolution brings. Returns UNFINISHED or why the lane ends."""
    wrap_crank(effects.rules.turning, i, W, block.work, n - 1, settings)
    return end_revolution(i, W, block.work, block.book, settings)


@lane_function
def load_lanes(W, n, block, queue, settings):
    """Give samples to lanes that rest. Returns how many run."""
    running = 0.0
    for i in range(W):
        if block.work[at.RUNNING * W + i] == 0.0:
            change_sample(i, W, n, UNFINISHED, block, queue, settings)
        running += block.work[at.RUNNING * W + i]
    return running


@lane_function
def judge_steps(effects, n, block, queue, settings, W):
    """Accept, cut or reject every lane's step. Returns the change of the number of running lanes."""
    work = block.work
    change = 0.0
    special = judge_step(work, settings, W)
    special += flag_gaps(
        effects, work, n - 1, settings[GAP_TOLERANCE], settings[CYCLE], W,
    )  # fmt: skip
    if special > 0.0:
        for i in range(W):
            if work[at.SPECIAL * W + i] == 1.0:
                status = end_of_step(effects, i, W, n, block, settings)
                if status != OK:
                    change += change_sample(i, W, n, status, block, queue, settings) - 1.0
    return change


@lane_function
def end_revolutions(effects, n, block, queue, settings, W):
    """Close the revolutions that ended. Returns the change of the number of running lanes."""
    work = block.work
    change = 0.0
    for i in range(W):
        ends = work[at.ACCEPT * W + i] * work[at.ENDING * W + i] * work[at.RUNNING * W + i]
        if ends == 1.0:
            status = close_revolution(effects, i, W, n, block, settings)
            if status != UNFINISHED:
                change += change_sample(i, W, n, status, block, queue, settings) - 1.0
    return change


@lane_function
def borrowed_all(block, queue, method):
    """The same arrays without their counts of references, which functions that are not inlined would keep."""
    lent: Any = borrowed
    return (
        at.Block(lent(block.work), lent(block.stages), lent(block.par), lent(block.book)),
        at.Queue(
            lent(queue.par), lent(queue.start), lent(queue.out),
            lent(queue.finished), lent(queue.counters),
        ),
        at.Method(
            lent(method.settings), lent(method.weights), lent(method.tables), lent(method.measures)
        ),
    )  # fmt: skip


@lane_function
def advance(joints, n, W, motion, bank, rules, block, queue, method, record, memory, budget):
    """Take at most `budget` block steps. Returns whether lanes are running."""
    block, queue, method = borrowed_all(block, queue, method)
    effects = at.Stepped(joints, rules, method.measures)
    settings, tables, work = method.settings, method.tables, block.work
    atol = settings[ATOL : ATOL + 2 * at.MAX_COORDINATES]
    step = Step(work, block.stages, block.par, method.weights, n, settings[RTOL], atol)
    running = load_lanes(W, n, block, queue, settings)
    while budget > 0 and running > 0.0:
        budget -= 1
        choose_step(work, block.par, effects.rules.free, W)
        implicit = settle_methods(memory, settings, work, W)
        if implicit < running:
            take_explicit_steps(effects, motion, step, tables, memory, W)
        if implicit > 0.0:
            take_implicit_steps(effects, bank, n, block, tables, memory, settings, W)
        running += judge_steps(effects, n, block, queue, settings, W)
        ended = commit(effects, work, block.stages, n, W)
        full = record_step(record, queue.counters, work, block.stages, block.book, n, W)
        if ended > 0.0:
            running += end_revolutions(effects, n, block, queue, settings, W)
        if full:
            break
    return running > 0.0


@cache
def make_stepper(
    W: int, n: int, joints: at.Open, *, recorded: bool = False, implicit: bool = False
) -> Callable[..., Any]:
    """Return the compiled stepper for W lanes of n coordinates, with these joints open.

    Its arguments: the addresses of the motion of W lanes and of eight (`rhs.motion_of`), `layout.Rules`, `layout.Block`,
    `layout.Queue`, `layout.Method`, if `recorded` an array for the steps of lane 0, if `implicit` the memory of the implicit
    method (see `radau.new_memory`), and the budget: how many block steps to take at most. It returns True while lanes are
    running. W = 1 is the single response; ensembles want at least twice the vector length.

    Raises
    ------
    ValueError
        If there are not 1 to `MAX_COORDINATES` coordinates.
    """
    if not 1 <= n <= at.MAX_COORDINATES:
        raise ValueError(f"the stepper holds 1 to {at.MAX_COORDINATES} coordinates, not {n}")
    known: dict[str, Any] = {"joints": joints, "n": n, "W": W}
    if not recorded:
        known["record"] = None
    if not implicit:
        known["memory"] = None
    text = one_text(advance, f"stepper_{W}", **known)
    return njit(error_model="numpy", fastmath=FASTMATH, cache=True)(text)  # type: ignore[no-any-return]
