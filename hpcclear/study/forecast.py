"""What a study simulates as a rule, and what a simulation of it costs, from a pilot: a few designs all over the box with their
scatter. Cost and scatter differ from design to design, and the design in the scene may differ from all that are found.

`hpcclear.study.extent.samples_of` has the most that there can be. Verified designs take as many simulations as their errors in
the pilot require; fronts are shorter and searches end earlier than they may.
"""

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import cast

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.errors import InputError
from hpcclear.ranks.boundary import alone
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.scene import Scene
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import box
from hpcclear.scene.points import Points, snapped
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES, Verification
from hpcclear.scene.streams import generator
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import spread, student
from hpcclear.statistics.surrogate.fitting import fit_kriging
from hpcclear.statistics.surrogate.metrics import accuracy
from hpcclear.study import (
    by_f,
    by_statistics,
    chaos,
    edge,
    extent,
    goals,
    optimisation,
    refinement,
    surrogates,
    tried,
    truth,
    verdicts,
)
from hpcclear.study.optimisation import Choice
from hpcclear.study.paper.printed import printed_designs
from hpcclear.study.run import StudyRun
from hpcclear.study.simulations import Simulations

DESIGNS, LENGTHS, PART = 4, (64, 32, 16, 8), 4
"""Designs of a case, points of each of their replicates (the most that `LONGEST` allows), and what part of these shows how
fast errors fall."""

FALL = 0.5, 1.5
"""Between these is the power of the number of simulations by which errors fall: of rough f, and of smooth f. The mean shows it
first: the error of a standard deviation by few points falls alike whether f is rough or smooth."""

LATER, EDGE, DISTINCT = 0.7, 0.55, 0.9
"""Shares of what there may be: rounds of a search from which on it may end, simulations at edges, designs that differ."""

EACH, BETWEEN, ALONE = 1.75, 0.5, 6
"""Designs that a search by statistics ends with for each direction that it looks in, and of those that may stand between;
designs of all rounds for one objective, at most, by models on two scales."""

POINTS, FRESH = 150, 50
"""Points of a surrogate of f that shows whether it is rough, and fresh ones that its R2 is of."""

CONTESTED = 1.5
"""Times the simulations that the accuracy of an objective takes: what designs get beyond it while they may be the best."""

CLEAR = 3.5
"""Standard errors that a probability of failure at the edge is from the largest allowed one when it is decided."""

CLEARLY, OPEN = 6.0, 0.4
"""Failures that plain simulations of a design at the edge meet, from which on they decide those that are far from it as a rule;
and the share of them that stays open then."""

NEAR = 0.3
"""Of what a rare failure takes by more weighted simulations than the fewest: what a design takes on average, since most are far
from the threshold."""

LONGEST = 10.0
"""Seconds that a pilot may take."""

Evaluate = Callable[[Points], Records]


class _Here(Simulations):
    """Simulations by a function, without files; what they took is measured."""

    def __init__(self, scene: Scene, evaluate: Evaluate) -> None:
        super().__init__(scene, alone(), cast(Checkpoint, None))
        self._evaluate = evaluate
        self.count, self.seconds = 0, 0.0

    def _records(self, points: Points, stage: str) -> Records:
        """Outcome records of designs, in their order."""
        if not self.count:
            self._evaluate(points.take(np.arange(1)))  # compiles
        start = time.perf_counter()
        found = self._evaluate(points)
        self.seconds += time.perf_counter() - start
        self.count += len(points)
        return found


def expected(scene: Scene, evaluate: Evaluate, seconds: float) -> tuple[int, float]:
    """Simulations that a study takes as a rule, and what one of them costs on one core.

    Where the pilot takes longer than `LONGEST`, makes no mechanisms, or needs worn clearances that are not known yet, these are
    `hpcclear.study.extent.samples_of` and `seconds`.

    Parameters
    ----------
    scene : Scene
        With cases.
    evaluate : function
        Points to records of the study's objective.
    seconds : float
        Of a simulation, as far as is known without a pilot.
    """
    study, samples = scene.required_study, extent.samples_of(scene)
    pilot, first = len(study.cases) * DESIGNS * REPLICATES * seconds, (POINTS + FRESH) * seconds
    lengths = [length for length in LENGTHS if first + pilot * length <= LONGEST]
    here = _Here(scene, evaluate)
    run = cast(StudyRun, SimpleNamespace(scene=scene, study=study, simulations=here))
    if study.worn or not lengths:
        return sum(samples.values()), seconds
    try:
        each = np.array([_of_case(run, case, lengths[0]) for case in study.cases])
    except InputError:
        return sum(samples.values()), seconds
    statistics = by_statistics.applies(study, _r2(run))
    designs, found = _verified(scene, statistics), _searched(study, statistics)
    at_edge = edge.designs(study) if study.verification.infill_rounds else 0
    found["verification"] = 0.0
    for case, its in zip(study.cases, each, strict=True):
        near, far = (_verifying(case, study.verification, its, side) for side in (True, False))
        found["verification"] += (at_edge * near + (designs - at_edge) * far) / len(study.cases)
    found["chaos"] = designs * 2 * chaos.PAIRS
    samples |= {name: int(extent.loads_of(scene) * count) for name, count in found.items()}
    return sum(samples.values()), here.seconds / here.count


