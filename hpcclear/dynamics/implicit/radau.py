"""Radau IIA of order 5: stages by simplified Newton, error estimate, integrals over a step. Scalar code for one lane.

Source: Hairer and Wanner, Solving ODEs II, IV.8 (RADAU5, doi:10.1007/978-3-642-05221-7), with two simplifications that
q' = v allows:

- the stages of q follow from those of v, ``Zq = h (c v + A Zv)``, so Newton's unknowns are Zv alone;
- for each eigenvalue mu/h of (h A)^-1 the linear system has n unknowns instead of 2 n, with the matrix
  ``mu/h - da/dv - (h/mu) da/dq``.

The lane's numbers are in `m`, a row as laid out in `memory`: its three stages stand side by side in the first bank, and are
evaluated together; what is done for all coordinates alike is done on vectors of them. n is the number of coordinates,
`blocks` that of a vector's rows.
"""

import math

import numpy as np

from hpcclear.base.arrays import Array, aligned
from hpcclear.base.eight import column, fetch, put, spread, total_of
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.control import MAX_ITERATIONS, begin_iteration, rate_of
from hpcclear.dynamics.implicit.dense import invert_both
from hpcclear.dynamics.implicit.jacobian import evaluate_bank
from hpcclear.dynamics.implicit.memory import BLOCKS, END, LANES

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


def new_memory(width: int) -> Array:
    """Memory of `width` lanes, shape (width, mem.MEMORY), with the method's coefficients in it.

    Lanes of a bank that no stage needs repeat the last one: what they hold must be a state like any other.
    """
    m = aligned(width * mem.MEMORY).reshape(width, mem.MEMORY)
    rows = m.reshape(width, -1, LANES)
    stage = np.minimum(np.arange(LANES), END)
    rows[:, mem.NODE] = NODES[stage]
    rows[:, mem.MATRIX : mem.MATRIX + 3] = MATRIX[stage].T
    rows[:, mem.UNIT : mem.UNIT + 3] = np.eye(3)[stage].T
    rows[:, mem.MARK : mem.MARK + LANES] = np.eye(LANES)
    rows[:, mem.HOLE : mem.HOLE + LANES + 1] = 1.0 - np.eye(LANES + 1, LANES)
    rows[:, mem.LEAST : mem.LEAST + 2 * BLOCKS] = 1.0  # of coordinates that are not there
    return m


@scalar_function
def start_of_step(n, m):
    """The start of the step as a stage, in every lane."""
    put(m, at.STAGE_TIME, spread(m[mem.TIME]))
    for k in range(n):
        put(m, at.QS + k, spread(m[mem.Q * LANES + k]))
        put(m, at.VS + k, spread(m[mem.V * LANES + k]))


@scalar_function
def make_inverses(n, blocks, m, h):
    """Inverses of the real and the complex system for step h. Returns False if one is singular."""
    square = MU_RE * MU_RE + MU_IM * MU_IM
    m[mem.FACTORED_STEP] = h
    for c in range(n * BLOCKS):
        by_q, by_v = fetch(m, mem.JACOBIAN + c), fetch(m, mem.JACOBIAN + n * BLOCKS + c)
        less = spread(0.0) - by_v
        put(m, mem.REAL + c, less - (h / MU) * by_q)
        put(m, mem.COMPLEX_RE + c, less - (h * MU_RE / square) * by_q)
        put(m, mem.COMPLEX_IM + c, (h * MU_IM / square) * by_q)
    for c in range(n):
        place = c * BLOCKS * LANES + c
        m[mem.REAL * LANES + place] += MU / h
        m[mem.COMPLEX_RE * LANES + place] += MU_RE / h
        m[mem.COMPLEX_IM * LANES + place] += MU_IM / h
    return invert_both(n, blocks, m)


@lane_function
def weights_at(x):
    """Weights of the three stages in the polynomial at x."""
    return (
        x * (BASIS[0, 0] + x * (BASIS[0, 1] + x * BASIS[0, 2])),
        x * (BASIS[1, 0] + x * (BASIS[1, 1] + x * BASIS[1, 2])),
        x * (BASIS[2, 0] + x * (BASIS[2, 1] + x * BASIS[2, 2])),
    )


@lane_function
@unrolled
def put_stages(m, b, z0, z1, z2):
    """Keep the velocities' increments at the three stages, and these decoupled."""
    put(m, mem.Z + b, z0)
    put(m, mem.Z + BLOCKS + b, z1)
    put(m, mem.Z + 2 * BLOCKS + b, z2)
    for s in written_out(range(3)):
        row = mem.TRANSFORMED + s * BLOCKS + b
        put(m, row, T_INVERSE[s, 0] * z0 + T_INVERSE[s, 1] * z1 + T_INVERSE[s, 2] * z2)


