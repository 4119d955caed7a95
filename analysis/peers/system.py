"""The scene as a compiled right-hand side of eight states, for integrators that take one."""

import numpy as np
from numba import njit
from plain_loop import motion
from scenes import Setup

from hpcclear.base.arrays import Array
from hpcclear.base.jit import FASTMATH
from hpcclear.dynamics.layout.views import Parameters

STATES = 8
SLIDER = 3  # index of the slider's position


@njit(error_model="numpy", fastmath=FASTMATH)
def right_hand_side(t, y, dy, p):
    """Rates of rod x, y, angle, slider x and their velocities; fixed damping, no memory."""
    gaps = np.empty(4)
    motion(t, y, dy, p, False, np.zeros(2, np.bool_), np.zeros(2), gaps)


def start(setup: Setup, sample: int = 0) -> Array:
    """Start state of one sample, shape (8,)."""
    return setup.start[sample].state(4)


def end_time(setup: Setup, sample: int = 0) -> float:
    """Seconds of all revolutions."""
    p = setup.problem
    return float(Parameters(setup.par[sample]).period) * (p.transient + p.averaged)


def tolerances(setup: Setup) -> Array:
    """Absolute tolerance of each state, shape (8,)."""
    return setup.problem.atol * Parameters(setup.par[0]).tolerances(4)
