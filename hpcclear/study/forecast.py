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
from hpcclear.scene.cases import Case, Constraint
from hpcclear.scene.domain import box
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import unit_lhs
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.streams import generator
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import spread, student
from hpcclear.study import (
    budget,
    extent,
    goals,
    optimisation,
    truth,
    verdicts,
)
from hpcclear.study.optimisation import Choice, chosen_in_all
from hpcclear.study.paper.printed import printed_designs
from hpcclear.study.run import StudyRun
from hpcclear.study.simulations import Simulations

DESIGNS, LENGTHS, PART = 4, (64, 32, 16, 8), 4
"""Designs of a case, points of each of their replicates (the most that `LONGEST` allows), and what part of these shows how
fast errors fall."""

FALL = 0.5, 1.5
"""Between these is the power of the number of simulations by which errors fall: of rough f, and of smooth f. The mean shows it
first: the error of a standard deviation by few points falls alike whether f is rough or smooth."""

SPENT = 0.04, 0.1, 0.12
"""Part of what a search may simulate beyond its first designs: of smooth f; more where a design takes all simulations that it
may have; and more where it has to keep constraints."""

ENDS, OTHERS = 1.2, 0.2
"""Times the simulations that the accuracy requested takes, of the best designs in each objective and of the baseline; part of
all other designs that there may be which are simulated."""

CONTESTED = 1.5
"""Times the simulations that the accuracy of an objective takes: what designs get beyond it while they may be the best."""

WEIGHED, SHOWN, NEAR = 2.3, 1.0, 6.0
"""Designs of a case whose rare failures are decided by weighted simulations; ones that are shown to keep another constraint, by
all simulations that a design may have; and times `verdicts.usual`: what shows a probability near its threshold."""

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
    pilot = len(study.cases) * DESIGNS * REPLICATES * seconds
    lengths = [length for length in LENGTHS if pilot * length <= LONGEST]
    here = _Here(scene, evaluate)
    run = cast(StudyRun, SimpleNamespace(scene=scene, study=study, simulations=here))
    if study.worn or not lengths:
        return sum(samples.values()), seconds
    try:
        each = np.array([_of_case(run, case, lengths[0]) for case in study.cases])
    except InputError:
        return sum(samples.values()), seconds
    searched, verified = np.sum(
        [_spent(study, case, its) for case, its in zip(study.cases, each, strict=True)], axis=0
    ).tolist()
    verified += len(printed_designs(scene)) * _looked(study)
    found = {"search": searched, "verification": verified}
    samples |= {name: int(extent.loads_of(scene) * count) for name, count in found.items()}
    return sum(samples.values()), here.seconds / here.count


def _spent(study: Study, case: Case, its: float) -> tuple[float, float]:
    """Simulations of the search and of the verification of a case, of which a design takes `its` for its accuracy."""
    settings, (begun, further) = study.verification, budget.simulations(study)
    least = truth.first_length(settings) * REPLICATES / 2
    rough = np.log(its / least) / np.log(settings.most_samples / least)
    part = SPENT[0] + SPENT[1] * rough + SPENT[2] * bool(case.kept)
    designs = sum(chosen_in_all(study)) / len(study.cases)
    if settings.infill_rounds:
        designs = budget.designs(study, case)
    ends = min(1 + case.plain + sum(not goal.exact for goal in case.goals), designs)
    verified = ENDS * ends * its + OTHERS * (designs - ends + 1) * min(_looked(study), its)
    if settings.draws:
        verified = designs * its + _looked(study)
    verified += WEIGHED * verdicts.usual_in(case, settings)
    shown = [_shown_by(one, study) for one in case.kept if not one.exact]
    verified += SHOWN * max(shown, default=0.0)
    return (begun + np.clip(part, 0.0, 1.0) * further) / len(study.cases), verified


def _looked(study: Study) -> float:
    """Simulations that each verified design begins with."""
    looks = truth.first_length(study.verification), truth.search_length(study), truth.LOOK
    return min(looks) * REPLICATES


def _shown_by(goal: Constraint, study: Study) -> float:
    """Simulations that show a design to keep a constraint near its threshold, but for rare failures."""
    settings = study.verification
    if verdicts.rare(goal, settings):
        return 0.0
    most = float(settings.draws or settings.most_samples)
    usual = verdicts.usual(goal, settings)
    return min(NEAR * usual, most) if usual else most


def _of_case(run: StudyRun, case: Case, length: int) -> float:
    """Simulations of a verified design, on average over the pilot's, which have so many points of each replicate."""
    names, study = run.study.design_variables(case.name), run.study
    region = box(run.scene, names)
    unit = unit_lhs(DESIGNS, len(names), generator(study.seed, "pilot", case.name))
    choices = optimisation.choices(
        run, case.name, region.lower + unit * (region.upper - region.lower)
    )
    made = truth.looked_at(run, choices, "pilot", "pilot", length)
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
        needed[:, 1 : 1 + objectives] *= CONTESTED
    most = np.sqrt(2.0) * np.nan_to_num(needed, nan=0.0).max(axis=1)  # lengths double
    least = truth.first_length(settings) * REPLICATES
    each = np.clip(most, least, settings.most_samples)
    return float(each.mean())


def _errors(run: StudyRun, choice: Choice, values: Array) -> Array:
    """Half-widths of all that a design is verified in, over the accuracy requested, (k,), from values (responses,
    replicates, n)."""
    settings, case = run.study.verification, run.study.case(choice.case)
    mean, _, _, *others = truth.estimates_of(run, choice, values)
    wanted = run.study.wanted
    rows = [(mean, 1.0, mean.value)]  # shows how errors fall, whether it is asked for or not
    for goal, one in zip((*case.goals, *case.kept), others, strict=True):
        decided = goal in case.kept and goal.statistic == "exceedance"
        if not goal.exact and not decided:
            share, relative = goals.wanted(goal, wanted)
            rows.append((one, share, one.value if relative else 1.0))
    width = student(settings.confidence, REPLICATES - 1)
    errors = np.array([spread(one.shifts[None])[0] for one, *_ in rows])
    sizes = np.array([share * abs(scale) for _, share, scale in rows])
    return np.asarray(width * errors / np.where(sizes > 0.0, sizes, np.nan))
