"""The box a study samples: bounds of its variables, widened by the random inputs about them.

Its coordinates are the values themselves (SI), except that an inertia given as a ratio is sampled
as r = I / (m L^2/12), because its bounds depend on the mass.
"""

import itertools
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arithmetic import divisors, names_in, value_of
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene.cases import Constraint, Goal
from hpcclear.scene.fields import invalid
from hpcclear.scene.named import Range
from hpcclear.scene.planar import slender_inertia
from hpcclear.scene.study import Study
from hpcclear.scene.tables import SceneTables
from hpcclear.scene.variables import StudyVariable

ON_BOUND = 5e-3
"""Share of a variable's range within which a design sits on its bound."""
FORMULAS = 512
"""Designs at which formulas are tried; of each variable a quarter sits on either bound."""
CORNERS, SURELY = 10, 0.05
"""Variables with which all corners are tried, too; and how far beyond a threshold, over the range of its formula, the least
of these designs is where none can keep it."""


@dataclass(frozen=True)
class Box:
    """Bounds in sampling coordinates, arrays of shape ``(d,)``, read-only."""

    names: tuple[str, ...]
    lower: Array
    upper: Array

    @property
    def bounds(self) -> Array:
        """Both, shape ``(d, 2)``."""
        return np.column_stack([self.lower, self.upper])

    def at(self, unit: Array) -> Array:
        """Points ``(n, d)`` of the unit cube in these bounds."""
        return self.lower + unit * (self.upper - self.lower)


def box(scene: SceneTables, names: Sequence[str] | None = None, widen: Iterable[str] = ()) -> Box:
    """Bounds of some study variables, in the order of `names`; of all of them by default.

    It grows by the reach of the random inputs `widen`, so that a surrogate trained on it never extrapolates; those that are
    absolute, or no variables among `names`, change nothing.
    Raises InputError if a name is unknown, or the widened box would hold inertias of 0 or below.
    """
    study = scene.required_study
    chosen = study.names if names is None else tuple(names)
    for name in chosen:
        if name not in study.names:
            reason = "is not a study variable"
            raise InputError("study.variables", name, reason, f"Use {', '.join(study.names)}")
    reach = _reaches(study, widen)
    bounds = [_bounds(scene, study.variable(name), chosen, reach) for name in chosen]
    lower, upper = (np.array(side, dtype=np.float64) for side in zip(*bounds, strict=True))
    lower.flags.writeable = upper.flags.writeable = False
    return Box(chosen, lower, upper)


def check_formulas(scene: SceneTables) -> None:
    """An error for validators where a formula of a case has no value at a design of its box, or the same at all, or where all
    designs break a constraint of it."""
    study = scene.required_study
    for case in study.cases:
        formulas = {place: goal for place, goal in case.rows.items() if goal.formula is not None}
        if not formulas:
            continue
        names = study.design_variables(case.name)
        drawn = np.random.default_rng(0).uniform(-0.5, 1.5, (FORMULAS, len(names)))
        unit = np.clip(drawn, 0.0, 1.0)
        if len(names) <= CORNERS:
            unit = np.vstack([unit, *itertools.product((0.0, 1.0), repeat=len(names))])
        columns = to_physical(scene, names, box(scene, names).at(unit)).T
        designs = dict(zip(names, columns, strict=True))
        for place, goal in formulas.items():
            _check_formula(study, goal, designs, f"study.cases.{case.name}.{place}")


def _check_formula(study: Study, goal: Goal, designs: Mapping[str, Array], key: str) -> None:
    formula, values = str(goal.formula), goal.of_design(designs)
    remedy = "Narrow the ranges of its variables, or rewrite it"
    if not (found := np.isfinite(values)).all():
        where = (f"{name} = {designs[name][found.argmin()]:.4g}" for name in names_in(formula))
        raise invalid(f"has no real value where {', '.join(where)}", remedy, f"{key}.formula")
    if values.min() == values.max():
        raise invalid("is the same for all designs", "Remove it, or rewrite it", f"{key}.formula")
    for part in divisors(formula):
        below = value_of(part, designs)
        steady = any(study.variable(one).options is None for one in names_in(part))
        if steady and below.min() < 0.0 < below.max():
            reason = f"divides by {part}, which is 0 within the ranges"
            raise invalid(reason, remedy, f"{key}.formula")
    least = float(values.min()) - SURELY * float(np.ptp(values))
    if isinstance(goal, Constraint) and len(designs) <= CORNERS and least > goal.most:
        reason = f"no design keeps it: the least is about {values.min():.4g}"
        raise invalid(reason, "Raise it, or widen the ranges", f"{key}.most", goal.most)


