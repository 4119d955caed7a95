"""Robust optimisation of each case: fronts of mean and standard deviation or others, and their ends (eqs. 19 to 23)."""

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import moocore
import numpy as np

from hpcclear.base import quantiles
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS
from hpcclear.plugins import SEARCHES
from hpcclear.scene import Scene
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import Box, box, to_physical
from hpcclear.scene.goals import Goal
from hpcclear.scene.points import snapped
from hpcclear.scene.random_inputs import RandomInput
from hpcclear.scene.sampling import generator, offsets, sobol, unit_lhs
from hpcclear.scene.study import Study
from hpcclear.statistics.random.inputs import Derived, RandomVariable
from hpcclear.statistics.random.moments import Drawn, RobustObjective
from hpcclear.statistics.search import foreign
from hpcclear.statistics.search.asking import Search, Task, made, minimise
from hpcclear.statistics.search.pareto import Front, cut, hypervolume
from hpcclear.statistics.search.settings import SwarmSettings
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study import surrogates
from hpcclear.study.goals import ends_in_all, excess, guessed, shortfall
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.surrogates import coordinate, method_of

Draws = tuple[int, np.random.Generator] | dict[str, Array] | Drawn | None
"""How many Monte Carlo draws of which generator, the draws themselves, those of designs, or none for an exact rule."""

PROBES = 64
"""Designs, beside the corners, at which the rules of derived random inputs are chosen."""


TOGETHER = 256
"""Points of a Sobol sequence at which the surrogate is taken for inputs that vary together, for a kernel that is no product of
them, and for all that is not mean and standard deviation."""


@dataclass(frozen=True)
class Problem:
    """What the swarm minimises in one case.

    Attributes
    ----------
    names : tuple of str
        Design variables Z.
    region : Box
        Their bounds in sampling coordinates.
    objective : RobustObjective
        Mean and standard deviation of designs in SI.
    scene : Scene
    case : Case
    draws : callable
        Of designs (n, d), points of a Sobol sequence in the random inputs, (n or 1, s) each, for what is made small besides.
    further : tuple of RobustObjective
        The same of `Study.further`, responses besides f that cases require.
    """

    names: tuple[str, ...]
    region: Box
    objective: RobustObjective
    scene: Scene
    case: Case
    draws: Drawn
    further: tuple[RobustObjective, ...] = ()

    def physical(self, coordinates: Array) -> Array:
        """The nearest designs that exist, in SI, shape (n, d)."""
        return to_physical(self.scene, self.names, self.snapped(coordinates))

    def snapped(self, coordinates: Array) -> Array:
        """The nearest designs that exist, in sampling coordinates, (n, d)."""
        return snapped(self.scene.required_study, self.names, coordinates)

    def searched(self, designs: Array) -> Array | tuple[Array, Array]:
        """Objectives of designs in SI, (n, objectives); with constraints, also by how much these are violated, (n,)."""
        if self.case.plain:
            return self.objective(designs)
        draws = self.draws(designs)
        each = [one.sampled(designs, draws) for one in (self.objective, *self.further)]
        named = dict(zip(self.names, designs.T, strict=True))

        def of(goal: Goal) -> Array:
            return each[max(goal.place - 1, 0)]

        found = np.column_stack([guessed(goal, of(goal), named) for goal in self.case.goals])
        if not self.case.kept:
            return found
        broken = [
            shortfall(one, one.most, of(one))
            if one.statistic == "exceedance"
            else excess([one], guessed(one, of(one), named)[:, None])
            for one in self.case.kept
        ]
        return found, np.maximum(np.max(broken, axis=0), 0.0)

    def moments(self, designs: Array) -> Array:
        """Mean and standard deviation of designs in SI, (n, 2); NaN where the surrogate does not hold."""
        found = np.full((len(designs), 2), np.nan)
        for row, design in enumerate(designs):
            try:
                found[row] = self.objective(design[None])[0]
            except InputError:  # the design's random inputs leave the surrogate's domain
                continue
        return found


