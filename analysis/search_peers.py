"""Simulations that a study's search takes, beside those of Bayesian optimisation, SMT and pymoo for the same regret.

    python analysis/search_peers.py OUT            # 20 studies, one after the other; writes results/search_peers.csv
    python analysis/search_peers.py OUT --workers 2

The studies are those of `analysis/fresh_studies.py`, ten from seed 2060 and ten from 2117 on; bounded probabilities below
`RAREST` are left out, since `DRAWS` plain draws a design do not see such failures. Each study is carried out once. Each peer
runs with several seeds until the median of their regrets is at most the study's plus `EQUAL`, the resolution of the judge;
what it has simulated by then counts (judged whenever it has simulated another batch, of one design mostly). Of the package
`reached` is the same: what its search takes with the least of `LIMITS` by which its regret is within `EQUAL` of that by
default; `search` is what it takes until it ends by itself, which peers do not. Peers evaluate the same formula for `DRAWS`
random draws of the inputs a design:

- bayes: scikit-learn's Gaussian processes (Matern 5/2 and white noise) of merit and constraints, expected improvement times the
  probability of keeping the constraints, in batches of one to a sixteenth of all designs; ends with the design that the models
  believe best among those that keep the constraints with a probability of `SURE`. The same draws for all designs, or
  (bayes_independent) others for each, which the white noise takes up.
- smt: efficient global optimisation with noisy Kriging, constraints as a penalty, one design at a time; up to `SLOW`
  simulations, since it fits its model anew for every design.
- pymoo: differential evolution with pymoo's constraints.

A design that breaks its constraint by more than 2 % has no regret: it is broken; `above` counts designs that break it by more
than 0.1 %, most of which gain by it. Peers state no confidence intervals and verify
no design; the package's simulations are given for its search and for the whole study. OUT keeps results, so that the command
goes on where it was stopped. Peers: pip install 'hpcclear[bench]'.
"""

import argparse
import csv
import json
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import count, islice
from pathlib import Path
from typing import Any

import numpy as np
from closed_forms import DESIGN, PATHS, Judge, dynamics
from fresh_studies import Truth, least, study
from pymoo.algorithms.soo.nonconvex.de import DE
from pymoo.core.problem import ElementwiseProblem
from regret import carried_out
from scipy.special import ndtr, ndtri
from scipy.stats import norm, qmc
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern, WhiteKernel
from smt.applications import EGO
from smt.design_space import DesignSpace
from smt.surrogate_models import KRG

from hpcclear.report.merit import recommended
from hpcclear.results import dataset

RESULTS = Path(__file__).parent / "results" / "search_peers.csv"
FIRST, STUDIES, RAREST, LIMITS = (2060, 2117), 10, 1e-2, ((1, 1), (1, 3), (1, 6), (1, 12), (2, 12))
DRAWS, SEEDS, SLOW = 64, (1, 2, 3), 3200
BUDGETS = (800, 1130, 1600, 2260, 3200, 4530, 6400, 9050, 12800, 25600, 51200)
EQUAL, SURE, ABOVE = 5e-4, 0.9, 1e-3
SEARCH = "kriging", "kriging check", "search"
LOW, HIGH = np.array([PATHS[name][1:] for name in DESIGN]).T
FIELDS = (
    "seed", "kind", "objective", "constraint", "method", "reached", "search", "simulations", *map(str, BUDGETS), "regret",
    "above", "broken",
)  # fmt: skip


