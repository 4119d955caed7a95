"""Lobatto collocation of order 16 with its eight stages side by side in the lanes: for one response.

A single response cannot fill a vector with samples, so it fills it with the stages of a step: the polynomial
of degree 8 through the accelerations at the nine Lobatto points, the first known from the step before, is
found by fixed-point iteration (Lobatto IIIA: Hairer and Wanner, Solving ODEs II, IV.5; iterated in parallel: van der
Houwen and Sommeijer 1990, doi:10.1016/0377-0427(90)90200-J; a guess from the polynomial of the step before and an
error from its last coefficients: Everhart 1985, doi:10.1007/978-94-009-5400-7_17, and Rein and Spiegel 2015,
doi:10.1093/mnras/stu2164). Eight stages cost little more than one where a vector holds eight numbers.

Everything stands in one flat buffer of rows of eight, at distances the compiler knows: a loop so short is only
vectorised where no run-time check of overlap is needed. Stages are the lanes of the rows that `layout` names.
"""

import math
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from hpcclear.base.arrays import Array
from hpcclear.base.jit import lane_function
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.rhs import run_motion

STAGES = 8
"""Unknown stages of a step; the last stands at its end."""

_ROWS = STAGES + 1  # of a matrix: one for each node, the start included
MOST_COORDINATES = 5  # minimal ones of two open joints with a free crank
COORDINATES = at.COORDINATES[:MOST_COORDINATES]

PAR = at.WORK  # parameters, the same in every lane
NODE = PAR + at.PARAMETERS  # where the stages stand in the step, 0 to 1
MATRIX = NODE + 1  # velocities by accelerations: row l holds the weights of node l
SQUARE = MATRIX + _ROWS  # coordinates by accelerations, likewise
LEGENDRE = SQUARE + _ROWS  # coefficients of degree 1 to 8 by accelerations, likewise
NODE_ACC = LEGENDRE + _ROWS  # accelerations that the stages are made from
CHANGE = NODE_ACC + MOST_COORDINATES  # by how much those that a sweep found differ from them
LAST_CHANGE = CHANGE + MOST_COORDINATES  # the same of the sweep before
LAST_ACC = LAST_CHANGE + MOST_COORDINATES  # what that found
LAST_ONCE = LAST_ACC + MOST_COORDINATES  # its integrals from the start to the nodes, over h
LAST_TWICE = LAST_ONCE + MOST_COORDINATES  # and theirs
COEFFICIENT = LAST_TWICE + MOST_COORDINATES  # of degree 1 to 8, of the accelerations
GAP_COEFFICIENT = COEFFICIENT + MOST_COORDINATES  # and of a gap
BASE = GAP_COEFFICIENT + 1  # row: coefficient of degree 0, lane by lane a coordinate
START_ACC = BASE + 1  # row: accelerations at the start of the step, lane by lane a coordinate
WEIGHT = START_ACC + 1  # row: squared scale of an acceleration's error over the step, likewise
# rows: scaled products, by stage, of the change with itself, with its own change, of that with itself
SQUARES = WEIGHT + 1
SCALARS = SQUARES + 3
(
    POLYNOMIAL_STEP,  # s, of the step whose coefficients are kept; 0 when there are none
    FOLLOWS,  # 1 where the step to come begins at that step's end, 0 where at its start
    CONTRACTION,  # of the fixed-point iteration
    CONTRACTION_STEP,  # s, of the step for which that was found
    AFTER_KINK,  # s, the step that was accepted first after the last kink
    KINK,  # where the last kink is: one of the following
) = range(SCALARS * STAGES, SCALARS * STAGES + 6)
MEMORY = (SCALARS + 1) * STAGES
KINK_BEHIND, KINK_AT_START, KINK_AT_END = 0.0, 1.0, 2.0  # of the step to come; of the step tried

MOST_SWEEPS = 12.0
"""Sweeps over the stages after which a step counts as not converging."""


def nodes() -> Array:
    """The nine Lobatto points on [0, 1]."""
    last = np.eye(_ROWS)[STAGES]
    inner = legendre.legroots(legendre.legder(last)).real  # complex from NumPy 2.5 on
    for _ in range(3):  # Newton: the eigenvalue solver leaves a few units in the last place
        first, second = legendre.legder(last), legendre.legder(last, 2)
        inner -= legendre.legval(inner, first) / legendre.legval(inner, second)
    return np.concatenate([[0.0], 0.5 * (1.0 + np.sort(inner)), [1.0]])


