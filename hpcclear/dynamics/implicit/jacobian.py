"""Evaluations of one lane eight at a time, and its Jacobian by differences: for every topology and every effect alike.

Where a vector holds eight numbers, eight evaluations take no longer than one. A Jacobian written out by hand, one for
each law and topology, could not be cheaper.
"""

from hpcclear.base.bits import beyond
from hpcclear.base.eight import column, fetch, put, spread
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.memory import BLOCKS, LANES
from hpcclear.dynamics.linkage.rhs import run_motion

RELATIVE = 1.5e-8  # square root of the round-off
SECOND_OFFSET = mem.SECOND * LANES


@scalar_function
def evaluate_bank(motion, bank, tables):
    """Accelerations and rates of the eight states held in a bank, by the motion of eight lanes."""
    run_motion(motion, bank, tables)


@lane_function
def increment(before, least, reach):
    """How far a number is displaced, exactly."""
    return before + min(RELATIVE * max(abs(before), least), reach * least) - before


@lane_function
def displace(m, row, least, number, first):
    """A row of the second bank: that of the middle stage, and in the lane that stands for its own column displaced.

    `least`: its size there; `number`: of its column, of which the bank holds those from `first` on.
    """
    value = m[row * LANES + mem.MIDDLE]
    by = increment(value, least, m[mem.REACH])
    m[mem.INCREMENT * LANES + number] = by
    place = number - first
    mark = place if 0 <= place < LANES else LANES
    put(m, mem.SECOND + row, value + by * fetch(m, mem.MARK + mark))


@scalar_function
def displace_all(n, m, first):
    """States of the second bank: that of the first one's middle stage, each displaced along one coordinate or velocity."""
    put(m, mem.SECOND + at.STAGE_TIME, spread(m[at.STAGE_TIME * LANES + mem.MIDDLE]))
    for k in range(n):
        displace(m, at.QS + k, m[mem.LEAST * LANES + k], k, first)
        displace(m, at.VS + k, m[(mem.LEAST + BLOCKS) * LANES + k], n + k, first)


@scalar_function
def difference_jacobian(motion, n, blocks, m, tables):
    """Partial derivatives of the accelerations at the state of the middle stage, into mem.JACOBIAN, column by column.

    mem.BASE holds the accelerations there.
    """
    first = 0
    while first < 2 * n:
        displace_all(n, m, first)
        bank = beyond(m, SECOND_OFFSET)
        evaluate_bank(motion, bank, tables)
        for i in range(min(LANES, 2 * n - first)):
            inverse = 1.0 / m[mem.INCREMENT * LANES + first + i]
            for b in range(blocks):
                change = column(m, mem.SECOND + at.ACC + LANES * b, i) - fetch(m, mem.BASE + b)
                put(m, mem.JACOBIAN + (first + i) * BLOCKS + b, change * inverse)
        first += LANES
