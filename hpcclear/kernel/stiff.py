"""Radau IIA of order 5 for the lanes whose motion has become stiff: scalar code, one step of one lane at a time.

Everything around the step (impacts, ends of revolutions, books, outcome) is the block stepper's: the step leaves its
result in the lane's rows as an explicit step would. Source: Hairer and Wanner, Solving ODEs II, IV.8 (RADAU5,
doi:10.1007/978-3-642-05221-7), with two simplifications that q' = v allows:

- the stages of q follow from those of v, ``Zq = h (c v + A Zv)``, so Newton's unknowns are Zv alone;
- for each eigenvalue mu/h of (h A)^-1 the linear system has n unknowns instead of 2 n, with the matrix
  ``mu/h - da/dv - (h/mu) da/dq``.
"""

import math

import numpy as np

from ..jit import lane_function, scalar_function
from . import layout as at
from .control import count_up
from .dense import factorise, factorise_complex, solve, solve_complex
from .jacobian import difference_jacobian, evaluate_lane
from .lifecycle import ATOL, IMPLICIT, RTOL

_S6 = math.sqrt(6.0)
NODES = np.array([(4.0 - _S6) / 10.0, (4.0 + _S6) / 10.0, 1.0])
MATRIX = np.array(
    [
        [(88.0 - 7.0 * _S6) / 360.0, (296.0 - 169.0 * _S6) / 1800.0, (-2.0 + 3.0 * _S6) / 225.0],
        [(296.0 + 169.0 * _S6) / 1800.0, (88.0 + 7.0 * _S6) / 360.0, (-2.0 - 3.0 * _S6) / 225.0],
        [(16.0 - _S6) / 36.0, (16.0 + _S6) / 36.0, 1.0 / 9.0],
    ]
)
MU = 3.0 + 3.0 ** (2.0 / 3.0) - 3.0 ** (1.0 / 3.0)  # real eigenvalue of the inverse of A
MU_RE = 3.0 + 0.5 * (3.0 ** (1.0 / 3.0) - 3.0 ** (2.0 / 3.0))
MU_IM = -0.5 * (3.0 ** (5.0 / 6.0) + 3.0 ** (7.0 / 6.0))
# A^-1 = T diag(MU, [[MU_RE, -MU_IM], [MU_IM, MU_RE]]) T^-1
T = np.array(
    [
        [0.09443876248897524, -0.14125529502095421, 0.03002919410514742],
        [0.25021312296533332, 0.20412935229379994, -0.38294211275726192],
        [1.0, 1.0, 0.0],
    ]
)
T_INVERSE = np.array(
    [
        [4.17871859155190428, 0.32768282076106237, 0.52337644549944951],
        [-4.17871859155190428, -0.32768282076106237, 0.47662355450055044],
        [0.50287263494578682, -2.57192694985560522, 0.59603920482822492],
    ]
)
ERROR_WEIGHTS = np.array([(-13.0 - 7.0 * _S6) / 3.0, (-13.0 + 7.0 * _S6) / 3.0, -1.0 / 3.0])
ERROR_BY_MATRIX = ERROR_WEIGHTS @ MATRIX
# coefficients of x, x^2, x^3 of the polynomial through 0 at x = 0 and 1 at one of the nodes, 0 at the others
BASIS = np.array(
    [
        [13.0 / 3.0 + 7.0 * _S6 / 3.0, -23.0 / 3.0 - 22.0 * _S6 / 3.0, 10.0 / 3.0 + 5.0 * _S6],
        [13.0 / 3.0 - 7.0 * _S6 / 3.0, -23.0 / 3.0 + 22.0 * _S6 / 3.0, 10.0 / 3.0 - 5.0 * _S6],
        [1.0 / 3.0, -8.0 / 3.0, 10.0 / 3.0],
    ]
)

