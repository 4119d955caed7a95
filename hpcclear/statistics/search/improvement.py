"""Where to evaluate next, by expected improvement: for objectives that are costly and known with errors.

Where f is rough, no model of f over designs and random inputs together holds, but the roughness averages out in a statistic.
So each objective gets one Kriging model over designs, with the kernel of Matern and a noise variance near that of the known
errors: a model that is free to fit noise as ripples finds what flatters it. The next designs are those that are expected
to win most, by turns in each direction (an objective, or a weighted sum of them) and of the hypervolume. Of several designs
at a time each takes those before it for evaluated, at the value that is expected (Kriging believer).

Sources: D. R. Jones, M. Schonlau and W. J. Welch, "Efficient global optimization of expensive black-box functions", J. Global
Optim. 13 (1998), doi:10.1023/A:1008306431147; with errors V. Picheny, T. Wagner and D. Ginsbourger, "A benchmark of
kriging-based infill criteria for noisy optimization", Struct. Multidisc. Optim. 48 (2013), doi:10.1007/s00158-013-0919-4; the
sum over strips M. Emmerich, K. Yang, A. Deutz, H. Wang and C. Fonseca, "A multicriteria generalization of Bayesian global
optimization" (2016), doi:10.1007/978-3-319-29975-4_12; random scalarisations J. Knowles, "ParEGO", IEEE Trans. Evol. Comput. 10
(2006), doi:10.1109/TEVC.2005.851274.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import moocore
import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from hpcclear.base.arrays import Array, Booleans
from hpcclear.statistics.search.infill import NEAR, eligible
from hpcclear.statistics.search.pareto import cut
from hpcclear.statistics.surrogate.fitting import fit_kriging
from hpcclear.statistics.surrogate.kernels import MATERN
from hpcclear.statistics.surrogate.kriging import Kriging

NOISE = 0.1, 2.0
"""Between these factors on the variance of known errors is the noise variance of a model. Designs that meet the same scatter
share part of their errors, which then is no noise between them."""

LENGTHS = (0.1, 1.0)
"""Length scales in the unit cube: a statistic that changes faster is not found by some ten designs per variable. Of few designs
with errors the likelihood takes any function for a plane, and what looks known is never visited."""

HEDGES = 2
"""Designs to verify that only may be the best: what is believed of those that are near each other is off together."""

EXPLORED = 3
"""One design in so many is the farthest from all others: expected improvement trusts the model, which may be wrong."""

WIDE, STEPS, LOCAL, CENTRES = 1024, (0.2, 0.06, 0.02, 0.006), 96, 4
"""Candidates all over the box, and about each of the best designs at each of these parts of the ranges."""

DRAWS = 64
"""Draws of three or more objectives for an expected improvement without a closed form."""

LIKELY = 0.5
"""Probability of keeping the constraints from which a design that was not evaluated may be the best."""

Exact = Callable[[Array], Array]
Snap = Callable[[Array], Array]


@dataclass(frozen=True)
class Known:
    """What was evaluated.

    Attributes
    ----------
    designs : array, shape (n, d)
    values : array, shape (n, m)
        Objectives, all minimised; NaN where they failed.
    errors : array, shape (n, m)
        Their standard errors.
    excess : array, shape (n,), or None
        By how much each breaks the constraints, at most 0 where it keeps them; NaN where it failed.
    """

    designs: Array
    values: Array
    errors: Array
    excess: Array | None = None


@dataclass(frozen=True)
class Space:
    """Where designs are.

    Attributes
    ----------
    bounds : array, shape (d, 2)
    directions : array, shape (k, m)
        Weights of the objectives in each sum whose least value counts.
    merit : array, shape (m,)
        Those of the sum that counts most.
    exact : sequence of functions or None, length m
        Objectives that are known as functions of designs, (n, d) to (n,).
    snap : function
        Designs (n, d) to the nearest ones that there are: values from a catalogue, say.
    """

    bounds: Array
    directions: Array
    merit: Array
    exact: Sequence[Exact | None]
    snap: Snap = lambda designs: designs


class Beliefs:
    """Models of all objectives and of the excess over designs.

    Raises
    ------
    InputError
        Fewer than d + 3 finite values.
    """

    def __init__(self, known: Known, space: Space, rng: np.random.Generator) -> None:
        self.known, self.space = known, space
        self.models = [
            None if exact else _fitted(known.designs, values, errors, space.bounds, rng)
            for values, errors, exact in zip(
                known.values.T, known.errors.T, space.exact, strict=True
            )
        ]
        self.excess = None
        if known.excess is not None:
            unknown = np.full(len(known.excess), np.nan)
            self.excess = _fitted(known.designs, known.excess, unknown, space.bounds, rng)
        self.pending = known.designs[:0]
        self.allowed = eligible(known.values, known.excess)
        self.believed = self.means(known.designs)[self.allowed]

    def means(self, points: Array) -> Array:
        """What is expected at points, (n, d) to (n, m)."""
        pairs = zip(self.models, self.space.exact, strict=True)
        return np.column_stack(
            [exact(points) if exact else model.predict(points) for model, exact in pairs]  # type: ignore[union-attr]
        )

    def variances(self, points: Array) -> Array:
        """What is not known of it, (n, d) to (n, m)."""
        nothing = np.zeros(len(points))
        return np.column_stack(
            [nothing if model is None else model.variance(points) for model in self.models]
        )

    def feasible(self, points: Array) -> Array:
        """Probability of keeping the constraints, (n, d) to (n,)."""
        if self.excess is None:
            return np.ones(len(points))
        deviation = np.sqrt(self.excess.variance(points)) + 1e-12
        return np.asarray(ndtr(-self.excess.predict(points) / deviation))

    def take(self, point: Array) -> None:
        """A design as if it were evaluated, at what is expected of it."""
        self.models = [None if one is None else _extended(one, point) for one in self.models]
        if self.excess is not None:
            self.excess = _extended(self.excess, point)
        self.pending = np.vstack([self.pending, point])
        if self.excess is None or self.excess.predict(point[None])[0] <= 0.0:
            self.believed = np.vstack([self.believed, self.means(point[None])])


def _fitted(
    designs: Array, values: Array, errors: Array, bounds: Array, rng: np.random.Generator
) -> Kriging:
    scale = float(np.nanstd(values))
    share = (
        float(np.nanmedian(errors)) / scale if scale > 0.0 and np.isfinite(errors).any() else 0.0
    )
    low, high = (max(factor * share**2, 1e-8) for factor in NOISE)
    noise = (low, max(high, 10.0 * low)) if share else None
    return fit_kriging(
        designs, values, bounds, rng=rng, restarts=2, lengths=LENGTHS, kernel=MATERN, noise=noise
    )


def _extended(model: Kriging, point: Array) -> Kriging:
    """A model with one more value, the one that it expects: which changes no other expectation, and has no weight."""
    return replace(
        model,
        inputs=np.vstack([model.inputs, point]),
        values=np.append(model.values, model.predict(point[None])),
        alpha=np.append(model.alpha, 0.0),
    )


def proposals(known: Known, space: Space, count: int, rng: np.random.Generator) -> Array:
    """Designs to evaluate next, at most `count`, shape (k, d).

    Raises
    ------
    InputError
        Too few designs for a model.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):  # the same bits, and faster
        beliefs = Beliefs(known, space, rng)
        turns = itertools.cycle([*space.directions, None])
        chosen: list[Array] = []
        failed = 0
        while len(chosen) < count and failed < len(space.directions) + 2:
            explores = (len(known.designs) + len(chosen)) % EXPLORED == 0 and not failed
            merit = partial(_unvisited, beliefs) if explores else _merit(beliefs, next(turns), rng)
            point, worth = _best(beliefs, merit, rng)
            if worth > 0.0:
                chosen.append(point)
                beliefs.take(point)
            failed = 0 if worth > 0.0 else failed + 1
        return np.reshape(chosen, (-1, len(space.bounds)))