def problem_of(
    scene: Scene, case: str, model: Piecewise, others: Sequence[Piecewise] = ()
) -> Problem:
    """The problem of one case on a surrogate of its objective, and on those of further responses.

    A surrogate that is cut into subintervals has no exact rule for an inertia that scatters while
    the model knows its ratio, nor for distributions that are known by their quantiles; no surrogate has one
    for inputs that vary together, or for a model whose length scales are a small part of a random input's range (it has
    found noise). Such a case is averaged by Monte Carlo; one on a kernel that is no product of its inputs over points of a
    Sobol sequence.
    """
    study = scene.required_study
    names = study.design_variables(case)
    region = box(scene, names)
    derived = [
        _ratio(scene, study.variable(name).paths[0])
        for name in study.optimisation
        if study.variable(name).ratio is not None
    ]
    random = study.case(case).random
    rng = generator(study.seed, "moments", case)
    unit = unit_lhs(PROBES, len(names), rng)
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=len(names))))
    probes = region.lower + np.concatenate([unit, corners]) * (region.upper - region.lower)
    rows = [study.random_input(name) for name in random]
    moving = any(study.moves(row) for row in rows)
    inputs = [
        RandomVariable(
            row.name, _inner(study, row) if moving else row.law, about_design=not row.absolute
        )
        for row in rows
    ]
    askew = len(model.leaves) > 1 and (
        any(set(one.of) & set(random) for one in derived)
        or any(isinstance(row.law, quantiles.Cut) for row in rows)
    )
    draws: Draws = None
    joint = None
    if moving:
        draws = _drawn(scene, case, names, sobol(len(random), rng, 0, TOGETHER).T)
    elif study.correlation is not None and len(set(study.correlation.inputs) & set(random)) > 1:
        draws = offsets(scene, random, list(sobol(len(random), rng, 0, TOGETHER).T))

        def joint(count: int, rng: np.random.Generator) -> dict[str, Array]:
            return offsets(scene, random, list(rng.random((len(random), count)) + 2.0**-54))

    elif study.swarm.statistics == "quadrature" and not model.separable:
        draws = offsets(scene, random, list(sobol(len(random), rng, 0, TOGETHER).T))
    elif askew or study.swarm.statistics == "monte-carlo":
        draws = (study.swarm.monte_carlo_samples, rng)

    def averaged(draws: Draws) -> RobustObjective:
        return RobustObjective(
            model,
            names,
            inputs,
            derived=derived,
            probes=to_physical(scene, names, probes),
            draws=draws,
            joint=joint,
        )

    try:
        objective = averaged(draws)
    except InputError:  # length scales too short for a quadrature rule
        if draws is not None:
            raise
        objective = averaged((study.swarm.monte_carlo_samples, rng))
    rng = generator(study.seed, "goals", case)
    points = _drawn(scene, case, names, sobol(len(random), rng, 0, TOGETHER).T)
    further = tuple(
        RobustObjective(
            other,
            names,
            inputs,
            derived=derived,
            probes=to_physical(scene, names, probes),
            draws=points,
        )
        for other in others
    )
    return Problem(names, region, objective, scene, study.case(case), points, further)


def _inner(study: Study, row: RandomInput) -> quantiles.Quantiles:
    """Ends of a distribution that depends on the design, as the domain of the surrogate has them for all."""
    low, high = study.reach(row) if row.absolute else (0.0, 0.0)
    return quantiles.Uniform((low + high) / 2.0, (high - low) / 2.0)


def _drawn(scene: Scene, case: str, names: Sequence[str], chances: Array) -> Drawn:
    """Draws of the random inputs of a case at probabilities (inputs, s): the same for all designs, unless distributions
    depend on them."""
    study = scene.required_study
    random = study.case(case).random
    if not any(study.moves(study.random_input(name)) for name in random):
        fixed = {name: one[None] for name, one in offsets(scene, random, list(chances)).items()}
        return lambda designs: fixed

    def of_designs(designs: Array) -> dict[str, Array]:
        rows = [
            offsets(scene, random, list(chances), dict(zip(names, design, strict=True)))
            for design in designs
        ]
        return {name: np.array([row[name] for row in rows]) for name in random}

    return of_designs


def _ratio(scene: Scene, inertia: str) -> Derived:
    """The ratio I / (m L^2 / 12) of a link from the inertia, and from its mass and length."""
    study, link = scene.required_study, inertia.rpartition(".")[0]
    variable = {path: name for name in study.optimisation for path in study.variable(name).paths}
    of = [variable[inertia]]
    places: dict[str, int] = {}
    for part in ("mass", "length"):
        if f"{link}.{part}" in variable:
            places[part] = len(of)
            of.append(variable[f"{link}.{part}"])
    numbers = {part: scene.number(f"{link}.{part}") for part in ("mass", "length")}

    def function(*values: Array) -> Array:
        mass, length = (
            values[places[part]] if part in places else numbers[part] for part in ("mass", "length")
        )
        return np.asarray(values[0] / (mass * length**2 / 12))

    return Derived(coordinate(study.variable(variable[inertia])), tuple(of), function)