MAX_ITERATIONS = 8
NEWTON_TOLERANCE = 0.03
CHEAP_CONTRACTION = 0.002  # below it the Jacobian is kept
STEP_SAFETY = 0.9
LARGEST_SHRINK, LARGEST_GROWTH = 0.2, 8.0
KEPT_FROM, KEPT_TO = 1.0, 1.2  # a growth between these is not worth new factors
CALM_STIFFNESS = 1.0  # h |J| below which the explicit method would do
CALM_STEPS = 3.0
STIFF_STEPS_NEEDED = 10.0
REJECTION_LIMIT = 3.0
REJECTION_MEMORY = 0.9
EDGE = 1.0

# ---- memory of one lane: rows like those of `work` with one lane, its parameters, then what follows
_N = at.MAX_COORDINATES
PAR = at.WORK
(
    POLYNOMIAL_STEP,  # s, of the step whose stages are kept; 0 when there are none
    TRIED_ERROR,  # of the step last tried
    ACCEPTED_STEP,  # s, of the step last accepted, for the predictive control
    ACCEPTED_ERROR,
    CONTRACTION,  # of Newton's iteration, rate over 1 - rate
    RATE,  # its last rate of convergence
    FACTORED_STEP,  # s, for which the factors hold; 0 when they do not
    NEW_JACOBIAN,  # 1 while the Jacobian is that of the start of this step
    NORM,  # estimate of the largest eigenvalue of the Jacobian, 1/s
) = range(PAR + at.PARAMETERS, PAR + at.PARAMETERS + 9)
Z = PAR + at.PARAMETERS + 9  # increments of the velocities at the stages, stage by stage
TRANSFORMED = Z + 3 * _N
FORCE = TRANSFORMED + 3 * _N  # accelerations at the stages
CHANGE = FORCE + 3 * _N
START = CHANGE + 3 * _N  # accelerations at the start of the step
SCALE = START + _N  # tolerances of coordinates, then velocities
LEAST = SCALE + 2 * _N
STAGE_RATES = LEAST + 2 * _N
BY_Q = STAGE_RATES + 3 * at.RATES
BY_V = BY_Q + _N * _N
REAL = BY_V + _N * _N
COMPLEX_RE = REAL + _N * _N
COMPLEX_IM = COMPLEX_RE + _N * _N
PIVOT = COMPLEX_IM + _N * _N
COMPLEX_PIVOT = PIVOT + _N
MEMORY = COMPLEX_PIVOT + _N


@scalar_function
def loosened(rtol, strictness):
    """Relative tolerance for an error estimate of order 3 that makes the fifth-order result as good as rtol asks.

    As in RADAU5. `strictness`: square of how many times tighter this sample's tolerances are.
    """
    return 0.1 * (rtol / math.sqrt(strictness)) ** (2.0 / 3.0)


@scalar_function
def take_over(size, lane, W, work, par, m, settings):
    """Forget what is known of an earlier stretch: the lane comes from the explicit method or is new."""
    n = len(size)
    for k in range(at.PARAMETERS):
        m[PAR + k] = par[k * W + lane]
    for k in range(n):
        m[LEAST + k] = settings[ATOL + k] / settings[RTOL]
        m[LEAST + n + k] = settings[ATOL + at.MAX_COORDINATES + k] / settings[RTOL]
    m[POLYNOMIAL_STEP] = 0.0
    m[ACCEPTED_STEP] = 0.0
    m[CONTRACTION] = 1.0
    m[RATE] = 1.0
    m[FACTORED_STEP] = 0.0


