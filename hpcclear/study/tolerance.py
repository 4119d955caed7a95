"""Effect of the integration tolerance on verified designs: part of all their intervals, and of a requested accuracy.

The tolerance moves every sample, and no number of samples shows it. So a few points of each design are simulated again at a
stricter tolerance. Both of a pair meet the same scatter, so their means and standard deviations differ by what the tolerance
does. Few pairs of one design show little, but designs of a case are alike: each leans on the others as far as its own pairs
are noisy (`hpcclear.statistics.random.pooled`). The best designs of each case, its ends, get more pairs. Without an accuracy
(`study.accuracy`) all pairs take `COST` of the study; with one the samples have to meet what the tolerance leaves.

A confidence interval is widened by the bias, and by its error as an independent one. Quantiles and probabilities change as
they do if f is moved and stretched so that its mean and standard deviation change as those of the pairs.

Sources: M. B. Giles, "Multilevel Monte Carlo methods", Acta Numerica 24 (2015), doi:10.1017/S096249291500001X (bias and
variance of paired samples).
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.student import student
from hpcclear.base.verdict import Verdict
from hpcclear.scene import Scene
from hpcclear.scene.fields import LARGEST_COUNT
from hpcclear.scene.stages import REPLICATES, MomentAccuracy
from hpcclear.scene.study import Study
from hpcclear.statistics.random.pooled import together
from hpcclear.statistics.random.replicates import Estimate, moments, spread
from hpcclear.study import contest, contributions, goals, truth, verdicts, verification
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.simulations import loads_of

STRICTER, STRICTEST, STEPS = 100.0, 1e-14, 10
"""By how much the tolerance of pairs is stricter, how strict it may be, and how many times the steps a sample then has."""

FALL = 0.5
"""What a tolerance ten times stricter leaves of a bias. Medians of 80 designs are 0.8 from 1e-3 to 1e-4, where contacts and
stability keep steps short, then 0.7, 0.55 and 0.35 to 1e-7. What the stricter one leaves counts too."""

FEW = 4
"""Points of each replicate of every design that pairs are made of at first, as far as `COST` allows, at least one."""

HIDDEN = 0.25
"""Standard error of a bias, over the accuracy, that is small enough."""

ROOM = 0.75
"""Share of an accuracy from which on the tolerance dominates: the samples then have to meet the accuracy by themselves."""

TYPICAL, AT = (0.0025, 0.0075), 1e-4
"""Bias of mean and standard deviation that is typical at a tolerance, relative; at others by `FALL`. Medians of 45 designs of
nine mechanisms were 0.2 and 0.4 %, a quarter had more than 0.8 and 3 %. It counts where chaos hides the bias from few pairs."""

COST = 0.02
"""Of a study's simulations that pairs may take where no accuracy is requested."""

NOTHING = 1e-9
"""Share of the mean below which a standard deviation is round-off."""

FREE, LIMITS = (-np.inf, np.inf), {"exceedance": (0.0, 1.0), "deviation": (0.0, np.inf)}
"""Between which a statistic lies, whatever the tolerance may take."""


class Taken(NamedTuple):
    """What the tolerance takes of mean and standard deviation of responses of designs, f first: (n, responses, 2) each, over
    their sizes (`_sizes`)."""

    bias: Array
    error: Array
    """Standard error of `bias`."""
    freedom: int
    """Degrees of freedom of a design's own error."""


def simulations(study: Study, designs: int, others: int) -> int:
    """Simulations in pairs of so many designs, at the fewest, beside so many others."""
    settings, most = study.verification, _most(study, others)
    if settings.draws is not None:
        return designs * _of_draws(settings.draws, designs, most)
    return designs * REPLICATES * _first(truth.first_length(settings), designs, most)


