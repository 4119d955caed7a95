"""Simulated designs: mean, standard deviation and 95th percentile with confidence intervals."""

from collections.abc import Sequence
from itertools import compress

import numpy as np
from scipy.special import ndtr

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Flag
from hpcclear.base.student import student
from hpcclear.base.verdict import Verdict
from hpcclear.report.merit import SPAN
from hpcclear.scene.cases import Case, Constraint
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.stages import REPLICATES, MomentAccuracy, Verification
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import (
    Estimate,
    limits,
    moments,
    quantile,
    spread,
)
from hpcclear.statistics.search import improvement
from hpcclear.study import contributions, goals, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

FIRST = 512
"""Simulations of a design from which its accuracy is judged, as far as it may have so many."""

LOOK = 16
"""Points of each replicate of every verified design, at most; those that decide get more."""

TIED, LOST = 0.4, 0.1
"""Of the accuracy requested: designs that differ by less are one in an objective; and what is lost beyond that, as a rule, by
taking one for the best in place of another, for more simulations to be worth it; all of it for all that a design may have."""

UNDECIDED = 0.3
"""Of the same: what all simulations that a design may have are expected to win, at least, of one that may be shown to keep its
constraints."""

CLOSE = 0.25
"""Of the accuracy requested: what a constraint that is not decided is known to, unless it is a probability."""

QUANTILE = 0.95
"""Probability of staying below the percentile that is reported."""


def samples_of(run: StudyRun, choice: Choice, count: int, purpose: str = "verification") -> Points:
    """Independent samples of a design in all study variables.

    Every design of a case meets the same scatter, so that differences between designs are not
    noise.
    """
    points = _of_design(run, choice, count, purpose, 0, None)
    return run.simulations.filled(points.names, points.values)


def scattered(
    run: StudyRun, choice: Choice, count: int, purpose: str = "verification", first: int = 0
) -> Points:
    """The points from `first` on of all replicates of a design, `count` of each, one replicate after the other."""
    made = [_of_design(run, choice, count, purpose, first, k) for k in range(REPLICATES)]
    return run.simulations.filled(made[0].names, np.concatenate([one.values for one in made]))


def _of_design(
    run: StudyRun, choice: Choice, count: int, purpose: str, first: int, replicate: int | None
) -> Points:
    return monte_carlo(
        run.scene,
        count,
        random=run.study.case(choice.case).random,
        design=dict(choice.design),
        purpose=purpose,
        first=first,
        replicate=replicate,
    )


def begun(run: StudyRun, choices: Sequence[Choice]) -> list[Array]:
    """The first points of each replicate of designs, (k, replicates, values) each as `made` returns them."""
    length = min(first_length(run.study.verification), search_length(run.study), LOOK)
    return looked_at(run, choices, "verification", "verification", length)


def made(
    run: StudyRun,
    choices: Sequence[Choice],
    before: Sequence[Array] = (),
    wanted: Sequence[MomentAccuracy] = (),
) -> list[Array]:
    """Simulations of designs, as many as the study requires, (k, replicates, values) each: f, whether beyond
    Hertz's range, further responses.

    Only those that decide are simulated further: in each objective the least is known as accurately as the study (or `wanted`
    of each design) requires, and others are simulated as long as choosing it may lose more than `LOST`.

    Raises
    ------
    InputError
        If all simulations fail.
    """
    settings, stage = run.study.verification, "verification"
    if settings.draws is not None:
        return drawn(run, choices, stage, stage, settings.draws)
    found = list(before) or begun(run, choices)
    wanted = wanted or [run.study.wanted] * len(choices)
    while rows := _open(run, choices, found, wanted):
        length = min(found[k].shape[2] for k in rows)  # a sequence is balanced at powers of two
        rows = [k for k in rows if found[k].shape[2] == length]
        lengthen(run, choices, found, rows, stage, stage, length)
    return found