def _searched(study: Study, statistics: bool) -> dict[str, float]:
    """Simulations of a search, as a rule: it may end sooner than it may go on, and some of its designs coincide."""
    settings, cases = study.verification, len(study.cases)
    if settings.infill_rounds == 0:
        return {}
    way = by_statistics if statistics else by_f
    first = way.first_designs(study)
    rounds = way.rounds(study, first)
    further = float(sum(rounds))
    if not statistics:
        patience = sum(rounds[: by_f.PATIENCE])
        further = patience + LATER * (further - patience)
        if max(len(case.goals) for case in study.cases) == 1:
            further = min(further, ALONE)
    each = truth.search_length(study) * REPLICATES
    beside = 0 if statistics else refinement.at_edges(study) - edge.simulations(study)
    return {
        "check": first * each,
        "infill": further * cases * each,
        "edge": EDGE * edge.simulations(study) + beside,
    }


def _verified(scene: Scene, statistics: bool) -> float:
    """Designs that are verified, as a rule."""
    study = scene.required_study
    others = len(study.cases) + len(printed_designs(scene))  # the design in the scene, of each case
    extremes, between = optimisation.chosen_in_all(study)
    if study.verification.infill_rounds == 0:
        return extremes + between + others
    if statistics:
        directions = extremes // 2 + sum(case.plain for case in study.cases)
        found = EACH * directions + BETWEEN * max(between - 2 * directions, 0)
    else:
        found = DISTINCT * (2 * extremes + between)
    return found + edge.designs(study) + others


def _r2(run: StudyRun) -> float:
    """R2 of a surrogate of f on fresh points, from at most `POINTS`; whichever it is where the study names its search."""
    study, names = run.study, run.study.models[-1]
    if study.surrogate.of is not None:
        return 1.0
    region = surrogates.domain(run, names)
    bounds = np.column_stack([region.lower, region.upper])
    rng = generator(study.seed, "pilot", "surrogate")
    count = min(study.samples, POINTS)
    unit = np.vstack([unit_lhs(n, len(names), rng) for n in (count, FRESH)])
    where = snapped(study, names, region.lower + unit * (region.upper - region.lower), model=True)
    f = run.simulations.values(names, where, "pilot")
    model = fit_kriging(where[:count], f[:count], bounds, rng=rng, restarts=1)
    return float(accuracy(f[count:], model.predict(where[count:])).r2)


def _of_case(run: StudyRun, case: Case, length: int) -> float:
    """Simulations of a verified design, on average over the pilot's, which have so many points of each replicate."""
    names, study = run.study.design_variables(case.name), run.study
    region = box(run.scene, names)
    unit = unit_lhs(DESIGNS, len(names), generator(study.seed, "pilot", case.name))
    choices = tried.choices(run, case.name, region.lower + unit * (region.upper - region.lower))
    made = truth.doubled(run, choices, "pilot", "pilot", length, length * REPLICATES)
    settings = study.verification
    if settings.draws is not None:
        return float(settings.draws)
    early, late = (
        np.array([_errors(run, one, its[..., :n]) for one, its in zip(choices, made, strict=True)])
        for n in (length // PART, length)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        steep = np.log(early / late) / np.log(PART)
        shown = np.nanmean(np.where(np.isfinite(steep), steep, np.nan), axis=0)
        fall = np.clip((shown + shown[0]) / 2.0, *FALL)
        needed = length * REPLICATES * late ** (1.0 / np.nan_to_num(fall, nan=FALL[0]))
    if settings.contest > 1:
        objectives = sum(not goal.exact for goal in case.goals)
        needed[:, 2 : 2 + objectives] *= CONTESTED
    most = np.sqrt(2.0) * np.nan_to_num(needed, nan=0.0).max(axis=1)  # lengths double
    least = truth.first_length(settings) * REPLICATES
    each = np.clip(most, least, settings.most_samples)
    return float(each.mean())


def _verifying(case: Case, settings: Verification, each: float, near: bool) -> float:
    """Simulations of a verified design, near the edge of its constraints or far from it, from those for its accuracy."""
    failures = [one for one in case.kept if one.statistic == "exceedance" and one.most > 0.0]
    rare = [one for one in failures if verdicts.rare(one, settings)]
    usual, fewest = (of(case, settings) for of in (verdicts.usual_in, verdicts.fewest_in))
    weighted = fewest + NEAR * (usual - fewest)
    if not near:
        plain = all(each * one.most > CLEARLY for one in rare)
        return each + (OPEN if plain else 1.0) * weighted
    if len(rare) == len(failures) or settings.draws is not None:
        return each + weighted
    most = np.array([one.most for one in failures if one not in rare])
    aims = np.array([*edge.AIMS, edge.LAST[1]])[:, None]
    needed = ((CLEAR / (1.0 - aims)) ** 2 * aims * (1.0 / most - aims)).max(axis=1)
    return float(np.clip(needed, each, settings.most_samples).mean()) + weighted


def _errors(run: StudyRun, choice: Choice, values: Array) -> Array:
    """Half-widths of all that a design is verified in, over the accuracy requested, (k,), from values (responses,
    replicates, n)."""
    settings, case = run.study.verification, run.study.case(choice.case)
    mean, deviation, _, *others = truth.estimates_of(run, choice, values)
    wanted = run.study.wanted
    rows = [(mean, wanted.mean, mean.value), (deviation, wanted.deviation, deviation.value)]
    for goal, one in zip((*case.goals, *case.kept), others, strict=True):
        decided = goal in case.kept and goal.statistic == "exceedance"
        if not goal.exact and not decided:
            share, relative = goals.wanted(goal, wanted)
            rows.append((one, share, one.value if relative else 1.0))
    width = student(settings.confidence, REPLICATES - 1)
    errors = np.array([spread(one.shifts[None])[0] for one, *_ in rows])
    sizes = np.array([share * abs(scale) for _, share, scale in rows])
    return np.asarray(width * errors / np.where(sizes > 0.0, sizes, np.nan))
