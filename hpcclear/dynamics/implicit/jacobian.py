"""Evaluations of one lane eight at a time, and its Jacobian by differences: for every topology and every effect alike.

Where a vector holds eight numbers, eight evaluations take no longer than one. A Jacobian written out by hand, one for
each law and topology, could not be cheaper.
"""

from hpcclear.base.bits import beyond
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.base.unrolled import unrolled, written_out
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.memory import LANES
from hpcclear.dynamics.linkage.rhs import run_motion

_RELATIVE = 1.5e-8  # square root of the round-off
SECOND_OFFSET = mem.SECOND * LANES
FIRSTS = range(0, mem.COLUMNS, LANES)
"""First of each group of columns of the Jacobian."""


@scalar_function
def evaluate_bank(motion, bank, tables):
    """Accelerations and rates of the eight states held in a bank, by the motion of eight lanes."""
    run_motion(motion, bank, tables)


@lane_function
def fill(m, row, value):
    """Give a row the same number in every lane."""
    for i in range(LANES):
        m[row * LANES + i] = value


@lane_function
def increment(before, least, reach):
    """How far a number is displaced, exactly."""
    return before + min(_RELATIVE * max(abs(before), least), reach * least) - before


@lane_function
def coordinate(k, n, m):
    """Coordinate k and its velocity at the middle stage, and their increments."""
    if k < n:
        q = m[(at.QS + k) * LANES + mem.MIDDLE]
        v = m[(at.VS + k) * LANES + mem.MIDDLE]
        by_q = increment(q, m[mem.LEAST + k], m[mem.REACH])
        return q, v, by_q, increment(v, m[mem.LEAST + n + k], m[mem.REACH])
    else:
        return 0.0, 0.0, 0.0, 0.0


@lane_function
def mark(m, column, i):
    """1 in the lane that stands for a column of those at hand, else 0."""
    if 0 <= column < LANES:
        return m[(mem.MARK + column) * LANES + i]
    else:
        return 0.0


@lane_function
def displace(k, n, m, c, first, i):
    """Coordinate k and its velocity in lane i of the second bank, which stands for a column. Returns its increment."""
    if k < n:
        by_q = c[2] * mark(m, k - first, i)
        by_v = c[3] * mark(m, n + k - first, i)
        m[(mem.SECOND + at.QS + k) * LANES + i] = c[0] + by_q
        m[(mem.SECOND + at.VS + k) * LANES + i] = c[1] + by_v
        return by_q + by_v
    else:
        return 0.0


@lane_function
@unrolled
def displace_all(n, m, first):
    """States of the second bank: that of the first one's middle stage, each displaced along one coordinate or velocity.

    All in one loop, and from locals: the compiler vectorises neither shorter loops nor what a store might change.
    """
    time = m[at.STAGE_TIME * LANES + mem.MIDDLE]
    c: dict = {}
    for k in written_out(at.COORDINATES):
        c[k] = coordinate(k, n, m)
    for i in range(LANES):
        m[(mem.SECOND + at.STAGE_TIME) * LANES + i] = time
        by = 0.0
        for k in written_out(at.COORDINATES):
            by += displace(k, n, m, c[k], first, i)
        m[mem.INCREMENT * LANES + i] = by


@lane_function
def take_differences(n, m, first):
    """Columns of the Jacobian from `first` on, as many as there are lanes."""
    for i in range(LANES):
        inverse = 1.0 / m[mem.INCREMENT * LANES + i]
        for r in range(n):
            change = m[(mem.SECOND + at.ACC + r) * LANES + i] - m[mem.BASE + r]
            m[mem.JACOBIAN + r * mem.COLUMNS + first + i] = change * inverse


@lane_function
def columns(motion, n, m, tables, first):
    """As many columns of the Jacobian as there are lanes, from `first` on."""
    if first < 2 * n:
        displace_all(n, m, first)
        bank = beyond(m, SECOND_OFFSET)  # type: ignore[call-arg, var-annotated]
        evaluate_bank(motion, bank, tables)
        take_differences(n, m, first)


@scalar_function
@unrolled
def difference_jacobian(motion, n, m, tables):
    """Partial derivatives of the accelerations at the state of the middle stage, into mem.JACOBIAN.

    mem.BASE holds the accelerations there.
    """
    for first in written_out(FIRSTS):
        columns(motion, n, m, tables, first)
