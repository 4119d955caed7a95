"""Forces and accelerations at given states: the stepper's equations of motion, read instead of integrated by it."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import scalar_function
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import DOUBLE, WHOLE, Kind
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.rhs import run_motion


def observe(
    motion: int, par: Array, tables: Array, states: Array, contacts: Array, times: Sequence[Array] | Array,
    out: Array, width: int = 1,
) -> None:  # fmt: skip
    """Fill `out` (instants, n + RATES) with accelerations and rates; with further columns, forces of pins as `PINS` has them.

    `motion`: address of a motion of so many lanes; `states` (instants, 2 n): coordinates, then velocities;
    `contacts` (instants, 2 MAX_JOINTS): active flags, then 1/d'_0; `times`, each (instants,): since the start of the
    revolution, and when that was; `tables`: as `Problem.tables`.
    """
    lanes = np.repeat(np.concatenate([np.zeros(at.WORK), par]), width)
    both = np.ascontiguousarray(times)
    observing_code()(motion, width, lanes, tables, states, contacts, both, out)


@scalar_function
def _observe(motion, W, lanes, tables, states, contacts, times, out):
    """`observe` by free lanes; those that are left over at the end repeat the last instant."""
    n, count = states.shape[1] // 2, len(states)
    for first in range(0, count, W):
        for i in range(W):
            row = min(first + i, count - 1)
            put_state(lanes, contacts[row], times[0, row], states[row], n, W, i)
            lanes[at.BEGAN * W + i] = times[1, row]
        run_motion(motion, lanes, tables)
        for i in range(min(W, count - first)):
            for k in range(n):
                out[first + i, k] = lanes[(at.ACC + k) * W + i]
            for r in range(at.RATES):
                out[first + i, n + r] = lanes[(at.RATE_NOW + r) * W + i]
            for r in range(out.shape[1] - n - at.RATES):
                out[first + i, n + at.RATES + r] = lanes[(at.PINS + r) * W + i]


_ROW, _TABLE = Kind("array", (DOUBLE, 1)), Kind("array", (DOUBLE, 2))
_KINDS = (Kind(WHOLE), Kind(WHOLE), _ROW, _ROW, _TABLE, _TABLE, _TABLE, _TABLE)


@cache
def observing_code() -> Compiled:
    """The compiled `_observe`, which `observe` calls."""
    return Compiled(_observe, _KINDS, ())


@scalar_function
def put_state(work, contacts, time, state, n, W, i):
    """What a motion reads of lane i besides parameters."""
    for k in range(n):
        work[(at.QS + k) * W + i] = state[k]
        work[(at.VS + k) * W + i] = state[n + k]
    for k in range(2 * at.MAX_JOINTS):
        work[(at.ACTIVE + k) * W + i] = contacts[k]
    work[at.STAGE_TIME * W + i] = time


OPEN, FORCE, RATE = 0, 1, 2
"""Columns of what `Derivative.joints` holds at each joint: gap (m), contact force (N), rate of the gap (m/s)."""


class Derivative(NamedTuple):
    """What `derivative` writes: dy/dt, the joints (j, 3), and the kernel's rows of one lane, parameters included."""

    rates: Array
    joints: Array
    lane: Array


def new_seen(n: int, par: Array, joints: int = 2) -> Derivative:
    """Memory for n coordinates and so many joints of the lane with these parameters (PARAMETERS,)."""
    lane = np.concatenate([np.zeros(at.WORK), par])
    return Derivative(np.empty(2 * n + joints), np.zeros((joints, 3)), lane)


@scalar_function
def derivative(motion, tables, contacts, time, y, out, joints, lane):
    """Rates of y = (coordinates, velocities, integrals of the absolute gaps) at `time` since the start of the revolution.

    `motion`: address of a motion of one lane; `contacts`: whether each joint is `latched`, then 1/d'_0 of each. Others as in
    `Derivative`.
    """
    n = (len(y) - len(joints)) // 2
    put_state(lane, contacts, time, y, n, 1, 0)
    run_motion(motion, lane, tables)
    for k in range(n):
        out[k] = y[n + k]
        out[n + k] = lane[at.ACC + k]
    for j in range(len(joints)):
        for m in range(3):
            joints[j, m] = lane[at.RATE_NOW + at.GAP + m * at.MAX_JOINTS + j]
        out[2 * n + j] = abs(joints[j, OPEN])
