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
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit.combine import any_stage_state, step_error
from hpcclear.dynamics.explicit.switching import sense_stiffness, settle_methods
from hpcclear.dynamics.implicit.stiff import take_implicit_steps
from hpcclear.dynamics.linkage.rhs import accelerations
from hpcclear.dynamics.stepping.control import choose_step, commit, flag_gaps, judge_step
from hpcclear.dynamics.stepping.lifecycle import (
    ATOL,
    BETA,
    EXPONENT,
    FINISHED,
    GAP_TOLERANCE,
    MAX_STEPS,
    NEXT_SLOT,
    OK,
    RTOL,
    SLOTS,
    SMALLEST_STEP,
    UNFINISHED,
    end_revolution,
    end_turn_of_free_crank,
    failure,
    finish,
    integrate_gap,
    load,
    stop_at_impacts,
    stop_at_kinks,
)
from hpcclear.dynamics.stepping.record import record_step


@lane_function
def begin_stage(work, par, torque, c, W):
    """Time of this stage within the revolution."""
    if torque is None:
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
def weigh_gap(flag, work, gap, first, row, b, e, i, W):
    """Add a stage's gap to the sums that become its integral over the step and the error of that."""
    if flag is not None:
        weigh_rate(flag, work, gap, first, row, b, i, W)
        before = work[(at.RATE_ERROR + gap) * W + i]
        before = 0.0 if first else before
        work[(at.RATE_ERROR + gap) * W + i] = before + e * work[(row + gap) * W + i]


@lane_function
def weigh_rate(flag, work, rate, first, row, b, i, W):
    """Add a stage's rate to the sum that becomes its integral over the step."""
    if flag is not None:
        before = work[(at.RATE_SUM + rate) * W + i]
        before = 0.0 if first else before
        work[(at.RATE_SUM + rate) * W + i] = before + b * work[(row + rate) * W + i]


@lane_function
def weigh_rates(crank_rod, rod_slider, ledger, responses, work, first, row, b, e, W):
    """Add a stage's rates, times the weights b and e of its method, to the sums over the step.

    One loop for all: shorter ones the compiler unrolls instead of vectorising. One product a sum: of two it might
    fuse either, and lanes would differ from a single response in the last bit.
    """
    for i in range(W):
        weigh_gap(crank_rod, work, at.GAP_12, first, row, b, e, i, W)
        weigh_gap(rod_slider, work, at.GAP_23, first, row, b, e, i, W)
        weigh_rate(ledger, work, at.DRIVE_POWER, first, row, b, i, W)
        weigh_rate(ledger, work, at.ABS_DRIVE_POWER, first, row, b, i, W)
        weigh_rate(ledger, work, at.DISSIPATION, first, row, b, i, W)
        weigh_rate(ledger, work, at.LOAD_POWER, first, row, b, i, W)
        weigh_rate(responses, work, at.FORCE_12, first, row, b, i, W)
        weigh_rate(responses, work, at.FORCE_23, first, row, b, i, W)
        weigh_rate(responses, work, at.SLIDER_ACCELERATION, first, row, b, i, W)
        weigh_rate(responses, work, at.SLIDER_SQUARE, first, row, b, i, W)


@lane_function
def weigh_stage(effects, work, weights, s, count, W):
    """Weigh the rates of stage s; those of the first stage are known from the step before."""
    B = count + 2 * count * count
    E = B + count
    if s == 1:
        weigh_rates(
            effects.crank_rod, effects.rod_slider, effects.ledger, effects.responses, work,
            True, at.RATE_OLD, weights[B], weights[E], W,
        )  # fmt: skip
    weigh_rates(
        effects.crank_rod, effects.rod_slider, effects.ledger, effects.responses, work,
        False, at.RATE_NOW, weights[B + s], weights[E + s], W,
    )  # fmt: skip


@lane_function
def free_crank_turn(torque, lane, W, work, settings, last):
    """End the step where a crank that is a coordinate ends its revolution; the status if it never will."""
    if torque is not None:
        return end_turn_of_free_crank(lane, W, work, settings, last)
    else:
        return OK


@lane_function
def impacts(latched, lane, W, work, settings):
    """End the step at the first impact inside it, under laws that need the impact speed."""
    if latched is not None:
        stop_at_impacts(lane, W, work, settings)


@lane_function
def wrap_crank(torque, baumgarte, lane, W, work, last):
    """Count a crank angle that is a coordinate anew each turn, so that it keeps its precision."""
    if torque is not None or baumgarte is not None:
        work[(at.Q + last) * W + lane] -= at.TURN