@scalar_function
def fetch(effects, size, lane, W, work, stages, m, p, torque_table, load_table, settings):
    """Bring the start of the step into the lane's memory: state, contact state, accelerations, tolerances."""
    n = len(size)
    for row in (
        at.TIME,
        at.STEP,
        at.ACTIVE_12,
        at.ACTIVE_23,
        at.INVERSE_IMPACT_12,
        at.INVERSE_IMPACT_23,
    ):
        m[row] = work[row * W + lane]
    for k in range(n):
        m[at.Q + k] = work[(at.Q + k) * W + lane]
        m[at.V + k] = work[(at.V + k) * W + lane]
    if work[at.FRESH * W + lane] == 1.0:
        m[NEW_JACOBIAN] = 0.0
        m[RATE] = 1.0
        start_of_step(n, m)
        evaluate_lane(effects, m, p, torque_table, load_table)
        for k in range(n):
            stages[k * W + lane] = m[at.ACC + k]
        for r in range(at.RATES):
            work[(at.RATE_OLD + r) * W + lane] = m[at.RATE_NOW + r]
        work[at.FRESH * W + lane] = 0.0
        work[at.EVALUATIONS * W + lane] += 1.0
    rtol = loosened(settings[RTOL], m[PAR + at.STRICTNESS])
    for k in range(n):
        m[START + k] = stages[k * W + lane]
        m[SCALE + k] = rtol * (m[LEAST + k] + abs(m[at.Q + k]))
        m[SCALE + n + k] = rtol * (m[LEAST + n + k] + abs(m[at.V + k]))


@scalar_function
def start_of_step(n, m):
    """The start of the step as a stage."""
    m[at.STAGE_TIME] = m[at.TIME]
    for k in range(n):
        m[at.QS + k] = m[at.Q + k]
        m[at.VS + k] = m[at.V + k]


@scalar_function
def norm_of_jacobian(size, m):
    """Estimate of the largest eigenvalue in 1/s from row sums, in units that make angles and lengths comparable."""
    n = len(size)
    by_q = 0.0
    by_v = 0.0
    for r in range(n):
        row_q = 0.0
        row_v = 0.0
        for k in range(n):
            unit = m[LEAST + n + k] / m[LEAST + n + r]
            row_q += abs(m[BY_Q + r * n + k]) * unit
            row_v += abs(m[BY_V + r * n + k]) * unit
        by_q = max(by_q, row_q)
        by_v = max(by_v, row_v)
    return by_v + math.sqrt(by_q)


@scalar_function
def factorise_both(size, m, h):
    """Factors of the real and the complex system for step h. Returns False if one is singular."""
    n = len(size)
    square = MU_RE * MU_RE + MU_IM * MU_IM
    for r in range(n):
        for c in range(n):
            j = r * n + c
            unit = 1.0 / h if r == c else 0.0
            m[REAL + j] = MU * unit - m[BY_V + j] - (h / MU) * m[BY_Q + j]
            m[COMPLEX_RE + j] = MU_RE * unit - m[BY_V + j] - (h * MU_RE / square) * m[BY_Q + j]
            m[COMPLEX_IM + j] = MU_IM * unit + (h * MU_IM / square) * m[BY_Q + j]
    m[FACTORED_STEP] = h
    real = factorise(size, m, REAL, PIVOT)
    return factorise_complex(size, m, COMPLEX_RE, COMPLEX_IM, COMPLEX_PIVOT) and real


@scalar_function
def guess_stages(size, m, h, accepted):
    """First guess of the stages: the polynomial of the step before, or of the longer try from the same start."""
    n = len(size)
    old = m[POLYNOMIAL_STEP]
    for s in range(3):
        for k in range(n):
            m[CHANGE + s * n + k] = 0.0
        if old > 0.0:
            x = NODES[s] * h / old
            x = 1.0 + x if accepted else x
            for j in range(3):
                weight = x * (BASIS[j, 0] + x * (BASIS[j, 1] + x * BASIS[j, 2]))
                weight -= 1.0 if (accepted and j == 2) else 0.0
                for k in range(n):
                    m[CHANGE + s * n + k] += weight * m[Z + j * n + k]
    for s in range(3):
        for k in range(n):
            m[Z + s * n + k] = m[CHANGE + s * n + k]
    for s in range(3):
        for k in range(n):
            total = 0.0
            for j in range(3):
                total += T_INVERSE[s, j] * m[Z + j * n + k]
            m[TRANSFORMED + s * n + k] = total


