"""Weighted sums of stage accelerations over all lanes.

Lanes are the outer loop everywhere in the kernel: the sums inside have constant lengths where these functions
are called, unroll first, and leave one loop whose rows stand at known distances, which the compiler vectorises.
"""

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at


@lane_function
def latest(work, stages, k, n, stage, i, W):
    """Accelerations of the stage before, put away on the way (those of the first stage already are)."""
    if stage == 0:
        return stages[k * W + i]
    else:
        a = work[(at.ACC + k) * W + i]
        stages[(stage * n + k) * W + i] = a
        return a


@lane_function
def group_of(n):
    """Coordinates worked on in one loop over lanes: the compiler unrolls four of them, nine it would not."""
    return n if n <= 5 else 3


@lane_function
def stage_state(work, stages, weights, c, av, aq, n, terms, W):
    """Coordinates and velocities of a stage; `av`, `aq`: where its rows of A and A A start in `weights`."""
    for first in range(0, n, group_of(n)):
        stage_part(work, stages, weights, c, av, aq, n, first, group_of(n), terms, W)


@lane_function
def stage_part(work, stages, weights, c, av, aq, n, first, count, terms, W):
    """`stage_state` of some coordinates."""
    for i in range(W):
        h = work[at.STEP * W + i]
        for k in range(first, first + count):
            a = latest(work, stages, k, n, terms - 1, i, W)
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
def any_stage_state(work, stages, weights, c, av, aq, n, s, W):
    """`stage_state` for stage s, as many terms as stages before it."""
    if s == 1:
        stage_state(work, stages, weights, c, av, aq, n, 1, W)
    elif s == 2:
        stage_state(work, stages, weights, c, av, aq, n, 2, W)
    elif s == 3:
        stage_state(work, stages, weights, c, av, aq, n, 3, W)
    elif s == 4:
        stage_state(work, stages, weights, c, av, aq, n, 4, W)
    elif s == 5:
        stage_state(work, stages, weights, c, av, aq, n, 5, W)
    else:
        stage_state(work, stages, weights, c, av, aq, n, 6, W)


@lane_function
def gap_error(flag, work, par, gap, clearance, rtol, i, W):
    """Square of the error of a gap's integral, relative to the clearance times a revolution; 0 for an ideal joint.

    A journal that flies past the bearing's centre turns its gap around within a small part of a step that is
    smooth for the coordinates: without this the objective would be far less accurate than the motion.
    """
    if flag is not None:
        scale = rtol * par[clearance * W + i] * par[at.PERIOD * W + i]
        error = work[at.STEP * W + i] * work[(at.RATE_ERROR + gap) * W + i] / scale
        return error * error
    else:
        return 0.0


@lane_function
def step_error(crank_rod, rod_slider, work, stages, par, weights, ev, eq, n, rtol, atol, terms, W):
    """Mean square of the scaled error, per lane; `terms` stages come before the new point."""
    count = group_of(n)
    for first in range(0, n, count):
        for i in range(W):
            if first == 0:
                total = gap_error(
                    crank_rod, work, par, at.GAP_12, at.JOINT_12 + at.CLEARANCE, rtol, i, W
                )
                total += gap_error(
                    rod_slider, work, par, at.GAP_23, at.JOINT_23 + at.CLEARANCE, rtol, i, W
                )
            else:
                total = work[at.ERROR * W + i]
            for k in range(first, first + count):
                total += coordinate_error(
                    work, stages, weights, ev, eq, n, k, rtol, atol, terms, i, W
                )
            if first + count == n:
                total *= (0.5 / n) * par[at.STRICTNESS * W + i]
            work[at.ERROR * W + i] = total


@lane_function
def coordinate_error(work, stages, weights, ev, eq, n, k, rtol, atol, terms, i, W):
    """Squares of the scaled errors of one coordinate and its velocity, added."""
    h = work[at.STEP * W + i]
    a = work[(at.ACC + k) * W + i]
    dv = weights[ev + terms] * a
    dq = weights[eq + terms] * a
    for j in range(terms):
        a = stages[(j * n + k) * W + i]
        dv += weights[ev + j] * a
        dq += weights[eq + j] * a
    q = max(abs(work[(at.Q + k) * W + i]), abs(work[(at.QS + k) * W + i]))
    v = max(abs(work[(at.V + k) * W + i]), abs(work[(at.VS + k) * W + i]))
    dq = h * h * dq / (atol[k] + rtol * q)
    dv = h * dv / (atol[at.MAX_COORDINATES + k] + rtol * v)
    return dq * dq + dv * dv