def matrices() -> tuple[Array, Array, Array]:
    """Integrals from 0 to each node of the polynomial through values at the nodes, their integrals, and its Legendre
    coefficients; each (9, 9), a column for each value."""
    x = 2.0 * nodes() - 1.0
    values = np.array([legendre.legval(x, unit) for unit in np.eye(_ROWS)])
    to_coefficients = np.linalg.inv(values.T)
    once = [0.5 * legendre.legint(unit, lbnd=-1) for unit in np.eye(_ROWS)]
    twice = [0.5 * legendre.legint(c, lbnd=-1) for c in once]
    integral = np.array([legendre.legval(x, c) for c in once]).T
    double = np.array([legendre.legval(x, c) for c in twice]).T
    return integral @ to_coefficients, double @ to_coefficients, to_coefficients


def new_memory() -> Array:
    """The buffer of one response, with the method's coefficients in it."""
    return _template().copy()


@cache
def _template() -> Array:
    m = np.zeros(MEMORY)
    rows = m.reshape(-1, STAGES)
    integral, double, to_coefficients = matrices()
    rows[PAR : PAR + at.PARAMETERS] = 1.0
    rows[NODE] = nodes()[1:]
    rows[MATRIX : MATRIX + _ROWS] = integral[1:].T
    rows[SQUARE : SQUARE + _ROWS] = double[1:].T
    rows[LEGENDRE : LEGENDRE + _ROWS] = to_coefficients[1:].T
    return m


# ---- sweeps over the stages ------------------------------------------------------------------------


@lane_function
def row_of(m, row):
    """The eight numbers of a row, as locals: the compiler need not ask whether a store changes them."""
    j = row * STAGES
    return m[j], m[j + 1], m[j + 2], m[j + 3], m[j + 4], m[j + 5], m[j + 6], m[j + 7]


@lane_function
@unrolled
def weighted(m, matrix, start, a, i):
    """Sum over the nodes of a matrix's weights for stage i."""
    total = m[matrix * STAGES + i] * start
    for s in written_out(range(STAGES)):
        total += m[(matrix + 1 + s) * STAGES + i] * a[s]
    return total


@lane_function
def mixed(m, row, new, back, i):
    """What a row's new number becomes with acceleration: less a part of its change. The row keeps the new one itself."""
    change = back * (new - m[row * STAGES + i])
    m[row * STAGES + i] = new
    return new - (change if back != 0.0 else 0.0)


@lane_function
def stages_of(m, work, k, h, found, back):
    """Stages of coordinate k from the accelerations at the nodes that stand from row `found` on."""
    q, v = work[at.Q + k], work[at.V + k]
    start = m[START_ACC * STAGES + k]
    a = row_of(m, found + k)
    for i in range(STAGES):
        # sums of what was found, mixed afterwards: they need not wait for `back`
        dv = mixed(m, LAST_ONCE + k, weighted(m, MATRIX, start, a, i), back, i)
        dq = mixed(m, LAST_TWICE + k, weighted(m, SQUARE, start, a, i), back, i)
        new = m[(found + k) * STAGES + i]
        m[(NODE_ACC + k) * STAGES + i] = mixed(m, LAST_ACC + k, new, back, i)
        m[(at.VS + k) * STAGES + i] = v + h * dv
        m[(at.QS + k) * STAGES + i] = q + h * (m[NODE * STAGES + i] * v + h * dq)


@lane_function
@unrolled
def set_stages(m, work, n, h, found, back):
    """Coordinates and velocities of all stages, from the accelerations from row `found` on, with acceleration by `back`."""
    for k in written_out(COORDINATES):
        if k < n:
            stages_of(m, work, k, h, found, back)


@lane_function
def set_times(m, work, h):
    """Times of all stages."""
    t = work[at.TIME]
    for i in range(STAGES):
        m[at.STAGE_TIME * STAGES + i] = t + m[NODE * STAGES + i] * h


@lane_function
def accelerations_of_stages(motion, m, tables):
    """Accelerations and rates at all stages, by the motion of eight lanes."""
    run_motion(motion, m, tables)


@lane_function
def weight_of(k, n, m):
    """Squared scale of coordinate k's acceleration."""
    if k < n:
        return m[WEIGHT * STAGES + k]
    else:
        return 0.0


@lane_function
@unrolled
def compare(m, n):
    """By how much the accelerations found differ from those that the stages were made from, and the products of that."""
    w: dict = {}
    for k in written_out(COORDINATES):
        w[k] = weight_of(k, n, m)
    for i in range(STAGES):
        square, along, turn = 0.0, 0.0, 0.0
        for k in written_out(COORDINATES):
            if k < n:
                change = m[(at.ACC + k) * STAGES + i] - m[(NODE_ACC + k) * STAGES + i]
                bend = change - m[(LAST_CHANGE + k) * STAGES + i]
                m[(CHANGE + k) * STAGES + i] = change
                square += w[k] * change * change
                along += w[k] * change * bend
                turn += w[k] * bend * bend
        m[SQUARES * STAGES + i] = square
        m[(SQUARES + 1) * STAGES + i] = along
        m[(SQUARES + 2) * STAGES + i] = turn


