"""Rare failures of designs: probabilities too small for plain sampling, by importance sampling until they are decided.

Of a probability of 1e-4 a hundred thousand samples show ten. Where a constraint allows less than `RARE`, designs that plain
samples do not decide are sampled where they fail (`hpcclear.statistics.random.importance`), for all of them at once; longer and
longer while a verdict is open and `most_samples` allows. A few of their draws are taken again at a stricter tolerance, and what
that changes is part of the interval. Where plain and weighted samples contradict each other, both count.
"""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.asking import Found, all_answered
from hpcclear.base.errors import InputError
from hpcclear.base.verdict import Verdict, together
from hpcclear.scene.cases import Constraint
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import offsets
from hpcclear.statistics.random.importance import REPEATS, Density, Rare
from hpcclear.statistics.random.replicates import Limited
from hpcclear.study import goals, tolerance, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

NEGLIGIBLE = 0.05
"""Of the allowed probability: less of it is not looked at closely."""

LENGTH = 128
"""Draws of each repeat at first."""

STAGE = "verification"

_LEAST = 2.0**-54


class Failing(NamedTuple):
    """A design and the probability that it must keep small."""

    choice: Choice
    goal: Constraint
    before: tuple[int, int] = 0, 0
    """Failures of plain draws, and their number."""
    taken: float = 0.0
    """What the tolerance takes of it, by pairs of these."""


class FailureEstimate(NamedTuple):
    """What is known of such a probability: by itself, and as one of many."""

    own: Limited
    sure: Limited
    simulations: int
    draws: int
    """Draws behind the probability, without pilots."""
    taken: float
    """What the tolerance takes of it."""
    density: Density
    """What was drawn from."""


def decided(run: StudyRun, choices: Sequence[Choice]) -> Result:
    """What `hpcclear.study.tolerance.verified` says of designs, rare failures that are open decided as far as they can be, of
    designs that can be the best in an objective: the least of it first, until one keeps its constraints. Besides
    ``rare_samples``, (n,): the simulations that took."""
    true = tolerance.verified(run, choices)
    true["rare_samples"] = np.zeros(len(choices), np.int64)
    many, tried = verdicts.rivals(choices), set[int]()
    densities = dict[tuple[str, int], Density]()
    while rows := _promising(run, choices, true, tried):
        where = [
            (row, k, Failing(choices[row], goal, _before(run, choices[row], true, row, k), true["taken"][row, k]))
            for row in rows
            for k, goal in enumerate(run.study.case(choices[row].case).kept)
            if verdicts.rare(goal, run.study.verification)
            and true["verdict"][row, k] == Verdict.UNDECIDED
        ]  # fmt: skip
        tried |= set(rows)
        keys = [(one.choice.case, k) for _, k, one in where]
        asked, rivals = [one for *_, one in where], [many[row] for row, *_ in where]
        found = probabilities(run, asked, rivals, [densities.get(key) for key in keys])
        for key, (row, k, one), its in zip(keys, where, found, strict=True):
            _enter(run, true, row, k, one, its)
            if not its.density.plain:
                densities[key] = its.density
        verdicts.decided(run, choices, true)
    return true


def _promising(
    run: StudyRun, choices: Sequence[Choice], true: Result, tried: set[int]
) -> list[int]:
    """Of each case and objective the undecided design with the least of it of those not tried yet, if a rare failure may leave
    it open and none that keeps all constraints is less."""
    found = set[int]()
    for case in run.study.cases:
        rows = [k for k, one in enumerate(choices) if one.case == case.name]
        each = true["verdict"][rows, : len(case.kept)].astype(int).tolist()
        states = [together(one) for one in each]
        if not any(verdicts.rare(goal, run.study.verification) for goal in case.kept):
            continue
        for column in range(len(case.goals)):
            own = true["goal"][rows, column]
            kept = [x for x, state in zip(own, states, strict=True) if state is Verdict.HOLDS]
            less = [
                (x, row)
                for x, row, state in zip(own, rows, states, strict=True)
                if state is Verdict.UNDECIDED and row not in tried and x < min(kept, default=np.inf)
            ]
            if less:
                found.add(min(less)[1])
    return sorted(found)


