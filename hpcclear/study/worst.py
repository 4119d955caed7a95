"""worst.nc: the largest f of designs within the bounds of their random inputs, beside the statistics.

Tried are all corners of the box of the random inputs (of many inputs some), points of a Sobol sequence inside, and, round by
round, points about the largest values so far, nearer and nearer. f need not be monotone, and where it is rough no search ends:
the result is a lower limit of the worst case. Inputs without bounds are taken within `REACH` standard deviations. Inputs
that are correlated stay so.
"""

from collections.abc import Sequence
from math import isinf

import numpy as np
from scipy.special import ndtr, ndtri

from hpcclear.base import quantiles
from hpcclear.base.arrays import Array, Integers
from hpcclear.results import dataset
from hpcclear.scene import Scene
from hpcclear.scene.streams import sobol
from hpcclear.study import rare
from hpcclear.study.contributions import inputs_of
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import Result, StudyRun

REACH = 3.0
"""Standard deviations of a normal within which an input without bounds is taken: 99.73 % of its values."""

CORNERS, INSIDE = 64, 64
"""Corners at most, and points inside, that are tried first."""

STEPS = (0.3, 0.15, 0.08, 0.04, 0.02, 0.01)
"""Parts of the box by which the best points are moved, a round each."""

CENTRES, ABOUT = 4, 8
"""The best points in each round, and points about each."""

_LEAST = 2.0**-54


def simulations(scene: Scene) -> int:
    """Simulations of all designs at most."""
    study = scene.required_study
    inputs = max(len(case.random) for case in study.cases)
    each = min(2**inputs, CORNERS) + INSIDE + len(STEPS) * CENTRES * ABOUT
    return each * sum(len(case.goals) + study.verification.designs + 1 for case in study.cases)


def unbounded(law: quantiles.Quantiles) -> bool:
    """Whether a distribution has no bounds of its own."""
    if isinstance(law, quantiles.Scaled):
        return unbounded(law.law)
    if isinstance(law, quantiles.Normal):
        return isinf(law.reach)
    return isinstance(law, quantiles.Cut) and (isinf(law.lower) or isinf(law.upper))


def of_designs(run: StudyRun, choices: Sequence[Choice]) -> Result:
    """Search the worst case of designs, arrays over these.

    ``worst`` and ``worst_corner``: the largest f, and that at a corner; ``searched_at`` (n, inputs): where, as the values
    of the random inputs, SI, NaN for those of other cases; ``tried``: simulations. NaN or 0 of designs that are not shown.
    """
    names = inputs_of(run)
    result: Result = {name: np.full(len(choices), np.nan) for name in ("worst", "worst_corner")}
    result["searched_at"] = np.full((len(choices), len(names)), np.nan)
    result["tried"] = np.zeros(len(choices), np.int64)
    # all but ends, points of the front, the baseline
    hidden = (" averaged ", " best ", " candidate ", " paper ")
    shown = [k for k, one in enumerate(choices) if not any(word in one.name for word in hidden)]
    for case in run.study.cases:
        rows = [k for k in shown if choices[k].case == case.name]
        if rows:
            _of_case(run, [choices[k] for k in rows], rows, names, result)
    return result


def _of_case(
    run: StudyRun, choices: Sequence[Choice], rows: Sequence[int], names: list[str], result: Result
) -> None:
    random, rng = run.study.case(choices[0].case).random, run.rng("worst", choices[0].case)
    corners = _corners(len(random), rng)
    places = np.concatenate([corners, sobol(len(random), rng, 0, INSIDE)])
    met: list[Array] = [places] * len(choices)
    f = _simulated(run, choices, met)
    for k, row in enumerate(rows):
        result["worst_corner"][row] = _largest(f[k][: len(corners)])
    for step in STEPS:
        best = [one[_order(its)[:CENTRES]] for one, its in zip(met, f, strict=True)]
        fresh = [_about(one, step, rng) for one in best]
        values = _simulated(run, choices, fresh)
        met = [np.vstack(pair) for pair in zip(met, fresh, strict=True)]
        f = [np.append(before, now) for before, now in zip(f, values, strict=True)]
    columns = [names.index(name) for name in random]
    for k, row in enumerate(rows):
        result["worst"][row], result["tried"][row] = _largest(f[k]), len(f[k])
        if np.isfinite(result["worst"][row]):
            u = _normals(run, choices[k], met[k][_order(f[k])[:1]])
            own, there = rare.rows_of(run, choices[k], u)
            result["searched_at"][row, columns] = [there[0, own.index(name)] for name in random]


def _corners(dimensions: int, rng: np.random.Generator) -> Array:
    """Corners of the unit box, (n, d): all, or `CORNERS` in which each bound comes as often as the other."""
    if 2**dimensions <= CORNERS:
        codes = np.arange(2**dimensions)
        return ((codes[:, None] >> np.arange(dimensions)) & 1).astype(float)
    half = rng.integers(0, 2, (CORNERS // 2, dimensions)).astype(float)
    half[0] = 0.0
    return np.concatenate([half, 1.0 - half])


def _about(centres: Array, step: float, rng: np.random.Generator) -> Array:
    """Points about some in the unit box, a few coordinates of each moved."""
    points = np.repeat(centres, ABOUT, axis=0)
    moves = step * rng.uniform(-1.0, 1.0, points.shape) * (rng.random(points.shape) < 0.6)
    return np.clip(points + moves, 0.0, 1.0)


def _order(f: Array) -> Integers:
    """Places of values from the largest on, those that failed last."""
    return np.argsort(np.where(np.isfinite(f), -f, np.inf), kind="stable")


def _largest(f: Array) -> float:
    return float(np.nanmax(f)) if np.isfinite(f).any() else np.nan


def _simulated(run: StudyRun, choices: Sequence[Choice], places: Sequence[Array]) -> list[Array]:
    """f of designs at points of the unit box, (n, d) each."""
    where = [(one, _normals(run, one, place)) for one, place in zip(choices, places, strict=True)]
    return [responses[0] for responses in rare.simulated(run, where, "worst")]


def _normals(run: StudyRun, choice: Choice, places: Array) -> Array:
    """Points of the unit box as standard normals: 0 and 1 are the bounds of each input."""
    u = np.empty_like(places)
    for k, name in enumerate(run.study.case(choice.case).random):
        law = run.study.law(run.study.random_input(name), choice.design)
        least = ndtr(-REACH) if unbounded(law) else 0.0
        u[:, k] = ndtri(np.clip(least + places[:, k] * (1.0 - 2.0 * least), _LEAST, 1.0 - _LEAST))
    return u


def write(run: StudyRun, choices: Sequence[Choice], found: Result) -> None:
    """Write worst.nc; `found` of `of_designs`, (n, ...) each."""
    names = inputs_of(run)
    rows = [run.study.random_input(name) for name in names]
    data = dict(found)
    data["without_bounds"] = np.array([unbounded(run.study.law(row, {})) for row in rows], np.int8)
    data["input_unit"] = np.array([run.scene.unit(row.paths[0]) for row in rows])
    coords = {"design": np.array([one.name for one in choices]), "input": np.array(names)}
    content = dataset.dataset("worst", coords, data, objective=run.scene.objective)
    run.write(content)
