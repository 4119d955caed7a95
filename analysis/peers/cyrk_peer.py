"""CyRK: compiled Runge-Kutta methods on a compiled right-hand side."""

from collections.abc import Callable

from CyRK import nb_diffeq_addr, nbsolve2_ivp
from numba import carray
from scenes import Setup

from hpcclear.dynamics import layout as at
from peers.system import SLIDER, STATES, end_time, right_hand_side, start, tolerances


def _right_hand_side(dy, t, y, args):
    right_hand_side(t, carray(y, (STATES,)), carray(dy, (STATES,)), carray(args, (at.OWN,)))


_ADDRESS = nb_diffeq_addr(_right_hand_side)


def _solver(method: str) -> Callable[[Setup, int], float]:
    def solve(setup: Setup, sample: int = 0) -> float:
        result = nbsolve2_ivp(
            _ADDRESS,
            (0.0, end_time(setup, sample)),
            start(setup, sample),
            method=method,
            args=setup.par[sample],
            rtol=setup.problem.rtol,
            atols=tolerances(setup),
        )
        return float(result.y[SLIDER, -1]) if result.success else float("nan")

    return solve


SOLVERS = {f"CyRK {method}": _solver(method) for method in ("RK45", "DOP853")}
LAWS = ("hunt-crossley", "frictionless")