def _enter(
    run: StudyRun, true: Result, row: int, k: int, one: Failing, its: FailureEstimate
) -> None:
    """Write what is known of a rare failure into the results of its design."""
    column = len(run.study.case(one.choice.case).goals) + k
    _replace(true, row, its.own, ("goal_lower", "goal_upper"), column)
    _replace(true, row, its.sure, ("sure_lower", "sure_upper"), k)
    ends = true["goal_lower"][row, column], true["goal_upper"][row, column]
    true["goal"][row, column] = np.clip(its.own.value, *ends)
    true["counted"][row, k], true["taken"][row, k] = its.draws, its.taken
    true["rare_samples"][row] += its.simulations


def _before(run: StudyRun, choice: Choice, true: Result, row: int, k: int) -> tuple[int, int]:
    """Failures of the plain draws of a design, by a constraint, and their number."""
    share = true["goal"][row, len(run.study.case(choice.case).goals) + k]
    draws = int(true["samples"][row] - true["failed"][row])
    return (round(float(share) * draws), draws) if np.isfinite(share) else (0, 0)


def _replace(true: Result, row: int, one: Limited, names: tuple[str, str], column: int) -> None:
    """Intervals by weighted samples in place of those by plain ones; both together where they do not meet."""
    lower, upper = (true[name][row, column] for name in names)
    apart = one.lower > upper or one.upper < lower
    ends = (min(one.lower, lower), max(one.upper, upper)) if apart else (one.lower, one.upper)
    true[names[0]][row, column], true[names[1]][row, column] = ends


def probabilities(
    run: StudyRun, asked: Sequence[Failing], many: Sequence[int], densities: Sequence[Density | None]
) -> list[FailureEstimate]:  # fmt: skip
    """Probabilities of designs, each until it is decided as one of `many`, known well enough, or too long; without pilots
    where `densities` of like designs are known."""
    rates = []
    for its, known in zip(asked, densities, strict=True):
        assert its.goal.limit is not None  # by validation
        size, negligible = len(run.study.case(its.choice.case).random), NEGLIGIBLE * its.goal.most
        rates.append(Rare(size, its.goal.limit, negligible, its.before, known))
    unknown = [k for k, one in enumerate(rates) if one.density is None]
    begun = [rates[k].prepared(run.rng("rare", STAGE, "pilot")) for k in unknown]
    answer(run, [asked[k] for k in unknown], begun, STAGE)  # all meet the same draws
    open_, round_ = list(range(len(asked))), 0
    while open_:
        going = []
        for one in (rates[k] for k in open_):  # all meet the same draws
            rngs = [run.rng("rare", STAGE, str(round_), str(k)) for k in range(REPEATS)]
            going.append(one.lengthened(max(one.f.shape[1], LENGTH), rngs))
        answer(run, [asked[k] for k in open_], going, STAGE)
        round_ += 1
        open_ = [
            k for k in open_
            if rates[k].begun_anew() or not _enough(run, asked[k], rates[k], many[k])
        ]  # fmt: skip
    _pair(run, asked, rates)
    return [
        FailureEstimate(
            _interval(its, one, run.study.verification.confidence),
            _interval(its, one, verdicts.level(run.study.verification, number, one.f.size)),
            one.simulations,
            one.draws,
            its.taken if one.plain else one.taken(its.goal.most),
            one.drawn_from,
        )
        for its, one, number in zip(asked, rates, many, strict=True)
    ]


def _interval(asked: Failing, rate: Rare, confidence: float) -> Limited:
    """With what the tolerance takes, which that of weighted draws has in it."""
    one, wider = rate.interval(confidence), asked.taken if rate.plain else 0.0
    return replace(one, lower=max(one.lower - wider, 0.0), upper=min(one.upper + wider, 1.0))


