"""Whether designs satisfy their constraints: decided by confidence intervals that hold for all designs and all looks at once.

A design is verified by more and more simulations, and is looked at after each doubling; and the best of those that satisfy a
constraint is recommended. Both favour luck: of many designs near a threshold some look better than they are. So each verdict
takes a share of the error that is allowed: designs share it evenly (Bonferroni), looks by halves, most of it for the last
(spending of error; K. K. G. Lan and D. L. DeMets, "Discrete sequential boundaries for clinical trials", Biometrika 70 (1983),
doi:10.1093/biomet/70.3.659). A design keeps its constraint or breaks it, so that one end of the interval alone can err, and has
all of that share. What is printed beside it is the usual interval of each design by itself.
"""

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.verdict import Verdict
from hpcclear.scene.cases import Constraint
from hpcclear.scene.stages import Verification
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import Limited
from hpcclear.study import goals
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun


class Decision(NamedTuple):
    """A constraint of one design."""

    verdict: Verdict
    price: float
    """Simulations of the design that would decide; infinite where the error of the tolerance leaves it open, NaN where it is
    decided or the estimate lies on the threshold."""


def rivals(choices: Sequence[Choice]) -> list[int]:
    """How many verdicts each design shares its error with: designs of its case."""
    counted = Counter(choice.case for choice in choices)
    return [counted[choice.case] for choice in choices]


def level(settings: Verification, many: int, simulations: int) -> float:
    """Two-sided confidence of the interval of one verdict of `many`, after so many simulations of a design.

    The last look that a design may get has half of its error, the one before a quarter, and so on; all of it for either end,
    since one of them alone can err.
    """
    longer = 1.0 if settings.draws is not None else settings.most_samples / simulations
    left = int(math.log2(max(longer, 1.0)))
    return 1.0 - 2.0 * (1.0 - settings.confidence) / many * 0.5 ** (1 + left)


def decided(run: StudyRun, choices: Sequence[Choice], true: Result) -> Result:
    """What is known of designs, with the verdicts on their constraints from ``sure_lower`` and ``sure_upper``.

    ``counted`` are the simulations behind each constraint, ``taken`` what the tolerance takes of it. Added are ``verdict``
    and ``price`` of `Decision`, (n, constraints), NaN beyond those of a case.
    """
    true["verdict"], true["price"] = np.full((2, *true["sure_lower"].shape), np.nan)
    many = rivals(choices)
    for row, choice in enumerate(choices):
        case = run.study.case(choice.case)
        for k, goal in enumerate(case.kept):
            simulations = int(true["counted"][row, k])
            sure = level(run.study.verification, many[row], simulations)
            value = true["goal"][row, len(case.goals) + k]
            interval = true["sure_lower"][row, k], true["sure_upper"][row, k]
            one, taken = Limited(value, np.empty(0), *interval), true["taken"][row, k]
            found = of_interval(goal, one, simulations, sure, taken)
            true["verdict"][row, k], true["price"][row, k] = found
    return true


def of_interval(
    goal: Constraint, one: Limited, simulations: int, confidence: float, taken: float = 0.0
) -> Decision:
    """How a design stands to a constraint, from an interval at a two-sided confidence by so many simulations, and its price.
    `taken` is the part of the half-width that more simulations leave."""
    if one.upper <= goal.most:
        return Decision(Verdict.HOLDS, np.nan)
    if one.lower > goal.most:
        return Decision(Verdict.FAILS, np.nan)
    gap = abs(goal.most - one.value)
    if taken >= gap > 0.0:
        return Decision(Verdict.UNDECIDED, np.inf)
    if goal.statistic == "exceedance" and one.value == 0.0:
        needed = without_any(goal.most, confidence)  # the interval narrows as one over the number
    elif not (gap > 0.0 and np.isfinite([one.value, one.lower, one.upper]).all()):
        return Decision(Verdict.UNDECIDED, np.nan)
    else:  # the width falls as the root of the number, but for what the tolerance takes
        reach = one.upper - one.value if one.value <= goal.most else one.value - one.lower
        needed = simulations * (max(reach - taken, 0.0) / (gap - taken)) ** 2
    price = 2.0 ** math.ceil(math.log2(max(needed, simulations + 1.0)))
    return Decision(Verdict.UNDECIDED, float(price))


def without_any(most: float, confidence: float) -> float:
    """Simulations without any exceedance that keep the upper limit of a probability at `most` (Clopper and Pearson)."""
    return math.log((1.0 - confidence) / 2.0) / math.log1p(-min(most, 1.0 - 1e-9))


RARE = 2e-2
"""Probability below which a constraint is decided by importance sampling where plain samples do not decide it. Of 1 % some 8000
plain samples meet 80 failures, which leaves a quarter of it open; as many weighted ones a tenth."""


def rare(goal: Constraint, settings: Verification) -> bool:
    """Whether a constraint is a probability of failure for importance sampling; a fixed number of draws leaves none."""
    return goal.statistic == "exceedance" and goal.most < RARE and settings.draws is None


HITS = 16
"""Exceedances after which a probability of half or twice what is allowed is distinguished from it."""


WEIGHTED, FEWEST = 12288, 6144
"""Simulations of a design by importance sampling that decide a rare failure as a rule; its pilot and first draws alone."""


def usual(goal: Constraint, settings: Verification) -> float:
    """Simulations that decide a constraint of a design that is not too near its threshold; 0 of what is no probability."""
    if rare(goal, settings):
        return float(min(WEIGHTED, max(2 * settings.most_samples, FEWEST)))
    return HITS / goal.most if goal.statistic == "exceedance" and goal.most > 0.0 else 0.0


def costs(study: Study, unit: str) -> Iterator[str]:
    """What each probability that is kept small takes of a design, a sentence each."""
    settings = study.verification
    for case in study.cases:
        for goal in case.kept:
            rate = usual(goal, settings)
            if rate == 0.0:
                continue
            given = settings.draws or settings.most_samples
            least = without_any(goal.most, settings.confidence)
            text = (
                f"{goal.words(unit)} at most {goal.most:g}: {least:.0f} simulations of a design without an exceedance would "
                f"show it; about {rate:.0f} decide a design near it"
            )
            if rare(goal, settings):
                text += " by importance sampling"
            elif least > given:
                key = "most_samples" if settings.draws is None else "samples"
                text += f"; study.verification.{key} allows {given}, too few to decide: raise it"
            yield text


def settled(
    goal: Constraint, values: Array, choice: Choice, settings: Verification, many: int
) -> bool:
    """Whether a constraint of a design is decided, as one of `many`."""
    count = values[0].size if values.ndim == 3 else values.size
    sure = level(settings, many, count)
    one = goals.goal_value(goal, values, choice.design, sure)
    return of_interval(goal, one, count, sure).verdict is not Verdict.UNDECIDED
