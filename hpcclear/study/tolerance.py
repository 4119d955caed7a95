"""Effect of the integration tolerance on verified designs: part of all their intervals, and of a requested accuracy.

The tolerance moves every sample, and no number of samples shows it. So the best designs of each case, its ends, are simulated
again at a stricter tolerance, at the same points. Both of a pair meet the same scatter, so their moments differ by what the
tolerance does. That is added to all confidence intervals of the case. With `study.accuracy`, the samples have to meet what it
leaves; elsewhere pairs take no more than `COST` of the study.

Sources: M. B. Giles, "Multilevel Monte Carlo methods", Acta Numerica 24 (2015), doi:10.1017/S096249291500001X (bias and
variance of paired samples).
"""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene import Scene
from hpcclear.scene.stages import REPLICATES, MomentAccuracy
from hpcclear.scene.study import Study
from hpcclear.statistics.random.replicates import spread
from hpcclear.study import goals, truth, verdicts, verification
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

STRICTER, STRICTEST = 100.0, 1e-14
"""By how much the tolerance of pairs is stricter, and how strict it may be."""

FALL = 0.5
"""What a tolerance ten times stricter leaves of a bias. Medians of 80 designs are 0.8 from 1e-3 to 1e-4, where contacts and
stability keep steps short, then 0.7, 0.55 and 0.35 to 1e-7. What the stricter one leaves counts too."""

FIRST, LEAST = 4, 4
"""Pairs are made of one in so many of a design's points at first, and of so many of each replicate at least: where few motions
go another way, fewer may miss them all."""

HIDDEN = 0.25
"""Standard error of a bias, over the accuracy, that is small enough."""

ROOM = 0.75
"""Share of an accuracy from which on the tolerance dominates: the samples then have to meet the accuracy by themselves."""

COST = 0.02
"""Of a study's simulations that pairs may take where no accuracy is requested, beyond the first of them."""

DRAWS = 16
"""Of independent draws pairs are made of one in so many, and of so many at least."""

NOTHING = 1e-9
"""Share of the mean below which a standard deviation is round-off."""

Taken = tuple[Array, Array]
"""Of a design, (k,) each: what the tolerance takes of each estimate of `truth.estimates_of`, without what chance made; and
the standard error."""


def simulations(study: Study) -> int:
    """Simulations in pairs, at the fewest."""
    draws = study.verification.draws
    if draws is not None:
        return goals.ends_in_all(study) * _of_draws(draws)
    return goals.ends_in_all(study) * REPLICATES * _first(truth.first_length(study.verification))


