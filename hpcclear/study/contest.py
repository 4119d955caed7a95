"""Which verified designs more simulations are worth: those that may change what is recommended, or how well it is known."""

from collections.abc import Collection, Sequence
from itertools import compress

import numpy as np
from scipy.special import ndtr

from hpcclear.base.arrays import Array
from hpcclear.base.student import student
from hpcclear.base.verdict import Verdict
from hpcclear.report.merit import SPAN
from hpcclear.scene.cases import Case, Constraint
from hpcclear.scene.stages import REPLICATES, MomentAccuracy, Verification
from hpcclear.statistics.random.replicates import Limited, limits, moments, spread
from hpcclear.statistics.search import improvement
from hpcclear.study import goals, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import StudyRun

TIED, LOST = 0.4, 0.1
"""Of the accuracy requested: designs that differ by less are one in an objective; and what is lost beyond that, as a rule, by
taking one for the best in place of another, for more simulations to be worth it; all of it for all that a design may have."""

UNDECIDED = 0.3
"""Of the same: what all simulations that a design may have are expected to win, at least, of one that may be shown to keep its
constraints."""

CLOSE = 0.25
"""Of the accuracy requested: what a constraint that is not decided is known to, unless it is a probability."""

FINE = 16
"""Points of each replicate from which designs get half as many again: sequences are balanced at powers of two, and nearly so
between them."""


def worth_more(
    run: StudyRun,
    choices: Sequence[Choice],
    made: Sequence[Array],
    wanted: Sequence[MomentAccuracy],
    without: Collection[int] = (),
) -> list[int]:
    """Designs that more simulations are worth, but for those `without` which it has to go: in each objective, and in mean + 2
    standard deviations where both are minimised, the least of those that keep the constraints, unless it is known well enough;
    and others without which more than `LOST` is lost as a rule, up to `contest` times its simulations. Where none is decided
    yet, the least of those that are likely shown to keep them is. The baseline, which all are compared with, is known as
    accurately or gets as many as these."""
    settings, many, found = run.study.verification, verdicts.rivals(choices), set[int]()
    later = [REPLICATES * longer(run, *one) for one in zip(choices, made, strict=True)]
    for case in run.study.cases:
        rows = [k for k, c in enumerate(choices) if (c.case, c.origin) == (case.name, "search")]
        rows = [k for k in rows if k not in without]
        if not rows:
            continue
        count = len(case.goals)
        estimates = [goals_of(run, choices[k], made[k])[:count] for k in rows]
        values = np.array([[one.value for one in row] for row in estimates])
        shifts = np.array([[one.shifts for one in row] for row in estimates])
        chances = np.array([shown(run, choices[k], made[k], many[k]) for k in rows])
        length = np.array([made[k][0].size for k in rows]) / settings.most_samples
        more = np.array([later[k] <= settings.most_samples for k in rows])
        known = np.isfinite(values).all(axis=1) & (chances > 0.0)
        holds, open_ = known & (chances == 1.0), known & (chances < 1.0) & more
        leaders = set[int]()
        for number, direction in enumerate(directions(case)):
            own, moved = values @ direction, np.einsum("nkr,k->nr", shifts, direction)
            if holds.any():
                least = int(np.where(holds, own, np.inf).argmin())
            elif open_.any():
                likely = open_ & (chances >= min(0.5, chances[open_].max()))
                least = int(np.where(likely, own, np.inf).argmin())
            else:
                continue
            first, asked = rows[least], None if number == 0 else direction
            if (number == 0 and not holds.any()) or not _accurate(
                run, choices[first], made[first], wanted[first], many[first], asked
            ):
                found.add(first)
            leaders.add(first)
            error = spread(moved - moved[least])
            size = size_of(run, case, direction, values[least])
            below = own[least] - np.where(holds, TIED * size, 0.0)
            lost = np.where(known, chances * improvement.gain(below, own, error), 0.0)
            worth = np.where(holds, np.maximum(LOST, length), UNDECIDED * (1.0 - length))
            rivals = (holds | open_) & (lost > worth * size)
            rivals[least] = False
            if (rivals & (error > 0.0)).any():
                found.add(first)
            limit = settings.contest * made[first][0].size
            found |= {k for k in compress(rows, rivals & holds) if later[k] <= limit}
            if (rivals & open_).any():  # when it is decided others may win less
                found.add(rows[int(np.where(rivals & open_, lost, 0.0).argmax())])
        most = max((made[k][0].size for k in leaders), default=0)
        found |= {
            k
            for k, one in enumerate(choices)
            if one.name == f"{case.name} original"
            and made[k][0].size < most
            and not _accurate(run, one, made[k], wanted[k], many[k])
        }
    return sorted(k for k in found if later[k] <= settings.most_samples)


