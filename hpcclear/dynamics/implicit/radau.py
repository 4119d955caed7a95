"""Radau IIA of order 5: stages by simplified Newton, error estimate, integrals over a step. Scalar code for one lane.

Source: Hairer and Wanner, Solving ODEs II, IV.8 (RADAU5, doi:10.1007/978-3-642-05221-7), with two simplifications that
q' = v allows:

- the stages of q follow from those of v, ``Zq = h (c v + A Zv)``, so Newton's unknowns are Zv alone;
- for each eigenvalue mu/h of (h A)^-1 the linear system has n unknowns instead of 2 n, with the matrix
  ``mu/h - da/dv - (h/mu) da/dq``.

The lane's numbers are in `m`, a row as laid out in `memory`: its three stages stand side by side in the first bank, and are
evaluated together. n is the number of coordinates.
"""

import math

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.dense import factorise, factorise_complex, solve, solve_complex
from hpcclear.dynamics.implicit.jacobian import evaluate_bank, fill
from hpcclear.dynamics.implicit.memory import END, LANES

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

MAX_ITERATIONS = 10
NEWTON_TOLERANCE = 0.005  # of the tolerance on the step's error: the energy balance closes no better than the iteration
STEP_SAFETY = 0.9
LARGEST_SHRINK, LARGEST_GROWTH = 0.2, 8.0


def new_memory(width: int) -> Array:
    """Memory of `width` lanes, shape (width, mem.MEMORY), with the method's coefficients in it.

    Lanes of a bank that no stage needs repeat the last one: what they hold must be a state like any other.
    """
    m = np.zeros((width, mem.MEMORY))
    rows = m[:, : mem.JACOBIAN].reshape(width, -1, LANES)
    stage = np.minimum(np.arange(LANES), END)
    rows[:, mem.NODE] = NODES[stage]
    rows[:, mem.MATRIX : mem.MATRIX + 3] = MATRIX[stage].T
    rows[:, mem.UNIT : mem.UNIT + 3] = np.eye(3)[stage].T
    rows[:, mem.MARK : mem.MARK + LANES] = np.eye(LANES)
    return m


@scalar_function
def start_of_step(n, m):
    """The start of the step as a stage, in every lane."""
    fill(m, at.STAGE_TIME, m[mem.TIME])
    for k in range(n):
        fill(m, at.QS + k, m[mem.Q + k])
        fill(m, at.VS + k, m[mem.V + k])


@scalar_function
def factorise_both(n, m, h):
    """Factors of the real and the complex system for step h. Returns False if one is singular."""
    square = MU_RE * MU_RE + MU_IM * MU_IM
    for r in range(n):
        for c in range(n):
            j = r * n + c
            unit = 1.0 / h if r == c else 0.0
            by_q = m[mem.JACOBIAN + r * mem.COLUMNS + c]
            by_v = m[mem.JACOBIAN + r * mem.COLUMNS + n + c]
            m[mem.REAL + j] = MU * unit - by_v - (h / MU) * by_q
            m[mem.COMPLEX_RE + j] = MU_RE * unit - by_v - (h * MU_RE / square) * by_q
            m[mem.COMPLEX_IM + j] = MU_IM * unit + (h * MU_IM / square) * by_q
    m[mem.FACTORED_STEP] = h
    real = factorise(n, m, mem.REAL, mem.PIVOT)
    return factorise_complex(n, m, mem.COMPLEX_RE, mem.COMPLEX_IM, mem.COMPLEX_PIVOT) and real


@scalar_function
def guess_stages(n, m, h):
    """First guess of the stages: the polynomial of the step before, or of the longer try from the same start.

    Without either, the velocities at the start.
    """
    old = m[mem.POLYNOMIAL_STEP]
    continues = m[mem.CONTINUES] == 1.0
    for s in range(3):
        for k in range(n):
            m[mem.CHANGE + s * n + k] = 0.0
        if old > 0.0:
            x = NODES[s] * h / old
            x = 1.0 + x if continues else x
            for j in range(3):
                weight = x * (BASIS[j, 0] + x * (BASIS[j, 1] + x * BASIS[j, 2]))
                weight -= 1.0 if (continues and j == 2) else 0.0
                for k in range(n):
                    m[mem.CHANGE + s * n + k] += weight * m[mem.Z + j * n + k]
    for s in range(3):
        for k in range(n):
            m[mem.Z + s * n + k] = m[mem.CHANGE + s * n + k]
    for s in range(3):
        for k in range(n):
            total = 0.0
            for j in range(3):
                total += T_INVERSE[s, j] * m[mem.Z + j * n + k]
            m[mem.TRANSFORMED + s * n + k] = total


@scalar_function
def guess_from_start(n, m, h):
    """First guess of the stages: the accelerations at the start."""
    for s in range(3):
        for k in range(n):
            m[mem.Z + s * n + k] = NODES[s] * h * m[mem.START + k]
    m[mem.POLYNOMIAL_STEP] = h
    m[mem.CONTINUES] = 0.0
    guess_stages(n, m, h)


