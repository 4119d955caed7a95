"""The block stepper: W samples in a batch, each with its own time, step, contact state and outcome.

A lane whose sample ends takes the next one from the queue. The stepper returns after a budget of steps with
its whole state in the arrays it was given, and goes on from there bit for bit.
"""

import ctypes
from functools import cache
from typing import NamedTuple

from hpcclear.base.bits import beyond, call_at
from hpcclear.base.jit import FASTMATH, lane_function, narrow_vectors
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import Kind
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import Asking, Block, Stepped, rules_in
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.linkage.rhs import run_motion
from hpcclear.dynamics.stepping.control import choose_step, commit, flag_gaps, judge_step
from hpcclear.dynamics.stepping.explicit.steps import settle_methods
from hpcclear.dynamics.stepping.implicit.batch import ask_implicit
from hpcclear.dynamics.stepping.peaks import peaks_inside
from hpcclear.dynamics.stepping.record import record_step
from hpcclear.dynamics.stepping.special import END_OF_REVOLUTION, END_OF_STEP, NEXT_SAMPLE, ask


@lane_function
def load_lanes(special, numbers, block, queue, method, W):
    """Give samples to lanes that rest. Returns how many run."""
    running = 0.0
    for i in range(W):
        if block.work[at.RUNNING * W + i] == 0.0:
            ask(special, NEXT_SAMPLE, i, numbers, block, queue, method)
        running += block.work[at.RUNNING * W + i]
    return running


@lane_function
def judge_steps(special, rules, n, numbers, block, queue, method, W):
    """Accept, cut or reject every lane's step. Returns the change of the number of running lanes."""
    work, settings = block.work, method.settings
    change = 0.0
    judge_step(work, settings, W)
    if flag_gaps(rules, work, block.par, n - 1, settings[RunSettings.gap_tolerance], W) > 0.0:
        for i in range(W):
            if work[at.SPECIAL * W + i] == 1.0:
                change += ask(special, END_OF_STEP, i, numbers, block, queue, method)
    return change


@lane_function
def end_revolutions(special, numbers, block, queue, method, W):
    """Close the revolutions that ended. Returns the change of the number of running lanes."""
    work = block.work
    change = 0.0
    for i in range(W):
        ends = work[at.ACCEPT * W + i] * work[at.ENDING * W + i] * work[at.RUNNING * W + i]
        if ends == 1.0:
            change += ask(special, END_OF_REVOLUTION, i, numbers, block, queue, method)
    return change


@lane_function
def ask_explicit(address, block, method):
    """One step of the pair on every lane, by `steps.explicit_code`."""
    arrays = (
        method.numbers, block.work, method.settings, method.weights, method.tables, method.measures
    )  # fmt: skip
    call_at(address, arrays)


@lane_function
def advance(W, codes, block, queue, method, record, memory, budget):
    """Take at most `budget` block steps. Returns whether lanes are running."""
    if W == 1:
        narrow_vectors()
    settings, numbers, work = method.settings, method.numbers, block.work
    n, rules = numbers[Asking.COORDINATES], rules_in(numbers)
    behind = beyond(work, at.STAGES * W), beyond(work, at.WORK * W)  # at known distances
    block = Block(work, behind[0], behind[1], block.book)
    running = load_lanes(codes.special, numbers, block, queue, method, W)
    while budget > 0 and running > 0.0:
        budget -= 1
        choose_step(rules, work, block.par, W)
        stiff = settle_methods(memory, settings, work, W)
        if stiff < running:
            ask_explicit(codes.explicit, block, method)
        if stiff > 0.0:
            ask_implicit(codes.implicit, numbers, block, method, memory)
        running += judge_steps(codes.special, rules, n, numbers, block, queue, method, W)
        if rules.profile:
            run_motion(numbers[Asking.PROFILE], work, method.tables)
        peaks_inside(rules, work, block.par, W)
        ended = commit(Stepped(rules, method.measures), work, block.stages, n, W)
        full = record_step(record, queue.counters, work, block.stages, block.book, n, W)
        if ended > 0.0:
            running += end_revolutions(codes.special, numbers, block, queue, method, W)
        if full:
            break
    return running > 0.0


class Codes(NamedTuple):
    """Addresses of what a stepper calls: `special.special_code`, `steps.explicit_code`, `batch.batch_code` (0 without)."""

    special: int
    explicit: int
    implicit: int


@cache
def make_stepper(W: int, kinds: tuple[Kind, ...], *, implicit: bool = False) -> Compiled:
    """Return the compiled stepper for W lanes, of any number of coordinates and any joints.

    Its arguments, of these kinds: `Codes`, and of `layout.arguments` `Block`, `Queue`, `Method`; an array for the steps of the
    first sample (see `record.record_step`); if `implicit` the memory of the implicit method (see `columns.new_columns`); and
    the budget: how many block steps to take at most. It returns 1 while lanes are running. A response and an ensemble call the
    same machine code; ensembles want at least twice the vector length.
    """
    known: dict[str, object] = {"W": W}
    if not implicit:
        known["memory"] = None
    return Compiled(advance, kinds, FASTMATH, ctypes.c_int64, **known)
