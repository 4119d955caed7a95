"""Designs that a search simulated: made from coordinates, simulated alike, and kept in their order."""

from collections.abc import Sequence
from dataclasses import dataclass

import moocore
import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene.domain import box, to_coordinates, to_physical
from hpcclear.scene.points import snapped
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.random.replicates import spread
from hpcclear.statistics.search.infill import eligible
from hpcclear.study import truth
from hpcclear.study.goals import most_of
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun


@dataclass
class Tried:
    """Designs of one case that were simulated, in their order.

    Attributes
    ----------
    names : tuple of str
        Design variables.
    coordinates : array, shape (n, d)
        Sampling coordinates.
    values : array, shape (n, objectives)
        What its case makes small: mean and standard deviation, if nothing else is requested.
    excess : array, shape (n,)
        By how much its constraints are broken (`hpcclear.study.goals.steered`).
    errors : array, shape (n, objectives)
        Standard errors of the values.
    """

    names: tuple[str, ...]
    coordinates: Array
    values: Array
    excess: Array
    errors: Array

    def best(self) -> Array:
        """Numbers of the designs that no other one dominates, of those that keep the constraints; if none does, of the one that
        comes nearest."""
        rows = np.flatnonzero(eligible(self.values, self.excess))
        return rows[moocore.is_nondominated(self.values[rows])]


def bounds(run: StudyRun, names: Sequence[str]) -> Array:
    """Of design variables, in sampling coordinates, (d, 2)."""
    region = box(run.scene, names)
    return np.column_stack([region.lower, region.upper])


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


def simulated(run: StudyRun, these: Sequence[Choice], stage: str) -> Result:
    """Cases, designs (NaN where a variable is not the case's), what they make small, by how much they break constraints."""
    names = run.study.optimisation
    most = most_of(run.study.cases)
    if not these:
        nothing = np.empty((0, len(names)))
        none = {"values": np.empty((0, most)), "errors": np.empty((0, most)), "excess": np.empty(0)}
        return {"case": np.array([], "U1"), "design": nothing, **none}
    count = truth.search_length(run.study)
    found = truth.sequences(run, these, stage, "search", count, count * REPLICATES)
    return {
        "case": np.array([choice.case for choice in these]),
        "design": np.array([[c.design.get(name, np.nan) for name in names] for c in these]),
        "values": found["goal"][:, :most],
        "errors": np.array([spread(one) for one in found["goal_shifts"][:, :most]]),
        "excess": found["excess"],
    }


def added(run: StudyRun, case: str, found: Result, before: Tried | None) -> Tried:
    """All designs of a case so far."""
    names = run.study.design_variables(case)
    rows = found["case"] == case
    columns = [run.study.optimisation.index(name) for name in names]
    coordinates = to_coordinates(run.scene, names, found["design"][rows][:, columns])
    region = box(run.scene, names)
    coordinates = np.clip(coordinates, region.lower, region.upper)  # round-off at the border
    count = len(run.study.case(case).goals)
    values, errors = (found[part][rows, :count] for part in ("values", "errors"))
    broken = found["excess"][rows]
    if before is None:
        return Tried(names, coordinates, values, broken, errors)
    return Tried(
        names,
        np.concatenate([before.coordinates, coordinates]),
        np.concatenate([before.values, values]),
        np.concatenate([before.excess, broken]),
        np.concatenate([before.errors, errors]),
    )