def shares(scene: SceneTables, design: Mapping[str, float]) -> Array:
    """Where the variables of a design lie in their ranges, from 0 to 1, shape (d,); raises InputError as `box`."""
    names, region = tuple(design), box(scene, tuple(design))
    at = to_coordinates(scene, names, np.array([list(design.values())]))[0]
    return np.asarray((at - region.lower) / (region.upper - region.lower))


def bound_at(share: float) -> str:
    """The bound on which a variable sits at this share of its range: "lower", "upper", or ""."""
    return "lower" if abs(share) < ON_BOUND else "upper" if abs(share - 1.0) < ON_BOUND else ""


def _reaches(study: Study, widen: Iterable[str]) -> dict[str, Range]:
    """How far each path moves below and above its design value."""
    found: dict[str, Range] = {}
    for row in map(study.random_input, widen):
        if not row.absolute:
            low, high = study.reach(row)
            found |= dict.fromkeys(row.paths, (min(low, 0.0), max(high, 0.0)))
    return found


def _bounds(
    scene: SceneTables, variable: StudyVariable, names: tuple[str, ...], reach: Mapping[str, Range]
) -> Range:
    lower, upper = variable.bounds
    if not variable.paths:
        return lower, upper
    low, high = reach.get(variable.paths[0], (0.0, 0.0))
    if variable.ratio is None:
        return lower + low, upper + high
    # The random inputs move I, m and L separately; r = 12 I/(m L^2) is monotonic in each of them
    # and in the design, so its extremes are at corners.
    link = variable.paths[0].rpartition(".")[0]
    parts = [f"{link}.{part}" for part in ("mass", "length")]
    masses, lengths = (_span(scene, path, names) for path in parts)
    mass_ends, length_ends = (reach.get(path, (0.0, 0.0)) for path in parts)
    ratios = []
    for mass, length in itertools.product(masses, lengths):
        unit = mass * length**2 / 12
        heavy = (mass + mass_ends[1]) * (length + length_ends[1]) ** 2 / 12
        light = (mass + mass_ends[0]) * (length + length_ends[0]) ** 2 / 12
        ratios += [(lower * unit + low) / heavy, (upper * unit + high) / light]
    if min(ratios) <= 0:
        reason = "reduces the smallest inertia of the box to 0 or below"
        remedy = f"Narrow it, or raise study.variables.{variable.name}.ratio"
        moved = scene.in_unit(low, "kg*m**2")
        raise InputError(f"study.random.{variable.name}", moved, reason, remedy)
    return min(ratios), max(ratios)


def _span(scene: SceneTables, path: str, names: tuple[str, ...]) -> Range:
    """Range of the design values at a path: its variable's, if that is among `names`, else the scene's."""
    for name in names:
        variable = scene.required_study.variable(name)
        if path in variable.paths and variable.range is not None:
            return variable.range
    value = scene.number(path)
    return value, value


def to_physical(scene: SceneTables, names: Sequence[str], coordinates: Array) -> Array:
    """Sampling coordinates (n, d), a column a name, to SI: ratios become inertias by mass and length of the same row."""
    return _scaled(scene, names, coordinates, inverse=False)


def to_coordinates(scene: SceneTables, names: Sequence[str], values: Array) -> Array:
    """SI values to sampling coordinates, the inverse of `to_physical`; shapes ``(n, d)``."""
    return _scaled(scene, names, values, inverse=True)


def _scaled(scene: SceneTables, names: Sequence[str], columns: Array, inverse: bool) -> Array:
    variables = [scene.required_study.variable(name) for name in names]
    result = np.array(columns, dtype=np.float64)
    paths = [variable.paths for variable in variables]
    for column, variable in enumerate(variables):
        if variable.ratio is not None:
            unit = slender_inertias(scene, paths, result, variable.paths[0])
            result[:, column] = result[:, column] / unit if inverse else result[:, column] * unit
    return result


def slender_inertias(
    scene: SceneTables, paths: Sequence[Sequence[str]], values: Array, inertia: str
) -> Array | float:
    """m L^2/12 of the link whose inertia stands at the path `inertia`, of each row (kg m2).

    `values` has shape ``(n, d)``, and column i drives the scene entries ``paths[i]``; mass and
    length come from the row where a column drives them, and from the scene where none does.
    """
    columns = {path: values[:, k] for k, driven in enumerate(paths) for path in driven}
    of_link = [f"{inertia.rpartition('.')[0]}.{part}" for part in ("mass", "length")]
    return slender_inertia(*(columns[p] if p in columns else scene.number(p) for p in of_link))
