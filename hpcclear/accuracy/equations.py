"""The kernel's equations of motion as a function of a state, for integrators that are not the kernel's.

A state is y = (q, v, integrals of the absolute gaps of the joints).
"""

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.layout.views import Parameters, Start
from hpcclear.dynamics.linkage.observe import derivative, new_seen
from hpcclear.dynamics.stepping.problem import Problem


class CalledEquations:
    """The equations of one design, `par` (PARAMETERS,) and `hpcclear.dynamics.setup.start`, for solvers that call them."""

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
        self.origin = start
        self.calls = 0
        self._head = problem.motion(problem.effects, 1).address, problem.tables
        self._seen = new_seen(n, par, self.size)

    def __call__(self, time: float, y: Array) -> Array:
        """dy/dt, shape (2 n + joints,)."""
        self.calls += 1
        derivative(*self._head, self.contacts, time, y, *self._seen)
        return self._seen.rates.copy()

    def joints(self, time: float, y: Array) -> Array:
        """Gap, contact force and rate of the gap of every joint, shape (joints, 3)."""
        derivative(*self._head, self.contacts, time, y, *self._seen)
        return self._seen.joints
