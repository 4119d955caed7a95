"""Where to evaluate next, so that the front of costly objectives is found with few designs.

Each objective gets a model of two scales: Kriging over everything that is known, and Kriging with
short length scales over what that one leaves. On the moments of a mechanism with clearances
one model alone took ripples of some percent, which decide the least standard deviation, for noise. Swarms search
what the models expect and what they do not rule out (their mean less one, two, three standard deviations): the
ends of what they find come first, then the same near the designs that are believed to be the ends, then whatever lies
farthest from all designs that are known. Values have errors: believed of a design is what the model makes of all of them,
not its own lucky one.

Sources of the bound: D. D. Cox and S. John, "SDO: a statistical method for global optimization" (1997);
N. Srinivas et al., ICML 2010, arXiv:0912.3995; of two scales S. Ba and V. R. Joseph, "Composite Gaussian process models for
emulating expensive functions", Ann. Appl. Stat. 6 (2012), doi:10.1214/12-AOAS570.
"""

from collections.abc import Callable, Sequence

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.statistics.search.mopso import minimise
from hpcclear.statistics.search.settings import SwarmSettings
from hpcclear.statistics.surrogate.fitting import fit_kriging

BOLD = (0.0, 1.0, 2.0, 3.0)
"""Standard deviations below the mean that each swarm believes in."""

NEARBY = 1.0, 3.0
"""The same, near the designs that are believed to be the ends."""

LOCAL, CANDIDATES = 0.1, 512
"""How near that is, as a part of each range, and how many designs are looked at."""

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
    snap: Callable[[Array], Array] = np.asarray,
) -> Array:
    """Designs to evaluate next, at most `count`, shape (k, d).

    Parameters
    ----------
    designs : array, shape (n, d)
        Evaluated; at least d + 3 with finite values.
    values : array, shape (n, m)
        Their objectives, all minimised; NaN where they failed.
    bounds : array, shape (d, 2)
    rng : Generator
        Advanced.
    excess : array, shape (n,), optional
        By how much each breaks the constraints, at most 0 where it keeps them; NaN where it failed.
    snap : callable, optional
        Points (n, d) to the nearest designs that exist.

    Raises
    ------
    InputError
        Too few designs for a model.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):  # as in the fit: the same bits, and faster
        table = values if excess is None else np.column_stack([values, excess])
        models = [TwoScales(designs, column, bounds, rng) for column in table.T]
        fronts = [
            minimise(
                _believed(models, boldness, values.shape[1], snap),
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
        least = _least(models[: values.shape[1]], designs, eligible(values, excess))
        near = _about(models, designs, least, bounds, rng, snap) if fronts else designs[:0]
    if not fronts:
        assert excess is not None  # only constraints leave a front without designs
        about = _nearer(designs, excess, bounds, rng)
        return _chosen(designs[:0], snap(about), designs, bounds, count, count)
    known = [front.points[front.values.argmin(axis=0)] for front in fronts]
    ends = np.concatenate([known[0], near, known[-1]])
    others = np.concatenate([front.points for front in fronts])
    most = (
        count if values.shape[1] == 2 else count // 2
    )  # between the ends of a surface there is more
    return _chosen(snap(ends), snap(others), designs, bounds, count, most)


def eligible(values: Array, excess: Array | None) -> Booleans:
    """Which designs may be the best: those whose objectives are known, and that keep the constraints; if none does, those
    that come nearest. `values` (n, m), `excess` (n,), as `proposals` takes them."""
    known = np.asarray(np.isfinite(values).all(axis=1))
    if excess is not None:
        known &= ~np.isnan(excess)
        known &= excess <= max(excess[known].min(initial=np.inf), 0.0)
    return known


def believed_ends(
    designs: Array, values: Array, bounds: Array, rng: np.random.Generator, excess: Array | None
) -> list[int]:
    """Of each objective the evaluated design that its model takes for the least; parameters and errors of `proposals`."""
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        models = [TwoScales(designs, column, bounds, rng) for column in values.T]
        return _least(models, designs, eligible(values, excess))


def _least(models: Sequence[TwoScales], designs: Array, allowed: Booleans) -> list[int]:
    """Of each model the design that it takes for the least."""
    found = [model.predict(designs) for model in models]
    return [int(np.where(allowed, one, np.inf).argmin()) for one in found]


def _about(
    models: Sequence[TwoScales],
    designs: Array,
    ends: Sequence[int],
    bounds: Array,
    rng: np.random.Generator,
    snap: Callable[[Array], Array],
) -> Array:
    """Near the design that is believed to be the end of each objective, the least that may be there, by each of `NEARBY`."""
    width = bounds[:, 1] - bounds[:, 0]
    found = []
    for boldness in NEARBY:
        for column, row in enumerate(ends):
            steps = LOCAL * width * rng.uniform(-1.0, 1.0, (CANDIDATES, len(width)))
            points = np.clip(designs[row] + steps, bounds[:, 0], bounds[:, 1])
            believed = _believed(models, boldness, len(ends), snap)(points)
            least, broken = (
                believed if isinstance(believed, tuple) else (believed, np.zeros(len(points)))
            )
            found.append(points[np.lexsort((least[:, column], broken))[0]])
    return np.array(found)


def _nearer(
    designs: Array, excess: Array, bounds: Array, rng: np.random.Generator, count: int = 64
) -> Array:
    """Designs about the one that comes nearest to the constraints, a tenth of each range off it."""
    width = bounds[:, 1] - bounds[:, 0]
    steps = 0.1 * width * rng.standard_normal((count, len(width)))
    return np.clip(designs[np.nanargmin(excess)] + steps, bounds[:, 0], bounds[:, 1])


def _best(designs: Array, values: Array, count: int, excess: Array | None) -> Array:
    """Designs with the least sum of all objectives, each in units of its standard deviation; those that keep the constraints
    first."""
    scale = np.nanstd(values, axis=0)
    merit = (values / np.where(scale > 0.0, scale, 1.0)).sum(axis=1)
    if excess is not None:
        merit = np.where(excess <= 0.0, merit, np.nanmax(merit) + 1.0 + excess)
    return designs[np.argsort(merit, kind="stable")[:count]]  # NaN comes last


def _believed(
    models: Sequence[TwoScales],
    boldness: float,
    objectives: int,
    snap: Callable[[Array], Array],
) -> Callable[[Array], Array | tuple[Array, Array]]:
    """Objectives as the models see them, less `boldness` standard deviations; with more models than objectives, what the last
    says of constraints besides."""

    def function(points: Array) -> Array | tuple[Array, Array]:
        points = snap(points)
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
