"""Weighted sums of stage accelerations over all lanes.

Lanes are the innermost loop that stays one: the sums inside it have constant lengths where these functions are called,
unroll first, and leave a loop whose rows stand at known distances, which the compiler vectorises. How many coordinates there
are it need not know.
"""

from typing import NamedTuple

from hpcclear.base.arrays import Array
from hpcclear.base.jit import lane_function
from hpcclear.base.unrolled import written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.stepping.control import coordinate, place
from hpcclear.dynamics.stepping.explicit import tableau as tab


class Step(NamedTuple):
    """What the sums over a step read: lanes, packed tableau, coordinates, relative tolerance; how many lanes there are, as a
    number that the compiler does not know: a loop of few instructions it would else write out, and not vectorise."""

    work: Array
    stages: Array
    par: Array
    weights: Array
    n: int
    rtol: float
    lanes: int


@lane_function
def stage_row(stage, k):
    """Where the accelerations of coordinate k at a stage stand."""
    return stage * at.MAX_COORDINATES + k


@lane_function
def latest(step, k, stage, i, W):
    """Accelerations of the stage before, put away on the way (those of the first stage already are)."""
    if stage == 0:
        return step.stages[k * W + i]
    a = step.work[(at.ACC + k) * W + i]
    step.stages[stage_row(stage, k) * W + i] = a
    return a


@lane_function
def stage_state(step, s, terms, W):
    """Coordinates and velocities of stage s, a sum of `terms` terms.

    Weights are read once: stores to lanes might change them, for all that the compiler knows.
    """
    work, stages, weights = step.work, step.stages, step.weights
    c = weights[tab.NODES + s]
    by_v: dict = {}
    by_q: dict = {}
    for j in written_out(range(terms)):
        by_v[j] = weights[tab.MATRIX + s * tab.STAGES + j]
        by_q[j] = weights[tab.SQUARE + s * tab.STAGES + j]
    for number in range(step.n):
        k = coordinate(number)
        for i in range(W):
            h = work[at.STEP * W + i]
            a = latest(step, k, terms - 1, i, W)
            dv = by_v[terms - 1] * a
            dq = by_q[terms - 1] * a
            for j in written_out(range(terms - 1)):
                a = stages[stage_row(j, k) * W + i]
                dv += by_v[j] * a
                dq += by_q[j] * a
            v = work[(at.V + k) * W + i]
            work[(at.VS + k) * W + i] = v + h * dv
            work[(at.QS + k) * W + i] = work[(at.Q + k) * W + i] + h * (c * v + h * dq)


@lane_function
def any_stage_state(step, s, stages, W):
    """`stage_state` for stage s of so many, as many terms as stages before it.

    A number from the start: lengths that the compiler finds out later it sums up in another order, which shows in the last bit.
    """
    for terms in written_out(range(1, stages)):
        if s == terms:
            stage_state(step, s, terms, W)


@lane_function
def gap_error(step, p, i, W):
    """Square of the error of the integral of joint p's gap, relative to the clearance times a revolution.

    A journal that flies past the bearing's centre turns its gap around within a small part of a step that is
    smooth for the coordinates: without this the objective would be far less accurate than the motion.
    """
    work, par = step.work, step.par
    clearance = at.JOINT_BLOCKS + at.JOINT_ROWS * p + at.CLEARANCE
    scale = step.rtol * par[clearance * W + i] * par[at.PERIOD * W + i]
    error = work[at.STEP * W + i] * work[(at.RATE_ERROR + at.GAP + p) * W + i] / scale
    return error * error


@lane_function
def step_error(effects, step, stages, W):
    """Mean square of the scaled error, per lane."""
    work, n = step.work, step.n
    for i in range(W):
        work[at.ERROR * W + i] = 0.0
    for joint in range(effects.rules.begin, effects.rules.end):
        p = place(joint)
        for i in range(step.lanes):
            work[at.ERROR * W + i] += gap_error(step, p, i, W)
    coordinate_errors(step, stages, W)
    for i in range(step.lanes):
        work[at.ERROR * W + i] *= (0.5 / n) * work[at.STRICTER * W + i]


@lane_function
def coordinate_errors(step, stages, W):
    """Add the squares of the scaled errors of coordinates and their velocities."""
    work, par, weights, rtol = step.work, step.par, step.weights, step.rtol
    by_v: dict = {}
    by_q: dict = {}
    for j in written_out(range(stages)):
        by_v[j] = weights[tab.ERROR + j]
        by_q[j] = weights[tab.ERROR_SQUARE + j]
    for number in range(step.n):
        k = coordinate(number)
        for i in range(W):
            h = work[at.STEP * W + i]
            a = work[(at.ACC + k) * W + i]
            dv = by_v[stages - 1] * a
            dq = by_q[stages - 1] * a
            for j in written_out(range(stages - 1)):
                a = step.stages[stage_row(j, k) * W + i]
                dv += by_v[j] * a
                dq += by_q[j] * a
            q = max(abs(work[(at.Q + k) * W + i]), abs(work[(at.QS + k) * W + i]))
            v = max(abs(work[(at.V + k) * W + i]), abs(work[(at.VS + k) * W + i]))
            dq = h * h * dq / (par[(at.LEAST + k) * W + i] + rtol * q)
            dv = h * dv / (par[(at.LEAST + at.MAX_COORDINATES + k) * W + i] + rtol * v)
            work[at.ERROR * W + i] += dq * dq + dv * dv
