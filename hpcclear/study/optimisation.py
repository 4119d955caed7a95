"""Robust optimisation of each case: fronts of mean and standard deviation or others, and their ends (eqs. 19 to 23)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import moocore
import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.objectives import ENDS
from hpcclear.plugins import SEARCHES
from hpcclear.scene import Scene
from hpcclear.scene.domain import Box, box, to_physical
from hpcclear.scene.points import snapped
from hpcclear.scene.study import Study
from hpcclear.statistics.search import foreign
from hpcclear.statistics.search.asking import Search, SearchTask, SwarmSettings, made, minimise
from hpcclear.statistics.search.mopso import swarm
from hpcclear.statistics.search.pareto import Front, cut, hypervolume
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import surrogates
from hpcclear.study.goals import ends_in_all
from hpcclear.study.problem import SwarmProblem, problem_of
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.surrogates import method_of


def optimise(run: StudyRun, model: Piecewise) -> Result:
    """All runs of the swarm on all cases: for case number k ``front_k`` (runs, solutions, d + objectives), design coordinates
    and what the case makes small, NaN-padded; ``hypervolume_k`` and ``gain_k`` (runs,)."""
    result: Result = {}
    others = surrogates.of_further(run, model)
    for index, case in enumerate(run.study.cases):
        fronts, gains = [], []
        problem = problem_of(run.scene, case.name, model, others)
        for number in range(run.study.swarm.runs):
            front = _search(run, problem, run.rng("swarm", case.name, str(number)))
            fronts.append(np.column_stack([problem.snapped(front.points), front.values]))
            gains.append(front.gain)
        size = max(len(front) for front in fronts)
        padded = np.full((len(fronts), size, fronts[0].shape[1]), np.nan)
        for k, solutions in enumerate(fronts):
            padded[k, : len(solutions)] = solutions
        count = len(case.goals)
        values = padded[..., -count:]
        reference = np.nanmax(values, axis=(0, 1)) * 1.1
        areas = [hypervolume(solutions[:, -count:], reference) for solutions in fronts]
        result[f"front_{index}"] = padded
        result[f"gain_{index}"] = np.array(gains)
        result[f"hypervolume_{index}"] = np.array(areas)
    return result


def check(scene: Scene) -> None:
    """That the surrogate and the search a study requires can be had, before anything is simulated. Raises InputError if a
    package is not installed, or it is none."""
    method_of(scene)
    for case in scene.required_study.cases:
        region = box(scene, scene.required_study.design_variables(case.name))
        _begun(scene, region, len(case.goals), np.random.default_rng(0))


def _begun(
    scene: Scene, region: Box, objectives: int, rng: np.random.Generator
) -> tuple[Search, SearchTask, str]:
    """The search of a study at its start, what it was made for, and its name."""
    settings = scene.required_study.swarm
    own = SwarmSettings(settings.particles, settings.c1, settings.c2, *settings.inertia)
    task = SearchTask(region.bounds, objectives, rng, settings.iterations, own)
    name = settings.algorithm or "swarm"
    if name == "swarm":
        return made(swarm, name, task), task, name
    source: Any = SEARCHES.get(name, scene.plugin_texts)
    if SEARCHES.is_ours(name):
        source = getattr(foreign, name.removeprefix("pymoo:"))
    maker = partial(foreign.adapted, source) if foreign.is_algorithm(source) else source
    return made(maker, name, task), task, name


def _search(run: StudyRun, problem: SwarmProblem, rng: np.random.Generator) -> Front:
    def function(coordinates: Array) -> Array | tuple[Array, Array]:
        run.ranks.raise_if_stopped()
        return problem.searched(problem.physical(coordinates))

    def broken(coordinates: Array) -> Array:
        return np.asarray(function(coordinates)[1])[:, None]

    def minimised(made: Callable[[Array], Array | tuple[Array, Array]], objectives: int) -> Front:
        search, task, name = _begun(run.scene, problem.region, objectives, rng)
        return minimise(search, made, task, run.study.swarm.archive, name)

    front = minimised(function, len(problem.case.goals))
    if len(front.values):
        return front
    near = minimised(broken, 1)  # no design keeps the constraints: the nearest
    return replace(near, values=np.asarray(function(near.points)[0]))


@dataclass(frozen=True)
class Choice:
    """A design of a case, SI, chosen for direct simulation."""

    name: str
    """Empty until a design has earned one."""
    case: str
    design: Mapping[str, float]
    place: tuple[int, int] | None = None
    """Run of the swarm and solution, for one that stands on a front."""
    origin: str = "search"
    """Or "given": the baseline design, and what a publication prints."""


def choices(run: StudyRun, case: str, coordinates: Array) -> list[Choice]:
    """Designs of a case from sampling coordinates, (n, d), moved to the nearest ones that there are."""
    names = run.study.design_variables(case)
    rows = to_physical(run.scene, names, snapped(run.study, names, coordinates))
    return [Choice("", case, dict(zip(names, row.tolist(), strict=True))) for row in rows]


def distinct(these: Sequence[Choice]) -> list[Choice]:
    """Of equal designs of a case the first."""
    found: dict[object, Choice] = {}
    for choice in these:
        found.setdefault((choice.case, *choice.design.values()), choice)
    return list(found.values())


def chosen_in_all(study: Study) -> tuple[int, int]:
    """How many designs `extremes` chooses, and `spread` at most; the front of one objective is its end."""
    fronts = sum(len(case.goals) > 1 for case in study.cases)
    return 2 * ends_in_all(study), study.verification.designs * fronts


def extremes(run: StudyRun, fronts: Result) -> list[Choice]:
    """Designs with the least of each that a case makes small, by the surrogate: of least mean and of lowest standard deviation.

    Averaged over the runs, as the paper makes its alpha and beta, in sampling coordinates, so that the
    average keeps the bounds; and the best single ones.
    """
    chosen = []
    for index, case in enumerate(run.study.cases):
        padded = fronts[f"front_{index}"]
        count = len(case.goals)
        for column, letter in enumerate(ENDS[:count], start=-count):
            best = np.nanargmin(padded[..., column], axis=1)
            own = padded[np.arange(len(padded)), best]
            average = own[:, :-count].mean(axis=0)
            winner = int(own[:, column].argmin())
            middle, end = choices(run, case.name, np.stack([average, own[winner, :-count]]))
            place = winner, int(best[winner])
            chosen.append(replace(middle, name=f"{case.name} averaged {letter}"))
            chosen.append(replace(end, name=f"{case.name} best {letter}", place=place))
    return chosen


def spread(run: StudyRun, fronts: Result) -> list[Choice]:
    """Points spread over the joint front of each case's runs, without its ends."""
    chosen = []
    for index, case in enumerate(run.study.cases):
        padded, count = fronts[f"front_{index}"], len(case.goals)
        places = np.argwhere(np.isfinite(padded[..., -1]))
        points = padded[places[:, 0], places[:, 1]]
        kept = moocore.is_nondominated(points[:, -count:])  # of equal ones the first
        points, places = points[kept], places[kept]
        values = points[:, -count:]
        ends = np.unique(values.argmin(axis=0))  # one may have the least of several
        wanted = cut(values, run.study.verification.designs + len(ends))
        inner = wanted[~np.isin(wanted, ends)]
        rows = inner[np.argsort(values[inner, 0], kind="stable")]
        found = choices(run, case.name, points[rows, :-count])
        where = map(tuple, places[rows].tolist())
        chosen += [replace(one, place=place) for one, place in zip(found, where, strict=True)]
    return chosen