@lane_function
def sum_of(m, row):
    """Sum over the stages."""
    a = row_of(m, row)
    return ((a[0] + a[1]) + (a[2] + a[3])) + ((a[4] + a[5]) + (a[6] + a[7]))


@lane_function
@unrolled
def keep_change(m, n):
    """Keep the changes for the next sweep."""
    for i in range(STAGES):
        for k in written_out(COORDINATES):
            if k < n:
                m[(LAST_CHANGE + k) * STAGES + i] = m[(CHANGE + k) * STAGES + i]


@lane_function
def take_accelerations(m, work, n, h, first):
    """Stages of the next sweep from what this one found. Returns the scaled size of the change.

    With Anderson's acceleration (1965, doi:10.1145/321296.321305) over two sweeps: what changes along the change before
    falls to nothing.
    """
    compare(m, n)
    turn = sum_of(m, SQUARES + 2)
    back = sum_of(m, SQUARES + 1) / (turn + 1e-300)
    set_stages(m, work, n, h, at.ACC, 0.0 if first else back)
    keep_change(m, n)
    return math.sqrt(sum_of(m, SQUARES))


# ---- the polynomial ---------------------------------------------------------------------------------


@lane_function
def coefficients_of(m, values, start, out):
    """Legendre coefficients of degree 1 to 8 of what stands at the nodes; returns that of degree 0."""
    a = row_of(m, values)
    for i in range(STAGES):
        m[out * STAGES + i] = weighted(m, LEGENDRE, start, a, i)
    c = row_of(m, out)
    # every polynomial of odd degree is -1 at the start, every other one 1
    return start + c[0] - c[1] + c[2] - c[3] + c[4] - c[5] + c[6] - c[7]


@lane_function
def continued(m, k, begin, ratio):
    """Guess of coordinate k's accelerations at the nodes: the kept polynomial, from `begin` on, stretched by `ratio`."""
    base = m[BASE * STAGES + k]
    c = row_of(m, COEFFICIENT + k)
    for i in range(STAGES):
        x = 2.0 * (begin + ratio * m[NODE * STAGES + i]) - 1.0
        p2 = 1.5 * x * x - 0.5
        p3 = (5.0 / 3.0) * x * p2 - (2.0 / 3.0) * x
        p4 = 1.75 * x * p3 - 0.75 * p2
        p5 = 1.8 * x * p4 - 0.8 * p3
        p6 = (11.0 / 6.0) * x * p5 - (5.0 / 6.0) * p4
        p7 = (13.0 / 7.0) * x * p6 - (6.0 / 7.0) * p5
        p8 = 1.875 * x * p7 - 0.875 * p6
        low = base + c[0] * x + c[1] * p2 + c[2] * p3 + c[3] * p4
        m[(NODE_ACC + k) * STAGES + i] = low + c[4] * p5 + c[5] * p6 + c[6] * p7 + c[7] * p8


@lane_function
def constant(m, k):
    """Guess of coordinate k's accelerations: as at the start."""
    a = m[START_ACC * STAGES + k]
    for i in range(STAGES):
        m[(NODE_ACC + k) * STAGES + i] = a


@lane_function
@unrolled
def guess(m, n, h):
    """First guess of the accelerations at the nodes."""
    old = m[POLYNOMIAL_STEP]
    if old > 0.0:
        ratio = h / old
        begin = m[FOLLOWS]
        for k in written_out(COORDINATES):
            if k < n:
                continued(m, k, begin, ratio)
    else:
        for k in range(n):
            constant(m, k)


@lane_function
def keep_coordinate(m, k):
    """`keep_polynomial` of one coordinate."""
    start = m[START_ACC * STAGES + k]
    m[BASE * STAGES + k] = coefficients_of(m, NODE_ACC + k, start, COEFFICIENT + k)


@lane_function
@unrolled
def keep_polynomial(m, n, h):
    """Coefficients of the accelerations over the step just converged."""
    m[POLYNOMIAL_STEP] = h
    m[FOLLOWS] = 0.0
    for k in written_out(COORDINATES):
        if k < n:
            keep_coordinate(m, k)


@lane_function
def tail(m, row):
    """Squares of the last two coefficients, and of the two before: how fast they fall."""
    j = row * STAGES
    high = m[j + 7] * m[j + 7] + m[j + 6] * m[j + 6]
    return high, m[j + 5] * m[j + 5] + m[j + 4] * m[j + 4]