@scalar_function
def copy_polynomial(n, m, source, target):
    """Copy the increments at the stages."""
    for j in range(3 * n):
        m[target + j] = m[source + j]


@lane_function
def start_and_increments(k, n, m):
    """Coordinate k and its velocity at the start of the step, and the velocity's increments at the stages."""
    if k < n:
        z = mem.Z + k
        return m[mem.Q + k], m[mem.V + k], m[z], m[z + n], m[z + 2 * n]
    else:
        return 0.0, 0.0, 0.0, 0.0, 0.0


@lane_function
def weighted(m, row, c, i):
    """Sum of a coordinate's increments with the weights that three rows give them in lane i."""
    total = m[row * LANES + i] * c[2]
    total += m[(row + 1) * LANES + i] * c[3]
    total += m[(row + 2) * LANES + i] * c[4]
    return total


@lane_function
def stage_of(k, n, m, c, h, i):
    """Coordinate k and its velocity at stage i."""
    if k < n:
        m[(at.VS + k) * LANES + i] = c[1] + weighted(m, mem.UNIT, c, i)
        change = m[mem.NODE * LANES + i] * c[1] + weighted(m, mem.MATRIX, c, i)
        m[(at.QS + k) * LANES + i] = c[0] + h * change


@scalar_function
@unrolled
def evaluate_stages(motion, n, m, tables, h):
    """Coordinates and velocities of the stages from the increments of the velocities; accelerations and rates there.

    All in one loop, and from locals: the compiler vectorises neither shorter loops nor what a store might change.
    """
    t = m[mem.TIME]
    c: dict = {}
    for k in written_out(at.COORDINATES):
        c[k] = start_and_increments(k, n, m)
    for i in range(LANES):
        m[at.STAGE_TIME * LANES + i] = t + m[mem.NODE * LANES + i] * h
        for k in written_out(at.COORDINATES):
            stage_of(k, n, m, c[k], h, i)
    evaluate_bank(motion, m, tables)


@scalar_function
def correct(n, m, h):
    """One correction of simplified Newton. Returns its size relative to the tolerance."""
    lam, re, im = MU / h, MU_RE / h, MU_IM / h
    for k in range(n):
        row = (at.ACC + k) * LANES
        f0, f1, f2 = m[row], m[row + 1], m[row + 2]
        w0, w1, w2 = (
            m[mem.TRANSFORMED + k],
            m[mem.TRANSFORMED + n + k],
            m[mem.TRANSFORMED + 2 * n + k],
        )
        r0 = T_INVERSE[0, 0] * f0 + T_INVERSE[0, 1] * f1 + T_INVERSE[0, 2] * f2
        r1 = T_INVERSE[1, 0] * f0 + T_INVERSE[1, 1] * f1 + T_INVERSE[1, 2] * f2
        r2 = T_INVERSE[2, 0] * f0 + T_INVERSE[2, 1] * f1 + T_INVERSE[2, 2] * f2
        m[mem.CHANGE + k] = r0 - lam * w0
        m[mem.CHANGE + n + k] = r1 - (re * w1 - im * w2)
        m[mem.CHANGE + 2 * n + k] = r2 - (re * w2 + im * w1)
    solve(n, m, mem.REAL, mem.PIVOT, mem.CHANGE)
    solve_complex(
        n,
        m,
        mem.COMPLEX_RE,
        mem.COMPLEX_IM,
        mem.COMPLEX_PIVOT,
        mem.CHANGE + n,
        mem.CHANGE + 2 * n,
    )
    total = 0.0
    for k in range(n):
        inverse_v = 1.0 / m[mem.SCALE + n + k]
        inverse_q = h / (MU * m[mem.SCALE + k])
        weight = inverse_v * inverse_v + inverse_q * inverse_q
        for s in range(3):
            change = m[mem.CHANGE + s * n + k]
            total += weight * change * change
            m[mem.TRANSFORMED + s * n + k] += change
        w0, w1, w2 = (
            m[mem.TRANSFORMED + k],
            m[mem.TRANSFORMED + n + k],
            m[mem.TRANSFORMED + 2 * n + k],
        )
        for s in range(3):
            m[mem.Z + s * n + k] = T[s, 0] * w0 + T[s, 1] * w1 + T[s, 2] * w2
    return math.sqrt(total / (3.0 * n))


@scalar_function
def newton(motion, n, m, tables, h, known):
    """Solve for the stages. Returns how many iterations it took, negative if it did not converge.

    `known`: the stages of the first guess have been evaluated already.
    """
    before = 1.0
    contraction = max(m[mem.CONTRACTION], 1e-16) ** 0.8
    m[mem.RATE] = 0.0
    for iteration in range(MAX_ITERATIONS):
        if iteration > 0 or not known:
            evaluate_stages(motion, n, m, tables, h)
        change = correct(n, m, h)
        if iteration > 0:
            rate = change / before
            m[mem.RATE] = max(m[mem.RATE], rate)
            if not rate < 0.99:
                return -(iteration + 1)
            contraction = rate / (1.0 - rate)
            left = MAX_ITERATIONS - 1 - iteration
            if contraction * change * rate**left > NEWTON_TOLERANCE:
                return -(iteration + 1)
        if not change < 1e10:
            return -(iteration + 1)
        if contraction * change <= NEWTON_TOLERANCE:
            m[mem.CONTRACTION] = contraction
            return iteration + 1
        before = max(change, 1e-300)
    return -MAX_ITERATIONS


