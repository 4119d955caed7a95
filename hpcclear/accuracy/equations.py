"""The kernel's equations of motion as a function of a state, and classical Runge-Kutta steps over them.

For integrators that are not the kernel's. A state is y = (q, v, integrals of the absolute gaps at O12 and O23).
"""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import scalar_function
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.lanes import Problem
from hpcclear.dynamics.linkage.rhs import accelerations

OPEN, FORCE, RATE = 0, 1, 2
"""Columns of what `seen` holds at each joint: gap (m), contact force (N), rate of the gap (m/s)."""


# eleven arguments: packed into a named tuple, a call from Python takes 32 us in place of 17
@scalar_function
def derivative(effects, n, par, torque_table, load_table, contacts, time, y, work, out, seen):
    """Write dy/dt at `time` since the start of the revolution to `out`, and what the joints show to `seen` (2, 3).

    `contacts`: whether each joint is latched, then 1/d'_0 of each. `work` holds the kernel's rows of one lane.
    """
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
            seen[j, m] = work[at.RATE_NOW + gap + m]
        out[2 * n + j] = abs(seen[j, OPEN])


@scalar_function
def latch(contacts, seen, floor):
    """Start or end contacts by the signs of the gaps; True if a contact started or ended."""
    changed = False
    for j in range(2):
        if contacts[j] == 0.0 and seen[j, OPEN] > 0.0:
            contacts[j] = 1.0
            contacts[2 + j] = 1.0 / max(seen[j, RATE], floor)
            changed = True
        elif contacts[j] == 1.0 and seen[j, OPEN] < 0.0:
            contacts[j] = 0.0
            changed = True
    return changed


@scalar_function
def classical_turn(
    effects, n, par, torque_table, load_table, latched, free, floor, steps, y, contacts
):
    """Integrate `y` over one revolution by the classical Runge-Kutta method of order 4, in equal steps.

    Contacts start and end between steps, as they come. Returns duration, largest contact force at a step's end, and
    evaluations; `free`: the last of the n coordinates is the crank angle, and the last step is cut at a full turn.
    """
    work, out, seen = np.zeros(at.WORK), np.empty(len(y)), np.zeros((2, 3))
    stage, total = y.copy(), np.empty(len(y))
    h = par[at.PERIOD] / steps
    time, peak, count, step, corrections, s, last = 0.0, 0.0, 0, 0, 0, 0, False
    while True:
        c = 0.0 if s == 0 else (1.0 if s == 3 else 0.5)
        derivative(
            effects,
            n,
            par,
            torque_table,
            load_table,
            contacts,
            time + c * h,
            stage,
            work,
            out,
            seen,
        )
        count += 1
        if s == 0:
            if latched and latch(contacts, seen, floor):
                continue  # the force has jumped: the first stage anew
            peak = max(peak, max(seen[0, FORCE], seen[1, FORCE]))
            if last or step >= 1000 * steps or not np.isfinite(out[n]):
                return time, peak, count
            total[:] = 0.0
        ahead = 0.5 if s < 2 else 1.0
        for k in range(len(y)):
            total[k] += out[k] * (1.0 if s == 0 or s == 3 else 2.0)
            stage[k] = y[k] + ahead * h * out[k]
        s += 1
        if s == 4:
            s = 0
            for k in range(len(y)):
                stage[k] = y[k] + h / 6.0 * total[k]
            beyond = free and (corrections > 0 or stage[n - 1] > at.TURN)
            if beyond and corrections < 6:
                h += (at.TURN - stage[n - 1]) / stage[2 * n - 1]
                corrections += 1
                stage[:] = y
            else:
                time += h
                step += 1
                last = beyond or (step == steps and not free)
                y[:] = stage


class Equations:
    """The equations of one design, for solvers that call them.

    Parameters
    ----------
    problem : Problem
    par : ndarray, shape (PARAMETERS,)
    start : ndarray, shape (STATE,)
        As `hpcclear.dynamics.lowering` makes them.
    """

    def __init__(self, problem: Problem, par: Array, start: Array) -> None:
        n = problem.coordinates
        none = np.zeros(4)
        tables = [none if t is None else t for t in (problem.torque_table, problem.load_table)]
        self.n = n
        self.problem = problem
        self.par = par
        self.latched = problem.effects.latched is not None
        self.free = problem.effects.torque is not None
        velocities = start[at.MAX_COORDINATES : at.MAX_COORDINATES + n]
        self.start = np.concatenate([start[:n], velocities, np.zeros(2)])
        self.contacts = start[2 * at.MAX_COORDINATES :][:4].copy()
        self.seen = np.zeros((2, 3))
        self.calls = 0
        self._head: tuple[Any, ...] = (problem.effects, n, par, *tables)
        self._work = np.zeros(at.WORK)

    def __call__(self, time: float, y: Array) -> Array:
        """dy/dt, shape (2 n + 2,)."""
        out = np.empty_like(y)
        self.calls += 1
        derivative(*self._head, self.contacts, time, y, self._work, out, self.seen)
        return out

    def joints(self, time: float, y: Array) -> Array:
        """Gap, contact force and rate of the gap at both joints, shape (2, 3)."""
        derivative(*self._head, self.contacts, time, y, self._work, np.empty_like(y), self.seen)
        return self.seen

    def classical(self, steps: int) -> tuple[Array, float, float, int]:
        """State after one revolution in `steps` classical steps, its duration, largest force, evaluations."""
        y, contacts = self.start.copy(), self.contacts.copy()
        floor = self.problem.impact_floor
        time, peak, count = classical_turn(
            *self._head, self.latched, self.free, floor, steps, y, contacts
        )
        return y, time, peak, count
