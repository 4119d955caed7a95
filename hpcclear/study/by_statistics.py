"""The search by models of what a case makes small and of its constraints over the designs, without one of f.

Where f is rough no surrogate of f holds, but the roughness averages out in a mean or a quantile. The next designs are those of
the largest expected improvement (`hpcclear.statistics.search.improvement`). Of some hundred simulations the least value has
more luck than another design may win, so the search does not end when values fall no more: it has a number of designs.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.merit import SPAN
from hpcclear.scene.domain import box
from hpcclear.scene.points import snapped
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.statistics.search import improvement
from hpcclear.statistics.search.improvement import Known, Space
from hpcclear.statistics.search.pareto import cut
from hpcclear.study import by_f, truth
from hpcclear.study.goals import ends_in_all, exact_in, wanted
from hpcclear.study.optimisation import Choice, chosen_in_all
from hpcclear.study.run import StudyRun
from hpcclear.study.tried import Tried, bounds, choices, distinct

ROUGH = 0.9
"""R2 of the searched surrogate of f on fresh points, below which it is used."""

FIRST, PARTS, GROWTH = 4, 3, 10
"""Designs per design variable at first; parts that a round is cut into, since each new design says where the next belongs; and
a round is at least one in so many of the designs before it."""


def applies(study: Study, r2: float) -> bool:
    """Whether it is used: if the study says so, or if a surrogate of f has less than `ROUGH` on fresh points."""
    asked = study.surrogate.of
    return not r2 >= ROUGH if asked is None else asked == "statistics"


def first_designs(study: Study) -> int:
    """Designs that it begins with, as a rule."""
    sizes = [len(study.design_variables(case.name)) for case in study.cases]
    return by_f.ends(study) + sum(map(_wide, sizes))


def _wide(variables: int) -> int:
    """Designs all over the box that it begins with."""
    return max(FIRST * variables, variables + 4)


def designs(study: Study) -> int:
    """Designs of a case in all: more than in the search that begins with a surrogate of f, since fewer are verified, neither
    the ends of the swarm nor runners-up."""
    each = truth.search_length(study) * REPLICATES
    saved = (chosen_in_all(study)[0] + ends_in_all(study)) * truth.expected(study)
    return (sum(by_f.simulations(study)) + saved) // each // len(study.cases)


def rounds(study: Study, begun: int) -> list[int]:
    """Designs of a case in each round after so many first designs."""
    known, found = begun // len(study.cases), list[int]()
    fewest = max(study.verification.infill_designs // PARTS, 1)
    while (more := designs(study) - known) > 0:
        found.append(min(max(known // GROWTH, fewest), more))
        known += found[-1]
    return found


def begin(run: StudyRun, start: Sequence[Choice]) -> list[Choice]:
    """The ends of the swarm, and designs all over the box."""
    chosen = []
    for case in run.study.cases:
        names = run.study.design_variables(case.name)
        region, rng = box(run.scene, names), run.rng("search", case.name)
        unit = unit_lhs(_wide(len(names)), len(names), rng)
        chosen += distinct([one for one in start if one.case == case.name and one.name])
        chosen += choices(run, case.name, region.lower + unit * (region.upper - region.lower))
    return chosen


def further(run: StudyRun, name: str, one: Tried, count: int, rng: np.random.Generator) -> Array:
    """Coordinates of the next designs of a case, at most so many, (k, d).

    Raises
    ------
    InputError
        Too few designs that did not fail for a model.
    """
    return improvement.proposals(*_problem(run, name, one), count, rng)


def stands(run: StudyRun, name: str, met: Sequence[Tried]) -> bool:
    """Whether there is no other design, from what was known after each round."""
    return len(met) > 1 and len(met[-1].values) == len(met[-2].values)


def left(run: StudyRun, name: str, met: Sequence[Tried]) -> str:
    """What another design is expected to win, in words; empty if nothing that counts."""
    case = run.study.case(name)
    try:
        gains, least = improvement.hopes(*_problem(run, name, met[-1]), run.rng("hoped", name))
    except InputError:  # too few designs that did not fail for a model
        return ""
    for goal, gain, value in zip(case.goals, gains, least, strict=False):
        share, relative = wanted(goal, run.study.wanted)
        if not goal.exact and gain > share * (abs(value) if relative else 1.0):
            words = goal.words(run.scene.objective.unit).removesuffix(" of f")
            won = f"{gain / abs(value):.1%}" if relative else f"{gain:.2g}"
            return f"another design is expected to lower the least {words} by {won}"
    return ""


def finalists(run: StudyRun, name: str, one: Tried, rng: np.random.Generator) -> Array:
    """Coordinates of the designs of a case to verify, (k, d): those that are believed to be the best."""
    most = run.study.verification.designs
    try:
        return improvement.finalists(*_problem(run, name, one), most, rng)
    except InputError:  # too few designs that did not fail for a model
        best = one.best()
        return one.coordinates[best[cut(one.values[best], most + one.values.shape[1])]]


def _problem(run: StudyRun, name: str, one: Tried) -> tuple[Known, Space]:
    """What is known of a case, and where to look: each objective, and mean + 2 standard deviations, the usual merit."""
    case = run.study.case(name)
    directions = np.eye(len(case.goals))
    merit = np.array([1.0, SPAN]) if case.plain else directions[0]
    if case.plain:
        directions = np.vstack([directions, merit])
    snap = partial(snapped, run.study, one.names)
    space = Space(bounds(run, one.names), directions, merit, exact_in(run.scene, case), snap)
    broken = one.excess if case.kept else None
    return Known(one.coordinates, one.values, one.errors, broken), space