class Draws:
    """Merit of a design in the unit cube and by how much it breaks its constraints, by few draws."""

    def __init__(self, scene: Any, form: Any, seed: int, common: bool) -> None:
        self._scene, self._form, self._seed = scene, form, seed
        self._common, self._count = common, 0
        self._last = self._judge()

    def _judge(self) -> Truth:
        judge = Judge(self._scene, self._form, DRAWS, 100_000 * self._seed + self._count, 1.0)
        return Truth(self._scene, judge, lambda: judge)

    def __call__(self, unit: np.ndarray) -> np.ndarray:
        """Merit, and each constraint less its threshold: relative, or probits of a share of the draws."""
        self._count += 1
        if not self._common:
            self._last = self._judge()
        merit, _, values = self._last.of(LOW + np.clip(unit, 0.0, 1.0) * (HIGH - LOW))
        case = self._last.case
        excess = [
            float(ndtri((x * DRAWS + 0.5) / (DRAWS + 1)) - ndtri(one.most)) if one.limit else x / one.most - 1.0
            for one, x in zip(case.kept, values[len(case.goals) :], strict=True)
        ]  # fmt: skip
        return np.array([merit, *excess])


def bayes(simulate: Draws, seed: int) -> Iterator[tuple[int, np.ndarray]]:
    """Numbers of designs and the one believed best, as Bayesian optimisation goes on."""
    rng = np.random.default_rng(seed)
    designs = qmc.LatinHypercube(3, rng=rng).random(12)
    found = np.array([simulate(one) for one in designs])
    kernels: list[Any] = [None] * found.shape[1]
    fitted = 0
    while True:
        again = len(designs) >= 1.25 * fitted and len(designs) <= 400
        fitted = len(designs) if again else fitted
        models, noise = [], []
        for k, values in enumerate(found.T):
            start = kernels[k] or ConstantKernel() * Matern(
                np.ones(3), (0.05, 50.0), nu=2.5
            ) + WhiteKernel(0.01, (1e-8, 1.0))
            model = GaussianProcessRegressor(
                start, optimizer="fmin_l_bfgs_b" if again else None, normalize_y=True
            )
            models.append(model.fit(designs, values))
            kernels[k] = model.kernel_
            noise.append(model.kernel_.k2.noise_level * values.std() ** 2)

        def beliefs(
            points: np.ndarray, models: list[Any] = models, noise: list[float] = noise
        ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            made = [model.predict(points, return_std=True) for model in models]
            means = np.array([mean for mean, _ in made])
            errors = [
                np.sqrt(np.maximum(std**2 - n, 1e-18))
                for (_, std), n in zip(made, noise, strict=True)
            ]
            sure = np.prod(
                [ndtr(-m / e) for m, e in zip(means[1:], errors[1:], strict=True)], axis=0
            )
            return means[0], errors[0], np.broadcast_to(sure, len(points))

        mean, _, sure = beliefs(designs)
        kept = sure >= min(SURE, sure.max())
        best = int(np.where(kept, mean, np.inf).argmin())
        yield len(designs), designs[best]
        near = designs[best] + rng.standard_normal((200, 3)) * 10.0 ** rng.uniform(
            -2.5, -0.5, (200, 1)
        )
        points = np.vstack([rng.random((400, 3)), np.clip(near, 0.0, 1.0)])
        means, errors, sure = beliefs(points)
        below = mean[best] - means
        won = (below * ndtr(below / errors) + errors * norm.pdf(below / errors)) * sure
        fresh: list[np.ndarray] = []
        for row in np.argsort(-won):
            if all(abs(points[row] - one).max() > 0.01 for one in fresh):
                fresh.append(points[row])
            if len(fresh) >= max(len(designs) // 16 - 2, 1):
                break
        designs = np.vstack([designs, fresh])
        found = np.vstack([found, [simulate(one) for one in fresh]])


class Search(EGO):  # type: ignore[misc]
    """Efficient global optimisation with random first points of each search in place of spread ones, half of its time."""

    def _setup_optimizer(self, fun: Any) -> Any:
        made, rng = super()._setup_optimizer(fun), np.random.default_rng(self.options["seed"])
        self._sampling = lambda count: rng.random((count, 3))
        return made


def smt(simulate: Draws, seed: int) -> Iterator[tuple[int, np.ndarray]]:
    """The same by SMT's efficient global optimisation."""
    size = 1.0

    def penalised(rows: np.ndarray) -> np.ndarray:
        found = np.array([simulate(one) for one in np.atleast_2d(rows)])
        return found[:, :1] / size + np.clip(10.0 * found[:, 1:], 0.0, 1.0).sum(
            axis=1, keepdims=True
        )

    space = DesignSpace([[0.0, 1.0]] * 3)
    designs = qmc.LatinHypercube(3, rng=np.random.default_rng(seed)).random(12)
    size = float(np.ptp([simulate(one)[0] for one in designs]))
    values = penalised(designs)
    yield len(designs), designs[values.argmin()]
    while len(designs) * DRAWS < SLOW:
        model = KRG(
            design_space=space,
            n_start=1,
            eval_noise=True,
            hyper_opt="TNC",
            print_global=False,
            seed=seed,
        )
        own = seed + 100 * len(designs)  # other first points of the search for each design
        search = Search(
            n_iter=1, criterion="EI", n_start=3, xdoe=designs, ydoe=values, surrogate=model, seed=own
        )  # fmt: skip
        best, _, _, designs, values = search.optimize(penalised)
        yield len(designs), np.ravel(best)


def pymoo(simulate: Draws, seed: int) -> Iterator[tuple[int, np.ndarray]]:
    """The same by pymoo's differential evolution."""

    class Problem(ElementwiseProblem):  # type: ignore[misc]
        def __init__(self) -> None:
            super().__init__(
                n_var=3, n_obj=1, n_ieq_constr=len(simulate(np.zeros(3))) - 1, xl=0.0, xu=1.0
            )

        def _evaluate(self, x: np.ndarray, out: dict[str, Any], *_: Any, **__: Any) -> None:
            values = simulate(x)
            out["F"], out["G"] = values[0], values[1:]

    search = DE(pop_size=25)
    search.setup(Problem(), termination=("n_gen", 10_000), seed=seed, verbose=False)
    while True:
        search.next()
        yield search.evaluator.n_eval, search.pop[_first(search.pop)].X


def _first(members: Any) -> int:
    """The best member: least broken, then the least merit."""
    broken = np.asarray(members.get("CV"))[:, 0]
    return int(np.lexsort([np.asarray(members.get("F"))[:, 0], broken])[0])


PEERS = {
    "pymoo": (pymoo, True), "bayes": (bayes, True), "smt": (smt, True), "bayes_independent": (bayes, False),
}  # fmt: skip


def compared(seed: int, out: Path, names: list[str]) -> list[dict[str, Any]]:
    """Rows of the table of one study: its own, and those of peers."""
    scene, form, kind, scanning, fine = study(seed)
    case, kept = scene.required_study.cases[0], out / f"{seed}.json"
    rows: list[dict[str, Any]] = json.loads(kept.read_text()) if kept.exists() else []
    ideal = fine.of(least(seed, scanning, fine))[0]

    def regret(design: Any) -> tuple[float, float]:
        merit, broken, _ = fine.of(design)
        return max((merit - ideal) / abs(ideal), 0.0) if broken <= 0.02 else np.inf, broken

    def add(method: str, **cells: Any) -> None:
        label = {
            "seed": seed, "kind": kind,
            "objective": "mean + 2 standard deviations" if case.plain else case.goals[0].words("m"),
            "constraint": f"{case.kept[0].words('m')} {case.kept[0].most:.2g}" if case.kept else "",
        }  # fmt: skip
        rows.append({**label, "method": method, **cells})
        kept.write_text(json.dumps(rows))
        print(*rows[-1].values(), flush=True)

    def carried(rounds: int = 0, designs: int = 0) -> tuple[int, int, float, float]:
        """Simulations of the search and of the whole study, and regret and excess of the design recommended; by default, or
        with so many new designs."""
        place = out / str(seed) / f"study_{rounds}_{designs}"
        place.parent.mkdir(exist_ok=True)
        keys = ("study.verification.infill_rounds", "study.verification.infill_designs")
        limited = dict(zip(keys, (rounds, designs), strict=True)) if rounds else {}
        with dynamics(form):
            directory, count = carried_out(scene.with_(limited), place)
        table = dataset.read(directory / "verification.nc", "verification").to_xarray()
        best = table.sel(design=recommended(table))
        stages = json.loads(place.with_suffix(".json").read_text())
        own, broken = regret([float(best[name]) for name in DESIGN])
        return sum(stages.get(one, 0) for one in SEARCH), count, own, broken

    if not rows:
        search, count, own, broken = carried()
        shorter = (carried(*limit) for limit in LIMITS)
        reached_by = next((spent for spent, _, its, _ in shorter if its <= own + EQUAL), search)
        add(
            "hpcclear", reached=min(reached_by, search), search=search, simulations=count, regret=round(own, 5),
            above=int(broken > ABOVE), broken=int(broken > 0.02),
        )  # fmt: skip
    for name in names:
        if name not in {row["method"] for row in rows}:
            add(
                name, **reached(PEERS[name], partial(Draws, scene, form), regret, rows[0]["regret"])
            )
    return rows


def reached(peer: Any, draws: Any, regret: Any, own: float) -> dict[str, Any]:
    """What a peer has simulated when its median regret is at most the study's, that median up to each of `BUDGETS`, and how
    many of its last designs break a constraint."""
    method, common = peer
    runs = [method(draws(seed, common), seed) for seed in SEEDS]
    most = SLOW if method is smt else BUDGETS[-1]
    cells: dict[str, Any] = {"simulations": f"> {most}"}
    for steps in zip(*runs, strict=True):
        spent = steps[0][0] * DRAWS
        if spent > most:
            break
        places = [LOW + np.clip(design, 0.0, 1.0) * (HIGH - LOW) for _, design in steps]
        found, broken = np.array([regret(one) for one in places]).T
        cells["above"], cells["broken"] = int((broken > ABOVE).sum()), int(np.isinf(found).sum())
        middle = float(np.median(found))
        column = next(str(budget) for budget in BUDGETS if budget >= spent)
        cells[column] = cells["regret"] = round(middle, 5) if np.isfinite(middle) else "broken"
        if middle <= own + EQUAL:
            return {**cells, "simulations": spent}
    return cells


def main() -> None:
    """Carry out, judge, write and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path)
    parser.add_argument("--peers", nargs="+", default=list(PEERS))
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--csv", type=Path, default=RESULTS)
    words = parser.parse_args()
    words.out.mkdir(exist_ok=True)
    warnings.simplefilter("ignore")  # of fits that end at a bound
    with ProcessPoolExecutor(
        words.workers, initializer=warnings.simplefilter, initargs=("ignore",)
    ) as pool:
        made = list(pool.map(partial(compared, out=words.out, names=words.peers), seeds()))
    with words.csv.open("w", newline="") as file:
        table = csv.DictWriter(file, FIELDS)
        table.writeheader()
        table.writerows(row for rows in made for row in rows)
    for name in words.peers:
        for part in ("reached", "search", "simulations"):
            pairs = [
                (rows[0][part], row["simulations"])
                for rows in made
                for row in rows
                if row["method"] == name
            ]
            more = sum(own < int(str(their).removeprefix("> ")) for own, their in pairs)
            print(
                f"{name} needs more than the {part} of hpcclear for the same regret in {more} of {len(pairs)}"
            )


def seeds() -> list[int]:
    """Seeds of the studies that are compared."""

    def taken(seed: int) -> bool:
        kept = study(seed)[0].required_study.cases[0].kept
        return all(one.statistic != "exceedance" or one.most >= RAREST for one in kept)

    return [seed for one in FIRST for seed in islice(filter(taken, count(one)), STUDIES)]


if __name__ == "__main__":
    main()
