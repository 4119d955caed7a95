"""The swarm beside those of pymoo and Platypus: same problems, evaluations, seeds and cut.

    python analysis/benchmark_swarms.py              # 25 000 evaluations, seeds 1-5, about 15 min
    python analysis/benchmark_swarms.py --quick      # 5 000 evaluations, seeds 1-2, about 1 min

ZDT1 to 3 (30 variables) and DTLZ2 (12 variables, 3 objectives), populations of 100, the front of
every method cut to 100 points by `hpcclear.statistics.search.pareto.cut`, hypervolume for the reference point 1.1 in
each objective. The peers run with their own defaults (OMOPSO has none
for its epsilons: 0.005). Writes benchmark_swarms.nc and .png.
Peers: pip install pymoo platypus-opt (one that is missing is reported and left out).
"""

import argparse
import importlib.metadata
import importlib.util
import random
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import moocore
import numpy as np
import xarray as xr
from drawing import described
from matplotlib.ticker import NullFormatter

from hpcclear.results.rows import FileVariables, number
from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.search.pareto import cut

POPULATION = 100
FRONT = 100
REFERENCE = 1.1
Function = Callable[[np.ndarray], np.ndarray]


def _zdt(shape: Function) -> Function:
    def function(x: np.ndarray) -> np.ndarray:
        g = 1.0 + 9.0 * x[:, 1:].mean(axis=1)
        return np.stack([x[:, 0], g * shape(np.stack([x[:, 0], x[:, 0] / g]))], axis=1)

    return function


zdt1 = _zdt(lambda r: 1.0 - np.sqrt(r[1]))
zdt2 = _zdt(lambda r: 1.0 - r[1] ** 2)
zdt3 = _zdt(lambda r: 1.0 - np.sqrt(r[1]) - r[1] * np.sin(10.0 * np.pi * r[0]))


def dtlz2(x: np.ndarray) -> np.ndarray:
    g = 1.0 + ((x[:, 2:] - 0.5) ** 2).sum(axis=1)
    a, b = 0.5 * np.pi * x[:, 0], 0.5 * np.pi * x[:, 1]
    shape = [np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)]
    return np.stack([g * part for part in shape], axis=1)


def true_front(function: Function, variables: int) -> np.ndarray:
    """A dense sample of the known Pareto front."""
    if function is dtlz2:
        a, b = np.meshgrid(np.linspace(0.0, 1.0, 60), np.linspace(0.0, 1.0, 60))
        best = np.full((a.size, variables), 0.5)
        best[:, 0], best[:, 1] = a.ravel(), b.ravel()
    else:
        best = np.zeros((2000, variables))
        best[:, 0] = np.linspace(0.0, 1.0, 2000)
    values = function(best)
    return values[moocore.is_nondominated(values)]


PROBLEMS: dict[str, tuple[Function, int, int]] = {
    "ZDT1": (zdt1, 30, 2),
    "ZDT2": (zdt2, 30, 2),
    "ZDT3": (zdt3, 30, 2),
    "DTLZ2": (dtlz2, 12, 3),
}
TARGETS = {"ZDT1": 0.8700, "ZDT2": 0.5379, "ZDT3": 1.3265, "DTLZ2": 0.7290}


RUNS = "problem algorithm seed"
VARIABLES: FileVariables = {
    "hypervolume": number(RUNS, "1", "hypervolume of the cut front, reference point 1.1"),
    "igd_plus": number(RUNS, "1", "IGD+ of the cut front against the known front"),
    "evaluations": number(RUNS, "1", "function evaluations used"),
    "front_size": number(RUNS, "1", "points in the cut front"),
    "seconds": number(RUNS, "s", "wall time of the run, function included"),
}
"""What is measured of every run."""


def run_hpcclear(function: Function, variables: int, _: int, budget: int, seed: int) -> np.ndarray:
    front = minimise(
        function,
        [(0.0, 1.0)] * variables,
        iterations=budget // POPULATION,
        rng=np.random.default_rng(seed),
        size=FRONT,
    )
    return front.values