@scalar_function
def guess_stages(blocks, m, h):
    """First guess of the stages: the polynomial of the step before, or of the longer try from the same start.

    Without either, the velocities at the start.
    """
    old = m[mem.POLYNOMIAL_STEP]
    after = 1.0 if m[mem.CONTINUES] == 1.0 else 0.0
    ratio = h / old if old > 0.0 else 0.0
    there = 1.0 if old > 0.0 else 0.0
    w0 = weights_at(after + NODES[0] * ratio)
    w1 = weights_at(after + NODES[1] * ratio)
    w2 = weights_at(after + NODES[2] * ratio)
    for b in range(blocks):
        z0 = there * fetch(m, mem.Z + b)
        z1 = there * fetch(m, mem.Z + BLOCKS + b)
        z2 = there * fetch(m, mem.Z + 2 * BLOCKS + b)
        put_stages(
            m, b,
            w0[0] * z0 + w0[1] * z1 + (w0[2] - after) * z2,
            w1[0] * z0 + w1[1] * z1 + (w1[2] - after) * z2,
            w2[0] * z0 + w2[1] * z1 + (w2[2] - after) * z2,
        )  # fmt: skip


@scalar_function
def guess_from_start(blocks, m, h):
    """First guess of the stages: the accelerations at the start."""
    for b in range(blocks):
        a = h * fetch(m, mem.START + b)
        put_stages(m, b, NODES[0] * a, NODES[1] * a, NODES[2] * a)
    m[mem.POLYNOMIAL_STEP] = h
    m[mem.CONTINUES] = 0.0


@scalar_function
def copy_polynomial(m, source, target):
    """Copy the increments at the stages."""
    for j in range(3 * BLOCKS):
        put(m, target + j, fetch(m, source + j))


@scalar_function
def evaluate_stages(motion, n, m, tables, h):
    """Coordinates and velocities of the stages from the increments of the velocities; accelerations and rates there."""
    node = fetch(m, mem.NODE)
    u0, u1, u2 = fetch(m, mem.UNIT), fetch(m, mem.UNIT + 1), fetch(m, mem.UNIT + 2)
    a0, a1, a2 = fetch(m, mem.MATRIX), fetch(m, mem.MATRIX + 1), fetch(m, mem.MATRIX + 2)
    put(m, at.STAGE_TIME, m[mem.TIME] + node * h)
    for k in range(n):
        v = m[mem.V * LANES + k]
        z0, z1, z2 = (
            m[mem.Z * LANES + k],
            m[(mem.Z + BLOCKS) * LANES + k],
            m[(mem.Z + 2 * BLOCKS) * LANES + k],
        )
        put(m, at.VS + k, v + (u0 * z0 + u1 * z1 + u2 * z2))
        put(m, at.QS + k, m[mem.Q * LANES + k] + h * (node * v + (a0 * z0 + a1 * z1 + a2 * z2)))
    evaluate_bank(motion, m, tables)


@lane_function
def residuals(blocks, m, h):
    """What is left of the decoupled equations, to mem.CHANGE."""
    lam, re, im = MU / h, MU_RE / h, MU_IM / h
    for b in range(blocks):
        row = at.ACC + LANES * b
        f0, f1, f2 = column(m, row, 0), column(m, row, 1), column(m, row, 2)
        w0 = fetch(m, mem.TRANSFORMED + b)
        w1 = fetch(m, mem.TRANSFORMED + BLOCKS + b)
        w2 = fetch(m, mem.TRANSFORMED + 2 * BLOCKS + b)
        r0 = T_INVERSE[0, 0] * f0 + T_INVERSE[0, 1] * f1 + T_INVERSE[0, 2] * f2
        r1 = T_INVERSE[1, 0] * f0 + T_INVERSE[1, 1] * f1 + T_INVERSE[1, 2] * f2
        r2 = T_INVERSE[2, 0] * f0 + T_INVERSE[2, 1] * f1 + T_INVERSE[2, 2] * f2
        put(m, mem.CHANGE + b, r0 - lam * w0)
        put(m, mem.CHANGE + BLOCKS + b, r1 - (re * w1 - im * w2))
        put(m, mem.CHANGE + 2 * BLOCKS + b, r2 - (re * w2 + im * w1))


@lane_function
def solved(n, m, b):
    """Block b of the three decoupled changes, from what is left of their equations."""
    x, y, z = spread(0.0), spread(0.0), spread(0.0)
    for k in range(n):
        c0 = m[mem.CHANGE * LANES + k]
        c1 = m[(mem.CHANGE + BLOCKS) * LANES + k]
        c2 = m[(mem.CHANGE + 2 * BLOCKS) * LANES + k]
        i = k * BLOCKS + b
        re, im = fetch(m, mem.COMPLEX_RE + i), fetch(m, mem.COMPLEX_IM + i)
        x = x + c0 * fetch(m, mem.REAL + i)
        y = y + c1 * re - c2 * im
        z = z + c2 * re + c1 * im
    return x, y, z