@scalar_function
def set_stage(n, m, h, s):
    """Coordinates and velocities of stage s from the increments of the velocities."""
    m[at.STAGE_TIME] = m[at.TIME] + NODES[s] * h
    for k in range(n):
        sum_z = 0.0
        for j in range(3):
            sum_z += MATRIX[s, j] * m[Z + j * n + k]
        v = m[at.V + k]
        m[at.VS + k] = v + m[Z + s * n + k]
        m[at.QS + k] = m[at.Q + k] + h * (NODES[s] * v + sum_z)


@scalar_function
def evaluate_stages(effects, size, m, p, torque_table, load_table, h):
    """Accelerations and rates at the three stages."""
    n = len(size)
    for s in range(3):
        set_stage(n, m, h, s)
        evaluate_lane(effects, m, p, torque_table, load_table)
        for k in range(n):
            m[FORCE + s * n + k] = m[at.ACC + k]
        for r in range(at.RATES):
            m[STAGE_RATES + s * at.RATES + r] = m[at.RATE_NOW + r]


@scalar_function
def correct(size, m, h):
    """One correction of simplified Newton. Returns its size relative to the tolerance."""
    n = len(size)
    lam, re, im = MU / h, MU_RE / h, MU_IM / h
    for k in range(n):
        f0, f1, f2 = m[FORCE + k], m[FORCE + n + k], m[FORCE + 2 * n + k]
        w0, w1, w2 = m[TRANSFORMED + k], m[TRANSFORMED + n + k], m[TRANSFORMED + 2 * n + k]
        r0 = T_INVERSE[0, 0] * f0 + T_INVERSE[0, 1] * f1 + T_INVERSE[0, 2] * f2
        r1 = T_INVERSE[1, 0] * f0 + T_INVERSE[1, 1] * f1 + T_INVERSE[1, 2] * f2
        r2 = T_INVERSE[2, 0] * f0 + T_INVERSE[2, 1] * f1 + T_INVERSE[2, 2] * f2
        m[CHANGE + k] = r0 - lam * w0
        m[CHANGE + n + k] = r1 - (re * w1 - im * w2)
        m[CHANGE + 2 * n + k] = r2 - (re * w2 + im * w1)
    solve(size, m, REAL, PIVOT, CHANGE)
    solve_complex(size, m, COMPLEX_RE, COMPLEX_IM, COMPLEX_PIVOT, CHANGE + n, CHANGE + 2 * n)
    total = 0.0
    for k in range(n):
        inverse_v = 1.0 / m[SCALE + n + k]
        inverse_q = h / (MU * m[SCALE + k])
        weight = inverse_v * inverse_v + inverse_q * inverse_q
        for s in range(3):
            change = m[CHANGE + s * n + k]
            total += weight * change * change
            m[TRANSFORMED + s * n + k] += change
        w0, w1, w2 = m[TRANSFORMED + k], m[TRANSFORMED + n + k], m[TRANSFORMED + 2 * n + k]
        for s in range(3):
            m[Z + s * n + k] = T[s, 0] * w0 + T[s, 1] * w1 + T[s, 2] * w2
    return math.sqrt(total / (3.0 * n))


@scalar_function
def newton(effects, size, m, p, torque_table, load_table, h):
    """Solve for the stages. Returns the evaluations it took, negative if it did not converge."""
    before = 1.0
    contraction = max(m[CONTRACTION], 1e-16) ** 0.8
    m[RATE] = 0.0
    for iteration in range(MAX_ITERATIONS):
        evaluate_stages(effects, size, m, p, torque_table, load_table, h)
        change = correct(size, m, h)
        if iteration > 0:
            rate = change / before
            m[RATE] = max(m[RATE], rate) if iteration > 1 else rate
            if not rate < 0.99:
                return -3.0 * (iteration + 1)
            contraction = rate / (1.0 - rate)
            left = MAX_ITERATIONS - 1 - iteration
            if contraction * change * rate**left > NEWTON_TOLERANCE:
                return -3.0 * (iteration + 1)
        if not change < 1e10:
            return -3.0 * (iteration + 1)
        if contraction * change <= NEWTON_TOLERANCE:
            m[CONTRACTION] = contraction
            return 3.0 * (iteration + 1)
        before = max(change, 1e-300)
    return -3.0 * MAX_ITERATIONS