def longer(run: StudyRun, choice: Choice, values: Array) -> int:
    """Points of each replicate that a design gets next: where each look at constraints costs certainty, twice as many."""
    kept, settings = run.study.case(choice.case).kept, run.study.verification
    decides = any(not (goal.exact or verdicts.rare(goal, settings)) for goal in kept)
    length = values.shape[2]
    power = 2 ** (length.bit_length() - 1)
    return power * 3 // 2 if length == power >= FINE and not decides else 2 * power


def directions(case: Case) -> Array:
    """Weights of the objectives (m,) in each sum whose least value counts, (k, m): first of that by which a design is
    recommended, mean + 2 standard deviations where both are minimised."""
    each = np.eye(len(case.goals))
    return np.vstack([[1.0, SPAN], each]) if case.plain else each


def size_of(run: StudyRun, case: Case, direction: Array, values: Array) -> float:
    """The accuracy requested of a weighted sum of objectives, (m,), at a design; of a formula that of a mean."""
    sizes = []
    for goal, value in zip(case.goals, values, strict=True):
        share, relative = goals.wanted(goal, run.study.wanted)
        share = run.study.wanted.mean if goal.exact else share
        sizes.append(share * (abs(value) if relative else 1.0))
    return float(abs(direction) @ np.array(sizes))


def shown(run: StudyRun, choice: Choice, values: Array, many: int) -> float:
    """Probability that a design will be shown to keep its constraints as one of `many`: 1 and 0 where that is decided; rare
    failures are decided later."""
    settings, count, chance = run.study.verification, values[0].size, 1.0
    sure, last = (verdicts.level(settings, many, n) for n in (count, settings.most_samples))
    for goal in run.study.case(choice.case).kept:
        if verdicts.rare(goal, settings):
            continue
        one = goals.goal_value(goal, values, choice.design, sure)
        verdict = verdicts.of_interval(goal, one, count, sure).verdict
        if verdict is Verdict.FAILS:
            return 0.0
        if verdict is Verdict.UNDECIDED:
            freedom, left = REPLICATES - 1, min(count / settings.most_samples, 0.99)
            error = (one.upper - one.lower) / (2.0 * student(sure, freedom))
            gap = goal.most - one.value - student(last, freedom) * error * left**0.5
            shown = ndtr(gap / (error * (1.0 - left) ** 0.5)) if np.isfinite(error) else 0.5
            chance *= float(np.clip(shown, 1e-9, 1.0 - 1e-9))
    return chance


def _accurate(
    run: StudyRun,
    choice: Choice,
    values: Array,
    wanted: MomentAccuracy,
    many: int,
    direction: Array | None = None,
) -> bool:
    """Whether the confidence intervals of the objectives in a direction, or of all, are as narrow as requested. A standard
    deviation of round-off is, and so is what significantly keeps or breaks its threshold, as one of `many` designs."""
    settings, case = run.study.verification, run.study.case(choice.case)
    mean, deviation = (one.value for one in moments(values[0]))
    reach = reaches(settings, values[0])
    first = {"mean": reach[0] <= wanted.mean * abs(mean)}
    first["deviation"] = reach[1] <= wanted.deviation * max(deviation, 1e-9 * abs(mean))
    weights = np.ones(len(case.goals)) if direction is None else direction
    values_of = zip((*case.goals, *case.kept), goals_of(run, choice, values), strict=True)
    for k, (goal, one) in enumerate(values_of):
        if isinstance(goal, Constraint):
            part = 1.0 if goal.statistic == "exceedance" else CLOSE
            good = goal.exact or verdicts.rare(goal, settings)
            good = good or goals.accurate(goal, one, wanted, part)
            good = good or verdicts.settled(goal, values, choice, settings, many)
        elif goal.exact or not weights[k]:
            continue
        elif goal.place == 0 and goal.statistic in first:
            good = first[goal.statistic]
        else:
            good = goals.accurate(goal, one, wanted)
        if not good:
            return False
    return True


def reaches(settings: Verification, values: Array) -> tuple[float, float]:
    """Half-widths of the confidence intervals of mean and standard deviation, the larger one where they are not symmetric."""
    mean, deviation = (limits(one, settings.confidence)[1] - one.value for one in moments(values))
    return mean, deviation


def goals_of(run: StudyRun, choice: Choice, values: Array) -> list[Limited]:
    """What a design comes to in all that its case requires."""
    case, level = run.study.case(choice.case), run.study.verification.confidence
    asked = (*case.goals, *case.kept)
    return [goals.goal_value(goal, values, choice.design, level) for goal in asked]
