"""How many designs a search has, and how many simulations it may take: what it goes by and what is said beforehand."""

from hpcclear.scene.cases import Case
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.statistics.random import importance
from hpcclear.study import truth
from hpcclear.study.failures import FEW, PILOT, failures_of
from hpcclear.study.optimisation import chosen_in_all

WIDE = 4
"""Designs per design variable all over the box at first."""

FIRST = 2
"""Points of each replicate that a design gets at first: what the surrogate explains of their scatter needs no more."""

HEDGES = 3
"""Designs to verify that only may be the best, since what is believed of neighbours is off together."""

AIM, AIMS = 0.8, (0.88, 0.78, 0.65)
"""Probability that is sought, over the largest that is allowed: so much below it can be shown; and of the designs that are
verified, of which one nearer to the threshold may stay undecided."""

OFF = 1.0, 2.0, 4.0
"""Standard errors of the constraints by which further designs keep them: all designs meet the same scatter, so that what few
simulations get wrong they get wrong of all, and designs along the threshold break or keep it together."""

SETTLED, SURE = 5, 64
"""Designs at the threshold that are looked at closely in the end, at most; weighted draws of each repeat there."""


def simulations(study: Study) -> tuple[int, int]:
    """Simulations of the first designs, and of all that follow, at most."""
    if study.verification.infill_rounds == 0:
        return 0, 0
    first = sum(chosen_in_all(study)) + sum(all_over(study, case) for case in study.cases)
    settings, most = study.verification, truth.search_length(study) * REPLICATES
    further = settings.infill_rounds * settings.infill_designs * len(study.cases) * most
    further += first * (most - FIRST * REPLICATES)
    failures = sum(len(failures_of(study, case)) for case in study.cases)
    designs = settings.infill_rounds * settings.infill_designs
    draws = importance.LEVELS * PILOT + (designs * FEW + SETTLED * SURE) * importance.REPEATS
    settled = sum(SETTLED for case in study.cases if any(not one.exact for one in case.kept))
    return first * FIRST * REPLICATES, further + settled * most + failures * draws


def all_over(study: Study, case: Case) -> int:
    """Designs all over the box that the search of a case begins with."""
    size = len(study.design_variables(case.name))
    return max(WIDE * size, size + 4)


def designs(study: Study, case: Case) -> int:
    """Designs of a case that are verified, at most."""
    directions = len(case.goals) + case.plain
    front = study.verification.designs if len(case.goals) > 1 else 0
    kept = len(AIMS) + len(OFF) if any(not one.exact for one in case.kept) else 0
    return 2 * directions + max(HEDGES, front and max(front, len(case.goals))) + kept