@scalar_function
def filtered_error(size, m, h):
    """Error estimate of order 3 in CHANGE (v, then q), filtered by the real system so that stiff parts do not spoil it.

    Reads the accelerations at the start and shifts of the velocities there from FORCE on. Returns the sum of the
    scaled squares.
    """
    n = len(size)
    for k in range(n):
        sum_q = 0.0
        sum_v = 0.0
        for j in range(3):
            sum_q += ERROR_BY_MATRIX[j] * m[Z + j * n + k]
            sum_v += ERROR_WEIGHTS[j] * m[Z + j * n + k]
        m[CHANGE + n + k] = m[FORCE + n + k] + sum_q
        m[CHANGE + k] = m[FORCE + k] + sum_v / h
    for r in range(n):
        total = 0.0
        for k in range(n):
            total += m[BY_Q + r * n + k] * m[CHANGE + n + k]
        m[CHANGE + r] += h / MU * total
    solve(size, m, REAL, PIVOT, CHANGE)
    total = 0.0
    for k in range(n):
        m[CHANGE + n + k] = h / MU * (m[CHANGE + k] + m[CHANGE + n + k])
        v = m[CHANGE + k] / m[SCALE + n + k]
        q = m[CHANGE + n + k] / m[SCALE + k]
        total += v * v + q * q
    return total


@scalar_function
def refilter_error(effects, size, m, p, torque_table, load_table, h):
    """The estimate once more, from the start moved by the estimate: for a first try that looked too inaccurate."""
    n = len(size)
    m[at.STAGE_TIME] = m[at.TIME]
    for k in range(n):
        m[at.VS + k] = m[at.V + k] + m[CHANGE + k]
        m[at.QS + k] = m[at.Q + k] + m[CHANGE + n + k]
    evaluate_lane(effects, m, p, torque_table, load_table)
    for k in range(n):
        m[FORCE + k] = m[at.ACC + k]
        m[FORCE + n + k] = m[CHANGE + k]
    return filtered_error(size, m, h)


@lane_function
def gap_of_step(flag, m, work, gap, clearance, rtol, lane, W):
    """Integral of a gap over the step into RATE_SUM; square of its scaled error, as for the explicit method."""
    if flag is not None:
        error = work[(at.RATE_OLD + gap) * W + lane]
        total = 0.0
        for s in range(3):
            d = m[STAGE_RATES + s * at.RATES + gap]
            total += MATRIX[2, s] * d
            error += ERROR_BY_MATRIX[s] * d
        work[(at.RATE_SUM + gap) * W + lane] = total
        error *= m[at.STEP] / MU / (rtol * m[PAR + clearance] * m[PAR + at.PERIOD])
        return error * error
    else:
        return 0.0


@lane_function
def powers_of_step(ledger, m, work, lane, W):
    """Means of the powers over the step."""
    if ledger is not None:
        for r in range(at.DRIVE_POWER, at.LOAD_POWER + 1):
            total = 0.0
            for s in range(3):
                total += MATRIX[2, s] * m[STAGE_RATES + s * at.RATES + r]
            work[(at.RATE_SUM + r) * W + lane] = total


@scalar_function
def next_step(m, h, error, evaluations):
    """Step size for the next try: by the error, and predictive after Gustafsson 1994 (doi:10.1145/198429.198437)."""
    iterations = evaluations / 3.0
    safety = STEP_SAFETY * (2.0 * MAX_ITERATIONS + 1.0) / (2.0 * MAX_ITERATIONS + iterations)
    error = max(error, 1e-10)
    factor = safety * error**-0.25
    if error <= 1.0 and m[ACCEPTED_STEP] > 0.0:
        trend = h / m[ACCEPTED_STEP] * (m[ACCEPTED_ERROR] / (error * error)) ** 0.25
        factor = min(factor, STEP_SAFETY * trend)
    return h * min(max(factor, LARGEST_SHRINK), LARGEST_GROWTH)


