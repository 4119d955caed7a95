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
from hpcclear.study import contest, contributions, goals, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

FIRST = 512
"""Simulations of a design from which its accuracy is judged, as far as it may have so many."""

LOOK = 8
"""Points of each replicate of every verified design, at most; those that decide get more."""

QUANTILE = 0.95
"""Probability of staying below the percentile that is reported."""


def samples_of(run: StudyRun, choice: Choice, count: int, purpose: str = "verification") -> Points:
    """Independent samples of a design in all study variables.

    Every design of a case meets the same scatter, so that differences between designs are not
    noise.
    """
    return _of_design(run, choice, count, purpose, 0, None)


def scattered(
    run: StudyRun, choice: Choice, count: int, purpose: str = "verification", first: int = 0
) -> Points:
    """The points from `first` on of all replicates of a design, `count` of each, one replicate after the other."""
    return _of_design(run, choice, count, purpose, first, range(REPLICATES))


def _of_design(
    run: StudyRun,
    choice: Choice,
    count: int,
    purpose: str,
    first: int,
    replicate: Sequence[int] | None,
) -> Points:
    points = monte_carlo(
        run.scene,
        count,
        random=run.study.case(choice.case).random,
        design=dict(choice.design),
        purpose=purpose,
        first=first,
        replicate=replicate,
    )
    return run.simulations.filled(points.names, points.values)


def begun(run: StudyRun, choices: Sequence[Choice]) -> list[Array]:
    """The first points of each replicate of designs, (k, replicates, values) each as `made` returns them."""
    length = min(first_length(run.study.verification), search_length(run.study), LOOK)
    return looked_at(run, choices, "verification", "verification", length)


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
    settings, stage = run.study.verification, "verification"
    if settings.draws is not None:
        return drawn(run, choices, stage, stage, settings.draws)
    found = list(before) or begun(run, choices)
    wanted = wanted or [run.study.wanted] * len(choices)
    while rows := contest.worth_more(run, choices, found, wanted, without):
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


def estimates_of(run: StudyRun, choice: Choice, values: Array) -> list[Estimate | goals.GoalValue]:
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
    for choice, whole, many in zip(choices, made, verdicts.rivals(choices), strict=True):
        values, beyond = whole[:2]
        row: dict[str, object] = {
            "samples": values.size,
            "failed": int(np.isnan(values).sum()),
            "beyond_hertz": int(beyond.sum()),
        }
        reaches = contest.reaches(settings, values)
        for name, one, reach in zip(("mean", "deviation"), moments(values), reaches, strict=True):
            row |= {name: one.value, f"{name}_error": one.error, f"{name}_reach": reach}
            row[f"{name}_shifts"] = one.shifts
        found = quantile(values, QUANTILE, settings.confidence)
        row |= {"percentile": found.value, "percentile_lower": found.lower}
        row["percentile_upper"] = found.upper
        estimates = contest.goals_of(run, choice, whole)
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