@cache
def make_stepper(W: int, n: int) -> Callable[..., Any]:
    """Return the compiled stepper for W lanes of n coordinates.

    Its arguments: effects (`layout.Effects`), number of stages, packed tableau, settings,
    work, stages (stages n W), par, book, drive and load tables, the queue (parameters, states), out,
    finished, counters, record (array or None), memory of the implicit method (see `radau.new_memory`; None switches it off)
    and budget: how many block steps to take at most.
    It returns True while lanes are running. W = 1 is the single response; ensembles want at least twice the
    vector length.
    """

    size = (0,) * n  # a length the compiler knows, for scalar code

    @njit(error_model="numpy", fastmath=FASTMATH, cache=True)
    def stepper(
        effects, count, weights, settings, work, stages, par, book, torque_table, load_table,
        queue_par, queue_state, out, finished, counters, record, memory, budget,
    ):  # fmt: skip
        # scalar functions would count references to what they are handed
        settings, work, stages = borrowed(settings), borrowed(work), borrowed(stages)  # type: ignore[call-arg]
        par, book, out, memory = borrowed(par), borrowed(book), borrowed(out), borrowed(memory)
        torque_table, load_table = borrowed(torque_table), borrowed(load_table)
        queue_par, queue_state = borrowed(queue_par), borrowed(queue_state)
        finished, counters = borrowed(finished), borrowed(counters)
        # offsets in the packed tableau: c, A, A A, b, e, e A
        A = count
        AA = A + count * count
        E = AA + count * count + count
        EA = E + count
        LAST = EA + count
        atol = settings[ATOL : ATOL + 2 * at.MAX_COORDINATES]
        running = 0.0
        for i in range(W):
            if work[at.RUNNING * W + i] == 0.0:
                load(i, W, n, work, par, book, queue_par, queue_state, counters, settings)
            running += work[at.RUNNING * W + i]
        while budget > 0 and running > 0.0:
            budget -= 1
            choose_step(work, par, effects.torque, W)
            implicit = settle_methods(memory, settings, work, W)
            if implicit < running:
                fresh = 0.0
                for i in range(W):
                    fresh += max(work[at.FRESH * W + i] - work[at.STIFF * W + i], 0.0)
                for s in range(0 if fresh > 0.0 else 1, count):
                    if s == 0:
                        start_state(work, n, W)
                    else:
                        any_stage_state(
                            work,
                            stages,
                            weights,
                            weights[s],
                            A + s * count,
                            AA + s * count,
                            n,
                            s,
                            W,
                        )
                    begin_stage(work, par, effects.torque, weights[s], W)
                    accelerations(effects, work, par, torque_table, load_table, W)
                    if s == 0:
                        adopt_fresh(work, stages, n, W)
                    else:
                        weigh_stage(effects, work, weights, s, count, W)
                step_error(
                    effects.crank_rod, effects.rod_slider, work, stages, par, weights, E, EA, n,
                    settings[RTOL], atol, 6, W,
                )  # fmt: skip
                sense_stiffness(memory, work, stages, weights, LAST, atol, n, 6, W)
                for i in range(W):
                    work[at.EVALUATIONS * W + i] += (count - 1.0) * (1.0 - work[at.STIFF * W + i])
            if implicit > 0.0:
                take_implicit_steps(
                    effects, size, work, stages, par, torque_table, load_table, memory, settings, W
                )
            special = judge_step(
                work,
                settings[EXPONENT],
                settings[BETA],
                settings[MAX_STEPS],
                settings[SMALLEST_STEP],
                W,
            )
            special += flag_gaps(
                effects.crank_rod, effects.rod_slider, effects.torque, effects.latched,
                work, n - 1, settings[GAP_TOLERANCE], W,
            )  # fmt: skip
            if special > 0.0:
                for i in range(W):
                    if work[at.SPECIAL * W + i] == 1.0:
                        status = failure(i, W, n, work, stages, settings)
                        if status == OK and work[at.ACCEPT * W + i] == 1.0:
                            impacts(effects.latched, i, W, work, settings)
                            if work[at.ACCEPT * W + i] == 1.0:
                                stop_at_kinks(i, W, work, settings)
                            if work[at.ACCEPT * W + i] == 1.0:
                                status = free_crank_turn(
                                    effects.torque, i, W, work, settings, n - 1
                                )
                            integrate_gap(i, W, work, at.GAP_12)
                            integrate_gap(i, W, work, at.GAP_23)
                        if status != OK:
                            finish(i, W, n, status, work, book, out, finished, counters)
                            load(
                                i, W, n, work, par, book, queue_par, queue_state, counters, settings
                            )
                            running += work[at.RUNNING * W + i] - 1.0
            ended = commit(
                effects.crank_rod, effects.rod_slider, effects.latched, effects.ledger,
                effects.responses, work, stages, n, W,
            )  # fmt: skip
            full = record_step(record, counters, work, stages, book, n, W)
            if ended > 0.0:
                for i in range(W):
                    if (
                        work[at.ACCEPT * W + i] * work[at.ENDING * W + i] * work[at.RUNNING * W + i]
                        == 1.0
                    ):
                        wrap_crank(effects.torque, effects.baumgarte, i, W, work, n - 1)
                        status = end_revolution(i, W, work, book, settings)
                        if status != UNFINISHED:
                            finish(i, W, n, status, work, book, out, finished, counters)
                            load(
                                i, W, n, work, par, book, queue_par, queue_state, counters, settings
                            )
                            running += work[at.RUNNING * W + i] - 1.0
            if full:
                break
        return running > 0.0

    return stepper


__all__ = ["FINISHED", "NEXT_SLOT", "SLOTS", "make_stepper"]
