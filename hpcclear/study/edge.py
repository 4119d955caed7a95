"""The edge of what constraints allow: designs of the best first objective that just keep them, for sure.

A design of the search has some hundred simulations, from which a probability of 1e-3 is extrapolated
(`hpcclear.statistics.random.tail`). A model of such indices over designs knows which way is safer, but not where the threshold
is. So the best design that it allows is simulated until its probability is known, the model is shifted by what it was wrong
there, and the best design is sought anew (sequential optimisation and reliability assessment).

Along the edge an objective changes by little while designs change by much, and which way is better depends on the slopes of
the constraint there. So the search ends with designs next to the edge, on both sides of each variable.

Source: X. Du and W. Chen, "Sequential optimization and reliability assessment method for efficient probabilistic design",
J. Mech. Design 126 (2004) 225-233, doi:10.1115/1.1649968.
"""

from collections.abc import Callable, Mapping

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene.cases import Case
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.points import snapped
from hpcclear.scene.study import Study
from hpcclear.statistics.random.tail import of_share
from hpcclear.statistics.search.infill import TwoScales
from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.search.settings import SwarmSettings
from hpcclear.study import goals, rare, truth, verdicts
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun
from hpcclear.study.verdicts import Standing

ROUNDS = 4
"""Designs that are tried at the edge of a case, at most."""

AIM, LESS = 0.8, 0.75
"""Probability that is sought, over the largest that is allowed: so much below it can be shown; and what is sought of that after
a design that could not be decided."""

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


def simulations(study: Study) -> int:
    """Simulations of all rounds, at most."""
    each = truth.expected(study)
    return sum(
        ROUNDS * (each + verdicts.usual_in(case, study.verification)) for case in cases_of(study)
    )


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
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    names = run.study.design_variables(case.name)
    bounds, rng = _bounds(run, case), run.rng("edge", case.name, str(len(coordinates)))
    with threadpool_limits(limits=1, user_api="blas"):
        models = _models(run, case, coordinates, values, excess, rng)
        judged = _judge(run, case, *models, _gap(case, AIM))
        place = _best(judged, bounds, _first(coordinates, excess), rng)
    moves = np.diag(aside * (bounds[:, 1] - bounds[:, 0]))
    points = np.clip(np.vstack([place, place + moves, place - moves]), *bounds.T)
    return np.unique(snapped(run.study, names, points), axis=0)


def _bounds(run: StudyRun, case: Case) -> Array:
    """Of design variables, in sampling coordinates, (d, 2)."""
    region = box(run.scene, run.study.design_variables(case.name))
    return np.column_stack([region.lower, region.upper])


def _first(coordinates: Array, excess: Array) -> Array:
    """Designs that a search begins with: those that break constraints least."""
    return coordinates[np.argsort(excess, kind="stable")[: PARTICLES // 2]]


def _models(
    run: StudyRun, case: Case, coordinates: Array, values: Array, excess: Array, rng: np.random.Generator
) -> tuple[TwoScales, list[Predict]]:  # fmt: skip
    """What steers to the constraints, and the first two objectives, as functions of designs."""
    bounds = _bounds(run, case)
    model = TwoScales(coordinates, excess, bounds, rng)
    return model, [
        exact or TwoScales(coordinates, column, bounds, rng).predict
        for exact, column in zip(goals.exact_in(run.scene, case)[:2], values.T, strict=False)
    ]


def _judge(
    run: StudyRun, case: Case, model: TwoScales, objectives: list[Predict], off: float
) -> Judge:
    """Objectives of designs and by how much they break the constraints, which are shifted by `off`."""
    names = run.study.design_variables(case.name)

    def judged(points: Array) -> tuple[Array, Array]:
        points = snapped(run.study, names, points)
        least = np.column_stack([one(points) for one in objectives])
        return least, np.maximum(model.predict(points) + off, 0.0)

    return judged


def _of_case(
    run: StudyRun, case: Case, coordinates: Array, values: Array, excess: Array
) -> list[Choice]:
    from threadpoolctl import threadpool_limits

    names = run.study.design_variables(case.name)
    bounds, rng = _bounds(run, case), run.rng("edge", case.name)
    kept: list[Choice] = []
    shift, aim = 0.0, AIM
    try:
        with threadpool_limits(limits=1, user_api="blas"):
            model, objectives = _models(run, case, coordinates, values, excess, rng)
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
            guess = float(model.predict(place[None])[0])
        row = to_physical(run.scene, names, place[None])[0]
        choice = Choice("", case.name, dict(zip(names, row.tolist(), strict=True)))
        try:
            true = _simulated(run, choice)
        except InputError:  # it fails with all inputs, or makes no mechanism with some
            break
        standing = float(true["standing"][0, : len(case.kept)].max())
        now = _precise(case, true)
        if standing < Standing.BROKEN:
            kept.append(choice)
        clear = standing == Standing.KEPT and now <= -_gap(case, CLOSE)
        if clear and now > -_gap(case, NEAR):
            break
        if clear:
            safe = place, now
        else:
            beyond = place, now
        shift, aim = now - guess, aim * (LESS if standing == Standing.UNDECIDED else 1.0)
    return kept


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
