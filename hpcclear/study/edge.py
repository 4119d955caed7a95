"""The edge of what constraints allow: designs of the best first objective that just keep them, for sure.

A design of the search has some hundred simulations, from which a probability of 1e-3 is extrapolated
(`hpcclear.statistics.random.tail`). A model of such indices over designs knows which way is safer, but not where the threshold
is. Along the edge an objective changes by little while designs change by much, and which way is better depends on the slopes of
the constraint there. So the search ends with designs next to the edge, on both sides of each variable.

Of probabilities of failure level and slopes are then sampled together, in smaller and smaller regions about the best design
(`hpcclear.study.nearby`). Where there are other constraints, the best design that the model allows is simulated until it is
decided, the model is shifted by what it was wrong there, and the best design is sought anew (sequential optimisation and
reliability assessment).

Source: X. Du and W. Chen, "Sequential optimization and reliability assessment method for efficient probabilistic design",
J. Mech. Design 126 (2004) 225-233, doi:10.1115/1.1649968.
"""

from collections.abc import Callable, Mapping

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.verdict import Verdict, together
from hpcclear.scene.cases import Case
from hpcclear.scene.points import snapped
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.statistics.random import importance
from hpcclear.statistics.random.indices import quadratic
from hpcclear.statistics.random.tail import of_share
from hpcclear.statistics.search.infill import TwoScales
from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.search.settings import SwarmSettings
from hpcclear.study import goals, nearby, rare, tried, truth, verdicts
from hpcclear.study.nearby import Nearby
from hpcclear.study.optimisation import Choice, chosen_in_all
from hpcclear.study.run import Result, StudyRun

ROUNDS = 4
"""Designs that are tried at the edge of a case, at most."""

AIM, LESS = 0.8, 0.75
"""Probability that is sought, over the largest that is allowed: so much below it can be shown; and what is sought of that after
a design that could not be decided."""

AIMS, LAST = (0.88, 0.78, 0.65), (0.05, 0.2)
"""The same of the designs that are verified where all constraints are probabilities of failure; and the range of one more: as
much as the simulations of a design can show, and no more than what holds if the model of indices is somewhat wrong or the
tolerance leaves twice the probability open."""

SURE = 2.0
"""Times the standard error that is expected there: few of the draws that show it carry most of it."""

TRIED, AGREE = 6, 0.3
"""There: designs that are looked at first, at most, and the error of the model of the search at one that is small enough."""

REACHES, DRAWS = (0.15, 0.08, 0.04, 0.015), (32, 32, 64, 64)
"""Half of a region over each range, the first and smaller ones, and draws of each of its designs."""

TURNS, MISSED = 8, 0.05
"""Regions at most, and how much the index of the best design may change in the last of them: some 15 % of a probability."""

FARTHEST = 4.0
"""Largest shortfall of an index that is modelled: what lies beyond is extrapolated."""

NEAR, CLOSE = 0.65, 0.9
"""Of the allowed probability: a design that significantly keeps it and has between these is near enough. Nearer to it the
verification, which has scatter of its own, may leave it open."""

SMALL = 0.012
"""Of the same for other statistics than probabilities: 0.24 % below the threshold is sought, then 0.5 % and more."""

ASIDE = 0.15, 0.1, 0.03
"""How far the designs next to the edge are from it, over each range, one turn after the other."""

PARTICLES, ITERATIONS = 48, 60
STEPS, AGAIN, LOCAL = (0.1, 0.03, 0.01, 0.003, 0.001), 16, 128
"""Parts of each range that the best design is moved by at last, how often it may be replaced at each, and by how many moves.
Along the edge some percent of a variable change the first objective by a thousandth."""

Judge = Callable[[Array], tuple[Array, Array]]
Predict = Callable[[Array], Array]


def cases_of(study: Study) -> list[Case]:
    """Cases with a constraint that simulations decide."""
    return [case for case in study.cases if any(not one.exact for one in case.kept)]


def of_failures(case: Case) -> bool:
    """Whether all constraints that simulations decide are probabilities of failure."""
    return all(one.statistic == "exceedance" for one in case.kept if not one.exact)


