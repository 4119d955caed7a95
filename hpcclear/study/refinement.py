"""The front by direct simulation: the swarm's designs and others are simulated, and where it is decided, more.

A surrogate of f that is good to a percent is no judge of standard deviations that differ by less: the swarm
finds what its errors flatter. So its designs are only where the search begins. Every design here
is simulated; models of the moments themselves say where to look next, until some rounds
win nothing or all are spent.
"""

import contextlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import moocore
import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS
from hpcclear.scene.domain import box, to_coordinates, to_physical
from hpcclear.scene.points import snapped
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import spread
from hpcclear.statistics.search import improvement
from hpcclear.statistics.search.improvement import Known, Space
from hpcclear.statistics.search.infill import believed_ends, eligible, proposals
from hpcclear.statistics.search.pareto import cut
from hpcclear.study import edge, truth
from hpcclear.study.goals import exact_in, most_of, wanted
from hpcclear.study.optimisation import Choice, chosen_in_all
from hpcclear.study.run import Result, StudyRun

RAYS = 6
"""Designs along each design variable, through a design of the swarm, beside the swarm's."""

PATIENCE = 3
"""Rounds in a row that win nothing together, after which a front stands."""


ROUGH = 0.9
"""R2 of the searched surrogate on fresh points, below which the statistics are searched and not f."""

FIRST, PARTS = 4, 3
"""There: designs per design variable at first, and parts that a round is cut into, since each new design says where the next
belongs."""


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


def simulations(study: Study) -> tuple[int, int]:
    """Simulations of the first designs, and of all rounds, at most."""
    if study.verification.infill_rounds == 0:
        return 0, 0
    extremes, spread = chosen_in_all(study)
    rays = sum(RAYS * len(study.design_variables(case.name)) for case in study.cases)
    rounds = study.verification.infill_rounds * study.verification.infill_designs
    each = truth.search_length(study) * REPLICATES
    return (extremes + spread + rays) * each, rounds * len(study.cases) * each


def first_designs(study: Study, statistics: bool) -> int:
    """Designs that a search begins with, as a rule."""
    extremes, between = chosen_in_all(study)
    if study.swarm.runs == 1:  # averages over one run are its ends
        extremes //= 2
    sizes = [len(study.design_variables(case.name)) for case in study.cases]
    if statistics:
        return extremes + sum(map(_wide, sizes))
    return extremes + between + RAYS * sum(sizes)


def at_edges(study: Study) -> int:
    """Simulations of designs at the edge of constraints and next to it, at most."""
    if study.verification.infill_rounds == 0:
        return 0
    beside = sum(2 * len(study.design_variables(case.name)) + 1 for case in edge.cases_of(study))
    return (
        edge.simulations(study) + len(edge.ASIDE) * beside * truth.search_length(study) * REPLICATES
    )


def by_statistics(study: Study, r2: float) -> bool:
    """Whether statistics over designs are modelled in place of f: if the study says so, or if a surrogate of f has less than
    `ROUGH` on fresh points."""
    asked = study.surrogate.of
    return not r2 >= ROUGH if asked is None else asked == "statistics"


def search(
    run: StudyRun, start: Sequence[Choice], statistics: bool
) -> tuple[list[Choice], list[str]]:
    """Designs to verify beside those of the swarm, the best that were found; and what a reader should know.

    Parameters
    ----------
    start : sequence of Choice
        Designs of the swarm, of all cases.
    statistics : bool
        Whether the search goes by models of the statistics alone.

    Raises
    ------
    InputError
        If all simulations of a round fail.
    """
    if run.study.verification.infill_rounds == 0:
        return [], []
    begun = run.stage("check-0", _begin_wide if statistics else _begin, start)
    met = {case.name: [_tried(run, case.name, begun, None)] for case in run.study.cases}
    patience = PATIENCE * (PARTS if statistics else 1)
    for round_, count in enumerate(rounds(run.study, len(begun["case"]), statistics)):
        going = {
            name: its[-1] for name, its in met.items() if not _stands(run, name, its, patience)
        }
        if not going:
            break
        stage = f"infill-{round_}"
        found = run.stage(stage, _go_on, going, stage, count, statistics)
        for name, before in going.items():
            met[name].append(_tried(run, name, found, before))
    remarks = [
        f"The search of {name} ended with its rounds while the last one {won}; more "
        "study.verification.infill_rounds may still win."
        for name, its in met.items()
        if not _stands(run, name, its, patience) and (won := _won(run, name, its[-2:]))
    ]
    if not statistics:
        _end_at_edges(run, met)
    named = [] if statistics else [choice for choice in start if choice.name]
    finalists = [
        one
        for name, its in met.items()
        for one in _finalists(run, name, its[-1], named, statistics)
    ]
    if edge.cases_of(run.study):
        last = {name: its[-1] for name, its in met.items()}
        known = {name: (one.coordinates, one.values, one.excess) for name, one in last.items()}
        finalists += edge.choices_of(run, run.stage("edge", edge.approach, known))
    named = _distinct(named)  # where designs are few, several finalists are one
    return _distinct([*named, *finalists])[len(named) :], remarks