def _pymoo(name: str) -> Callable[..., np.ndarray]:
    def run(function: Function, variables: int, objectives: int, budget: int, seed: int):
        from pymoo.algorithms.moo.cmopso import CMOPSO
        from pymoo.algorithms.moo.mopso_cd import MOPSO_CD
        from pymoo.core.problem import Problem
        from pymoo.optimize import minimize

        class Wrapped(Problem):
            def _evaluate(self, x, out, *args, **kwargs):
                out["F"] = function(x)

        problem = Wrapped(n_var=variables, n_obj=objectives, xl=0.0, xu=1.0)
        algorithm = {"MOPSO_CD": MOPSO_CD, "CMOPSO": CMOPSO}[name](pop_size=POPULATION)
        return minimize(problem, algorithm, ("n_eval", budget), seed=seed).F

    return run


def _platypus(name: str) -> Callable[..., np.ndarray]:
    def run(function: Function, variables: int, objectives: int, budget: int, seed: int):
        import platypus

        random.seed(seed)  # Platypus draws from Python's global generator
        problem = platypus.Problem(variables, objectives)
        problem.types[:] = [platypus.Real(0.0, 1.0) for _ in range(variables)]
        problem.function = lambda x: function(np.array([x]))[0].tolist()
        options = {"swarm_size": POPULATION, "max_iterations": budget // POPULATION}
        if name == "SMPSO":
            algorithm = platypus.SMPSO(problem, **options)
        else:
            algorithm = platypus.OMOPSO(problem, epsilons=[0.005] * objectives, **options)
        algorithm.run(budget)
        return np.array([list(solution.objectives) for solution in algorithm.result])

    return run


METHODS: dict[str, tuple[str, Callable[..., np.ndarray]]] = {
    "hpcclear": ("hpcclear", run_hpcclear),
    "pymoo MOPSO_CD": ("pymoo", _pymoo("MOPSO_CD")),
    "pymoo CMOPSO": ("pymoo", _pymoo("CMOPSO")),
    "Platypus SMPSO": ("platypus", _platypus("SMPSO")),
    "Platypus OMOPSO": ("platypus", _platypus("OMOPSO")),
}


def compare(methods: list[str], budget: int, seeds: list[int]) -> xr.Dataset:
    """Every method on every problem for every seed."""
    shape = (len(PROBLEMS), len(methods), len(seeds))
    result = {name: np.full(shape, np.nan) for name in VARIABLES}
    fronts = np.full((*shape, FRONT, 3), np.nan)
    for p, (function, variables, objectives) in enumerate(PROBLEMS.values()):
        known = true_front(function, variables)
        for a, method in enumerate(methods):
            for s, seed in enumerate(seeds):
                calls = [0]

                def counted(x: np.ndarray, function=function, calls=calls) -> np.ndarray:
                    calls[0] += len(x)
                    return function(x)

                begin = time.perf_counter()
                values = METHODS[method][1](counted, variables, objectives, budget, seed)
                result["seconds"][p, a, s] = time.perf_counter() - begin
                values = values[moocore.is_nondominated(values)]
                values = values[cut(values, FRONT)]
                result["hypervolume"][p, a, s] = moocore.hypervolume(values, REFERENCE)
                result["igd_plus"][p, a, s] = moocore.igd_plus(values, known)
                result["evaluations"][p, a, s] = calls[0]
                result["front_size"][p, a, s] = len(values)
                fronts[p, a, s, : len(values), :objectives] = values
            print(f"  {list(PROBLEMS)[p]:6s} {method} done", flush=True)
    return _dataset(result, fronts, methods, seeds)


def _dataset(result: dict, fronts: np.ndarray, methods: list[str], seeds: list[int]) -> xr.Dataset:
    data: dict[str, Any] = dict(described(result, VARIABLES))
    data["front"] = (
        (*RUNS.split(), "solution", "objective"),
        fronts,
        {"long_name": "objectives of the cut front, NaN where absent", "units": "1"},
    )
    limits = [
        float(moocore.hypervolume(true_front(function, variables), REFERENCE))
        for function, variables, _ in PROBLEMS.values()
    ]
    limits[:2] = [1.21 - 1.0 / 3.0, 1.21 - 2.0 / 3.0]  # closed forms
    limits[3] = 1.331 - np.pi / 6.0
    note = {"long_name": "hypervolume of the whole known front", "units": "1"}
    data["limit"] = (("problem",), limits, note)
    packages = ("numpy", "moocore", "pymoo", "platypus-opt")
    versions = [f"{name} {_version(name)}" for name in packages]
    return xr.Dataset(
        data,
        coords={"problem": list(PROBLEMS), "algorithm": methods, "seed": seeds},
        attrs={"title": "Particle swarms on known problems", "versions": ", ".join(versions)},
    )


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def table(result: xr.Dataset, full: bool) -> str:
    """Median and worst hypervolume, 80 columns at most."""
    lines = ["Hypervolume, median / worst seed (reference point 1.1, fronts cut to 100)"]
    lines.append(f"{'':16s}" + "".join(f"{name:>16s}" for name in PROBLEMS))
    for method in result.algorithm.values:
        reached = result.hypervolume.sel(algorithm=method)
        cells = [
            f"{float(row.median()):.4f} /{float(row.min()):7.4f}"
            for row in (reached.sel(problem=name) for name in PROBLEMS)
        ]
        lines.append(f"{method:16s}" + "".join(f"{cell:>16s}" for cell in cells))
    limit = "".join(f"{float(value):>16.4f}" for value in result.limit)
    lines.append(f"{'whole front':16s}{limit}")
    if full:
        lines.append(f"{'target (median)':16s}" + "".join(f"{TARGETS[n]:>16.4f}" for n in PROBLEMS))
    lines.append("Seconds a run, median")
    for method in result.algorithm.values:
        spent = result.seconds.sel(algorithm=method).median("seed")
        lines.append(f"{method:16s}" + "".join(f"{float(value):>16.2f}" for value in spent))
    used = result.evaluations.max(["problem", "seed"])
    counts = (f"{method} {int(used.sel(algorithm=method))}" for method in result.algorithm.values)
    lines += textwrap.wrap("Most evaluations used: " + ", ".join(counts), 79)
    return "\n".join(lines)


def figure(result: xr.Dataset, path: Path) -> None:
    """Hypervolume that each run lacks to the whole front; lower is better."""
    panels, axes = plt.subplots(1, len(PROBLEMS), figsize=(12, 3.6), sharey=True, squeeze=True)
    rows = np.arange(result.sizes["algorithm"])
    for axis, problem in zip(axes, PROBLEMS, strict=True):
        lack = result.limit.sel(problem=problem) - result.hypervolume.sel(problem=problem)
        for row in rows:
            colour = "tab:red" if result.algorithm.values[row] == "hpcclear" else "tab:blue"
            run = lack.isel(algorithm=row).values
            axis.plot(run, np.full(run.shape, row), "o", color=colour, alpha=0.5, ms=5)
            axis.plot(np.median(run), row, "|", color=colour, ms=22, mew=2)
        axis.set_xscale("log")
        axis.xaxis.set_minor_formatter(NullFormatter())
        axis.set_title(problem)
        axis.grid(axis="x", which="both", alpha=0.25)
    axes[0].set_yticks(rows, list(result.algorithm.values))
    axes[0].invert_yaxis()
    panels.supxlabel("hypervolume lacking to the whole front (dot: one seed, bar: median)")
    panels.tight_layout()
    panels.savefig(path, dpi=150)
    plt.close(panels)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="5 000 evaluations, two seeds")
    parser.add_argument("-o", "--output", type=Path, default=Path("results"), help="folder")
    options = parser.parse_args()
    budget, seeds = (5_000, [1, 2]) if options.quick else (25_000, [1, 2, 3, 4, 5])
    methods = []
    for method, (package, _) in METHODS.items():
        if importlib.util.find_spec(package) is None:
            print(f"  {method}: {package} is not installed, left out")
        else:
            methods.append(method)
    minimise(zdt1, [(0.0, 1.0)] * 2, iterations=2, rng=np.random.default_rng(0))  # compile first
    result = compare(methods, budget, seeds)
    options.output.mkdir(parents=True, exist_ok=True)
    written = options.output / "benchmark_swarms.nc"
    partial = written.with_suffix(".partial")
    result.to_netcdf(partial, engine="h5netcdf")
    partial.replace(written)
    figure(result, options.output / "benchmark_swarms.png")
    print(f"{budget} evaluations, seeds {seeds[0]}-{seeds[-1]}\n{result.attrs['versions']}")
    print(table(result, full=not options.quick))
    print(f"written: {written}, {written.with_suffix('.png')}")


if __name__ == "__main__":
    main()