def _of_draws(draws: int) -> int:
    return min(max(draws // DRAWS, DRAWS), draws)


def stricter(scene: Scene) -> tuple[Scene, float]:
    """The scene that pairs are simulated by, and what share of a bias is left there."""
    numerics = scene.numerics
    if numerics.target_error is not None:
        return scene.with_({"numerics.target_error": 0.5 * numerics.target_error}), 0.5
    rtol = max(numerics.rtol / STRICTER, STRICTEST)
    changes = {"numerics.rtol": rtol}
    if numerics.atol is not None:
        changes["numerics.atol"] = numerics.atol * rtol / numerics.rtol
    return scene.with_(changes), FALL ** float(np.log10(numerics.rtol / rtol))


def verified(run: StudyRun, designs: Sequence[Choice]) -> Result:
    """What `truth.results_of` returns, with what the tolerance takes in all confidence intervals.

    Returns
    -------
    dict of arrays over the designs
        Besides ``tolerance`` and ``tolerance_error``, (n, 2): largest relative error of mean and standard deviation by the
        tolerance, of the designs of its case; and its standard error.
    """
    made = truth.begun(run, designs) if run.study.paired else truth.made(run, designs)
    taken: dict[int, Taken] = {}
    while fresh := sorted(set(_ends(run, designs, made)) - set(taken)):
        taken |= _taken(run, designs, made, fresh)
        if run.study.paired:
            made = truth.made(run, designs, made, _left(run.study.wanted, list(taken.values())))
    true = _widened(run, designs, truth.results_of(run, designs, made), taken)
    return true | truth.explained(run, designs, made)


def _ends(run: StudyRun, designs: Sequence[Choice], made: Sequence[Array]) -> list[int]:
    """Rows of the designs that are the ends of their cases, by what is known."""
    table = verification.named(run, designs, truth.results_of(run, designs, made))
    named = zip(table.choices, table.rows, strict=True)
    return [row for one, row in named if one.name in run.study.case(one.case).ends]


def _left(wanted: MomentAccuracy, taken: Sequence[Taken]) -> MomentAccuracy:
    """What the tolerance leaves the samples of an accuracy."""
    share = np.max([one[0][:2] for one in taken], axis=0)
    asked = np.array([wanted.mean, wanted.deviation])
    share = np.where(share < ROOM * asked, share, 0.0)
    mean, deviation = (asked - share).tolist()
    return wanted.model_copy(update={"mean": mean, "deviation": deviation})


def _first(length: int) -> int:
    """Points of each replicate that pairs are made of at first, of so many."""
    return min(max(length // FIRST, LEAST), length)


def _taken(
    run: StudyRun, designs: Sequence[Choice], made: Sequence[Array], rows: Sequence[int]
) -> dict[int, Taken]:
    """What the tolerance takes of some designs: by more and more of their points until that is known well enough, or all are
    paired, or pairs have cost enough."""
    scene, left = stricter(run.scene)
    tight, draws = run.of(scene), run.study.verification.draws
    if draws is None:
        strict = _sequences(run, tight, designs, made, rows)
    else:
        chosen = [designs[k] for k in rows]
        strict = dict(
            zip(
                rows,
                truth.drawn(tight, chosen, "pairs", "verification", _of_draws(draws)),
                strict=True,
            )
        )
    run.simulations.next = tight.simulations.next
    return {k: _known(run, designs[k], made[k], strict[k], left) for k in rows}


def _sequences(
    run: StudyRun,
    tight: StudyRun,
    designs: Sequence[Choice],
    made: Sequence[Array],
    rows: Sequence[int],
) -> dict[int, Array]:
    """Points of each replicate of some designs at the stricter tolerance, (k, replicates, values) each."""
    asked = HIDDEN * np.array([run.study.wanted.mean, run.study.wanted.deviation])
    strict = [truth.nothing(run)] * len(designs)
    open_, length = list(rows), _first(min(made[k].shape[2] for k in rows))
    _, left = stricter(run.scene)
    most = np.inf if run.study.paired else COST * run.simulations.next
    spent = 0
    while open_:
        more = length - strict[open_[0]].shape[2]
        truth.lengthen(tight, designs, strict, open_, "pairs", "verification", more)
        spent += len(open_) * REPLICATES * more
        known = {k: _known(run, designs[k], made[k], strict[k], left)[1] for k in open_}
        length *= 2
        open_ = [
            k for k in open_
            if (known[k][:2] > asked).any() and length <= made[k].shape[2] and 2 * spent <= most
        ]  # fmt: skip
    return {k: strict[k] for k in rows}


def _known(run: StudyRun, choice: Choice, made: Array, strict: Array, left: float) -> Taken:
    """What the tolerance takes of a design, from values (k, replicates, n) and the first of them at the stricter one."""
    _, replicates, length = strict.shape
    bias, error = _apart(run, choice, made[:, :replicates, :length], strict)
    bias, error = bias / (1.0 - left), error / (1.0 - left)
    # a bias that chance may have made counts for nothing
    return np.nan_to_num(np.sqrt(np.maximum(bias**2 - error**2, 0.0))), error


def _apart(run: StudyRun, choice: Choice, ours: Array, theirs: Array) -> Taken:
    """By how much the results of a design differs in paired values (k, replicates, n), and the standard errors."""
    both = np.isfinite(ours) & np.isfinite(theirs)
    one, other = (
        truth.estimates_of(run, choice, np.where(both, x, np.nan)) for x in (ours, theirs)
    )
    scale = _scales(run, choice, np.array([one.value for one in other]))
    bias = np.array([a.value - b.value for a, b in zip(one, other, strict=True)]) / scale
    shifts = np.array([a.shifts - b.shifts for a, b in zip(one, other, strict=True)])
    return bias, spread(shifts) / scale


def _scales(run: StudyRun, choice: Choice, values: Array) -> Array:
    """What errors of the results of a design are relative to: (k,) as `truth.estimates_of` returns them."""
    case, scale = run.study.case(choice.case), np.abs(values)
    scale[1] = max(scale[1], NOTHING * scale[0])
    for k, goal in enumerate((*case.goals, *case.kept), 3):
        if not goals.wanted(goal, run.study.wanted)[1]:
            scale[k] = 1.0
    return np.where(scale > 0.0, scale, 1.0)


def _widened(
    run: StudyRun, designs: Sequence[Choice], true: Result, taken: dict[int, Taken]
) -> Result:
    """All intervals with what the tolerance takes, the worst of the ends of a case for all its designs."""
    true["tolerance"], true["tolerance_error"] = np.zeros((2, len(designs), 2))
    for k, choice in enumerate(designs):
        ends = [one for row, one in taken.items() if designs[row].case == choice.case]
        if not ends:
            continue
        share, error = (np.max([one[part] for one in ends], axis=0) for part in (0, 1))
        true["tolerance"][k], true["tolerance_error"][k] = share[:2], error[:2]
        count, first = len(share) - 3, len(run.study.case(choice.case).goals)
        values = np.array(
            [true[name][k] for name in ("mean", "deviation", "percentile")]
            + true["goal"][k, :count].tolist()
        )
        wider = share * _scales(run, choice, values)
        true["taken"][k, : count - first] = wider[3 + first :]
        for name, more in zip(("mean_reach", "deviation_reach"), wider[:2], strict=True):
            true[name][k] += more
        for lower, upper, value, more in (
            (true["percentile_lower"][k:], true["percentile_upper"][k:], values[2:3], wider[2:3]),
            (true["goal_lower"][k], true["goal_upper"][k], values[3:], wider[3:]),
            (true["sure_lower"][k], true["sure_upper"][k], values[3 + first :], wider[3 + first :]),
        ):
            number = len(value)
            lower[:number] -= more
            upper[:number] += more
    return verdicts.decided(run, designs, true)


def reached(run: StudyRun, true: Result, names: Sequence[str]) -> tuple[str, list[str]]:
    """What verified designs reached of the accuracy, in a sentence; and what a reader should know, a sentence each."""
    wanted = np.array([run.study.wanted.mean, run.study.wanted.deviation])
    moments = ("mean", "deviation")
    within = np.column_stack([true[f"{name}_reach"] / abs(true[name]) for name in moments])
    worst = np.nanmax(within, axis=0, initial=0.0)
    share, doubt = (np.nanmax(true[name], axis=0) for name in ("tolerance", "tolerance_error"))
    tight, _ = stricter(run.scene)
    numerics, level = tight.numerics, f"{run.study.verification.confidence:.0%}"
    pairs = f"target error {numerics.target_error:g}" if numerics.target_error else f"rtol {numerics.rtol:.0e}"  # fmt: skip
    target = f" (target: {_shares(wanted)})" if run.study.paired else ""
    text = (
        f"Largest half-widths at {level}: {_shares(worst)}{target}. The integration tolerance contributes "
        f"{_shares(share)}, by pairs at {pairs}."
    )
    limit = ROOM * (wanted if run.study.paired else worst)
    remarks = []
    if (share > limit).any():
        tenths = max(np.ceil(np.log((share / limit).max() * 1.5) / -np.log(FALL)), 1.0)
        lower = "numerics.target_error"
        if run.scene.numerics.target_error is None:
            lower = f"numerics.rtol, to {run.scene.numerics.rtol / 10.0**tenths:.0e} say"
        remarks.append(
            f"The integration tolerance dominates: it contributes {_shares(share)}{target}. Lower {lower}."
        )
    elif run.study.paired and (doubt > 2.0 * HIDDEN * wanted).any():
        remarks.append(
            f"Chaotic motion hides the error of the integration tolerance: its standard error is {_shares(doubt)}."
        )
    missed = [
        name for name, row in zip(names, within, strict=True) if not (row <= 1.0001 * wanted).all()
    ]
    if run.study.paired and missed and not (share > limit).any():
        remarks.append(
            f"{len(missed)} of {len(names)} designs did not reach the target, {missed[0]} among them. "
            "Raise study.verification.most_samples."
        )
    return text, remarks


def _shares(values: Array) -> str:
    return (
        f"{100 * values[0]:.2g} % of the mean and {100 * values[1]:.2g} % of the standard deviation"
    )