def hopes(known: Known, space: Space, rng: np.random.Generator) -> tuple[Array, Array]:
    """What another design is expected to win in each direction, and the least that is believed there, shape (k,) each.

    Raises
    ------
    InputError
        Too few designs for a model.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        beliefs = Beliefs(known, space, rng)
        gains = [_best(beliefs, _merit(beliefs, one, rng), rng)[1] for one in space.directions]
        return np.array(gains), (beliefs.believed @ space.directions.T).min(axis=0)


def finalists(known: Known, space: Space, most: int, rng: np.random.Generator) -> Array:
    """Designs that are believed to be the best, shape (k, d): in each direction of those evaluated and of all; `HEDGES` others
    that may be; and of the front of what is expected of those evaluated as many as spread best, up to so many in all.

    Raises
    ------
    InputError
        Too few designs for a model.
    """
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        beliefs = Beliefs(known, space, rng)
        designs, means = known.designs[beliefs.allowed], beliefs.believed
        found = []
        for direction in space.directions:
            found.append(designs[(means @ direction).argmin()])
            point, worth = _best(beliefs, _likely(beliefs, direction), rng)
            if worth > 0.0:
                found.append(point)
        merit = _merit(beliefs, space.merit, rng)
        for _ in range(HEDGES):
            point, worth = _best(beliefs, merit, rng)
            if worth > 0.0:
                found.append(point)
                beliefs.take(point)
        front = np.flatnonzero(moocore.is_nondominated(means))
        if (left := most - len(found)) >= means.shape[1]:
            found += list(designs[front[cut(means[front], left)]])
        return np.unique(np.array(found), axis=0)


def _likely(beliefs: Beliefs, direction: Array) -> Callable[[Array], Array]:
    """How far what is expected at points lies below that of those evaluated, where constraints are likely kept."""
    least = float((beliefs.believed @ direction).min())

    def function(points: Array) -> Array:
        won = least - beliefs.means(points) @ direction
        return np.where(beliefs.feasible(points) >= LIKELY, won, -np.inf)

    return function


def _merit(
    beliefs: Beliefs, direction: Array | None, rng: np.random.Generator
) -> Callable[[Array], Array]:
    """What is expected to be won at points, (n, d) to (n,): in a direction, or of the hypervolume."""
    weights = rng.dirichlet(np.ones(beliefs.believed.shape[1]))
    noise = rng.standard_normal((DRAWS, 1, beliefs.believed.shape[1]))

    def function(points: Array) -> Array:
        mean, deviation = beliefs.means(points), np.sqrt(beliefs.variances(points))
        if direction is not None:
            own, spread = mean @ direction, np.sqrt(deviation**2 @ direction**2)
            won = gain(float((beliefs.believed @ direction).min()), own, spread)
        elif beliefs.believed.shape[1] == 2:
            won = volume(beliefs.believed, mean, deviation)
        else:
            won = _scalarised(beliefs.believed, mean + deviation * noise, weights)
        return won * beliefs.feasible(points) * _apart(points, beliefs)

    return function


def gain(least: float, mean: Array, deviation: Array) -> Array:
    """Expected amount by which normal numbers stay below `least`, (n,)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        steps = (least - mean) / deviation
        density = np.exp(-0.5 * steps**2) / np.sqrt(2.0 * np.pi)
        found = (least - mean) * ndtr(steps) + deviation * density
    return np.where(deviation > 0.0, np.maximum(found, 0.0), np.maximum(least - mean, 0.0))


