"""One explicit step of every lane: stages, integrals, error. Compiled for a number of lanes, and called by its address.

Also which lanes take implicit steps: scores of stiffness on the explicit lanes, and when a stiff lane comes back. That is all
that a scene which may be stiff has to pay for lanes that are not.
"""

from functools import cache

from hpcclear.base.bits import beyond, carray
from hpcclear.base.jit import FASTMATH, lane_function, narrow_vectors
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import COUNTS, DOUBLES
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import NUMBERS, Asking, Stepped, rules_in
from hpcclear.dynamics.layout.views import RunSettings
from hpcclear.dynamics.linkage.rhs import run_observed
from hpcclear.dynamics.stepping.control import coordinate, count_up, measure, place
from hpcclear.dynamics.stepping.explicit import tableau as tab
from hpcclear.dynamics.stepping.explicit.combine import Step, any_stage_state, stage_row, step_error

CALM_STEPS = 7.0  # so many in a row send a lane back
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
    scale = 1.0 / step.par[(at.LEAST + at.MAX_COORDINATES + k) * W + i]
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


@lane_function
def start_state(work, n, W):
    """The start of the step as a stage, for lanes whose accelerations there are not known yet."""
    for number in range(n):
        k = coordinate(number)
        for i in range(W):
            work[(at.QS + k) * W + i] = work[(at.Q + k) * W + i]
            work[(at.VS + k) * W + i] = work[(at.V + k) * W + i]


@lane_function
def adopt_fresh(effects, work, stages, n, W):
    """Take over accelerations and rates at the start of the step on fresh lanes of the explicit method only."""
    for i in range(W):
        if work[at.FRESH * W + i] > work[at.STIFF * W + i]:
            for k in range(n):
                stages[k * W + i] = work[(at.ACC + k) * W + i]
            for r in range(at.PROFILES if effects.rules.profile else at.ANGLES):
                work[(at.RATE_OLD + r) * W + i] = work[(at.RATE_NOW + r) * W + i]
            for c in range(effects.rules.curves):
                for r in (at.PLACES + c, at.PLACE_RATES + c):
                    work[(at.RATE_OLD + r) * W + i] = work[(at.RATE_NOW + r) * W + i]
            work[at.FRESH * W + i] = 0.0
            work[at.EVALUATIONS * W + i] += 1.0


@lane_function
def weigh(work, sums, rate, first, row, weight, i, W):
    """Add a stage's rate, weighted, to a sum over the step: that of its integral, or of the error of that."""
    before = work[(sums + rate) * W + i]
    before = 0.0 if first else before
    work[(sums + rate) * W + i] = before + weight * work[(row + rate) * W + i]


@lane_function
def weigh_rates(effects, work, first, row, b, e, lanes, W):
    """Add a stage's rates, times the weights b and e of its method, to the sums over the step.

    One loop over all gaps of all lanes, whose rows are contiguous: shorter ones the compiler unrolls instead of
    vectorising. One product a sum: of two it might fuse either, and lanes would differ from a single response in the last bit.
    What has no weight, as one or two of the stages of every pair, is left out.
    """
    begin = place(effects.rules.begin)
    if (b != 0.0) | (e != 0.0):
        for k in range(place(effects.rules.end - 1 - begin) * W + W):
            i = begin * W + k
            weigh(work, at.RATE_SUM, at.GAP, first, row, b, i, W)
            weigh(work, at.RATE_ERROR, at.GAP, first, row, e, i, W)
    if b != 0.0:
        for r in range(len(effects.measures)):
            rate = measure(effects, r)
            for i in range(lanes):
                weigh(work, at.RATE_SUM, rate, first, row, b, i, W)


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
def take_explicit_steps(effects, observing, motion, step, tables, senses, stages, W):
    """One step of the pair on every lane, with its integrals and its error, and the scores of its stiffness."""
    work, weights = step.work, step.weights
    for s in range(0 if any_fresh(work, W) else 1, stages):
        if s == 0:
            start_state(work, step.n, W)
        else:
            any_stage_state(step, s, stages, W)
        c = weights[tab.NODES + s]
        for i in range(step.lanes):
            work[at.STAGE_TIME * W + i] = work[at.TIME * W + i] + c * work[at.STEP * W + i]
        run_observed(observing, motion, work, tables)
        if s == 0:
            adopt_fresh(effects, work, step.stages, step.n, W)
        else:
            weigh_stage(effects, step, s, W)
    step_error(effects, step, stages, W)
    if senses != 0.0:
        sense_stiffness(step, stages, W)
    for i in range(W):
        evaluations = (stages - 1.0) * (1.0 - work[at.STIFF * W + i])
        work[at.EVALUATIONS * W + i] += evaluations


@lane_function
def explicit_steps(W, stages, numbers, lanes, settings, weights, tables, measures):
    """`take_explicit_steps` for arrays at addresses."""
    if W == 1:
        narrow_vectors()
    of = carray(numbers, NUMBERS)
    work = carray(lanes, (at.STAGES + stages * at.MAX_COORDINATES) * W)
    entries = carray(settings, RunSettings.size)
    behind, par = beyond(work, at.STAGES * W), beyond(work, at.WORK * W)
    rtol, n, count = entries[RunSettings.rtol], of[Asking.COORDINATES], of[Asking.WIDTH] & 127
    step = Step(work, behind, par, carray(weights, tab.PACKED), n, rtol, count)
    effects = Stepped(rules_in(of), carray(measures, of[Asking.MEASURES]))
    curves, senses = carray(tables, at.MAX_CURVES), entries[RunSettings.senses]
    observing, motion = of[Asking.OBSERVING], of[Asking.MOTION]
    take_explicit_steps(effects, observing, motion, step, curves, senses, stages, W)


@cache
def explicit_code(W: int, stages: int) -> Compiled:
    """The compiled steps of W lanes by pairs of so many stages; their ``address`` is what steppers take."""
    return Compiled(explicit_steps, (COUNTS, *[DOUBLES] * 4, COUNTS), FASTMATH, W=W, stages=stages)
