"""numbalsoda: LSODA and DOP853 called from compiled code. One absolute tolerance for all states."""

from collections.abc import Callable

import numpy as np
from numba import carray, cfunc
from numbalsoda import dop853, lsoda, lsoda_sig
from scenes import Setup

from hpcclear.dynamics import layout as at
from peers.system import SLIDER, STATES, end_time, right_hand_side, start


@cfunc(lsoda_sig)
def _right_hand_side(t, u, du, p):
    right_hand_side(t, carray(u, (STATES,)), carray(du, (STATES,)), carray(p, (at.OWN,)))


def _solver(method: Callable) -> Callable[[Setup, int], float]:
    def solve(setup: Setup, sample: int = 0) -> float:
        rtol = setup.problem.rtol
        times = np.array([0.0, end_time(setup, sample)])
        states, success = method(
            _right_hand_side.address,
            start(setup, sample),
            times,
            setup.par[sample],
            rtol=rtol,
            atol=1e-3 * rtol,
            mxstep=10**9,
        )
        return float(states[-1, SLIDER]) if success else float("nan")

    return solve


SOLVERS = {"numbalsoda dop853": _solver(dop853), "numbalsoda lsoda": _solver(lsoda)}
LAWS = ("hunt-crossley", "frictionless")