@scalar_function
def leave(effects, size, lane, W, work, m):
    """Put the end of the step where an explicit step would leave it."""
    n = len(size)
    for k in range(n):
        work[(at.QS + k) * W + lane] = m[at.QS + k]
        work[(at.VS + k) * W + lane] = m[at.VS + k]
        work[(at.ACC + k) * W + lane] = m[at.ACC + k]
    for r in range(at.RATES):
        work[(at.RATE_NOW + r) * W + lane] = m[at.RATE_NOW + r]


@scalar_function
def implicit_step(
    effects, size, lane, W, work, stages, par, torque_table, load_table, memory, settings
):
    """Try one step of `work[STEP]` on one lane: new state, rates, error and next step into its rows."""
    m = memory[lane]
    p = m[PAR : PAR + at.PARAMETERS]
    n = len(size)
    accepted = work[at.ACCEPT * W + lane] == 1.0
    if work[at.STIFF_STEPS_HERE * W + lane] == 0.0:
        take_over(size, lane, W, work, par, m, settings)
        accepted = True
        m[TRIED_ERROR] = 0.0
        m[NEW_JACOBIAN] = 0.0
    elif accepted:
        m[ACCEPTED_STEP] = m[at.STEP]
        m[ACCEPTED_ERROR] = max(m[TRIED_ERROR], 1e-2)
        m[NEW_JACOBIAN] = 0.0
    fetch(effects, size, lane, W, work, stages, m, p, torque_table, load_table, settings)
    h = m[at.STEP]
    evaluations = 0.0
    work[at.STIFF_STEPS_HERE * W + lane] += 1.0
    work[at.STIFF_STEPS * W + lane] += 1.0
    if m[RATE] > CHEAP_CONTRACTION and m[NEW_JACOBIAN] == 0.0:
        start_of_step(n, m)
        difference_jacobian(effects, size, m, p, torque_table, load_table, START, LEAST, BY_Q, BY_V)
        m[NORM] = norm_of_jacobian(size, m)
        m[NEW_JACOBIAN] = 1.0
        m[FACTORED_STEP] = 0.0
        evaluations += 2.0 * n
    regular = True
    if m[FACTORED_STEP] != h:
        regular = factorise_both(size, m, h)
    guess_stages(size, m, h, accepted)
    spent = -3.0
    if regular:
        spent = newton(effects, size, m, p, torque_table, load_table, h)
    evaluations += abs(spent)
    if spent < 0.0:
        m[POLYNOMIAL_STEP] = 0.0
        m[RATE] = 1.0
        m[CONTRACTION] = 1.0
        work[at.ERROR * W + lane] = 1e6
        work[at.NEXT_STEP * W + lane] = 0.5 * h
    else:
        m[POLYNOMIAL_STEP] = h
        evaluations += judge(
            effects, size, lane, W, work, m, p, torque_table, load_table, settings, h, spent
        )
    work[at.EVALUATIONS * W + lane] += evaluations