def simulations(study: Study) -> int:
    """Simulations of all rounds, at most."""
    each, looked = truth.expected(study), truth.search_length(study) * REPLICATES
    found = 0
    for case in cases_of(study):
        if of_failures(case):
            failures = sum(not one.exact for one in case.kept)
            found += TRIED * looked + failures * nearby.simulations(DRAWS, TURNS)
        else:
            found += ROUNDS * (each + verdicts.usual_in(case, study.verification))
    return found


def designs(study: Study) -> int:
    """Designs at the edge of all cases that are verified, at most."""
    return sum(len(AIMS) + 1 if of_failures(case) else ROUNDS for case in cases_of(study))


def approach(run: StudyRun, known: Mapping[str, tuple[Array, Array, Array]]) -> Result:
    """Designs at the edge of each case, from what the search knows of it.

    Parameters
    ----------
    known : mapping of case to arrays
        Sampling coordinates (n, d), what the case makes small (n, objectives), what steers to its constraints (n,).

    Returns
    -------
    dict of arrays
        ``case`` (k,) and ``design`` (k, variables of the optimisation, NaN where one is not the case's), without
        those that significantly break a constraint.
    """
    found: list[Choice] = []
    for case in cases_of(run.study):
        found += _of_case(run, case, *known[case.name])
    names = run.study.optimisation
    rows = [[one.design.get(name, np.nan) for name in names] for one in found]
    return {
        "case": np.array([one.case for one in found], "U64"),
        "design": np.reshape(rows, (-1, len(names))),
    }


def neighbours(
    run: StudyRun, case: Case, aside: float, coordinates: Array, values: Array, excess: Array
) -> Array:
    """Designs next to the best one at the edge, on both sides of each design variable, (k, d), from what the search knows
    (see `approach`).

    Raises
    ------
    InputError
        Too few designs that did not fail for a model.
    """
    from threadpoolctl import threadpool_limits

    names = run.study.design_variables(case.name)
    bounds, rng = tried.bounds(run, names), run.rng("edge", case.name, str(len(coordinates)))
    with threadpool_limits(limits=1, user_api="blas"):
        model = _steering(coordinates, excess, bounds, rng)
        objectives = _objectives(run, case, coordinates, values, rng)
        judged = _judge(run, case, model, objectives, _gap(case, AIM))
        place = _best(judged, bounds, _first(coordinates, excess), rng)
    moves = np.diag(aside * (bounds[:, 1] - bounds[:, 0]))
    points = np.clip(np.vstack([place, place + moves, place - moves]), *bounds.T)
    return np.unique(snapped(run.study, names, points), axis=0)


