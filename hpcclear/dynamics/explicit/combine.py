"""Weighted sums of stage accelerations over all lanes.

Lanes are the outer loop everywhere in the kernel: the sums inside have constant lengths where these functions
are called, unroll first, and leave one loop whose rows stand at known distances, which the compiler vectorises.
"""

from typing import Any, NamedTuple

from hpcclear.base.jit import lane_function
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.explicit import tableau as tab

LATER_STAGES = range(1, tab.STAGES)
"""Numbers, so that the sums have constant lengths from the start: lengths that the compiler finds out later it sums up in
another order, which shows in the last bit."""


class Step(NamedTuple):
    """What the sums over a step read: lanes, packed tableau, coordinates, tolerances (`atol` of coordinates, then of
    velocities from MAX_COORDINATES on)."""

    work: Any
    stages: Any
    par: Any
    weights: Any
    n: Any
    rtol: Any
    atol: Any


@lane_function
def latest(step, k, stage, i, W):
    """Accelerations of the stage before, put away on the way (those of the first stage already are)."""
    if stage == 0:
        return step.stages[k * W + i]
    else:
        a = step.work[(at.ACC + k) * W + i]
        step.stages[(stage * step.n + k) * W + i] = a
        return a


@lane_function
def group_of(n):
    """Coordinates worked on in one loop over lanes: the compiler unrolls up to five of them, nine it would not.

    A divisor of n, so that no group is left over: a second copy of the sums for that would be compiled by all.
    """
    return n if n <= 5 else 3 if n % 3 == 0 else 4 if n % 4 == 0 else 1


@lane_function
def stage_state(step, s, terms, W):
    """Coordinates and velocities of stage s, a sum of `terms` terms."""
    n = step.n
    count = group_of(n)
    for first in range(0, n, count):
        stage_part(step, s, first, count, terms, W)


@lane_function
def stage_part(step, s, first, count, terms, W):
    """`stage_state` of some coordinates."""
    work, stages, weights, n = step.work, step.stages, step.weights, step.n
    c = weights[tab.NODES + s]
    av = tab.MATRIX + s * tab.STAGES
    aq = tab.SQUARE + s * tab.STAGES
    for i in range(W):
        h = work[at.STEP * W + i]
        for k in range(first, first + count):
            a = latest(step, k, terms - 1, i, W)
            dv = weights[av + terms - 1] * a
            dq = weights[aq + terms - 1] * a
            for j in range(terms - 1):
                a = stages[(j * n + k) * W + i]
                dv += weights[av + j] * a
                dq += weights[aq + j] * a
            v = work[(at.V + k) * W + i]
            work[(at.VS + k) * W + i] = v + h * dv
            work[(at.QS + k) * W + i] = work[(at.Q + k) * W + i] + h * (c * v + h * dq)


@lane_function
@unrolled
def any_stage_state(step, s, W):
    """`stage_state` for stage s, as many terms as stages before it: a number that the compiler has to know."""
    for terms in written_out(LATER_STAGES):
        if s == terms:
            stage_state(step, s, terms, W)


@lane_function
def gap_error(flag, step, gap, clearance, i, W):
    """Square of the error of a gap's integral, relative to the clearance times a revolution; 0 for an ideal joint.

    A journal that flies past the bearing's centre turns its gap around within a small part of a step that is
    smooth for the coordinates: without this the objective would be far less accurate than the motion.
    """
    if flag is not None:
        work, par = step.work, step.par
        scale = step.rtol * par[clearance * W + i] * par[at.PERIOD * W + i]
        error = work[at.STEP * W + i] * work[(at.RATE_ERROR + gap) * W + i] / scale
        return error * error
    else:
        return 0.0


@lane_function
@unrolled
def gap_errors(effects, step, i, W):
    """Squares of the scaled errors of all gaps' integrals, added."""
    total = 0.0
    for gap in written_out(at.GAPS):
        total += gap_error(getattr(effects.open, gap.asked_by), step, gap.rate, gap.clearance, i, W)
    return total


@lane_function
def error_part(effects, step, first, count, W):
    """`step_error` of some coordinates; the gaps' with the first of them."""
    work = step.work
    for i in range(W):
        total = gap_errors(effects, step, i, W) if first == 0 else work[at.ERROR * W + i]
        for k in range(first, first + count):
            total += coordinate_error(step, k, i, W)
        if first + count == step.n:
            total *= (0.5 / step.n) * step.par[at.STRICTNESS * W + i]
        work[at.ERROR * W + i] = total


@lane_function
def step_error(effects, step, W):
    """Mean square of the scaled error, per lane."""
    n = step.n
    count = group_of(n)
    for first in range(0, n, count):
        error_part(effects, step, first, count, W)


@lane_function
def coordinate_error(step, k, i, W):
    """Squares of the scaled errors of one coordinate and its velocity, added."""
    work, stages, weights, rtol, atol = step.work, step.stages, step.weights, step.rtol, step.atol
    h = work[at.STEP * W + i]
    a = work[(at.ACC + k) * W + i]
    dv = weights[tab.ERROR + tab.STAGES - 1] * a
    dq = weights[tab.ERROR_SQUARE + tab.STAGES - 1] * a
    for j in range(tab.STAGES - 1):
        a = stages[(j * step.n + k) * W + i]
        dv += weights[tab.ERROR + j] * a
        dq += weights[tab.ERROR_SQUARE + j] * a
    q = max(abs(work[(at.Q + k) * W + i]), abs(work[(at.QS + k) * W + i]))
    v = max(abs(work[(at.V + k) * W + i]), abs(work[(at.VS + k) * W + i]))
    dq = h * h * dq / (atol[k] + rtol * q)
    dv = h * dv / (atol[at.MAX_COORDINATES + k] + rtol * v)
    return dq * dq + dv * dv
