"""What the search minimises in one case: mean and standard deviation of a surrogate over random inputs, or other objectives."""

import contextlib
import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hpcclear.base import quantiles
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene import Scene
from hpcclear.scene.cases import Case, Goal
from hpcclear.scene.domain import Box, box, to_physical
from hpcclear.scene.points import snapped
from hpcclear.scene.sampling import offsets, unit_lhs
from hpcclear.scene.streams import generator, sobol
from hpcclear.statistics.random.inputs import DerivedInput, RandomVariable
from hpcclear.statistics.random.moments import Drawn, RobustObjective
from hpcclear.statistics.surrogate.piecewise import Piecewise
from hpcclear.study.goals import excess, guessed, shortfall
from hpcclear.study.surrogates import coordinate

PROBES = 64
"""Designs, beside the corners, at which the rules of derived random inputs are chosen."""

TOGETHER = 256
"""Points of a Sobol sequence at which the surrogate is taken for inputs that vary together, for a model that is no product over
them, and for all that is not mean and standard deviation."""


@dataclass(frozen=True)
class SwarmProblem:
    """What the swarm minimises in one case: over the design variables `names`, whose bounds are `region`."""

    names: tuple[str, ...]
    region: Box
    objective: RobustObjective
    """Mean and standard deviation of designs in SI."""
    scene: Scene
    case: Case
    draws: Drawn
    """Of designs (n, d), points of a Sobol sequence in the random inputs, (n or 1, s) each, for what is made small besides."""
    independent: Callable[[int, np.random.Generator], Drawn]
    """So many independent draws, in place of those points."""
    further: tuple[RobustObjective, ...] = ()
    """As `objective`, of `Study.further`, responses besides f that cases require."""

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
        named, broken = dict(zip(self.names, designs.T, strict=True)), []

        def of(goal: Goal) -> Array:
            return each[max(goal.place - 1, 0)]

        found = np.column_stack([guessed(goal, of(goal), named) for goal in self.case.goals])
        for one in self.case.kept:
            if one.statistic == "exceedance":
                broken.append(shortfall(one, one.most, of(one)))
            else:
                broken.append(excess([one], guessed(one, of(one), named)[:, None]))
        return (found, np.maximum(np.max(broken, axis=0), 0.0)) if broken else found

    def moments(self, designs: Array) -> Array:
        """Mean and standard deviation of designs in SI, (n, 2); NaN where the surrogate does not hold."""
        found = np.full((len(designs), 2), np.nan)
        for row, design in enumerate(designs):
            with contextlib.suppress(InputError):  # random inputs leave the surrogate's domain
                found[row] = self.objective(design[None])[0]
        return found


class _Averages:
    """How the surrogates of one case are averaged over its random inputs.

    `moving`: whether a distribution depends on the design; `correlated`: whether inputs vary together.
    """

    def __init__(self, scene: Scene, case: str) -> None:
        self.scene, self.study, self.case = scene, scene.required_study, case
        self.names, self.random = self.study.design_variables(case), self.study.case(case).random
        self.rows = [self.study.random_input(name) for name in self.random]
        self.moving = any(self.study.moves(row) for row in self.rows)
        together = self.study.correlation
        inputs = () if together is None else together.inputs
        self.correlated = len(set(inputs) & set(self.random)) > 1

    def objective(self, model: Piecewise) -> RobustObjective:
        """Mean and standard deviation of f, by an exact rule where there is one."""
        rng = generator(self.study.seed, "moments", self.case)
        probes = self.probes(rng)
        if not self.moving and not self.correlated and model.separable:
            with contextlib.suppress(InputError):  # length scales too short for a quadrature rule
                return self.averaged(model, probes)
        return self.averaged(model, probes, self.drawn(self.chances(rng)))

    def averaged(
        self, model: Piecewise, probes: Array, draws: Drawn | None = None
    ) -> RobustObjective:
        laws = [row.law for row in self.rows]
        if self.moving:  # as the domain of the surrogate has them for all designs
            reach = [self.study.reach(row) if row.absolute else (0.0, 0.0) for row in self.rows]
            laws = [
                quantiles.Uniform((low + high) / 2.0, (high - low) / 2.0) for low, high in reach
            ]
        each = zip(self.rows, laws, strict=True)
        inputs = [RandomVariable(row.name, law, not row.absolute) for row, law in each]
        variables = [self.study.variable(name) for name in self.study.optimisation]
        ratios = [_ratio(self.scene, x.paths[0]) for x in variables if x.ratio is not None]
        return RobustObjective(
            model, self.names, inputs, derived=ratios, probes=probes, draws=draws
        )

    def probes(self, rng: np.random.Generator) -> Array:
        """Designs at which the rules of derived random inputs are chosen, SI, (m, d): corners, and some between."""
        region = box(self.scene, self.names)
        corners = list(itertools.product((0.0, 1.0), repeat=len(self.names)))
        unit = np.concatenate([unit_lhs(PROBES, len(self.names), rng), np.array(corners)])
        return to_physical(self.scene, self.names, region.at(unit))

    def chances(self, rng: np.random.Generator) -> Array:
        """Probabilities of the random inputs, (inputs, s)."""
        return sobol(len(self.rows), rng, 0, TOGETHER).T

    def drawn(self, chances: Array) -> Drawn:
        """Draws at probabilities (inputs, s): the same for all designs, unless distributions depend on them."""
        random = self.random
        if not self.moving:
            found = offsets(self.scene, random, list(chances))
            fixed = {name: one[None] for name, one in found.items()}
            return lambda designs: fixed

        def of_designs(designs: Array) -> dict[str, Array]:
            named = (dict(zip(self.names, one, strict=True)) for one in designs)
            rows = [offsets(self.scene, random, list(chances), one) for one in named]
            return {name: np.array([row[name] for row in rows]) for name in random}

        return of_designs

    def independent(self, count: int, rng: np.random.Generator) -> Drawn:
        """So many independent draws."""
        return self.drawn(rng.random((len(self.rows), count)) + 2.0**-54)


def problem_of(
    scene: Scene, case: str, model: Piecewise, others: Sequence[Piecewise] = ()
) -> SwarmProblem:
    """The problem of one case on a surrogate of its objective, and on those of further responses.

    A surrogate that is cut into subintervals has no exact rule, nor has one for inputs that vary together or on a kernel
    that is no product of its inputs, nor where length scales are a small part of a random input's range (it has found noise):
    these are averaged over points of a Sobol sequence.
    """
    averages, study = _Averages(scene, case), scene.required_study
    objective, region = averages.objective(model), box(scene, averages.names)
    points = averages.drawn(averages.chances(generator(study.seed, "goals", case)))
    probes = averages.probes(generator(study.seed, "moments", case))
    further = tuple(averages.averaged(other, probes, points) for other in others)
    return SwarmProblem(
        averages.names, region, objective, scene, study.case(case), points, averages.independent, further
    )  # fmt: skip


def _ratio(scene: Scene, inertia: str) -> DerivedInput:
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
        given = {part: values[place] for part, place in places.items()}
        mass, length = (numbers | given).values()
        return np.asarray(values[0] / (mass * length**2 / 12))

    return DerivedInput(coordinate(study.variable(variable[inertia])), tuple(of), function)