def volume(front: Array, mean: Array, deviation: Array) -> Array:
    """Expected area that independent normal numbers, (n, 2), add to that of points, (k, 2), scaled to the extent of these, up
    to 1.1 times that."""
    points = front[moocore.is_nondominated(front)]
    points = points[np.argsort(points[:, 0])]
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    extent = np.where(extent > 0.0, extent, np.ptp(front, axis=0))
    extent = np.where(extent > 0.0, extent, 1.0)
    first, second = ((points - low) / extent).T
    mean, deviation = (mean - low) / extent, deviation / extent
    left, right = (
        gain_to(np.append(first, 1.1), mean[:, 0], deviation[:, 0]),
        np.append(1.1, second),
    )
    strips = np.diff(left, axis=0, prepend=0.0)  # between one point and the next
    return np.asarray((strips * gain_to(right, mean[:, 1], deviation[:, 1])).sum(axis=0))


def gain_to(levels: Array, mean: Array, deviation: Array) -> Array:
    """`gain` below each of some levels, (k, n)."""
    return np.array([gain(float(level), mean, deviation) for level in levels])


def _scalarised(front: Array, drawn: Array, weights: Array) -> Array:
    """What draws, (s, n, m), win on average of a weighted distance to the ideal point (augmented Chebyshev)."""
    low, extent = front.min(axis=0), np.ptp(front, axis=0)
    extent = np.where(extent > 0.0, extent, 1.0)

    def distance(values: Array) -> Array:
        parts = weights * (values - low) / extent
        return np.asarray(parts.max(axis=-1) + 0.05 * parts.sum(axis=-1))

    return np.asarray(np.maximum(distance(front).min() - distance(drawn), 0.0).mean(axis=0))


