"""Simulated designs: mean, standard deviation and 95th percentile with confidence intervals."""

from collections.abc import Collection, Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Flag
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.stages import REPLICATES, MomentAccuracy, Verification
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import Estimate, moments, quantile
from hpcclear.study import contest, goals, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

FIRST = 512
"""Simulations of a design from which its accuracy is judged, as far as it may have so many."""

LOOK = 8
"""Points of each replicate of every verified design, at most; those that decide get more."""

NETS = 2
"""Sobol sequences that the replicates of a search are consecutive points of: a few long ones integrate better than many of a
few points, and differences between them say how much better."""

QUANTILE = 0.95
"""Probability of staying below the percentile that is reported."""


def scattered(
    run: StudyRun, choice: Choice, count: int, stage: str = "verification", first: int | None = 0
) -> Points:
    """Points of a design in all study variables: from `first` on of all replicates, `count` of each, one replicate after the
    other; so many independent samples where that is None.

    Every design of a case meets the same scatter in a stage, so that differences between designs are not noise; pairs meet
    that of the verification. In a search doubled lengths belong together: all replicates are then parts of `NETS`.
    """
    random = run.study.case(choice.case).random
    purpose = "verification" if stage == "pairs" else stage
    parts = REPLICATES // NETS if stage == "search" else 1
    points = monte_carlo(
        run.scene, count * parts, random=random, design=dict(choice.design), purpose=purpose,
        first=(first or 0) * parts, replicate=None if first is None else range(REPLICATES // parts),
    )  # fmt: skip
    return run.simulations.filled(points.names, points.values, checked=True)


def begun(run: StudyRun, choices: Sequence[Choice]) -> list[Array]:
    """The first points of each replicate of designs, (k, replicates, values) each as `made` returns them."""
    length = min(first_length(run.study.verification), search_length(run.study), LOOK)
    return drawn(run, choices, "verification", length)


def made(
    run: StudyRun,
    choices: Sequence[Choice],
    before: Sequence[Array] = (),
    wanted: Sequence[MomentAccuracy] = (),
    without: Collection[int] = (),
) -> list[Array]:
    """Simulations of designs, as many as the study requires, (k, replicates, values) each: f, whether beyond
    Hertz's range, further responses.

    Only those that decide are simulated further: in each objective the least is known as accurately as the study (or `wanted`
    of each design) requires, and others are simulated as long as choosing it may lose more than `LOST`; as if those `without`
    which it has to go were not there. Raises InputError if all simulations fail.
    """
    settings = run.study.verification
    if settings.draws is not None:
        return drawn(run, choices, "verification", settings.draws, None)
    found = list(before) or begun(run, choices)
    wanted = wanted or [run.study.wanted] * len(choices)
    while rows := contest.worth_more(run, choices, found, wanted, without):
        ends = {k: (found[k].shape[2], contest.longer(run, choices[k], found[k])) for k in rows}
        first, last = least = min(ends.values())
        rows = [k for k in rows if ends[k] == least]
        lengthen(run, choices, found, rows, "verification", last - first)
    return found


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


def lengthen(
    run: StudyRun, choices: Sequence[Choice], made: list[Array], rows: Sequence[int], stage: str, length: int
) -> None:  # fmt: skip
    """So many points more of each replicate of some designs that are equally long; `made` as `made` returns it."""
    fresh = drawn(run, [choices[k] for k in rows], stage, length, made[rows[0]].shape[2])
    for k, one in zip(rows, fresh, strict=True):
        made[k] = np.concatenate([made[k], one], axis=2)


def drawn(
    run: StudyRun, choices: Sequence[Choice], stage: str, count: int, first: int | None = 0
) -> list[Array]:
    """f, whether beyond Hertz's range, and further responses of designs, (k, replicates, values) each: at `count` points from
    `first` on of each replicate; of as many independent draws, each a replicate, where that is None."""
    batches = [scattered(run, choice, count, stage, first) for choice in choices]
    shape = (count, 1) if first is None else (REPLICATES, count)
    values = np.concatenate([batch.values for batch in batches])
    points = Points(batches[0].names, values, batches[0].paths)
    records, responses = run.simulations.judged(points, stage)
    beyond = (records["flags"] & Flag.BEYOND_HERTZ) != 0
    found = np.stack([responses[0], beyond, *responses[1:]])
    return [part.reshape(len(found), *shape) for part in np.split(found, len(choices), axis=1)]


def estimates_of(run: StudyRun, choice: Choice, values: Array) -> list[Estimate]:
    """Mean, standard deviation, percentile, objectives and constraints of a design, from its simulations (k, replicates, n)."""
    percentile = quantile(values[0], QUANTILE, run.study.verification.confidence)
    return [*moments(values[0]), percentile, *contest.goals_of(run, choice, values)]


def nothing(run: StudyRun) -> Array:
    """No simulations yet: f, whether beyond Hertz's range, further responses, shape (k, replicates, 0)."""
    return np.empty((2 + len(run.study.further), REPLICATES, 0))


def results_of(run: StudyRun, choices: Sequence[Choice], made: Sequence[Array]) -> Result:
    """Results of designs from their simulations, shape (2, replicates, values) each.

    Arrays over the designs:
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

    def padded(found: list[float], count: int) -> list[float]:
        return found + [np.nan] * (count - len(found))

    for choice, whole, many in zip(choices, made, verdicts.rivals(choices), strict=True):
        values, beyond = whole[:2]
        failed = int(np.isnan(values).sum())
        row: dict[str, object] = {"samples": values.size, "failed": failed}
        row["beyond_hertz"] = int(beyond.sum())
        reaches = contest.reaches(settings, values)
        for name, one, reach in zip(("mean", "deviation"), moments(values), reaches, strict=True):
            row |= {name: one.value, f"{name}_error": one.error, f"{name}_reach": reach}
            row[f"{name}_shifts"] = one.shifts
        kept = run.study.case(choice.case).kept
        sure = verdicts.level(settings, many, values.size)
        percentile = quantile(values, QUANTILE, settings.confidence)
        estimates = contest.goals_of(run, choice, whole)
        certain = [goals.goal_value(goal, whole, choice.design, sure) for goal in kept]
        row |= {"percentile": percentile.value, "goal": padded([x.value for x in estimates], most)}
        for end in ("lower", "upper"):
            row[f"percentile_{end}"] = getattr(percentile, end)
            row[f"goal_{end}"] = padded([getattr(one, end) for one in estimates], most)
            row[f"sure_{end}"] = padded([getattr(one, end) for one in certain], held)
        unknown = [np.full(len(values), np.nan)] * (most - len(estimates))
        row["goal_shifts"] = [one.shifts for one in estimates] + unknown
        row["taken"] = padded([0.0] * len(kept), held)
        row["counted"] = padded([float(values.size)] * len(kept), held)
        row["beyond"] = padded([goals.beyond(goal, whole) for goal in kept], held)
        rows.append(row)
    found = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return verdicts.decided(run, choices, found)
