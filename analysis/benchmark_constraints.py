"""The swarm on constrained problems, beside algorithms of pymoo: same evaluations, seeds and reference.

    python analysis/benchmark_constraints.py              # 25 000 evaluations, 21 seeds, about 15 min
    python analysis/benchmark_constraints.py --others     # 26 further problems, 11 seeds, about 40 min
    python analysis/benchmark_constraints.py --seeds 3    # a look

BNH, SRN, TNK, OSY, CTP1 and MW7 as pymoo has them, populations of 100 and fronts of 100 points: the peers' are their last
populations, the swarm's the best of its archive of 400. Hypervolumes over that of the best of all that was found, reference
point 1.1 times its extent from its best corner. `--others`: CTP2 to 8, the other MW of two objectives, C1-DTLZ1, C1-DTLZ3 and
C2-DTLZ2 with two, DAS-CMOP1 to 6 at the fifth of their difficulties. The search was made on the first six; of the others MW1,
MW6 and DAS-CMOP4 to 6 were looked at on the way: a seed of MW1 had no feasible point. Peers: pip install pymoo.
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
PROBLEMS: dict[str, tuple[object, ...]] = dict.fromkeys(
    ("bnh", "srn", "tnk", "osy", "ctp1", "mw7"), ()
)
OTHERS: dict[str, tuple[object, ...]] = {
    **{f"ctp{k}": () for k in range(2, 9)},
    **{f"mw{k}": () for k in (1, 2, 3, 5, 6, 9, 10, 11, 12, 13)},
    "c1dtlz1": (6, 2),  # variables, objectives
    "c1dtlz3": (11, 2),
    "c2dtlz2": (11, 2),
    **{f"dascmop{k}": (5,) for k in range(1, 7)},  # difficulty
}


def main() -> None:
    """Print a line for each problem: of every method the median and the least share of the hypervolume."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, help="21, or 11 of the others")
    parser.add_argument("--iterations", type=int, default=250)
    parser.add_argument("--others", action="store_true", help="further problems")
    words = parser.parse_args()
    problems, seeds = (OTHERS, 11) if words.others else (PROBLEMS, 21)
    methods = {"swarm": _swarm, **{peer: _peer(make) for peer, make in PEERS.items()}}
    print("median / least share; + where the swarm's median is level with the best peer's or ahead")
    print(" " * 9 + "".join(f"{method:>18}" for method in methods))
    for name, details in problems.items():
        problem = get_problem(name, *details)
        fronts = {
            method: [run(problem, words.iterations, seed) for seed in range(words.seeds or seeds)]
            for method, run in methods.items()
        }
        found = _shares(fronts)
        cells = "".join(f"{np.median(one):>9.4f} /{min(one):>7.4f}" for one in found.values())
        swarm, *peers = (float(np.median(one)) for one in found.values())
        print(f"{name:9}{cells} {'+' if swarm >= max(peers) else '-'}", flush=True)


def _shares(fronts: dict[str, list[np.ndarray]]) -> dict[str, list[float]]:
    """Hypervolume of every front, cut, over that of the best of all."""
    known = np.concatenate([one for each in fronts.values() for one in each])
    best = known[moocore.is_nondominated(known)]
    low, extent = best.min(axis=0), np.ptp(best, axis=0)
    extent = np.where(extent > 0.0, extent, 1.0)  # one point
    reference = np.full(len(low), 1.1)
    whole = hypervolume((best - low) / extent, reference)

    def share(values: np.ndarray) -> float:
        return hypervolume((values[cut(values, POPULATION)] - low) / extent, reference) / whole

    return {method: [share(one) for one in each] for method, each in fronts.items()}


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