def _best(
    beliefs: Beliefs, merit: Callable[[Array], Array], rng: np.random.Generator
) -> tuple[Array, float]:
    """The candidate of most merit, (d,), moved by smaller and smaller steps while that helps; and its merit."""
    space = beliefs.space
    low, width = space.bounds[:, 0], space.bounds[:, 1] - space.bounds[:, 0]
    points = [low + rng.random((WIDE, len(low))) * width]
    for centre in _centres(beliefs):
        points += [_about(centre, step, space, rng) for step in STEPS]
    place, worth = _most(space.snap(np.concatenate(points)), merit)
    for step in STEPS:
        other, its = _most(space.snap(_about(place, step, space, rng)), merit)
        if its > worth:
            place, worth = other, its
    return place, worth


def _most(points: Array, merit: Callable[[Array], Array]) -> tuple[Array, float]:
    worth = merit(points)
    row = int(worth.argmax())
    return points[row], float(worth[row])


def _centres(beliefs: Beliefs) -> Array:
    """The best designs in each direction, (k, d)."""
    designs = np.vstack([beliefs.known.designs[beliefs.allowed], beliefs.pending])
    means = beliefs.means(designs)
    rows = np.unique([np.argsort(means @ one)[:CENTRES] for one in beliefs.space.directions])
    return np.asarray(designs[rows])


def _about(centre: Array, step: float, space: Space, rng: np.random.Generator) -> Array:
    """Designs about one, at most a part of each range off; some along a few axes only, so that bounds are kept."""
    low, high = space.bounds.T
    moves = step * (high - low) * rng.uniform(-1.0, 1.0, (LOCAL, len(low)))
    moves *= rng.random(moves.shape) < 0.6
    return np.clip(centre + moves, low, high)


def _apart(points: Array, beliefs: Beliefs) -> Booleans:
    """Whether designs differ from all that were evaluated or chosen, (n,)."""
    return _distance(beliefs, points) > NEAR


def _distance(beliefs: Beliefs, points: Array) -> Array:
    """How far designs are from all that were evaluated or chosen, over the ranges, (n,)."""
    width = beliefs.space.bounds[:, 1] - beliefs.space.bounds[:, 0]
    others = np.vstack([beliefs.known.designs, beliefs.pending])
    steps = cdist(points / width, others / width, "chebyshev")
    return np.asarray(steps.min(axis=1))


def _unvisited(beliefs: Beliefs, points: Array) -> Array:
    """The same where designs likely keep the constraints; 0 of those that were evaluated."""
    return np.where(
        _apart(points, beliefs), _distance(beliefs, points) * beliefs.feasible(points), 0.0
    )
