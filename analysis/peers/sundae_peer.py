"""scikit-sundae: CVODE of SUNDIALS, right-hand side compiled, called through Python."""

from collections.abc import Callable

from scenes import Setup
from sksundae.cvode import CVODE

from peers.system import SLIDER, end_time, right_hand_side, start, tolerances


def _solver(method: str) -> Callable[[Setup, int], float]:
    def solve(setup: Setup, sample: int = 0) -> float:
        parameters = setup.par[sample]

        def rates(t, y, yp):
            right_hand_side(t, y, yp, parameters)

        solver = CVODE(
            rates,
            method=method,
            rtol=max(setup.problem.rtol, 1e-14),
            atol=tolerances(setup),
            max_num_steps=10**8,
        )
        result = solver.solve([0.0, end_time(setup, sample)], start(setup, sample))
        return float(result.y[-1, SLIDER]) if result.success else float("nan")

    return solve


SOLVERS = {"scikit-sundae Adams": _solver("Adams"), "scikit-sundae BDF": _solver("BDF")}
LAWS = ("hunt-crossley", "frictionless")