def drawn(
    run: StudyRun, choices: Sequence[Choice], stage: str, purpose: str, count: int
) -> list[Array]:
    """f of so many independent draws of designs, (2, draws, 1) each."""
    return _values(run, choices, stage, purpose, count, None)


def explained(
    run: StudyRun, choices: Sequence[Choice], made: Sequence[Array], purpose: str = "verification"
) -> Result:
    """What makes the scatter of designs (`hpcclear.study.contributions.of_designs`), from f of each, (rows, n) or (n,)."""

    def drawn(choice: Choice, f: Array) -> Points:
        if run.study.verification.draws is not None:
            return samples_of(run, choice, f.size, purpose)
        return scattered(run, choice, f.shape[1], purpose)

    return contributions.of_designs(run, choices, made, drawn)


def scrambled_length(simulations: int) -> int:
    """Points of each replicate that so many simulations make at most: a power of two."""
    return 2 ** int(np.log2(max(simulations // REPLICATES, 1)))


def first_length(settings: Verification) -> int:
    """Points of each replicate from which accuracy is judged: a power of two."""
    least = FIRST if settings.least_samples is None else settings.least_samples
    return scrambled_length(min(least, settings.most_samples))


def search_length(study: Study) -> int:
    """Points of each replicate that a design of the search gets: fewer than verified ones, a power of two."""
    wanted = min(study.verification.infill_samples, study.verification.draws or FIRST)
    return 2 ** max(int(np.log2(max(wanted, REPLICATES) // REPLICATES)), 1)


def expected(study: Study) -> int:
    """Simulations of a design, on average: those for the standard deviation of the paper's designs, whose half-width was
    1.4 % after 512 and fell as the power 0.6 of their number."""
    settings = study.verification
    if settings.draws is not None:
        return settings.draws
    needed = FIRST * max(0.014 / study.wanted.deviation, 1.0) ** 1.7
    kept = [goal for case in study.cases for goal in case.kept if not verdicts.rare(goal, settings)]
    needed = max([needed, *(verdicts.usual(goal, settings) for goal in kept)])
    return int(np.clip(needed, first_length(settings) * REPLICATES, settings.most_samples))


def looked_at(
    run: StudyRun, choices: Sequence[Choice], stage: str, purpose: str, length: int
) -> list[Array]:
    """f of designs by so many points of each scrambled Sobol sequence, (k, replicates, values) each."""
    made = [nothing(run)] * len(choices)
    lengthen(run, choices, made, range(len(choices)), stage, purpose, length)
    return made


def lengthen(
    run: StudyRun,
    choices: Sequence[Choice],
    made: list[Array],
    rows: Sequence[int],
    stage: str,
    purpose: str,
    length: int,
) -> None:
    """So many points more of each replicate of some designs that are equally long; `made` as `made` returns it, shape
    (2, replicates, values) each."""
    first = made[rows[0]].shape[2]
    fresh = _values(run, [choices[k] for k in rows], stage, purpose, length, first)
    for k, one in zip(rows, fresh, strict=True):
        made[k] = np.concatenate([made[k], one], axis=2)


def _open(
    run: StudyRun,
    choices: Sequence[Choice],
    made: Sequence[Array],
    wanted: Sequence[MomentAccuracy],
) -> list[int]:
    """Designs that more simulations are worth: in each objective, and in mean + 2 standard deviations where both are
    minimised, the least of those that keep the constraints, unless it is known well enough; and others without which more
    than `LOST` is lost as a rule, up to `contest` times its simulations. Where none is decided yet, the least of those that are
    likely shown to keep them. The baseline, which all are compared with, is known as accurately or gets as many as these."""
    settings, many, found = run.study.verification, verdicts.rivals(choices), set[int]()
    for case in run.study.cases:
        rows = [k for k, c in enumerate(choices) if (c.case, c.origin) == (case.name, "search")]
        if not rows:
            continue
        count = len(case.goals)
        estimates = [_goals(run, choices[k], made[k])[:count] for k in rows]
        values = np.array([[one.value for one in row] for row in estimates])
        shifts = np.array([[one.shifts for one in row] for row in estimates])
        chances = np.array([_shown(run, choices[k], made[k], many[k]) for k in rows])
        length = np.array([made[k][0].size for k in rows]) / settings.most_samples
        known = np.isfinite(values).all(axis=1) & (chances > 0.0)
        holds, open_ = known & (chances == 1.0), known & (chances < 1.0) & (length <= 0.5)
        directions = np.eye(count) if not case.plain else np.vstack([[1.0, SPAN], np.eye(count)])
        leaders = set[int]()
        for number, direction in enumerate(directions):
            own, moved = values @ direction, np.einsum("nkr,k->nr", shifts, direction)
            if holds.any():
                least = int(np.where(holds, own, np.inf).argmin())
            elif open_.any():
                likely = open_ & (chances >= min(0.5, chances[open_].max()))
                least = int(np.where(likely, own, np.inf).argmin())
            else:
                continue
            first, asked = rows[least], None if number == 0 else direction
            if not _accurate(run, choices[first], made[first], wanted[first], many[first], asked):
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
            found |= {k for k in compress(rows, rivals & holds) if 2 * made[k][0].size <= limit}
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
    return sorted(k for k in found if 2 * made[k][0].size <= settings.most_samples)


def size_of(run: StudyRun, case: Case, direction: Array, values: Array) -> float:
    """The accuracy requested of a weighted sum of objectives, (m,), at a design; of a formula that of a mean."""
    sizes = []
    for goal, value in zip(case.goals, values, strict=True):
        share, relative = goals.wanted(goal, run.study.wanted)
        share = run.study.wanted.mean if goal.exact else share
        sizes.append(share * (abs(value) if relative else 1.0))
    return float(abs(direction) @ np.array(sizes))


def _shown(run: StudyRun, choice: Choice, values: Array, many: int) -> float:
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
            chance *= float(np.clip(ndtr(gap / (error * (1.0 - left) ** 0.5)), 1e-9, 1.0 - 1e-9))
    return chance


def _values(
    run: StudyRun,
    choices: Sequence[Choice],
    stage: str,
    purpose: str,
    count: int,
    first: int | None,
) -> list[Array]:
    """f, whether beyond Hertz's range, and further responses, (k, replicates, values) each: `count` draws, or points from
    `first` on of each replicate."""
    if first is None:
        batches = [samples_of(run, choice, count, purpose) for choice in choices]
        shape = count, 1
    else:
        batches = [scattered(run, choice, count, purpose, first) for choice in choices]
        shape = REPLICATES, count
    values = np.concatenate([batch.values for batch in batches])
    points = Points(batches[0].names, values, batches[0].paths)
    records, responses = run.simulations.judged(points, stage)
    beyond = (records["flags"] & Flag.BEYOND_HERTZ) != 0
    found = np.stack([responses[0], beyond, *responses[1:]])
    return [part.reshape(len(found), *shape) for part in np.split(found, len(choices), axis=1)]


def _reaches(settings: Verification, values: Array) -> tuple[float, float]:
    """Half-widths of the confidence intervals of mean and standard deviation, the larger one where they are not symmetric."""
    mean, deviation = (limits(one, settings.confidence)[1] - one.value for one in moments(values))
    return mean, deviation


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
    reach = _reaches(settings, values[0])
    first = {
        "mean": reach[0] <= wanted.mean * abs(mean),
        "deviation": reach[1] <= wanted.deviation * max(deviation, 1e-9 * abs(mean)),
    }
    weights = np.ones(len(case.goals)) if direction is None else direction
    values_of = zip((*case.goals, *case.kept), _goals(run, choice, values), strict=True)
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


def _goals(run: StudyRun, choice: Choice, values: Array) -> list[goals.GoalValue]:
    """What a design comes to in all that its case requires."""
    case, level = run.study.case(choice.case), run.study.verification.confidence
    asked = (*case.goals, *case.kept)
    return [goals.goal_value(goal, values, choice.design, level) for goal in asked]


def estimates_of(run: StudyRun, choice: Choice, values: Array) -> list[Estimate | goals.GoalValue]:
    """Mean, standard deviation, percentile, objectives and constraints of a design, from its simulations (k, replicates, n)."""
    percentile = quantile(values[0], QUANTILE, run.study.verification.confidence)
    return [*moments(values[0]), percentile, *_goals(run, choice, values)]


def nothing(run: StudyRun) -> Array:
    """No simulations yet: f, whether beyond Hertz's range, further responses, shape (k, replicates, 0)."""
    return np.empty((2 + len(run.study.further), REPLICATES, 0))


def results_of(run: StudyRun, choices: Sequence[Choice], made: Sequence[Array]) -> Result:
    """Results of designs from their simulations, shape (2, replicates, values) each.

    Returns
    -------
    dict of arrays over the designs
        ``mean`` and ``deviation``, each with its ``_error`` (standard), ``_reach`` (half-width of the
        interval) and ``_shifts`` (n, replicates); ``percentile``, ``percentile_lower``, ``percentile_upper``;
        ``goal``, ``goal_lower``, ``goal_upper`` (n, objectives), ``goal_shifts`` (n, objectives, replicates): objectives,
        then constraints, NaN beyond; ``sure_lower``, ``sure_upper``, ``taken`` (by the tolerance), ``counted``, ``verdict``
        and ``price`` (n, constraints): of `hpcclear.study.verdicts.decided`; ``beyond`` (n, constraints): of
        `hpcclear.study.goals.beyond`; ``samples``, ``failed``, ``beyond_hertz``.
    """
    settings = run.study.verification
    most = max(len(case.goals) + len(case.kept) for case in run.study.cases)
    held = max(len(case.kept) for case in run.study.cases)
    rows: list[dict[str, object]] = []
    for choice, whole, many in zip(choices, made, verdicts.rivals(choices), strict=True):
        values, beyond = whole[:2]
        row: dict[str, object] = {
            "samples": values.size,
            "failed": int(np.isnan(values).sum()),
            "beyond_hertz": int(beyond.sum()),
        }
        reaches = _reaches(settings, values)
        for name, one, reach in zip(("mean", "deviation"), moments(values), reaches, strict=True):
            row |= {name: one.value, f"{name}_error": one.error, f"{name}_reach": reach}
            row[f"{name}_shifts"] = one.shifts
        found = quantile(values, QUANTILE, settings.confidence)
        row |= {"percentile": found.value, "percentile_lower": found.lower}
        row["percentile_upper"] = found.upper
        estimates = _goals(run, choice, whole)
        missing = [np.nan] * (most - len(estimates))
        row["goal"] = [one.value for one in estimates] + missing
        row["goal_lower"] = [one.lower for one in estimates] + missing
        row["goal_upper"] = [one.upper for one in estimates] + missing
        unknown = np.full(len(values), np.nan)
        row["goal_shifts"] = [one.shifts for one in estimates] + [unknown] * len(missing)
        sure = verdicts.level(settings, many, values.size)
        kept = run.study.case(choice.case).kept
        certain = [goals.goal_value(goal, whole, choice.design, sure) for goal in kept]
        missing = [np.nan] * (held - len(kept))
        row["taken"] = [0.0] * len(certain) + missing
        row["counted"] = [float(values.size)] * len(certain) + missing
        row["beyond"] = [goals.beyond(goal, whole) for goal in kept] + missing
        row["sure_lower"] = [one.lower for one in certain] + missing
        row["sure_upper"] = [one.upper for one in certain] + missing
        rows.append(row)
    return verdicts.decided(
        run, choices, {name: np.array([row[name] for row in rows]) for name in rows[0]}
    )
