"""Jacobian of the accelerations by differences, for every topology and every effect alike.

A right-hand side takes 60 to 80 ns, so 2 n more of them cost little beside what an implicit step does with the result.
"""

from ..jit import scalar_function
from . import layout as at
from .rhs import lane_motion

_RELATIVE = 1.5e-8  # square root of the round-off


@scalar_function
def evaluate_lane(effects, m, par, torque_table, load_table):
    """Accelerations and rates of one lane at the stage held in its own `m` (WORK rows first) and `par`."""
    lane_motion(
        effects,
        effects.crank_rod,
        effects.rod_slider,
        effects.torque,
        m,
        par,
        torque_table,
        load_table,
        0,
        1,
    )


@scalar_function
def difference_jacobian(effects, size, m, par, torque_table, load_table, start, least, by_q, by_v):
    """Partial derivatives of the accelerations at the stage held in `m`; accelerations and rates there are overwritten.

    The length of `size` is the number n of coordinates. Offsets in `m`: `start`, the accelerations at this stage;
    `least`, sizes of coordinates, then velocities, below which an increment shrinks no further (2 n); `by_q`
    and `by_v`, where d a_r / d q_k and d a_r / d v_k go (at r n + k).
    """
    n = len(size)
    for k in range(2 * n):
        is_speed = k >= n
        column = k - n if is_speed else k
        row = (at.VS if is_speed else at.QS) + column
        out = (by_v if is_speed else by_q) + column
        before = m[row]
        m[row] = before + _RELATIVE * max(abs(before), m[least + k])
        inverse = 1.0 / (m[row] - before)
        evaluate_lane(effects, m, par, torque_table, load_table)
        m[row] = before
        for r in range(n):
            m[out + r * n] = (m[at.ACC + r] - m[start + r]) * inverse