def _of_draws(draws: int, designs: int, most: float) -> int:
    """Pairs of each design, of so many independent draws: as many as of sequences."""
    return min(REPLICATES * _first(draws // REPLICATES, designs, most), draws)


def _most(study: Study, others: int) -> float:
    """Simulations that pairs may take beside so many others."""
    return np.inf if study.paired else COST * others


def _first(length: int, designs: int, most: float) -> int:
    """Points of each replicate, of so many, that pairs are made of at first: a power of two."""
    few = 2 ** (max(min(FEW, length), 1).bit_length() - 1)
    while few > 1 and designs * REPLICATES * few > most:
        few //= 2
    return few


@lru_cache(maxsize=4)
def stricter(scene: Scene) -> tuple[Scene, float]:
    """The scene that pairs are simulated by, and what share of a bias is left there."""
    numerics = scene.numerics
    changes: dict[str, float] = {
        "numerics.max_steps": min(STEPS * numerics.max_steps, LARGEST_COUNT)
    }
    if numerics.target_error is not None:
        return scene.with_(changes | {"numerics.target_error": 0.5 * numerics.target_error}), 0.5
    rtol = max(numerics.rtol / STRICTER, STRICTEST)
    changes["numerics.rtol"] = rtol
    if numerics.atol is not None:
        changes["numerics.atol"] = numerics.atol * rtol / numerics.rtol
    return scene.with_(changes), FALL ** float(np.log10(numerics.rtol / rtol))


def verified(run: StudyRun, designs: Sequence[Choice]) -> Result:
    """What `truth.results_of` returns, with what the tolerance takes in all confidence intervals; besides ``tolerance`` and
    ``tolerance_error``, (n, 2): bias of mean and standard deviation by the tolerance, relative, and its standard error."""
    made = truth.begun(run, designs) if run.study.paired else truth.made(run, designs)
    most = _most(run.study, run.simulations.next // loads_of(run.scene))
    strict = _begun(run, designs, made, most)
    paired: set[int] = set()
    taken = _known(run, designs, made, strict)
    while fresh := sorted(set(_ends(run, designs, made)) - paired):
        taken = _lengthened(run, designs, made, strict, fresh, most)
        paired |= set(fresh)
        if run.study.paired:
            made = truth.made(run, designs, made, _left(run, taken))
    true, without = _widened(run, designs, made, taken), set[int]()
    while undone := _undone(run, designs, made, true) - without:
        without |= undone
        made = truth.made(run, designs, made, _left(run, taken), without)
        true = _widened(run, designs, made, taken)
    return true | contributions.of_designs(run, designs, made)


def _undone(
    run: StudyRun, designs: Sequence[Choice], made: Sequence[Array], true: Result
) -> set[int]:
    """Rows of the designs that keep their constraints by samples, but not significantly with what the tolerance takes."""
    settings, many, found = run.study.verification, verdicts.rivals(designs), set[int]()
    if settings.draws is not None:
        return found
    for k, choice in enumerate(designs):
        kept = run.study.case(choice.case).kept
        plain = [n for n, goal in enumerate(kept) if not verdicts.rare(goal, settings)]
        open_ = (true["verdict"][k, plain] == Verdict.UNDECIDED).any()
        if open_ and contest.shown(run, choice, made[k], many[k]) == 1.0:
            found.add(k)
    return found


def _ends(run: StudyRun, designs: Sequence[Choice], made: Sequence[Array]) -> list[int]:
    """Rows of the designs that are the ends of their cases, by what is known; none if all have as many pairs."""
    if run.study.verification.draws is not None:
        return []
    table = verification.named(run, designs, truth.results_of(run, designs, made))
    named = zip(table.choices, table.rows, strict=True)
    return [row for one, row in named if one.name in run.study.case(one.case).ends]


def _left(run: StudyRun, taken: Taken) -> list[MomentAccuracy]:
    """What the tolerance leaves the samples of each design of an accuracy; all of it where it takes too much."""
    wanted, found = run.study.wanted, []
    far = student(run.study.verification.confidence, taken.freedom)
    for bias, error in zip(abs(taken.bias[:, 0]), far * taken.error[:, 0], strict=True):
        asked = np.array([wanted.mean, wanted.deviation])
        rest = np.sqrt(np.maximum((asked - bias) ** 2 - error**2, 0.0))
        mean, deviation = np.where(bias + error < ROOM * asked, rest, asked).tolist()
        found.append(wanted.model_copy(update={"mean": mean, "deviation": deviation}))
    return found


def _begun(
    run: StudyRun, designs: Sequence[Choice], made: Sequence[Array], most: float
) -> list[Array]:
    """The first points of all designs at the stricter tolerance, (k, replicates, values) each."""
    draws, tight = run.study.verification.draws, run.of(stricter(run.scene)[0])
    if draws is None:
        count = _first(min(one.shape[2] for one in made), len(designs), most)
    else:
        count = _of_draws(draws, len(designs), most)
    strict = truth.drawn(tight, designs, "pairs", count, 0 if draws is None else None)
    run.simulations.next = tight.simulations.next
    return strict


def _lengthened(
    run: StudyRun,
    designs: Sequence[Choice],
    made: Sequence[Array],
    strict: list[Array],
    rows: Sequence[int],
    most: float,
) -> Taken:
    """What the tolerance takes, after more and more pairs of some designs: until it is known well enough there, or all points
    are paired, or pairs have cost enough."""
    while True:
        taken = _known(run, designs, made, strict)
        spent = sum(one[0].size for one in strict)
        length = strict[rows[0]].shape[2]
        more = min(contest.longer(run, designs[k], strict[k]) for k in rows) - length
        rows = [
            k for k in rows
            if length + more <= made[k].shape[2]
            and _hidden(run, designs[k], made[k], taken.error[k])
        ]  # fmt: skip
        if not rows or spent + len(rows) * REPLICATES * more > most:
            return taken
        tight = run.of(stricter(run.scene)[0])
        truth.lengthen(tight, designs, strict, rows, "pairs", more)
        run.simulations.next = tight.simulations.next


def _hidden(run: StudyRun, choice: Choice, whole: Array, error: Array) -> bool:
    """Whether what the tolerance takes is not known well enough yet, in what the case of a design requires."""
    wanted, case = run.study.wanted, run.study.case(choice.case)
    moved = _shares(run, choice, whole, np.zeros_like(error), error)[1][3:]
    estimates = contest.goals_of(run, choice, whole)
    for goal, one, far in zip((*case.goals, *case.kept), estimates, moved, strict=True):
        share, relative = goals.wanted(goal, wanted)
        if goal.statistic == "exceedance":
            if (error[0] > HIDDEN * np.array([wanted.mean, wanted.deviation])).any():
                return True
        elif not goal.exact and far > HIDDEN * share * (abs(one.value) if relative else 1.0):
            return True
    return False


def _known(
    run: StudyRun, designs: Sequence[Choice], made: Sequence[Array], strict: Sequence[Array]
) -> Taken:
    """What the tolerance takes of designs by all their pairs: values (k, replicates, n), and the first at the stricter one."""
    scene, left = run.scene, stricter(run.scene)[1]
    responses = [0, *range(2, len(made[0]))]  # between them is whether beyond Hertz's range
    apart = []
    for whole, tight in zip(made, strict, strict=True):
        ours = whole[:, : tight.shape[1], : tight.shape[2]]
        apart.append([_apart(ours[k], tight[k]) for k in responses])
    bias, error = np.moveaxis(np.array(apart) / (1.0 - left), 2, 0)
    for case in {choice.case for choice in designs}:
        rows = [k for k, choice in enumerate(designs) if choice.case == case]
        for place in np.ndindex(bias.shape[1:]):
            at = (rows, *place)
            bias[at], error[at] = together(bias[at], error[at], _typical(scene)[place[-1]])
    error = np.where(np.isfinite(error), error, _typical(scene))  # no pair shows it
    return Taken(np.nan_to_num(bias), error, strict[0].shape[1] - 1)


def _typical(scene: Scene) -> tuple[float, float]:
    """Bias of mean and standard deviation as a rule, relative."""
    numerics = scene.numerics
    if numerics.target_error is not None:
        size = numerics.target_error / TYPICAL[0]
    else:
        size = FALL ** float(np.log10(AT / numerics.rtol))
    return size * TYPICAL[0], size * TYPICAL[1]


def _apart(ours: Array, theirs: Array) -> tuple[Array, Array]:
    """By how much mean and standard deviation differ in paired values (replicates, n), over their sizes, and the standard
    errors: (2,) each."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    one, other = (moments(np.where(both, values, np.nan)) for values in (ours, theirs))
    bias, error = np.empty((2, 2))
    for k, size in enumerate(_sizes(*other)):
        scale = abs(size.value) or 1.0
        bias[k] = (one[k].value - other[k].value) / scale
        # the size is an estimate too: what is proportional to it has no error
        moved = one[k].shifts - other[k].shifts - bias[k] * np.sign(size.value) * size.shifts
        error[k] = spread(moved[None])[0] / scale
    return bias, error


def _sizes(mean: Estimate, deviation: Estimate) -> tuple[Estimate, Estimate]:
    """What errors of mean and standard deviation are relative to."""
    large, still = abs(mean.value) >= deviation.value, deviation.value <= NOTHING * abs(mean.value)
    return mean if large else deviation, mean if still else deviation


def _moved(whole: Array, taken: Array) -> Array:
    """Values of responses (k, replicates, n) with mean and standard deviation moved by (responses, 2) of their sizes."""
    found = whole.copy()
    for k, (shift, stretch) in zip((0, *range(2, len(whole))), taken, strict=True):
        mean, deviation = moments(whole[k])
        first, second = (abs(one.value) for one in _sizes(mean, deviation))
        steady = not deviation.value > NOTHING * abs(mean.value)
        factor = 0.0 if steady else stretch * second / deviation.value
        found[k] += shift * first + factor * (whole[k] - mean.value)
    return found


def _shares(run: StudyRun, choice: Choice, whole: Array, bias: Array, error: Array) -> Array:
    """Of each estimate of `truth.estimates_of` what the tolerance takes, and its standard error, (2, k)."""

    def off(taken: Array) -> Array:
        ends = [truth.estimates_of(run, choice, _moved(whole, x)) for x in (taken, -taken)]
        return np.array([0.5 * abs(a.value - b.value) for a, b in zip(*ends, strict=True)])

    return np.array([off(bias), np.hypot(off(error * [1.0, 0.0]), off(error * [0.0, 1.0]))])


def _widened(
    run: StudyRun, designs: Sequence[Choice], made: Sequence[Array], taken: Taken
) -> Result:
    """What `truth.results_of` returns, with what the tolerance takes of each design in all intervals."""
    true = truth.results_of(run, designs, made)
    settings, many = run.study.verification, verdicts.rivals(designs)
    true["tolerance"] = abs(taken.bias[:, 0])
    true["tolerance_error"] = taken.error[:, 0]
    far = student(settings.confidence, taken.freedom)
    for k, (choice, whole) in enumerate(zip(designs, made, strict=True)):
        bias, error = _shares(run, choice, whole, taken.bias[k], taken.error[k])
        for place, name in enumerate(("mean_reach", "deviation_reach")):
            true[name][k] = bias[place] + np.hypot(true[name][k], far * error[place])
        case = run.study.case(choice.case)
        count, first = len(bias) - 3, len(case.goals)
        least, most = np.array(
            [LIMITS.get(one.statistic or "", FREE) for one in (*case.goals, *case.kept)]
        ).T
        sure = student(verdicts.level(settings, many[k], whole[0].size), taken.freedom)
        found = true["goal"][k, :count]
        true["taken"][k, : count - first] = (bias + sure * error)[3 + first :]
        for name, values, part, times, limits in (
            ("percentile", true["percentile"][k : k + 1], slice(2, 3), far, FREE),
            ("goal", found, slice(3, None), far, (least, most)),
            ("sure", found[first:], slice(3 + first, None), sure, (least[first:], most[first:])),
        ):
            for end, sign in (("lower", -1.0), ("upper", 1.0)):
                ends = true[f"{name}_{end}"][k, ...].reshape(-1)[: len(values)]
                reach = np.hypot(ends - values, times * error[part])
                ends[:] = np.clip(values + sign * (bias[part] + reach), *limits)
    return verdicts.decided(run, designs, true)


def reached(run: StudyRun, true: Result, table: verification.NamedDesigns) -> tuple[str, list[str]]:
    """What designs that decide reached of the accuracy, in a sentence; and what a reader should know, a sentence each."""
    wanted = np.array([run.study.wanted.mean, run.study.wanted.deviation])
    moments = ("mean", "deviation")
    within = np.column_stack([true[f"{name}_reach"] / abs(true[name]) for name in moments])
    within = within[table.deciding]
    worst = np.nanmax(within, axis=0, initial=0.0)
    share, doubt = (np.nanmax(true[name], axis=0) for name in ("tolerance", "tolerance_error"))
    tight, _ = stricter(run.scene)
    numerics, level = tight.numerics, f"{100 * run.study.verification.confidence:.0f} %"
    pairs = f"target error {numerics.target_error:g}" if numerics.target_error else f"rtol {numerics.rtol:.0e}"  # fmt: skip
    target = f" (target: {_percents(wanted)})" if run.study.paired else ""
    text = (
        f"Largest half-widths at {level}: {_percents(worst)}{target}. The integration tolerance contributes "
        f"{_percents(share)}, by pairs at {pairs}; standard errors: {_percents(doubt)}."
    )
    limit = ROOM * (wanted if run.study.paired else worst)
    remarks, dominates = [], (share > limit).any()
    if dominates:
        tenths = max(np.ceil(np.log((share / limit).max() * 1.5) / -np.log(FALL)), 1.0)
        lower = "numerics.target_error"
        if run.scene.numerics.target_error is None:
            lower = f"numerics.rtol, to {run.scene.numerics.rtol / 10.0**tenths:.0e} say"
        much = f"it contributes {_percents(share)}{target}"
        remarks.append(f"The integration tolerance dominates: {much}. Lower {lower}.")
    elif run.study.paired and (doubt > 2.0 * HIDDEN * wanted).any():
        hidden = "Chaotic motion hides the error of the integration tolerance"
        remarks.append(f"{hidden}: its standard error is {_percents(doubt)}.")
    texts = verification.short_of_accuracy(run, table, true)
    rows = zip(table.choices, texts, table.recommended, strict=True)
    missed = "; ".join(f"{one.name}: {text}" for one, text, best in rows if text and best)
    if run.study.paired and missed and not dominates:
        short = f"The accuracy requested was not reached by {missed}"
        remarks.append(f"{short}. Raise study.verification.most_samples.")
    return text, remarks


def _percents(values: Array) -> str:
    mean, deviation = (f"{100 * one:.2g} %" for one in values)
    return f"{mean} of the mean and {deviation} of the standard deviation"
