"""The search that begins with the designs that a swarm found on a surrogate of f, and with others along each variable.

Models of mean and standard deviation, or whatever else is made small, on two scales say where to look next
(`hpcclear.statistics.search.infill`). It ends when some rounds together win nothing.
"""

from collections.abc import Sequence
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS
from hpcclear.scene.domain import box, to_coordinates
from hpcclear.scene.points import snapped
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.statistics.search import infill
from hpcclear.statistics.search.pareto import cut
from hpcclear.study import truth
from hpcclear.study.goals import wanted
from hpcclear.study.optimisation import Choice, chosen_in_all
from hpcclear.study.run import StudyRun
from hpcclear.study.tried import Tried, bounds, choices, distinct

RAYS = 6
"""Designs along each design variable, through a design of the swarm, beside the swarm's."""

PATIENCE = 3
"""Rounds in a row that win nothing together, after which a front stands."""


def simulations(study: Study) -> tuple[int, int]:
    """Simulations of the first designs, and of all rounds, at most."""
    if study.verification.infill_rounds == 0:
        return 0, 0
    extremes, spread = chosen_in_all(study)
    rays = sum(RAYS * len(study.design_variables(case.name)) for case in study.cases)
    rounds = study.verification.infill_rounds * study.verification.infill_designs
    each = truth.search_length(study) * REPLICATES
    return (extremes + spread + rays) * each, rounds * len(study.cases) * each


def first_designs(study: Study) -> int:
    """Designs that it begins with, as a rule."""
    sizes = [len(study.design_variables(case.name)) for case in study.cases]
    return ends(study) + chosen_in_all(study)[1] + RAYS * sum(sizes)


def ends(study: Study) -> int:
    """Designs of the swarm that are ends of a front, as a rule: averages over one run are the ends themselves."""
    extremes, _ = chosen_in_all(study)
    return extremes // 2 if study.swarm.runs == 1 else extremes


def rounds(study: Study, begun: int) -> list[int]:
    """Designs of a case in each round, at most, after so many first designs."""
    return [study.verification.infill_designs] * study.verification.infill_rounds


def begin(run: StudyRun, start: Sequence[Choice]) -> list[Choice]:
    """The swarm's designs, and rays along each variable through its design of lowest standard deviation."""
    chosen = []
    for case in run.study.cases:
        own = [choice for choice in start if choice.case == case.name]
        chosen += distinct(own)
        names = run.study.design_variables(case.name)
        region, rng = box(run.scene, names), run.rng("search", case.name)
        end = ENDS[min(len(case.goals), 2) - 1]
        middle = next(choice for choice in own if choice.name == f"{case.name} best {end}")
        centre = to_coordinates(run.scene, names, np.array([list(middle.design.values())]))[0]
        for k in range(len(names)):
            ray = np.tile(np.clip(centre, region.lower, region.upper), (RAYS, 1))
            places = (np.arange(RAYS) + rng.random(RAYS)) / RAYS
            ray[:, k] = region.lower[k] + places * (region.upper[k] - region.lower[k])
            chosen += distinct(choices(run, case.name, ray))
    return chosen


def further(run: StudyRun, name: str, one: Tried, count: int, rng: np.random.Generator) -> Array:
    """Coordinates of the next designs of a case, at most so many, (k, d).

    Raises
    ------
    InputError
        Too few designs that did not fail for a model.
    """
    broken = one.excess if run.study.case(name).kept else None
    region, snap = bounds(run, one.names), partial(snapped, run.study, one.names)
    return infill.proposals(one.coordinates, one.values, region, count, rng, broken, snap)


def stands(run: StudyRun, name: str, met: Sequence[Tried]) -> bool:
    """Whether a front stands, from what was known after each round."""
    return len(met) > PATIENCE and not won(run, name, met[-1 - PATIENCE :])


def left(run: StudyRun, name: str, met: Sequence[Tried]) -> str:
    """What shows that more rounds may win, in words; empty if nothing."""
    return won(run, name, met[-2:])


def won(run: StudyRun, name: str, met: Sequence[Tried]) -> str:
    """What was won from the first to the last of what was known, in words; empty if nothing that counts.

    That is the accuracy requested: many small steps are one large one. Designs that only stand between those of the earlier
    front count for nothing.
    """
    before, now = met[0], met[-1]
    old, new = (one.values[one.best()] for one in (before, now))
    if not (len(old) and len(new)):
        return "the last one found no design with moments"
    broken = before.excess[before.best()].min()
    if broken > 0.0 and now.excess[now.best()].min() < broken:
        return "the last one still came nearer to the constraints"
    case, accuracy = run.study.case(name), run.study.wanted
    shares, relative = zip(*(wanted(goal, accuracy) for goal in case.goals), strict=True)
    gains = _gains(old, new, relative)
    counts = np.asarray(gains > np.array(shares))
    for column, goal in enumerate(case.goals):
        gain = _gains(old.min(axis=0)[None], new.min(axis=0)[None], relative)[0, 0, column]
        if gain > shares[column]:
            words = goal.words(run.scene.objective.unit).removesuffix(" of f")
            return f"the last one still lowered the least {words} by {gain:.1%}"
    better = np.any(counts, axis=2) & np.all(gains >= 0.0, axis=2)
    moved = int(np.any(better, axis=1).sum())
    return f"the last one still dominated {moved} of {len(old)} designs" if moved else ""


def _gains(old: Array, new: Array, relative: Sequence[bool]) -> Array:
    """What each new design wins over each old one, (old, new, objectives): relative, or as it is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.sign(old[:, None]) * (1.0 - new / old[:, None])
    return np.asarray(np.where(relative, shares, old[:, None] - new))


def finalists(run: StudyRun, name: str, one: Tried, rng: np.random.Generator) -> Array:
    """Coordinates of the designs of a case to verify, (k, d): a front that is spread well, with one more for each end, since
    ends are chosen among designs that are nearly as good; and what all values together make the ends, for the least of them
    has luck."""
    case = run.study.case(name)
    most = run.study.verification.designs + len(case.goals)
    best = one.best()
    rows = best[cut(one.values[best], most)]
    try:
        broken = one.excess if case.kept else None
        region = bounds(run, one.names)
        believed = infill.believed_ends(one.coordinates, one.values, region, rng, broken)
    except InputError:  # too few designs that did not fail for a model
        return one.coordinates[rows]
    return one.coordinates[np.unique(np.append(rows, believed))]