def _end_at_edges(run: StudyRun, met: Mapping[str, list[Tried]]) -> None:
    """Add designs next to the edge of the constraints, whose slopes decide which design there is the best."""
    names = [case.name for case in edge.cases_of(run.study)]
    for turn, aside in enumerate(edge.ASIDE if names else ()):
        going = {name: met[name][-1] for name in names}
        found = run.stage(f"edge-{turn}", _beside, going, f"edge-{turn}", aside)
        for name, before in going.items():
            met[name].append(_tried(run, name, found, before))


def _beside(run: StudyRun, tried: Mapping[str, Tried], stage: str, aside: float) -> Result:
    """One of these turns."""
    chosen = []
    for name, one in tried.items():
        with contextlib.suppress(InputError):  # too few designs that did not fail for a model
            case, known = run.study.case(name), (one.coordinates, one.values, one.excess)
            chosen += _choices(run, name, edge.neighbours(run, case, aside, *known))
    return _simulated(run, chosen, stage)


def rounds(study: Study, begun: int, statistics: bool) -> list[int]:
    """Designs of a case in each round after so many first designs. A search by statistics has fewer in all than the other one,
    first designs included: those of the swarm between its ends are left out."""
    settings = study.verification
    if not statistics:
        return [settings.infill_designs] * settings.infill_rounds
    most = sum(simulations(study)) // (truth.search_length(study) * REPLICATES)
    left = (most - chosen_in_all(study)[1] - begun) // len(study.cases)
    count = max(settings.infill_designs // PARTS, 1)
    return [count] * (left // count)


def _stands(run: StudyRun, name: str, met: Sequence[Tried], patience: int = PATIENCE) -> bool:
    """Whether a front stands, from what was known after each round."""
    return len(met) > patience and not _won(run, name, met[-1 - patience :])


def _begin(run: StudyRun, start: Sequence[Choice]) -> Result:
    """The swarm's designs, and rays along each variable through its design of lowest standard deviation."""
    chosen = []
    for case in run.study.cases:
        own = [choice for choice in start if choice.case == case.name]
        chosen += _distinct(own)
        names = run.study.design_variables(case.name)
        region, rng = box(run.scene, names), run.rng("search", case.name)
        end = ENDS[min(len(case.goals), 2) - 1]
        middle = next(choice for choice in own if choice.name == f"{case.name} best {end}")
        centre = to_coordinates(run.scene, names, np.array([list(middle.design.values())]))[0]
        for k in range(len(names)):
            ray = np.tile(np.clip(centre, region.lower, region.upper), (RAYS, 1))
            places = (np.arange(RAYS) + rng.random(RAYS)) / RAYS
            ray[:, k] = region.lower[k] + places * (region.upper[k] - region.lower[k])
            chosen += _distinct(_choices(run, case.name, ray))
    return _simulated(run, chosen, "check-0")


def _begin_wide(run: StudyRun, start: Sequence[Choice]) -> Result:
    """The ends of the swarm, the design in the scene, and others all over the box."""
    chosen = []
    for case in run.study.cases:
        names = run.study.design_variables(case.name)
        region, rng = box(run.scene, names), run.rng("search", case.name)
        unit = unit_lhs(_wide(len(names)), len(names), rng)
        chosen += _distinct([one for one in start if one.case == case.name and one.name])
        chosen += _choices(run, case.name, region.lower + unit * (region.upper - region.lower))
    return _simulated(run, chosen, "check-0")


def _wide(variables: int) -> int:
    """Designs all over the box that a search by statistics begins with."""
    return max(FIRST * variables, variables + 4)


def _distinct(choices: Sequence[Choice]) -> list[Choice]:
    """Of equal designs of a case the first."""
    found: dict[object, Choice] = {}
    for choice in choices:
        found.setdefault((choice.case, *choice.design.values()), choice)
    return list(found.values())


def _go_on(
    run: StudyRun, tried: Mapping[str, Tried], stage: str, count: int, statistics: bool
) -> Result:
    """One round of the cases that are not decided."""
    chosen = []
    for name, one in tried.items():
        bounds, rng = _bounds(run, one.names), run.rng(stage, name)
        broken = one.excess if run.study.case(name).kept else None
        try:
            snap = partial(snapped, run.study, one.names)
            if statistics:
                where = improvement.proposals(*_problem(run, name, one), count, rng)
            else:
                where = proposals(one.coordinates, one.values, bounds, count, rng, broken, snap)
        except InputError:  # too few designs that did not fail for a model
            unit = unit_lhs(count, len(one.names), rng)
            where = bounds[:, 0] + unit * (bounds[:, 1] - bounds[:, 0])
        chosen += _choices(run, name, where)
    return _simulated(run, chosen, stage)


def _problem(run: StudyRun, name: str, one: Tried) -> tuple[Known, Space]:
    """What is known of a case, and where to look: each objective, and mean + 2 standard deviations, the usual merit."""
    case = run.study.case(name)
    directions = np.eye(len(case.goals))
    if case.plain:
        directions = np.vstack([directions, [1.0, 2.0]])
    snap = partial(snapped, run.study, one.names)
    space = Space(_bounds(run, one.names), directions, exact_in(run.scene, case), snap)
    broken = one.excess if case.kept else None
    return Known(one.coordinates, one.values, one.errors, broken), space


def _bounds(run: StudyRun, names: Sequence[str]) -> Array:
    """Of design variables, in sampling coordinates, (d, 2)."""
    region = box(run.scene, names)
    return np.column_stack([region.lower, region.upper])


def _choices(run: StudyRun, case: str, coordinates: Array) -> list[Choice]:
    names = run.study.design_variables(case)
    rows = to_physical(run.scene, names, snapped(run.study, names, coordinates))
    return [Choice("", case, dict(zip(names, row.tolist(), strict=True))) for row in rows]


def _simulated(run: StudyRun, choices: Sequence[Choice], stage: str) -> Result:
    """Cases, designs (NaN where a variable is not the case's), what they make small, by how much they break constraints."""
    names = run.study.optimisation
    most = most_of(run.study.cases)
    if not choices:
        nothing = np.empty((0, len(names)))
        none = {"values": np.empty((0, most)), "errors": np.empty((0, most)), "excess": np.empty(0)}
        return {"case": np.array([], "U1"), "design": nothing, **none}
    count = truth.search_length(run.study)
    found = truth.sequences(run, choices, stage, "search", count, count * REPLICATES)
    return {
        "case": np.array([choice.case for choice in choices]),
        "design": np.array([[c.design.get(name, np.nan) for name in names] for c in choices]),
        "values": found["goal"][:, :most],
        "errors": np.array([spread(one) for one in found["goal_shifts"][:, :most]]),
        "excess": found["excess"],
    }


def _tried(run: StudyRun, case: str, found: Result, before: Tried | None) -> Tried:
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


def _won(run: StudyRun, name: str, met: Sequence[Tried]) -> str:
    """What was won from the first to the last of what was known, in words; empty if nothing that counts.

    That is the accuracy requested: many small steps are one large one. Designs that only stand between those of the earlier
    front count for nothing.
    """
    before, now = met[0], met[-1]
    old, new = (one.values[one.best()] for one in (before, now))
    if not (len(old) and len(new)):
        return "no design had moments"
    broken = before.excess[before.best()].min()
    if broken > 0.0 and now.excess[now.best()].min() < broken:
        return "still came nearer to the constraints"
    case, accuracy = run.study.case(name), run.study.wanted
    shares, relative = zip(*(wanted(goal, accuracy) for goal in case.goals), strict=True)
    gains = _gains(old, new, relative)
    counts = np.asarray(gains > np.array(shares))
    for column, goal in enumerate(case.goals):
        gain = _gains(old.min(axis=0)[None], new.min(axis=0)[None], relative)[0, 0, column]
        if gain > shares[column]:
            words = goal.words(run.scene.objective.unit).removesuffix(" of f")
            return f"still lowered the least {words} by {gain:.1%}"
    better = np.any(counts, axis=2) & np.all(gains >= 0.0, axis=2)
    moved = int(np.any(better, axis=1).sum())
    return f"still dominated {moved} of {len(old)} designs" if moved else ""


def _gains(old: Array, new: Array, relative: Sequence[bool]) -> Array:
    """What each new design wins over each old one, (old, new, objectives): relative, or as it is."""
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.sign(old[:, None]) * (1.0 - new / old[:, None])
    return np.asarray(np.where(relative, shares, old[:, None] - new))


def _finalists(
    run: StudyRun, case: str, tried: Tried, verified: Sequence[Choice], statistics: bool
) -> list[Choice]:
    """The best designs of a case, well spread, for verification on scatter of its own; those of `verified` have it anyway.

    Beside those of the front one for each end, since ends are chosen among designs that are nearly as good, and what all
    values together make the end: the least of them has luck.
    """
    most = run.study.verification.designs + len(run.study.case(case).goals)
    rng, broken = run.rng("finalists", case), tried.excess if run.study.case(case).kept else None
    best = tried.best()
    where = tried.coordinates[best[cut(tried.values[best], most)]]
    with contextlib.suppress(InputError):  # too few designs that did not fail for a model
        if statistics:
            most = run.study.verification.designs
            where = improvement.finalists(*_problem(run, case, tried), most, rng)
        else:
            believed = believed_ends(
                tried.coordinates, tried.values, _bounds(run, tried.names), rng, broken
            )
            rows = np.unique(np.append(best[cut(tried.values[best], most)], believed))
            where = tried.coordinates[rows]
    own = [list(choice.design.values()) for choice in verified if choice.case == case]
    return [
        choice
        for choice in _choices(run, case, where)
        if not any(
            np.allclose(list(choice.design.values()), one, rtol=1e-9, atol=0.0) for one in own
        )
    ]
