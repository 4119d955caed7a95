"""Which lanes take implicit steps: scores of stiffness on the explicit lanes, and when a stiff lane comes back.

All that a scene which may be stiff has to pay for lanes that are not.
"""

from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.stepping.control import coordinate, count_up
from hpcclear.dynamics.stepping.explicit import tableau as tab
from hpcclear.dynamics.stepping.explicit.combine import stage_row

CALM_STEPS = 6.0  # so many in a row send a lane back
EDGE = 1.0  # h lambda above which an explicit step counts as held up by stiffness
CHATTER = 4.0  # or that times the change over the step between its last two stages: as good a sign
EDGE_LIMIT = 40.0  # such a score sends a lane to the implicit method
EDGE_STRICT = 3.0  # such a score makes its tolerance stricter until it is 0 again
REJECTION_LIMIT = 5.0  # or this one: friction that chatters shows little else
REJECTION_MEMORY = 0.9


@lane_function
def settle_methods(memory, settings, work, W):
    """Decide, between steps, which lanes go on with which method. Returns how many take implicit steps."""
    count = 0.0
    if memory is not None:
        always = 1.0 if settings[RunSettings.implicit] == 2.0 else 0.0
        for i in range(W):
            stiff = work[at.STIFF * W + i]
            go = 1.0 if work[at.EDGE_SCORE * W + i] >= EDGE_LIMIT else 0.0
            go = max(go, 1.0 if work[at.REJECTION_SCORE * W + i] >= REJECTION_LIMIT else 0.0)
            stay = 1.0 if work[at.CALM * W + i] < CALM_STEPS else 0.0
            new = max(stay if stiff == 1.0 else go, always)
            same = 1.0 if new == stiff else 0.0
            work[at.STIFF * W + i] = new
            for row in (at.EDGE_SCORE, at.REJECTION_SCORE, at.CALM, at.STIFF_STEPS_HERE):
                score = work[row * W + i]
                work[row * W + i] = score if same == 1.0 else 0.0
            count = count_up(count, new * work[at.RUNNING * W + i])
    return count


@lane_function
def edge_excess(step, k, stages, i, W):
    """Square of the change of acceleration between the last two stages of the pair less that of the velocity times EDGE / h.

    Both stages stand at the end of the step: summed over the coordinates it is positive where h lambda, estimated as
    h |a7 - a6| / |v7 - v6|, is above `EDGE` (Hairer and Wanner, Solving ODEs II, IV.2). Friction that saturates within
    the step hides its slope from this estimate; but then the acceleration changes far more between these two stages
    than over the whole step, which on a smooth path it never does.
    """
    new = step.work[(at.ACC + k) * W + i]
    change = new - step.stages[stage_row(stages - 2, k) * W + i]
    dv = 0.0  # without a factor h
    for j in range(stages - 1):
        dv += step.weights[tab.LAST + j] * step.stages[stage_row(j, k) * W + i]
    scale = 1.0 / step.atol[at.MAX_COORDINATES + k]
    over_step = CHATTER * (abs(new - step.stages[k * W + i]) + 1e-8 * abs(new))
    least = min(EDGE * abs(dv), over_step) * scale
    change *= scale
    return change * change - least * least


@lane_function
def sense_stiffness(step, stages, W):
    """Scores of stiffness on the explicit lanes: steps at the edge of stability, less half a point for any other, and a
    decaying count of rejections. What stays at the edge gets the stricter tolerance, which costs nothing there."""
    work = step.work
    for i in range(W):
        work[at.EDGE_EXCESS * W + i] = -1e-300
    for number in range(step.n):
        k = coordinate(number)
        for i in range(W):
            work[at.EDGE_EXCESS * W + i] += edge_excess(step, k, stages, i, W)
    for i in range(W):
        at_edge = 1.0 if work[at.EDGE_EXCESS * W + i] > 0.0 else 0.0
        score = work[at.EDGE_SCORE * W + i] + 1.5 * at_edge - 0.5
        score = min(max(score, 0.0), EDGE_LIMIT)
        work[at.EDGE_SCORE * W + i] = score
        rejected = 1.0 if work[at.ERROR * W + i] > 1.0 else 0.0
        count = REJECTION_MEMORY * work[at.REJECTION_SCORE * W + i] + rejected
        work[at.REJECTION_SCORE * W + i] = count
        usual = work[at.STRICTER_WITHIN * W + i]
        before = work[at.STRICTER * W + i]
        new = work[at.STRICTER_AT_EDGE * W + i] if score >= EDGE_STRICT else before
        new = usual if score == 0.0 else new
        # of lanes that implicit steps move, stages mean nothing
        work[at.STRICTER * W + i] = before if work[at.STIFF * W + i] == 1.0 else new