def optimise(run: StudyRun, model: Piecewise) -> Result:
    """All runs of the swarm on all cases.

    Returns
    -------
    dict of arrays
        For case number k ``front_k`` (runs, solutions, d + objectives): design coordinates, and what the case makes
        small, NaN-padded; ``hypervolume_k`` and ``gain_k`` (runs,).
    """
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
        result[f"front_{index}"] = padded
        result[f"gain_{index}"] = np.array(gains)
        result[f"hypervolume_{index}"] = np.array(
            [hypervolume(solutions[:, -count:], reference) for solutions in fronts]
        )
    return result


def check(scene: Scene) -> None:
    """That the surrogate and the search a study requires can be had, before anything is simulated.

    Raises
    ------
    InputError
        A package is not installed, or it is none.
    """
    method_of(scene)
    for case in scene.required_study.cases:
        region = box(scene, scene.required_study.design_variables(case.name))
        _begun(scene, region, len(case.goals), np.random.default_rng(0))


def _begun(
    scene: Scene, region: Box, objectives: int, rng: np.random.Generator
) -> tuple[Search, Task, str]:
    """The search of a study at its start, what it was made for, and its name."""
    settings = scene.required_study.swarm
    task = Task(
        bounds=np.column_stack([region.lower, region.upper]),
        objectives=objectives,
        rng=rng,
        iterations=settings.iterations,
        settings=SwarmSettings(
            particles=settings.particles,
            c1=settings.c1,
            c2=settings.c2,
            inertia_first=settings.inertia[0],
            inertia_last=settings.inertia[1],
        ),
    )
    name = settings.algorithm or "swarm"
    source = SEARCHES.get(name, scene.plugin_texts)
    maker = partial(foreign.adapted, source) if foreign.is_algorithm(source) else source
    return made(maker, name, task), task, name


def _search(run: StudyRun, problem: Problem, rng: np.random.Generator) -> Front:
    def function(coordinates: Array) -> Array | tuple[Array, Array]:
        run.ranks.raise_if_stopped()
        return problem.searched(problem.physical(coordinates))

    def nearest(coordinates: Array) -> Array:
        """Where no design keeps the constraints: how much it breaks them, and the first objective."""
        values, broken = function(coordinates)
        return np.column_stack([broken, values[:, 0]])

    front = _minimised(run, problem, function, len(problem.case.goals), rng)
    if len(front.values):
        return front
    near = _minimised(run, problem, nearest, 2, rng)
    return replace(near, values=np.asarray(function(near.points)[0]))


def _minimised(
    run: StudyRun,
    problem: Problem,
    function: Callable[[Array], Array | tuple[Array, Array]],
    objectives: int,
    rng: np.random.Generator,
) -> Front:
    search, task, name = _begun(run.scene, problem.region, objectives, rng)
    return minimise(search, function, task, run.study.swarm.archive, name)


@dataclass(frozen=True)
class Choice:
    """A design chosen for direct simulation.

    Attributes
    ----------
    name, case : str
        The name is empty until a design has earned one.
    design : dict of str to float
        SI.
    place : (int, int) or None
        Run of the swarm and solution, for one that stands on a front.
    origin : str
        "search", or "given": the baseline design, and what a publication prints.
    """

    name: str
    case: str
    design: Mapping[str, float]
    place: tuple[int, int] | None = None
    origin: str = "search"


def chosen_in_all(study: Study) -> tuple[int, int]:
    """How many designs `extremes` chooses, and `spread` at most."""
    return 2 * ends_in_all(study), study.verification.designs * len(study.cases)


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
            chosen.append(
                Choice(
                    f"{case.name} averaged {letter}", case.name, _design(run, case.name, average)
                )
            )
            winner = int(own[:, column].argmin())
            place = winner, int(best[winner])
            design = _design(run, case.name, own[winner, :-count])
            chosen.append(Choice(f"{case.name} best {letter}", case.name, design, place))
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
        for row in inner[np.argsort(values[inner, 0], kind="stable")]:
            number_of_run, solution = (int(index) for index in places[row])
            design = _design(run, case.name, points[row, :-count])
            chosen.append(Choice("", case.name, design, (number_of_run, solution)))
    return chosen


def _design(run: StudyRun, case: str, coordinates: Array) -> dict[str, float]:
    names = run.study.design_variables(case)
    place = snapped(run.study, names, coordinates[None])
    values = to_physical(run.scene, names, place)[0]
    return dict(zip(names, values.tolist(), strict=True))