def _pair(run: StudyRun, asked: Sequence[Failing], rates: Sequence[Rare]) -> None:
    """Take a few draws of each probability that is known again at a stricter tolerance; of plain ones pairs are known."""
    scene, left = tolerance.stricter(run.scene)
    tight, rows = run.of(scene), [k for k, one in enumerate(rates) if one.known and not one.plain]
    answer(tight, [asked[k] for k in rows], [rates[k].paired(left) for k in rows], "pairs")
    run.simulations.next = tight.simulations.next


def _enough(run: StudyRun, one: Failing, rate: Rare, many: int) -> bool:
    settings, first = run.study.verification, LENGTH * REPEATS
    if rate.f.size >= first * 2 ** int(np.log2(max(settings.most_samples / first, 1.0))):
        return True
    sure = verdicts.level(settings, many, rate.f.size)
    found = verdicts.of_interval(one.goal, _interval(one, rate, sure), rate.f.size, sure)
    if found.verdict is not Verdict.UNDECIDED:
        return True
    return goals.accurate(one.goal, _interval(one, rate, settings.confidence), run.study.wanted)


def answer(
    run: StudyRun, asked: Sequence[Failing], going: Sequence[Generator[Array, Array, Found]], stage: str
) -> list[Found]:  # fmt: skip
    """What procedures of several designs find by f, all that they request at a time in one batch."""

    def f_of(wanted: Mapping[int, Array]) -> list[Array]:
        parts = simulated(run, [(asked[k].choice, u) for k, u in wanted.items()], stage)
        places = (max(asked[k].goal.place - 1, 0) for k in wanted)
        return [part[place] for part, place in zip(parts, places, strict=True)]

    return all_answered(going, f_of)


def simulated(run: StudyRun, where: Sequence[tuple[Choice, Array]], stage: str) -> list[Array]:
    """Responses of designs at standard normals, (k, n) each: f, and `Study.further`; NaN where it failed, or where inputs so
    far out make no mechanism."""
    makes, batches = [], []
    for choice, u in where:
        names, own = rows_of(run, choice, u)
        makes.append(good := _valid(run, names, own))
        batches.append(run.simulations.filled(names, own[good]))
    values = np.concatenate([one.values for one in batches])
    points = Points(batches[0].names, values, batches[0].paths)
    f = np.empty((1 + len(run.study.further), 0))
    if len(values):
        f = run.simulations.judged(points, stage)[1]
    parts = np.split(f, np.cumsum([len(one) for one in batches])[:-1], axis=1)
    found = []
    for good, part in zip(makes, parts, strict=True):
        whole = np.full((len(f), len(good)), np.nan)
        whole[:, good] = part
        found.append(whole)
    return found


def _valid(run: StudyRun, names: tuple[str, ...], values: Array) -> Booleans:
    """Which rows make a mechanism, (n,)."""
    try:
        run.simulations.filled(names, values)
    except InputError:
        if len(values) == 1:
            return np.zeros(1, bool)
        middle = len(values) // 2
        halves = (_valid(run, names, part) for part in (values[:middle], values[middle:]))
        return np.concatenate(list(halves))
    return np.ones(len(values), bool)


def rows_of(run: StudyRun, choice: Choice, u: Array) -> tuple[tuple[str, ...], Array]:
    """Names and values, (n, d), of a design at standard normals u, (n, random inputs)."""
    random = run.study.case(choice.case).random
    design = dict(choice.design)
    chances = list(np.clip(ndtr(u), _LEAST, 1.0 - 2.0 * _LEAST).T)
    moved = offsets(run.scene, random, chances, choice.design)
    for name, values in moved.items():
        row = run.study.random_input(name)
        centre = design.get(name, run.scene.number(row.paths[0]))
        design[name] = values if row.absolute else centre + values  # type: ignore[assignment]
    names = tuple(design)
    columns = [np.broadcast_to(design[name], len(u)) for name in names]
    return names, np.column_stack(columns)
