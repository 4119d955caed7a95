"""Radau IIA of order 5: stages by simplified Newton, error estimate, integrals over a step. Scalar code for one lane.

Source: Hairer and Wanner, Solving ODEs II, IV.8 (RADAU5, doi:10.1007/978-3-642-05221-7), with two simplifications that
q' = v allows:

- the stages of q follow from those of v, ``Zq = h (c v + A Zv)``, so Newton's unknowns are Zv alone;
- for each eigenvalue mu/h of (h A)^-1 the linear system has n unknowns instead of 2 n, with the matrix
  ``mu/h - da/dv - (h/mu) da/dq``.

The lane's numbers are in `m`, a row as laid out in `memory`; `size` is a tuple whose length is the number n of
coordinates, known to the compiler.
"""

import math

import numpy as np

from ..jit import lane_function, scalar_function
from . import layout as at
from . import memory as mem
from .dense import factorise, factorise_complex, solve, solve_complex
from .jacobian import evaluate_lane

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
NEWTON_TOLERANCE = 0.03  # of the tolerance on the step's error
STEP_SAFETY = 0.9
LARGEST_SHRINK, LARGEST_GROWTH = 0.2, 8.0


@scalar_function
def start_of_step(n, m):
    """The start of the step as a stage."""
    m[at.STAGE_TIME] = m[at.TIME]
    for k in range(n):
        m[at.QS + k] = m[at.Q + k]
        m[at.VS + k] = m[at.V + k]


@scalar_function
def factorise_both(size, m, h):
    """Factors of the real and the complex system for step h. Returns False if one is singular."""
    n = len(size)
    square = MU_RE * MU_RE + MU_IM * MU_IM
    for r in range(n):
        for c in range(n):
            j = r * n + c
            unit = 1.0 / h if r == c else 0.0
            m[mem.REAL + j] = MU * unit - m[mem.BY_V + j] - (h / MU) * m[mem.BY_Q + j]
            m[mem.COMPLEX_RE + j] = (
                MU_RE * unit - m[mem.BY_V + j] - (h * MU_RE / square) * m[mem.BY_Q + j]
            )
            m[mem.COMPLEX_IM + j] = MU_IM * unit + (h * MU_IM / square) * m[mem.BY_Q + j]
    m[mem.FACTORED_STEP] = h
    real = factorise(size, m, mem.REAL, mem.PIVOT)
    return factorise_complex(size, m, mem.COMPLEX_RE, mem.COMPLEX_IM, mem.COMPLEX_PIVOT) and real


@scalar_function
def guess_stages(size, m, h, accepted):
    """First guess of the stages: the polynomial of the step before, or of the longer try from the same start."""
    n = len(size)
    old = m[mem.POLYNOMIAL_STEP]
    for s in range(3):
        for k in range(n):
            m[mem.CHANGE + s * n + k] = 0.0
        if old > 0.0:
            x = NODES[s] * h / old
            x = 1.0 + x if accepted else x
            for j in range(3):
                weight = x * (BASIS[j, 0] + x * (BASIS[j, 1] + x * BASIS[j, 2]))
                weight -= 1.0 if (accepted and j == 2) else 0.0
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
def set_stage(n, m, h, s):
    """Coordinates and velocities of stage s from the increments of the velocities."""
    m[at.STAGE_TIME] = m[at.TIME] + NODES[s] * h
    for k in range(n):
        sum_z = 0.0
        for j in range(3):
            sum_z += MATRIX[s, j] * m[mem.Z + j * n + k]
        v = m[at.V + k]
        m[at.VS + k] = v + m[mem.Z + s * n + k]
        m[at.QS + k] = m[at.Q + k] + h * (NODES[s] * v + sum_z)


@scalar_function
def evaluate_stages(effects, size, m, p, torque_table, load_table, h):
    """Accelerations and rates at the three stages."""
    n = len(size)
    for s in range(3):
        set_stage(n, m, h, s)
        evaluate_lane(effects, m, p, torque_table, load_table)
        for k in range(n):
            m[mem.FORCE + s * n + k] = m[at.ACC + k]
        for r in range(at.RATES):
            m[mem.STAGE_RATES + s * at.RATES + r] = m[at.RATE_NOW + r]


