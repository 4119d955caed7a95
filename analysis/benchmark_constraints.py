"""The swarm on constrained problems, beside algorithms of pymoo: same evaluations, seeds, cut and reference.

    python analysis/benchmark_constraints.py              # 25 000 evaluations, 11 seeds, about 10 min
    python analysis/benchmark_constraints.py --seeds 3    # a look

BNH, SRN, TNK, OSY, CTP1 and MW7 as pymoo has them, populations of 100, fronts cut to 100 points by
`hpcclear.statistics.search.pareto.cut`, hypervolumes over that of the best of all that was found, reference point 1.1 times its
extent from its best corner. Peers: pip install pymoo.
"""

import argparse
from collections.abc import Callable

import moocore
import numpy as np
from pymoo.algorithms.moo.age import AGEMOEA
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.algorithms.moo.sms import SMSEMOA
from pymoo.optimize import minimize
from pymoo.problems import get_problem

from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.search.pareto import cut, hypervolume

POPULATION = 100
PEERS: dict[str, Callable[..., object]] = {
    "NSGA-II": NSGA2,
    "SMS-EMOA": SMSEMOA,
    "AGE-MOEA": AGEMOEA,
}
PROBLEMS = ("bnh", "srn", "tnk", "osy", "ctp1", "mw7")


def main() -> None:
    """Print a line for each problem and method: median and least of the shares of the true hypervolume."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=11)
    parser.add_argument("--iterations", type=int, default=250)
    words = parser.parse_args()
    for name in PROBLEMS:
        problem = get_problem(name)
        methods = {"swarm": _swarm, **{peer: _peer(make) for peer, make in PEERS.items()}}
        fronts = {
            method: [run(problem, words.iterations, seed) for seed in range(words.seeds)]
            for method, run in methods.items()
        }
        known = np.concatenate([one for each in fronts.values() for one in each])
        best = known[moocore.is_nondominated(known)]
        low, extent = best.min(axis=0), np.ptp(best, axis=0)
        reference = np.full(len(low), 1.1)
        whole = hypervolume((best - low) / extent, reference)
        for method, each in fronts.items():
            kept = [values[cut(values, POPULATION)] for values in each]
            found = [hypervolume((one - low) / extent, reference) / whole for one in kept]
            text = f"median {np.median(found):.4f}, least {min(found):.4f}"
            print(f"{name:5} {method:9} {text}", flush=True)


def _swarm(problem, iterations: int, seed: int) -> np.ndarray:
    def function(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        found = problem.evaluate(points, return_as_dictionary=True)
        return found["F"], np.maximum(found["G"], 0.0)

    bounds = np.column_stack(problem.bounds())
    rng = np.random.default_rng(seed)
    return minimise(function, bounds, iterations=iterations, rng=rng, size=POPULATION).values


def _peer(make: Callable[..., object]) -> Callable[..., np.ndarray]:
    def run(problem, iterations: int, seed: int) -> np.ndarray:
        algorithm = make(pop_size=POPULATION)
        found = minimize(problem, algorithm, ("n_eval", POPULATION * iterations), seed=seed).F
        return np.empty((0, problem.n_obj)) if found is None else np.atleast_2d(found)

    return run


if __name__ == "__main__":
    main()