@scalar_function
@unrolled
def correct(n, blocks, m, h):
    """One correction of simplified Newton. Returns its size relative to the tolerance."""
    residuals(blocks, m, h)
    total = spread(0.0)
    for b in range(blocks):
        x, y, z = solved(n, m, b)
        by_q = (h / MU) * fetch(m, mem.INVERSE_SCALE + b)
        by_v = fetch(m, mem.INVERSE_SCALE + BLOCKS + b)
        total = total + (by_v * by_v + by_q * by_q) * (x * x + y * y + z * z)
        w0 = fetch(m, mem.TRANSFORMED + b) + x
        w1 = fetch(m, mem.TRANSFORMED + BLOCKS + b) + y
        w2 = fetch(m, mem.TRANSFORMED + 2 * BLOCKS + b) + z
        put(m, mem.TRANSFORMED + b, w0)
        put(m, mem.TRANSFORMED + BLOCKS + b, w1)
        put(m, mem.TRANSFORMED + 2 * BLOCKS + b, w2)
        for s in written_out(range(3)):
            put(m, mem.Z + s * BLOCKS + b, T[s, 0] * w0 + T[s, 1] * w1 + T[s, 2] * w2)
    return math.sqrt(total_of(total) / (3.0 * n))


@scalar_function
def newton(motion, n, blocks, m, tables, h, known):
    """Solve for the stages. Returns how many iterations it took, negative if it did not converge.

    `known`: the stages of the first guess have been evaluated already.
    """
    before = 1.0
    begin_iteration(m, 0)
    for iteration in range(MAX_ITERATIONS):
        if iteration > 0 or not known:
            evaluate_stages(motion, n, m, tables, h)
        change = correct(n, blocks, m, h)
        iterations = rate_of(m, 0, iteration, change, before)
        if iterations != 0:
            return iterations
        before = max(change, 1e-300)
    return -MAX_ITERATIONS


@lane_function
def product(n, m, matrix, vector, b):
    """Block b of a matrix times a vector, both by their first rows."""
    total = spread(0.0)
    for k in range(n):
        total = total + m[vector * LANES + k] * fetch(m, matrix + k * BLOCKS + b)
    return total


@scalar_function
def filtered_error(n, blocks, m, h):
    """Error estimate of order 3, filtered by the real system so that stiff parts do not spoil it, in mem.CHANGE (v, then q).

    Reads the accelerations at the start and shifts of the velocities there from mem.SHIFTED on. Returns the sum of the
    scaled squares.
    """
    by_v, by_q = mem.CHANGE, mem.CHANGE + BLOCKS
    for b in range(blocks):
        z0, z1, z2 = (
            fetch(m, mem.Z + b),
            fetch(m, mem.Z + BLOCKS + b),
            fetch(m, mem.Z + 2 * BLOCKS + b),
        )
        q = ERROR_BY_MATRIX[0] * z0 + ERROR_BY_MATRIX[1] * z1 + ERROR_BY_MATRIX[2] * z2
        v = ERROR_WEIGHTS[0] * z0 + ERROR_WEIGHTS[1] * z1 + ERROR_WEIGHTS[2] * z2
        put(m, by_q + b, fetch(m, mem.SHIFTED + BLOCKS + b) + q)
        put(m, by_v + b, fetch(m, mem.SHIFTED + b) + (1.0 / h) * v)
    for b in range(blocks):
        put(m, by_v + b, fetch(m, by_v + b) + (h / MU) * product(n, m, mem.JACOBIAN, by_q, b))
    total = spread(0.0)
    for b in range(blocks):  # behind what is still read
        put(m, mem.CHANGE + 2 * BLOCKS + b, product(n, m, mem.REAL, by_v, b))
    for b in range(blocks):
        v = fetch(m, mem.CHANGE + 2 * BLOCKS + b)
        q = (h / MU) * (v + fetch(m, by_q + b))
        put(m, by_v + b, v)
        put(m, by_q + b, q)
        v = v * fetch(m, mem.INVERSE_SCALE + BLOCKS + b)
        q = q * fetch(m, mem.INVERSE_SCALE + b)
        total = total + v * v + q * q
    return total_of(total)


@scalar_function
def refilter_error(motion, n, blocks, m, tables, h):
    """The estimate once more, from the start moved by the estimate: for a first try that looked too inaccurate."""
    put(m, at.STAGE_TIME, spread(m[mem.TIME]))
    for k in range(n):
        by_q = m[(mem.CHANGE + BLOCKS) * LANES + k]
        put(m, at.VS + k, spread(m[mem.V * LANES + k] + m[mem.CHANGE * LANES + k]))
        put(m, at.QS + k, spread(m[mem.Q * LANES + k] + by_q))
    evaluate_bank(motion, m, tables)
    for b in range(blocks):
        put(m, mem.SHIFTED + b, column(m, at.ACC + LANES * b, END))
        put(m, mem.SHIFTED + BLOCKS + b, fetch(m, mem.CHANGE + b))
    return filtered_error(n, blocks, m, h)


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