@scalar_function
def filtered_error(n, m, h):
    """Error estimate of order 3, filtered by the real system so that stiff parts do not spoil it, in mem.CHANGE (v, then q).

    Reads the accelerations at the start and shifts of the velocities there from mem.SHIFTED on. Returns the sum of the
    scaled squares.
    """
    for k in range(n):
        sum_q = 0.0
        sum_v = 0.0
        for j in range(3):
            sum_q += ERROR_BY_MATRIX[j] * m[mem.Z + j * n + k]
            sum_v += ERROR_WEIGHTS[j] * m[mem.Z + j * n + k]
        m[mem.CHANGE + n + k] = m[mem.SHIFTED + n + k] + sum_q
        m[mem.CHANGE + k] = m[mem.SHIFTED + k] + sum_v / h
    for r in range(n):
        total = 0.0
        for k in range(n):
            total += m[mem.JACOBIAN + r * mem.COLUMNS + k] * m[mem.CHANGE + n + k]
        m[mem.CHANGE + r] += h / MU * total
    solve(n, m, mem.REAL, mem.PIVOT, mem.CHANGE)
    total = 0.0
    for k in range(n):
        m[mem.CHANGE + n + k] = h / MU * (m[mem.CHANGE + k] + m[mem.CHANGE + n + k])
        v = m[mem.CHANGE + k] / m[mem.SCALE + n + k]
        q = m[mem.CHANGE + n + k] / m[mem.SCALE + k]
        total += v * v + q * q
    return total


@scalar_function
def refilter_error(motion, n, m, tables, h):
    """The estimate once more, from the start moved by the estimate: for a first try that looked too inaccurate."""
    fill(m, at.STAGE_TIME, m[mem.TIME])
    for k in range(n):
        fill(m, at.VS + k, m[mem.V + k] + m[mem.CHANGE + k])
        fill(m, at.QS + k, m[mem.Q + k] + m[mem.CHANGE + n + k])
    evaluate_bank(motion, m, tables)
    for k in range(n):
        m[mem.SHIFTED + k] = m[(at.ACC + k) * LANES + END]
        m[mem.SHIFTED + n + k] = m[mem.CHANGE + k]
    return filtered_error(n, m, h)


@lane_function
def gap_error(m, work, p, lane, W):
    """Square of the scaled error of the integral of joint p's gap over the step, as for the explicit method."""
    error = work[(at.RATE_OLD + at.GAP + p) * W + lane]
    for s in range(3):
        error += ERROR_BY_MATRIX[s] * m[(at.RATE_NOW + at.GAP + p) * LANES + s]
    clearance = mem.PAR + at.JOINT_BLOCKS + at.JOINT_ROWS * p + at.CLEARANCE
    span = m[clearance * LANES] * m[(mem.PAR + at.PERIOD) * LANES]
    error *= m[mem.STEP] / MU / (m[mem.TOLERANCE] * span)
    return error * error


@scalar_function
def gap_errors(rules, m, work, lane, W):
    """Squares of the scaled errors of all gaps' integrals, added."""
    total = 0.0
    for p in range(rules.begin, rules.end):
        total += gap_error(m, work, p, lane, W)
    return total


@lane_function
def mean_of_step(m, work, rate, lane, W):
    """Mean of a rate over the step."""
    total = 0.0
    for s in range(3):
        total += MATRIX[2, s] * m[(at.RATE_NOW + rate) * LANES + s]
    work[(at.RATE_SUM + rate) * W + lane] = total


@scalar_function
def means_of_step(effects, m, work, lane, W):
    """Means of all that is integrated over the step."""
    for p in range(effects.rules.begin, effects.rules.end):
        mean_of_step(m, work, at.GAP + p, lane, W)
    for r in range(len(effects.measures)):
        mean_of_step(m, work, effects.measures[r], lane, W)


@scalar_function
def next_step(m, h, error, iterations):
    """Step size for the next try: by the error, and predictive after Gustafsson 1994 (doi:10.1145/198429.198437)."""
    safety = STEP_SAFETY * (2.0 * MAX_ITERATIONS + 1.0) / (2.0 * MAX_ITERATIONS + iterations)
    error = max(error, 1e-10)
    factor = safety * error**-0.25
    if error <= 1.0 and m[mem.ACCEPTED_STEP] > 0.0:
        trend = h / m[mem.ACCEPTED_STEP] * (m[mem.ACCEPTED_ERROR] / (error * error)) ** 0.25
        factor = min(factor, STEP_SAFETY * trend)
    return h * min(max(factor, LARGEST_SHRINK), LARGEST_GROWTH)
