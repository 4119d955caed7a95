"""Simulated designs: mean, standard deviation and 95th percentile with confidence intervals."""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Flag
from hpcclear.scene.cases import Constraint
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.stages import REPLICATES, MomentAccuracy, Verification
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import Estimate, limits, moments, quantile
from hpcclear.statistics.search.certainty import Compared
from hpcclear.study import contributions, goals, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

FIRST = 512
"""Simulations of a design from which its accuracy is judged, as far as it may have so many."""

TIED = 0.4
"""Of the accuracy requested: designs that differ by less are one in an objective, and which is better need not be known."""

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
    """The first points of each replicate of designs, (k, replicates, values) each as `doubled` returns them."""
    made = [nothing(run)] * len(choices)
    length = first_length(run.study.verification)
    lengthen(run, choices, made, range(len(choices)), "verification", "verification", length)
    return made


def made(
    run: StudyRun,
    choices: Sequence[Choice],
    before: Sequence[Array] = (),
    wanted: Sequence[MomentAccuracy] = (),
) -> list[Array]:
    """f of designs, by as many simulations as the study requires, (2, replicates, values) each as `doubled` returns them.

    Raises
    ------
    InputError
        If all simulations fail.
    """
    settings, stage = run.study.verification, "verification"
    if settings.draws is not None:
        return drawn(run, choices, stage, stage, settings.draws)
    length, most = first_length(settings), settings.most_samples
    found = doubled(run, choices, stage, stage, length, most, before, wanted)
    return contested(run, choices, found, stage, stage)


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


def sequences(
    run: StudyRun, choices: Sequence[Choice], stage: str, purpose: str, length: int, most: int
) -> Result:
    """The same by scrambled Sobol sequences, doubled from `length` until accurate or beyond `most` simulations."""
    return results_of(run, choices, doubled(run, choices, stage, purpose, length, most))


def doubled(
    run: StudyRun,
    choices: Sequence[Choice],
    stage: str,
    purpose: str,
    length: int,
    most: int,
    before: Sequence[Array] = (),
    wanted: Sequence[MomentAccuracy] = (),
) -> list[Array]:
    """Objectives and whether beyond Hertz's range, (k, replicates, values) of each design: `length` points of each replicate,
    doubled until accurate (as the study or `wanted` of each requires) or beyond `most` simulations; `before` is continued."""
    wanted = wanted or [run.study.wanted] * len(choices)
    made = list(before) or [nothing(run)] * len(choices)
    many = verdicts.rivals(choices)
    while True:
        rows = [
            k for k, one in enumerate(made)
            if one.size == 0 or (2 * one[0].size <= most and not _accurate(run, choices[k], one, wanted[k], many[k]))
        ]  # fmt: skip
        if not rows:
            return made
        first = min(made[k].shape[2] for k in rows)  # a sequence is balanced at powers of two
        rows = [k for k in rows if made[k].shape[2] == first]
        lengthen(run, choices, made, rows, stage, purpose, first or length)


def lengthen(
    run: StudyRun,
    choices: Sequence[Choice],
    made: list[Array],
    rows: Sequence[int],
    stage: str,
    purpose: str,
    length: int,
) -> None:
    """So many points more of each replicate of some designs that are equally long; `made` as `doubled` returns it, shape
    (2, replicates, values) each."""
    first = made[rows[0]].shape[2]
    fresh = _values(run, [choices[k] for k in rows], stage, purpose, length, first)
    for k, one in zip(rows, fresh, strict=True):
        made[k] = np.concatenate([made[k], one], axis=2)


def contested(
    run: StudyRun, choices: Sequence[Choice], made: list[Array], stage: str, purpose: str
) -> list[Array]:
    """Designs doubled further while the ends of a front are not decided, the shortest first; `made`, shape (2, replicates,
    values) each, as `doubled` returns it."""
    settings = run.study.verification
    most = [min(one[0].size * settings.contest, settings.most_samples) for one in made]
    while True:
        rows = [k for k in _contenders(run, choices, made) if 2 * made[k][0].size <= most[k]]
        if not rows:
            return made
        length = min(made[k].shape[2] for k in rows)
        rows = [k for k in rows if made[k].shape[2] == length]
        lengthen(run, choices, made, rows, stage, purpose, length)


def _contenders(run: StudyRun, choices: Sequence[Choice], made: Sequence[Array]) -> list[int]:
    """Designs of the search that may be the best in an objective for all that is known, though not as good as the least to
    within `TIED`; and that least."""
    settings, found = run.study.verification, set[int]()
    for case in run.study.cases:
        rows = [
            k for k, one in enumerate(choices) if one.case == case.name and one.origin == "search"
        ]
        if not rows:
            continue
        estimates = [_goals(run, choices[k], made[k])[: len(case.goals)] for k in rows]
        values = np.array([[one.value for one in row] for row in estimates])
        shifts = np.moveaxis(np.array([[one.shifts for one in row] for row in estimates]), 1, 0)
        less = Compared(values, shifts, settings.confidence).less
        for column, goal in enumerate(case.goals):
            share, relative = goals.wanted(goal, run.study.wanted)
            own = values[:, column]
            if not np.isfinite(own).any():
                continue
            least = int(np.nanargmin(own))
            near = TIED * share * (abs(own[least]) if relative else 1.0)
            far = ~less[column][least] & (own > own[least] + near)
            found |= {rows[k] for k in np.flatnonzero(far)} | (
                {rows[least]} if far.any() else set()
            )
    return sorted(found)


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
    run: StudyRun, choice: Choice, values: Array, wanted: MomentAccuracy, many: int
) -> bool:
    """Whether all confidence intervals are as narrow as requested. A standard deviation of round-off is, and so is what
    significantly keeps or breaks its threshold, as one of `many` designs. Others are simulated further until decided."""
    settings, case = run.study.verification, run.study.case(choice.case)
    mean, deviation = (one.value for one in moments(values[0]))
    reach = _reaches(settings, values[0])
    good = reach[0] <= wanted.mean * abs(mean)
    good &= reach[1] <= wanted.deviation * max(deviation, 1e-9 * abs(mean))
    if good and not case.plain:
        good = all(
            goals.accurate(goal, one, wanted, 1.0 if goal.statistic == "exceedance" else CLOSE)
            or verdicts.settled(goal, values, choice, settings, many)
            if isinstance(goal, Constraint)
            else goals.accurate(goal, one, wanted)
            for goal, one in zip(
                (*case.goals, *case.kept), _goals(run, choice, values), strict=True
            )
            if not goal.exact and not (goal in case.kept and verdicts.rare(goal, settings))
        )
    return bool(good)


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
        and ``price`` (n, constraints): of `hpcclear.study.verdicts.decided`; ``excess`` (n,): of
        `hpcclear.study.goals.steered`; ``beyond`` (n, constraints): of `hpcclear.study.goals.beyond`; ``samples``, ``failed``,
        ``beyond_hertz``.
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
        row["excess"] = goals.steered(kept, whole, choice.design)
        row["beyond"] = [goals.beyond(goal, whole) for goal in kept] + missing
        row["sure_lower"] = [one.lower for one in certain] + missing
        row["sure_upper"] = [one.upper for one in certain] + missing
        rows.append(row)
    return verdicts.decided(
        run, choices, {name: np.array([row[name] for row in rows]) for name in rows[0]}
    )
