"""The kernel's equations of motion as a function of a state, and classical Runge-Kutta steps over them.

For integrators that are not the kernel's. A state is y = (q, v, integrals of the absolute gaps of the joints).
"""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.jit import scalar_function
from hpcclear.dynamics.layout import MAX_JOINTS
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.linkage.observe import FORCE, OPEN, RATE, derivative, new_seen
from hpcclear.dynamics.stepping.problem import Problem


@scalar_function
def latch(contacts, seen, floor):
    """Start or end contacts by the signs of the gaps; True if a contact started or ended."""
    changed = False
    for j in range(len(seen)):
        if contacts[j] == 0.0 and seen[j, OPEN] > 0.0:
            contacts[j] = 1.0
            contacts[MAX_JOINTS + j] = 1.0 / max(seen[j, RATE], floor)
            changed = True
        elif contacts[j] == 1.0 and seen[j, OPEN] < 0.0:
            contacts[j] = 0.0
            changed = True
    return changed


@scalar_function
def classical_turn(motion, tables, rule, steps, y, contacts, seen):
    """Integrate `y` over one revolution by the classical Runge-Kutta method of order 4, in equal steps.

    Contacts start and end between steps, as they come. `rule`: whether contacts latch, whether the last coordinate is the
    driven angle (then the last step is cut where its turn ends), least impact speed, period, and that angle there.
    Returns duration, largest contact force at a step's end, and evaluations.
    """
    latched, free, floor, period, end = rule
    out, joints = seen.rates, seen.joints
    n = (len(y) - len(joints)) // 2
    stage, total = y.copy(), np.empty(len(y))
    h = period / steps
    time, peak, count, step, corrections, s, last = 0.0, 0.0, 0, 0, 0, 0, False
    while True:
        c = 0.0 if s == 0 else (1.0 if s == 3 else 0.5)
        derivative(motion, tables, contacts, time + c * h, stage, out, joints, seen.lane)
        count += 1
        if s == 0:
            if latched and latch(contacts, joints, floor):
                continue  # the force has jumped: the first stage anew
            for j in range(len(joints)):
                peak = max(peak, joints[j, FORCE])
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
            beyond = free and (corrections > 0 or stage[n - 1] > end)
            if beyond and corrections < 6:
                h += (end - stage[n - 1]) / stage[2 * n - 1]
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
    par : ndarray, shape (PARAMETERS,)
    start : Start
        Of this design alone, as `hpcclear.dynamics.setup.start` makes it.
    """

    def __init__(self, problem: Problem, par: Array, start: Start) -> None:
        n = problem.coordinates
        self.n = n
        self.problem = problem
        self.par = par
        self.named = Parameters(par)
        self.latched = problem.effects.latched is not None
        self.free = problem.effects.torque is not None
        effects = problem.effects
        self.size = effects.first + effects.joints  # places of joints whose gaps are integrated
        self.start = np.concatenate([start.state(n), np.zeros(self.size)])
        self.contacts = start.contacts.copy()
        self._origin = start
        self.calls = 0
        self._head: tuple[object, ...] = (
            problem.motion(problem.effects, 1).address,
            problem.tables,
        )
        self._seen = new_seen(n, par, self.size)

    def anew(self) -> "Equations":
        """The same design at its start."""
        return Equations(self.problem, self.par, self._origin)

    def __call__(self, time: float, y: Array) -> Array:
        """dy/dt, shape (2 n + joints,)."""
        self.calls += 1
        derivative(*self._head, self.contacts, time, y, *self._seen)
        return self._seen.rates.copy()

    def joints(self, time: float, y: Array) -> Array:
        """Gap, contact force and rate of the gap of every joint, shape (joints, 3)."""
        derivative(*self._head, self.contacts, time, y, *self._seen)
        return self._seen.joints

    def classical(self, steps: int) -> tuple[Array, float, float, int]:
        """State after one revolution in `steps` classical steps, its duration, largest force, evaluations."""
        y, contacts = self.start.copy(), self.contacts.copy()
        problem, period = self.problem, float(self.named.period)
        end = float(self.named.turn_end)
        rule = (self.latched, self.free, problem.impact_floor, period, end)
        time, peak, count = classical_turn(
            *self._head,
            rule,
            steps,
            y,
            contacts,
            self._seen,
        )
        return y, time, peak, count
