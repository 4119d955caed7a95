"""Forces and accelerations at given states: the stepper's equations of motion, read instead of integrated by it."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.rhs import accelerations


@scalar_function
def observe(effects, par, tables, states, contacts, times, out):
    """Fill `out` (instants, n + RATES) with accelerations and rates.

    `states` (instants, 2 n): coordinates, then velocities; `contacts` (instants, 4): active flags and 1/d'_0 of both
    joints; `times` (instants,): since the start of the revolution; `tables`: `layout.Tables`.
    """
    n = states.shape[1] // 2
    work = out[0, :1].repeat(at.WORK)
    work[:] = 0.0
    for row in range(len(times)):
        for k in range(n):
            work[at.QS + k] = states[row, k]
            work[at.VS + k] = states[row, n + k]
        work[at.ACTIVE_12] = contacts[row, 0]
        work[at.ACTIVE_23] = contacts[row, 1]
        work[at.INVERSE_IMPACT_12] = contacts[row, 2]
        work[at.INVERSE_IMPACT_23] = contacts[row, 3]
        work[at.STAGE_TIME] = times[row]
        accelerations(effects, work, par, tables.torque, tables.load, 1)
        for k in range(n):
            out[row, k] = work[at.ACC + k]
        for r in range(at.RATES):
            out[row, n + r] = work[at.RATE_NOW + r]


OPEN, FORCE, RATE = 0, 1, 2
"""Columns of what `Seen.joints` holds at each joint: gap (m), contact force (N), rate of the gap (m/s)."""


class Seen(NamedTuple):
    """What `derivative` writes: dy/dt, the joints (2, 3), and the kernel's rows of one lane."""

    rates: Array
    joints: Array
    work: Array


def new_seen(n: int) -> Seen:
    """Room for n coordinates."""
    return Seen(np.empty(2 * n + 2), np.zeros((2, 3)), np.zeros(at.WORK))


# ten arguments: packed into named tuples, a call from Python takes 32 us in place of 17
@scalar_function
def derivative(effects, par, torque_table, load_table, contacts, time, y, out, joints, work):
    """Rates of y = (coordinates, velocities, integrals of the absolute gaps) at `time` since the start of the revolution.

    `contacts`: whether each joint is latched, then 1/d'_0 of each. `out`, `joints`, `work`: as in `Seen`.
    """
    n = len(y) // 2 - 1
    for k in range(n):
        work[at.QS + k] = y[k]
        work[at.VS + k] = y[n + k]
    work[at.ACTIVE_12] = contacts[0]
    work[at.ACTIVE_23] = contacts[1]
    work[at.INVERSE_IMPACT_12] = contacts[2]
    work[at.INVERSE_IMPACT_23] = contacts[3]
    work[at.STAGE_TIME] = time
    accelerations(effects, work, par, torque_table, load_table, 1)
    for k in range(n):
        out[k] = y[n + k]
        out[n + k] = work[at.ACC + k]
    for j, gap in ((0, at.GAP_12), (1, at.GAP_23)):
        for m in range(3):
            joints[j, m] = work[at.RATE_NOW + gap + m]
        out[2 * n + j] = abs(joints[j, OPEN])
