"""Where to evaluate next, so that the front of costly objectives is found with few designs.

Each objective gets a model of two scales: Kriging over everything that is known, and Kriging with
short length scales over what that one leaves. On the moments of a mechanism with clearances
one model alone took ripples of some percent, which decide the least deviation, for noise. Swarms search
what the models expect and what they do not rule out (their mean less one, two, three standard deviations): the
ends of what they find come first, then whatever lies farthest from all designs that are known.

Sources of the bound: D. D. Cox and S. John, "SDO: a statistical method for global optimization" (1997);
N. Srinivas et al., ICML 2010, arXiv:0912.3995; of two scales S. Ba and V. R. Joseph, "Composite Gaussian process models for
emulating expensive functions", Ann. Appl. Stat. 6 (2012), doi:10.1214/12-AOAS570.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.search.settings import SwarmSettings
from hpcclear.statistics.surrogate.fitting import fit_kriging

BOLD = (0.0, 1.0, 2.0, 3.0)
"""Standard deviations below the mean that each swarm believes in."""

ITERATIONS, PARTICLES = 30, 32
SHORT = (0.02, 0.3)
"""Length scales of the second model, in the unit cube."""

NEAR = 3e-3
"""Largest difference of coordinates, in the unit cube, below which two designs are one."""


class TwoScales:
    """Kriging over values, and over what it leaves of them.

    Parameters
    ----------
    designs : array, shape (n, d)
    values : array, shape (n,)
        NaN where an evaluation failed.
    bounds : array, shape (d, 2)
    rng : Generator

    Raises
    ------
    InputError
        Fewer than d + 3 finite values.
    """

    def __init__(
        self, designs: Array, values: Array, bounds: Array, rng: np.random.Generator
    ) -> None:
        wide = fit_kriging(designs, values, bounds, rng=rng, restarts=1)
        left = values - wide.predict(designs)
        fine = fit_kriging(designs, left, bounds, rng=rng, restarts=2, lengths=SHORT)
        self._models = wide, fine

    def predict(self, points: Array) -> Array:
        """What is expected at points, (n, d) to (n,)."""
        return self._models[0].predict(points) + self._models[1].predict(points)

    def variance(self, points: Array) -> Array:
        """What is not known of it, (n, d) to (n,)."""
        return self._models[0].variance(points) + self._models[1].variance(points)


def proposals(
    designs: Array,
    values: Array,
    bounds: Array,
    count: int,
    rng: np.random.Generator,
    excess: Array | None = None,
) -> Array:
    """Designs to evaluate next, at most `count`, shape (k, d).

    Parameters
    ----------
    designs : array, shape (n, d)
        Evaluated; at least d + 3 with finite values.
    values : array, shape (n, m)
        Their objectives, all minimised; NaN where they failed.
    bounds : array, shape (d, 2)
    count : int
    rng : Generator
        Advanced.
    excess : array, shape (n,), optional
        By how much each breaks the constraints, at most 0 where it keeps them; NaN where it failed.

    Raises
    ------
    InputError
        Too few designs for a model.
    """
    from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

    with threadpool_limits(limits=1, user_api="blas"):  # as in the fit: the same bits, and faster
        table = values if excess is None else np.column_stack([values, excess])
        models = [TwoScales(designs, column, bounds, rng) for column in table.T]
        fronts = [
            minimise(
                _believed(models, boldness, values.shape[1]),
                bounds,
                iterations=ITERATIONS,
                rng=rng,
                size=PARTICLES,
                settings=SwarmSettings(particles=PARTICLES),
                start=_best(designs, values, PARTICLES // 2, excess),
            )
            for boldness in BOLD
        ]
        fronts = [
            front for front in fronts if len(front.points)
        ]  # none where nothing keeps the constraints
    if not fronts:
        assert excess is not None  # only constraints leave a front without designs
        near = _nearer(designs, excess, bounds, rng)
        return _chosen(designs[:0], near, designs, bounds, count, count)
    ends = np.concatenate([front.points[front.values.argmin(axis=0)] for front in fronts])
    others = np.concatenate([front.points for front in fronts])
    most = (
        count if values.shape[1] == 2 else count // 2
    )  # between the ends of a surface there is more
    return _chosen(ends, others, designs, bounds, count, most)


def _nearer(
    designs: Array, excess: Array, bounds: Array, rng: np.random.Generator, count: int = 64
) -> Array:
    """Designs about the one that comes nearest to the constraints, a tenth of each range off it."""
    width = bounds[:, 1] - bounds[:, 0]
    steps = 0.1 * width * rng.standard_normal((count, len(width)))
    return np.clip(designs[np.nanargmin(excess)] + steps, bounds[:, 0], bounds[:, 1])


def _best(designs: Array, values: Array, count: int, excess: Array | None) -> Array:
    """Designs with the least sum of all objectives, each in units of its deviation; those that keep the constraints first."""
    scale = np.nanstd(values, axis=0)
    merit = (values / np.where(scale > 0.0, scale, 1.0)).sum(axis=1)
    if excess is not None:
        merit = np.where(excess <= 0.0, merit, np.nanmax(merit) + 1.0 + excess)
    return designs[np.argsort(merit, kind="stable")[:count]]  # NaN comes last


def _believed(
    models: Sequence[TwoScales], boldness: float, objectives: int
) -> Callable[[Array], Array | tuple[Array, Array]]:
    """Objectives as the models see them, less `boldness` standard deviations; with more models than objectives, what the last
    says of constraints besides."""

    def function(points: Array) -> Array | tuple[Array, Array]:
        means = [model.predict(points) for model in models]
        if boldness:
            reach = [boldness * np.sqrt(model.variance(points)) for model in models]
            means = [mean - off for mean, off in zip(means, reach, strict=True)]
        found = np.stack(means[:objectives], axis=1)
        return found if len(means) == objectives else (found, np.maximum(means[-1], 0.0))

    return function


def _chosen(
    ends: Array, others: Array, designs: Array, bounds: Array, count: int, most: int
) -> Array:
    """The ends, at most so many, then the others farthest from all that is known or chosen; none twice."""
    width = bounds[:, 1] - bounds[:, 0]
    known = list(designs / width)

    def distance(points: Array) -> Array:
        steps = np.abs(points[:, None] / width - np.array(known))
        return np.asarray(steps.max(axis=2).min(axis=1))

    chosen: list[Array] = []
    for point in ends:
        if len(chosen) < most and distance(point[None])[0] > NEAR:
            chosen.append(point)
            known.append(point / width)
    while len(chosen) < count:
        apart = distance(others)
        if apart.max() <= NEAR:
            break
        chosen.append(others[apart.argmax()])
        known.append(chosen[-1] / width)
    return np.reshape(chosen, (-1, len(width)))