def _first(coordinates: Array, excess: Array) -> Array:
    """Designs that a search begins with: those that break constraints least."""
    return coordinates[np.argsort(excess, kind="stable")[: PARTICLES // 2]]


def _steering(
    coordinates: Array, excess: Array, bounds: Array, rng: np.random.Generator
) -> Predict:
    """What steers to the constraints as a function of designs: a polynomial, and a model of what that leaves."""
    near = np.clip(excess, -FARTHEST, FARTHEST)
    trend = quadratic(coordinates, near, bounds)
    model = TwoScales(coordinates, near - trend(coordinates), bounds, rng)
    return lambda points: trend(points) + model.predict(points)


def _objectives(
    run: StudyRun, case: Case, coordinates: Array, values: Array, rng: np.random.Generator
) -> list[Predict]:
    """The first two objectives as functions of designs."""
    bounds = tried.bounds(run, run.study.design_variables(case.name))
    return [
        exact or TwoScales(coordinates, column, bounds, rng).predict
        for exact, column in zip(goals.exact_in(run.scene, case)[:2], values.T, strict=False)
    ]


def _judge(
    run: StudyRun, case: Case, model: Predict, objectives: list[Predict], off: float
) -> Judge:
    """Objectives of designs and by how much they break the constraints, which are shifted by `off`."""
    names = run.study.design_variables(case.name)

    def judged(points: Array) -> tuple[Array, Array]:
        points = snapped(run.study, names, points)
        least = np.column_stack([one(points) for one in objectives])
        return least, np.maximum(model(points) + off, 0.0)

    return judged


def _of_case(
    run: StudyRun, case: Case, coordinates: Array, values: Array, excess: Array
) -> list[Choice]:
    from threadpoolctl import threadpool_limits

    names = run.study.design_variables(case.name)
    bounds, rng = tried.bounds(run, names), run.rng("edge", case.name)
    kept: list[Choice] = []
    shift, aim = 0.0, AIM
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            if of_failures(case):
                return _of_failures(run, case, coordinates, values, excess)
            model = _steering(coordinates, excess, bounds, rng)
            objectives = _objectives(run, case, coordinates, values, rng)
    except InputError:  # too few designs that did not fail for a model
        return kept
    start = _first(coordinates, excess)
    safe: tuple[Array, float] | None = None
    beyond: tuple[Array, float] | None = None
    for _ in range(ROUNDS):
        judged = _judge(run, case, model, objectives, shift + _gap(case, aim))
        with threadpool_limits(limits=1, user_api="blas"):
            place = _best(judged, bounds, start, rng)
            if safe is not None and beyond is not None:
                place = _between(safe, beyond, -_gap(case, aim))
            place = snapped(run.study, names, place[None])[0]
            guess = float(model(place[None])[0])
        choice = tried.choices(run, case.name, place[None])[0]
        try:
            true = _simulated(run, choice)
        except InputError:  # it fails with all inputs, or makes no mechanism with some
            break
        verdict = together(true["verdict"][0, : len(case.kept)].astype(int).tolist())
        now = _precise(case, true)
        if verdict is not Verdict.FAILS:
            kept.append(choice)
        clear = verdict is Verdict.HOLDS and now <= -_gap(case, CLOSE)
        if clear and now > -_gap(case, NEAR):
            break
        if clear:
            safe = place, now
        else:
            beyond = place, now
        shift, aim = now - guess, aim * (LESS if verdict is Verdict.UNDECIDED else 1.0)
    return kept


def _of_failures(
    run: StudyRun, case: Case, coordinates: Array, values: Array, excess: Array
) -> list[Choice]:
    """The same where all constraints are probabilities of failure: the draws of many designs next to each other make one
    model of their indices (`hpcclear.study.nearby`). It begins where the search takes the best design to be; each turn goes on
    from the best design of the last one, in a smaller region if that was inside of it."""
    names = run.study.design_variables(case.name)
    bounds, rng = tried.bounds(run, names), run.rng("edge", case.name)
    near = Nearby(run, case, bounds, rng)
    objectives = _objectives(run, case, coordinates, values, rng)
    start = _first(coordinates, excess)

    def best(model: Predict, region: Array, first: Array, aim: float) -> Array:
        judged = _judge(run, case, model, objectives, _gap(case, aim))
        place = _best(judged, region, np.clip(first, *region.T), rng)
        return snapped(run.study, names, place[None])[0]

    for _ in range(TRIED):
        guess = _steering(coordinates, excess, bounds, rng)
        place = best(guess, bounds, start, AIM)
        true = _looked_at(run, case, place)
        if abs(true - guess(place[None])[0]) < AGREE:
            break
        coordinates, excess = np.vstack([coordinates, place]), np.append(excess, true)
    step, last = 0, len(REACHES) - 1
    for _ in range(TURNS):
        near.draw(place, REACHES[step], guess, DRAWS[step])
        missed = abs(near.shortfall(place[None]) - guess(place[None]))[0]
        guess = near.fixed()
        place = best(guess, near.region, place[None], AIM)
        broken = guess(place[None])[0] > 0.0
        if step == last and missed < MISSED and not broken:
            break
        if broken:
            step = max(step - 1, 0)
        elif not near.at_end(place):
            step = min(step + 1, last)
    error = near.error(rare.most_draws(run.study.verification))
    aims = *AIMS, shown(run.study, error)
    points = np.array([best(guess, near.region, place[None], aim) for aim in aims])
    return tried.choices(run, case.name, points)


def shown(study: Study, error: float) -> float:
    """Probability over the largest that is allowed which is shown to keep it, by its relative standard error."""
    settings = study.verification
    many = sum(chosen_in_all(study)) // len(study.cases) + len(AIMS)
    sure = verdicts.level(settings, many, settings.most_samples)
    return float(np.clip(1.0 / importance.reach(SURE * error, sure), *LAST))


def _looked_at(run: StudyRun, case: Case, place: Array) -> float:
    """What steers to the constraints of a design, by as many simulations as the search gives one."""
    count = truth.search_length(run.study)
    choice = tried.choices(run, case.name, place[None])[0]
    found = truth.sequences(run, [choice], "edge", "search", count, count * REPLICATES)
    return float(found["excess"][0])


def _between(safe: tuple[Array, float], beyond: tuple[Array, float], sought: float) -> Array:
    """The design between two on both sides of the edge: what steers to the constraints is as sought there, if it is linear."""
    part = (sought - safe[1]) / (beyond[1] - safe[1]) if beyond[1] > safe[1] else 0.5
    return np.asarray(safe[0] + np.clip(part, 0.1, 0.9) * (beyond[0] - safe[0]))


def _best(judged: Judge, bounds: Array, start: Array, rng: np.random.Generator) -> Array:
    """The design with the least first objective of those allowed, or the one that comes nearest, (d,)."""
    settings = SwarmSettings(particles=PARTICLES)
    front = minimise(
        judged,
        bounds,
        iterations=ITERATIONS,
        rng=rng,
        size=PARTICLES,
        settings=settings,
        start=start,
    )
    points = np.concatenate([front.points, start])
    place = _least(judged, points)
    width = bounds[:, 1] - bounds[:, 0]
    for step in np.repeat(STEPS, AGAIN):
        moves = step * width * rng.uniform(-1.0, 1.0, (LOCAL, len(width)))
        moves *= rng.random(moves.shape) < 0.7  # along some axes only, so that bounds are kept
        place = _least(
            judged,
            np.concatenate([place[None], np.clip(place + moves, bounds[:, 0], bounds[:, 1])]),
        )
    return place


def _least(judged: Judge, points: Array) -> Array:
    values, broken = judged(points)
    return np.asarray(points[np.lexsort((values[:, -1], values[:, 0], broken))[0]])


def _gap(case: Case, share: float) -> float:
    """How much larger the index of a share of the allowed probability is, at most over the constraints of a case; of other
    statistics, whose errors are small, `SMALL` times the rest, relative to the threshold."""
    return max(
        of_share(share * one.most) - of_share(one.most)
        if one.statistic == "exceedance" and one.most > 0.0
        else SMALL * (1.0 - share)
        for one in case.kept
    )


def _simulated(run: StudyRun, choice: Choice) -> Result:
    """A design, simulated until its constraints are decided, on scatter of its own."""
    settings = run.study.verification
    length = truth.first_length(settings)
    if settings.draws is not None:
        length = truth.scrambled_length(settings.draws)
    most = settings.most_samples if settings.draws is None else settings.draws
    true = truth.sequences(run, [choice], "edge", "edge", length, most)
    return rare.decided(run, [choice], true, "edge")


def _precise(case: Case, true: Result) -> float:
    """What steers to the constraints, from the probabilities themselves where some exceedances were met."""
    values = true["goal"][0, len(case.goals) :]
    found = []
    for goal, value in zip(case.kept, values, strict=False):
        if goal.statistic != "exceedance":
            found.append(float(goals.excess([goal], np.array([[value]]))[0]))
        elif value > 0.0:
            found.append(of_share(goal.most) - of_share(value))
        else:
            found.append(float(true["excess"][0]))
    return max(found)


def choices_of(run: StudyRun, found: Result) -> list[Choice]:
    """The designs of `approach`."""
    chosen = []
    for case, row in zip(found["case"], found["design"], strict=True):
        own = run.study.design_variables(str(case))
        design = {n: float(x) for n, x in zip(run.study.optimisation, row, strict=True) if n in own}
        chosen.append(Choice("", str(case), design))
    return chosen