@scalar_function
def correct(size, m, h):
    """One correction of simplified Newton. Returns its size relative to the tolerance."""
    n = len(size)
    lam, re, im = MU / h, MU_RE / h, MU_IM / h
    for k in range(n):
        f0, f1, f2 = m[mem.FORCE + k], m[mem.FORCE + n + k], m[mem.FORCE + 2 * n + k]
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
    solve(size, m, mem.REAL, mem.PIVOT, mem.CHANGE)
    solve_complex(
        size,
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
def newton(effects, size, m, p, torque_table, load_table, h, known):
    """Solve for the stages. Returns how many iterations it took, negative if it did not converge.

    `known`: the stages of the first guess have been evaluated already.
    """
    before = 1.0
    contraction = max(m[mem.CONTRACTION], 1e-16) ** 0.8
    m[mem.RATE] = 0.0
    for iteration in range(MAX_ITERATIONS):
        if iteration > 0 or not known:
            evaluate_stages(effects, size, m, p, torque_table, load_table, h)
        change = correct(size, m, h)
        if iteration > 0:
            rate = change / before
            m[mem.RATE] = max(m[mem.RATE], rate) if iteration > 1 else rate
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
def filtered_error(size, m, h):
    """Error estimate of order 3, filtered by the real system so that stiff parts do not spoil it, in mem.CHANGE (v, then q).

    Reads the accelerations at the start and shifts of the velocities there from mem.FORCE on. Returns the sum of the
    scaled squares.
    """
    n = len(size)
    for k in range(n):
        sum_q = 0.0
        sum_v = 0.0
        for j in range(3):
            sum_q += ERROR_BY_MATRIX[j] * m[mem.Z + j * n + k]
            sum_v += ERROR_WEIGHTS[j] * m[mem.Z + j * n + k]
        m[mem.CHANGE + n + k] = m[mem.FORCE + n + k] + sum_q
        m[mem.CHANGE + k] = m[mem.FORCE + k] + sum_v / h
    for r in range(n):
        total = 0.0
        for k in range(n):
            total += m[mem.BY_Q + r * n + k] * m[mem.CHANGE + n + k]
        m[mem.CHANGE + r] += h / MU * total
    solve(size, m, mem.REAL, mem.PIVOT, mem.CHANGE)
    total = 0.0
    for k in range(n):
        m[mem.CHANGE + n + k] = h / MU * (m[mem.CHANGE + k] + m[mem.CHANGE + n + k])
        v = m[mem.CHANGE + k] / m[mem.SCALE + n + k]
        q = m[mem.CHANGE + n + k] / m[mem.SCALE + k]
        total += v * v + q * q
    return total


@scalar_function
def refilter_error(effects, size, m, p, torque_table, load_table, h):
    """The estimate once more, from the start moved by the estimate: for a first try that looked too inaccurate."""
    n = len(size)
    m[at.STAGE_TIME] = m[at.TIME]
    for k in range(n):
        m[at.VS + k] = m[at.V + k] + m[mem.CHANGE + k]
        m[at.QS + k] = m[at.Q + k] + m[mem.CHANGE + n + k]
    evaluate_lane(effects, m, p, torque_table, load_table)
    for k in range(n):
        m[mem.FORCE + k] = m[at.ACC + k]
        m[mem.FORCE + n + k] = m[mem.CHANGE + k]
    return filtered_error(size, m, h)


@lane_function
def gap_of_step(flag, m, work, gap, clearance, rtol, lane, W):
    """Integral of a gap over the step into RATE_SUM; square of its scaled error, as for the explicit method."""
    if flag is not None:
        error = work[(at.RATE_OLD + gap) * W + lane]
        total = 0.0
        for s in range(3):
            d = m[mem.STAGE_RATES + s * at.RATES + gap]
            total += MATRIX[2, s] * d
            error += ERROR_BY_MATRIX[s] * d
        work[(at.RATE_SUM + gap) * W + lane] = total
        error *= m[at.STEP] / MU / (rtol * m[mem.PAR + clearance] * m[mem.PAR + at.PERIOD])
        return error * error
    else:
        return 0.0


@lane_function
def rate_of_step(m, work, rate, lane, W):
    """Mean of a rate over the step."""
    total = 0.0
    for s in range(3):
        total += MATRIX[2, s] * m[mem.STAGE_RATES + s * at.RATES + rate]
    work[(at.RATE_SUM + rate) * W + lane] = total


@lane_function
def rates_of_step(ledger, responses, m, work, lane, W):
    """Means of the powers, and of what the responses are made of, over the step."""
    if ledger is not None:
        for r in range(at.DRIVE_POWER, at.LOAD_POWER + 1):
            rate_of_step(m, work, r, lane, W)
    if responses is not None:
        rate_of_step(m, work, at.FORCE_12, lane, W)
        rate_of_step(m, work, at.FORCE_23, lane, W)
        rate_of_step(m, work, at.SLIDER_ACCELERATION, lane, W)
        rate_of_step(m, work, at.SLIDER_SQUARE, lane, W)


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
