"""Lobatto collocation of order 16 with its eight stages side by side in the lanes: for one response.

A single response cannot fill a vector with samples, so it fills it with the stages of a step: the polynomial
of degree 8 through the accelerations at the nine Lobatto points, the first known from the step before, is
found by fixed-point iteration (Lobatto IIIA: Hairer and Wanner, Solving ODEs II, IV.5; iterated in parallel: van der
Houwen and Sommeijer 1990, doi:10.1016/0377-0427(90)90200-J; a guess from the polynomial of the step before and an
error from its last coefficients: Everhart 1985, doi:10.1007/978-94-009-5400-7_17, and Rein and Spiegel 2015,
doi:10.1093/mnras/stu2164). Eight stages cost little more than one where a vector holds eight numbers.

Everything stands in one flat buffer of rows of eight, each a vector. Stages are the lanes of the rows that `layout` names.
"""

import math
from functools import cache

import numpy as np
from numpy.polynomial import legendre

from hpcclear.base.arrays import Array, aligned
from hpcclear.base.eight import combined, either, fetch, nine_rows, put, spread, total_of
from hpcclear.base.jit import lane_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.rhs import run_motion

STAGES = 8
"""Unknown stages of a step; the last stands at its end."""

_ROWS = STAGES + 1  # of a matrix: one for each node, the start included
_FEW = -(-at.MAX_COORDINATES // STAGES)  # rows that hold a number of each coordinate

PAR = at.WORK  # parameters, the same in every lane
NODE = PAR + at.PARAMETERS  # where the stages stand in the step, 0 to 1
MATRIX = NODE + 1  # velocities by accelerations: row l holds the weights of node l
SQUARE = MATRIX + _ROWS  # coordinates by accelerations, likewise
LEGENDRE = SQUARE + _ROWS  # coefficients of degree 1 to 8 by accelerations, likewise
LAST_NODE = (
    LEGENDRE + _ROWS
)  # row: weights of the nodes in the integral over the step, but for the first
NODE_ACC = LAST_NODE + 1  # accelerations that the stages are made from
LAST_CHANGE = (
    NODE_ACC + at.MAX_COORDINATES
)  # by how much those that the last sweep found differ from them
LAST_ACC = LAST_CHANGE + at.MAX_COORDINATES  # what that found
LAST_ONCE = LAST_ACC + at.MAX_COORDINATES  # its integrals from the start to the nodes, over h
LAST_TWICE = LAST_ONCE + at.MAX_COORDINATES  # and theirs
COEFFICIENT = LAST_TWICE + at.MAX_COORDINATES  # of degree 1 to 8, of the accelerations
GAP_COEFFICIENT = COEFFICIENT + at.MAX_COORDINATES  # and of a gap
BASE = GAP_COEFFICIENT + 1  # rows: coefficient of degree 0, one coordinate after the other
SINCE = BASE + _FEW  # row: integral of a rate from the start to the nodes, over h
START_ACC = SINCE + 1  # rows: accelerations at the start of the step, likewise
WEIGHT = START_ACC + _FEW  # rows: squared scale of an acceleration's error over the step, likewise
SCALARS = WEIGHT + _FEW
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
    m = aligned(MEMORY)
    m[:] = _template()
    return m


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
    rows[LAST_NODE] = integral[-1, 1:]
    return m


# ---- sweeps over the stages ------------------------------------------------------------------------


@lane_function
def mixed(m, row, new, back):
    """What a row's new vector becomes with acceleration: less a part of its change. The row keeps the new one itself."""
    change = either(back != 0.0, (new - fetch(m, row)) * back, spread(0.0))
    put(m, row, new)
    return new - change


@lane_function
def set_stages(m, work, n, h, found, back):
    """Coordinates and velocities of all stages, from the accelerations from row `found` on, with acceleration by `back`."""
    once, twice = nine_rows(m, MATRIX), nine_rows(m, SQUARE)
    node = fetch(m, NODE)
    for k in range(n):
        q, v = work[at.Q + k], work[at.V + k]
        start = m[START_ACC * STAGES + k]
        # sums of what was found, mixed afterwards: they need not wait for `back`
        dv = mixed(m, LAST_ONCE + k, combined(once, start, m, found + k), back)
        dq = mixed(m, LAST_TWICE + k, combined(twice, start, m, found + k), back)
        put(m, NODE_ACC + k, mixed(m, LAST_ACC + k, fetch(m, found + k), back))
        put(m, at.VS + k, v + h * dv)
        put(m, at.QS + k, q + h * (node * v + h * dq))


@lane_function
def set_times(m, work, h):
    """Times of all stages."""
    put(m, at.STAGE_TIME, work[at.TIME] + fetch(m, NODE) * h)


@lane_function
def accelerations_of_stages(motion, m, tables):
    """Accelerations and rates at all stages, by the motion of eight lanes."""
    run_motion(motion, m, tables)


@lane_function
def compare(m, n):
    """By how much the accelerations found differ from those that the stages were made from, scaled; and what part of each
    change Anderson's acceleration (1965, doi:10.1145/321296.321305) over two sweeps takes back: what changes along the change
    before falls to nothing."""
    square, along, turn = spread(0.0), spread(0.0), spread(0.0)
    for k in range(n):
        change = fetch(m, at.ACC + k) - fetch(m, NODE_ACC + k)
        bend = change - fetch(m, LAST_CHANGE + k)
        put(m, LAST_CHANGE + k, change)
        scaled = m[WEIGHT * STAGES + k] * change
        square = square + scaled * change
        along = along + scaled * bend
        turn = turn + m[WEIGHT * STAGES + k] * bend * bend
    return math.sqrt(total_of(square)), total_of(along) / (total_of(turn) + 1e-300)


# ---- the polynomial ---------------------------------------------------------------------------------


@lane_function
def coefficients_of(m, values, start, out):
    """Legendre coefficients of degree 1 to 8 of what stands at the nodes; returns that of degree 0."""
    put(m, out, combined(nine_rows(m, LEGENDRE), start, m, values))
    c = out * STAGES
    # every polynomial of odd degree is -1 at the start, every other one 1
    odd = (m[c] + m[c + 2]) + (m[c + 4] + m[c + 6])
    even = (m[c + 1] + m[c + 3]) + (m[c + 5] + m[c + 7])
    return start + (odd - even)


@lane_function
def continue_polynomial(m, n, begin, ratio):
    """Guess of the accelerations at the nodes: the kept polynomial, from `begin` on, stretched by `ratio`."""
    x = 2.0 * (begin + ratio * fetch(m, NODE)) - 1.0
    p2 = 1.5 * x * x - 0.5
    p3 = (5.0 / 3.0) * x * p2 - (2.0 / 3.0) * x
    p4 = 1.75 * x * p3 - 0.75 * p2
    p5 = 1.8 * x * p4 - 0.8 * p3
    p6 = (11.0 / 6.0) * x * p5 - (5.0 / 6.0) * p4
    p7 = (13.0 / 7.0) * x * p6 - (6.0 / 7.0) * p5
    p8 = 1.875 * x * p7 - 0.875 * p6
    for k in range(n):
        c = (COEFFICIENT + k) * STAGES
        low = m[BASE * STAGES + k] + m[c] * x + m[c + 1] * p2 + m[c + 2] * p3 + m[c + 3] * p4
        put(m, NODE_ACC + k, low + m[c + 4] * p5 + m[c + 5] * p6 + m[c + 6] * p7 + m[c + 7] * p8)


@lane_function
def guess(m, n, h):
    """First guess of the accelerations at the nodes; without a polynomial as at the start."""
    old = m[POLYNOMIAL_STEP]
    if old > 0.0:
        continue_polynomial(m, n, m[FOLLOWS], h / old)
    else:
        for k in range(n):
            put(m, NODE_ACC + k, spread(m[START_ACC * STAGES + k]))


@lane_function
def keep_polynomial(m, n, h):
    """Coefficients of the accelerations over the step just converged."""
    m[POLYNOMIAL_STEP] = h
    m[FOLLOWS] = 0.0
    for k in range(n):
        start = m[START_ACC * STAGES + k]
        m[BASE * STAGES + k] = coefficients_of(m, NODE_ACC + k, start, COEFFICIENT + k)


@lane_function
def tail(m, row):
    """Squares of the last two coefficients, and of the two before: how fast they fall."""
    j = row * STAGES
    high = m[j + 7] * m[j + 7] + m[j + 6] * m[j + 6]
    return high, m[j + 5] * m[j + 5] + m[j + 4] * m[j + 4]