@scalar_function
def judge(effects, size, lane, W, work, m, p, torque_table, load_table, settings, h, spent):
    """Error of a converged step, its integrals, the next step; returns the evaluations spent."""
    n = len(size)
    evaluations = 1.0
    rtol = loosened(settings[RTOL], m[PAR + at.STRICTNESS])
    for k in range(n):
        m[FORCE + k] = m[START + k]
        m[FORCE + n + k] = 0.0
    total = filtered_error(size, m, h)
    gaps = gap_of_step(
        effects.crank_rod, m, work, at.GAP_12, at.JOINT_12 + at.CLEARANCE, rtol, lane, W
    )
    gaps += gap_of_step(
        effects.rod_slider, m, work, at.GAP_23, at.JOINT_23 + at.CLEARANCE, rtol, lane, W
    )
    powers_of_step(effects.ledger, m, work, lane, W)
    uneasy = work[at.REJECTED * W + lane] == 1.0 or m[ACCEPTED_STEP] == 0.0
    if total + gaps > 2.0 * n and uneasy:
        total = refilter_error(effects, size, m, p, torque_table, load_table, h)
        evaluations += 1.0
    mean = (total + gaps) * (0.5 / n)
    error = math.sqrt(mean)
    m[TRIED_ERROR] = error
    set_stage(n, m, h, 2)
    evaluate_lane(effects, m, p, torque_table, load_table)
    leave(effects, size, lane, W, work, m)
    work[at.ERROR * W + lane] = mean
    proposal = next_step(m, h, error, spent)
    if error <= 1.0:
        if work[at.REJECTED * W + lane] == 1.0:
            proposal = min(proposal, h)
        if work[at.ENDING * W + lane] == 1.0:
            proposal = max(proposal, work[at.NEXT_STEP * W + lane])
        if m[RATE] <= CHEAP_CONTRACTION and KEPT_FROM * h <= proposal <= KEPT_TO * h:
            proposal = h
        calm = h * m[NORM] < CALM_STIFFNESS
        work[at.CALM * W + lane] = work[at.CALM * W + lane] + 1.0 if calm else 0.0
    work[at.NEXT_STEP * W + lane] = proposal
    return evaluations


# ---- what the block stepper calls -----------------------------------------------------------------------


@lane_function
def settle_methods(memory, settings, work, W):
    """Decide, between steps, which lanes go on with which method. Returns how many take implicit steps."""
    count = 0.0
    if memory is not None:
        always = 1.0 if settings[IMPLICIT] == 2.0 else 0.0
        for i in range(W):
            stiff = work[at.STIFF * W + i]
            go = 1.0 if work[at.EDGE_SCORE * W + i] >= STIFF_STEPS_NEEDED else 0.0
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
def take_implicit_steps(
    effects, size, work, stages, par, torque_table, load_table, memory, settings, W
):
    """One step of Radau IIA on every stiff lane, over whatever the explicit method left in its rows."""
    if memory is not None:
        for i in range(W):
            if work[at.STIFF * W + i] * work[at.RUNNING * W + i] == 1.0:
                implicit_step(
                    effects,
                    size,
                    i,
                    W,
                    work,
                    stages,
                    par,
                    torque_table,
                    load_table,
                    memory,
                    settings,
                )


@lane_function
def sense_stiffness(memory, work, stages, weights, last, atol, n, terms, W):
    """Scores of stiffness on the explicit lanes, from the last two stages of the pair, both at the end of the step.

    h lambda is about h |k7 - k6| / |v7 - v6| (Hairer, Norsett and Wanner, Solving ODEs I, IV.2 of volume II); its score
    counts steps above `EDGE`, a step below takes half a point back. The other score is a decaying count of rejections.
    """
    if memory is not None:
        for i in range(W):
            forces = 0.0
            speeds = 1e-300
            for k in range(n):
                a = work[(at.ACC + k) * W + i]
                b = stages[((terms - 1) * n + k) * W + i]
                dv = 0.0
                for j in range(terms):
                    dv += weights[last + j] * stages[(j * n + k) * W + i]
                scale = 1.0 / atol[at.MAX_COORDINATES + k]
                da = (a - b) * scale
                dv = dv * scale
                forces += da * da
                speeds += dv * dv
            # speeds lacks a factor h^2: forces / speeds is the square of h lambda
            at_edge = 1.0 if forces > EDGE * EDGE * speeds else 0.0
            score = work[at.EDGE_SCORE * W + i] + 1.5 * at_edge - 0.5
            work[at.EDGE_SCORE * W + i] = max(score, 0.0)
            rejected = 1.0 if work[at.ERROR * W + i] > 1.0 else 0.0
            work[at.REJECTION_SCORE * W + i] = (
                REJECTION_MEMORY * work[at.REJECTION_SCORE * W + i] + rejected
            )
