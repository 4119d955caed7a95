"""What another simulation is worth, where objectives and constraints are costly and known with errors.

Each objective and constraint gets one Kriging model over designs, with the kernel of Matern and the known error of each value:
a model that is free to fit noise as ripples finds what flatters it. A new design is worth its expected improvement, times the
probability that it keeps the constraints, and less where its own error hides what is not known yet (augmented expected
improvement); how it may differ from the best one counts, for what both have in common decides nothing. More simulations
of a known design are worth what they may change in which design is taken for the best (knowledge gradient). Both are compared
by simulation: few for a new design at first, more for contenders only ("replication or exploration"). Of several designs at a
time each takes those before it for evaluated, at the value that is expected (Kriging believer). Where no design is expected to
win enough, draws of what is believed of all designs together say what is lost if none is simulated any more, and which may be
the best (Thompson sampling).

Sources: D. R. Jones, M. Schonlau and W. J. Welch, "Efficient global optimization of expensive black-box functions", J. Global
Optim. 13 (1998), doi:10.1023/A:1008306431147; with errors D. Huang, T. T. Allen, W. I. Notz and N. Zeng,
"Global optimization of stochastic black-box systems via sequential kriging meta-models", J. Global Optim. 34 (2006),
doi:10.1007/s10898-005-2454-3; V. Picheny, T. Wagner and D. Ginsbourger, "A benchmark of
kriging-based infill criteria for noisy optimization", Struct. Multidisc. Optim. 48 (2013), doi:10.1007/s00158-013-0919-4;
of draws W. R. Thompson, "On the likelihood that one unknown probability exceeds another in view of the evidence of two
samples", Biometrika 25 (1933), doi:10.1093/biomet/25.3-4.285;
M. Binois, J. Huang, R. B. Gramacy and M. Ludkovski, "Replication or exploration? Sequential design for stochastic simulation
experiments", Technometrics 61 (2019), doi:10.1080/00401706.2018.1469433; the sum over strips M. Emmerich, K. Yang, A. Deutz,
H. Wang and C. Fonseca, "A multicriteria generalization of Bayesian global optimization" (2016),
doi:10.1007/978-3-319-29975-4_12; random scalarisations J. Knowles, "ParEGO", IEEE Trans. Evol. Comput. 10 (2006),
doi:10.1109/TEVC.2005.851274.
"""

from collections.abc import Callable

import moocore
import numpy as np
from scipy.linalg.lapack import dpstrf
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from hpcclear.base.arrays import Array
from hpcclear.statistics.search.beliefs import LIKELY, Beliefs, Space

EXPLORED = 5
"""One new design in so many is the farthest from all others: expected improvement trusts the model, which may be wrong."""

UNSURE = 2.0
"""What is not known of a new design over what models say: their length scales and trends are estimates, and where these are
wrong no design would show it."""

WIDE, STEPS, LOCAL, CENTRES = 512, (0.2, 0.06, 0.02, 0.006), 64, 2
"""Candidates all over the box, and about each of the best designs at each of these parts of the ranges."""

NEAR = 3e-3
"""Largest difference of coordinates, in the unit cube, below which two designs are one."""

DRAWS = 64
"""Draws of what is believed: of three or more objectives for an expected improvement without a closed form, and of all designs
together."""

UNSEEN, MOST = 4.0, 400
"""Standard deviations that a design may be below its mean in draws: where that is not the least mean it is not drawn; and how
many designs are drawn at most, those that may be the least."""

ROUND_OFF = 1e-9
"""Smallest variance that is drawn, over the largest."""

Merit = Callable[[Array], Array]


def proposed(beliefs: Beliefs, direction: Array | None) -> tuple[Array, float]:
    """The new design, (d,), that is expected to win most in a direction, or of the hypervolume; and how much."""
    return _best(beliefs, _merit(beliefs, direction))


def farthest(beliefs: Beliefs) -> tuple[Array, float]:
    """The design, (d,), that is farthest from all that are known, where constraints are likely kept; and how far."""

    def merit(points: Array) -> Array:
        away = _distance(beliefs, points)
        return np.where(away > NEAR, away * beliefs.feasible(points), 0.0)

    return _best(beliefs, merit)


def expected(beliefs: Beliefs, direction: Array, margins: Array | None = None) -> Array:
    """The design, (d,), that is expected to be the best in a direction of those that keep the constraints by some margins."""

    def merit(points: Array) -> Array:
        broken = np.maximum(beliefs.shortfalls(points, margins)[0], 0.0).max(axis=1, initial=0.0)
        return np.where(broken > 0.0, -1e30 * (1.0 + broken), -(beliefs.means(points) @ direction))

    return _best(beliefs, merit)[0]


def drawn(beliefs: Beliefs, direction: Array, count: int) -> tuple[Array, float]:
    """At most so many new designs, (k, d), each the best by one draw of what is believed of all together (Thompson sampling),
    and what the design that is believed to be the best is expected to lose to the best of all; 0 where none is new."""
    points = np.vstack([beliefs.known.designs[beliefs.allowed], _candidates(beliefs)])
    points = points[beliefs.feasible(points) >= LIKELY]
    mean, variance = beliefs.means(points) @ direction, beliefs.variances(points) @ direction**2
    least = mean - UNSEEN * np.sqrt(variance)
    least[mean <= mean.min(initial=np.inf)] = -np.inf  # the best is drawn first: losses are its own
    may = np.argsort(least, kind="stable")[: min((least <= mean.min(initial=np.inf)).sum(), MOST)]
    points, mean = points[may], mean[may]
    new = _distance(beliefs, points) > NEAR
    if not new.any():
        return points[:0], 0.0
    square = np.zeros((len(points), len(points)))
    for model, weight in zip(beliefs.models, direction, strict=True):
        if model is not None and weight:
            square += weight**2 * model.rest.covariance(points)
    draws = beliefs.rng.standard_normal((DRAWS, len(points)))
    # Known designs have next to no variance, and round-off makes some of it negative: pivots end before these.
    smallest = ROUND_OFF * max(square.diagonal().max(), 0.0)
    factor, order, rank, _ = dpstrf(square, tol=smallest, lower=1)
    paths = np.tile(mean, (DRAWS, 1))
    paths[:, order - 1] += draws[:, :rank] @ np.tril(factor)[:, :rank].T
    loss = paths[:, mean.argmin()] - paths.min(axis=1)
    rows = list[int]()
    for path in paths:
        if len(rows) == count or not new.any():
            break
        rows.append(int(np.where(new, path, np.inf).argmin()))
        new &= beliefs.space.apart(points, points[rows[-1]]) > NEAR
    return points[rows], float(loss.mean())


def replications(beliefs: Beliefs, direction: Array) -> Array:
    """What twice the simulations of each known design are worth in a direction, (n,): by how much they are expected to better
    the choice of the best design, from which others differ by what they do not have in common."""
    rows = np.flatnonzero(beliefs.allowed)
    found = np.zeros(len(beliefs.known.designs))
    if len(rows) < 2:
        return found
    designs, own = beliefs.known.designs[rows], beliefs.believed[rows] @ direction
    order = np.argsort(own)
    left = beliefs.apart(designs, designs[order[0]]) @ direction**2
    left[order[0]] = left[order[1]]
    noise = np.zeros(len(rows))
    for column, (model, weight) in enumerate(zip(beliefs.models, direction, strict=True)):
        if model is not None and weight:
            rest, places = model.rest, np.cumsum(np.isfinite(beliefs.known.values[:, column])) - 1
            noise += weight**2 * rest.error_variances[places[rows]]
    moved = np.sqrt(left**2 / (left + noise + 1e-300))
    others = np.where(np.arange(len(own)) == order[0], own[order[1]], own[order[0]])
    worth = gain(others, own, moved) - np.maximum(others - own, 0.0)
    chance = beliefs.feasible(designs)
    found[rows] = worth * chance + np.maximum(others - own, 0.0) * (1.0 - chance)
    return found


def _merit(beliefs: Beliefs, direction: Array | None) -> Merit:
    """What is expected to be won at points, (n, d) to (n,): in a direction, or of the hypervolume."""
    designs, front = beliefs.front()
    if not len(front):  # nothing keeps the constraints: the nearest, by the worst of them
        means, _ = beliefs.shortfalls(beliefs.known.designs[beliefs.finite])
        least = float(means.max(axis=1).min(initial=np.inf))

        def nearer(points: Array) -> Array:
            means, spreads = beliefs.shortfalls(points)
            rows = np.arange(len(points)), means.argmax(axis=1)
            won = gain(np.full(len(points), least), means[rows], spreads[rows])
            return won * (_distance(beliefs, points) > NEAR)

        return nearer
    weights = beliefs.rng.dirichlet(np.ones(front.shape[1]))
    noise = beliefs.rng.standard_normal((DRAWS, 1, front.shape[1]))
    best = None if direction is None else designs[(front @ direction).argmin()]
    errors = beliefs.noise

    def function(points: Array) -> Array:
        mean, deviation = beliefs.means(points), UNSURE * np.sqrt(beliefs.apart(points, best))
        if direction is not None:
            own, spread = mean @ direction, np.sqrt(deviation**2 @ direction**2)
            error = np.sqrt(errors @ direction**2)
            told = 1.0 - error / np.sqrt(spread**2 + error**2 + 1e-300)
            won = gain((front @ direction).min(), own, spread) * told
        elif front.shape[1] == 2:
            won = volume(front, mean, deviation)
        else:
            won = _scalarised(front, mean + deviation * noise, weights)
        return won * beliefs.feasible(points) * (_distance(beliefs, points) > NEAR)

    return function


def gain(least: Array | float, mean: Array, deviation: Array) -> Array:
    """Expected amount by which normal numbers stay below `least`, (n,); (k, n) below each of (k, 1)."""
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
    left = gain(np.append(first, 1.1)[:, None], mean[:, 0], deviation[:, 0])
    strips = np.diff(left, axis=0, prepend=0.0)  # between one point and the next
    heights = gain(np.append(1.1, second)[:, None], mean[:, 1], deviation[:, 1])
    return np.asarray((strips * heights).sum(axis=0))


def _scalarised(front: Array, drawn: Array, weights: Array) -> Array:
    """What draws, (s, n, m), win on average of a weighted distance to the ideal point (augmented Chebyshev)."""
    low, extent = front.min(axis=0), np.ptp(front, axis=0)

    def distance(values: Array) -> Array:
        parts = weights * (values - low) / np.where(extent > 0.0, extent, 1.0)
        return np.asarray(parts.max(axis=-1) + 0.05 * parts.sum(axis=-1))

    return np.asarray(np.maximum(distance(front).min() - distance(drawn), 0.0).mean(axis=0))


def _best(beliefs: Beliefs, merit: Merit) -> tuple[Array, float]:
    """The candidate of most merit, (d,), moved by smaller and smaller steps while that helps; and its merit."""
    space, rng = beliefs.space, beliefs.rng
    place, worth = _most(_candidates(beliefs), merit)
    for step in STEPS:
        other, its = _most(space.snap(_about(place, step, space, rng)), merit)
        if its > worth:
            place, worth = other, its
    return place, worth


def _candidates(beliefs: Beliefs) -> Array:
    """Designs all over the box and about the best ones, (n, d)."""
    space, rng = beliefs.space, beliefs.rng
    low, width = space.bounds[:, 0], space.bounds[:, 1] - space.bounds[:, 0]
    points = [low + rng.random((WIDE, len(low))) * width]
    for centre in _centres(beliefs):
        points += [_about(centre, step, space, rng) for step in STEPS]
    return np.asarray(space.snap(np.concatenate(points)))


def _most(points: Array, merit: Merit) -> tuple[Array, float]:
    worth = merit(points)
    row = int(worth.argmax())
    return points[row], float(worth[row])


def _centres(beliefs: Beliefs) -> Array:
    """The best designs in each direction, (k, d); those nearest to the constraints where none keeps them."""
    known, kept = beliefs.known.designs, beliefs.allowed
    if not kept.any():
        means, _ = beliefs.shortfalls(known)
        broken = np.where(beliefs.finite, means.max(axis=1, initial=0.0), np.inf)
        return known[np.argsort(broken, kind="stable")[:CENTRES]]
    means = beliefs.believed[kept]
    rows = np.unique([np.argsort(means @ one)[:CENTRES] for one in beliefs.space.directions])
    return np.asarray(known[kept][rows])


def _about(centre: Array, step: float, space: Space, rng: np.random.Generator) -> Array:
    """Designs about one, at most a part of each range off; some along a few axes only, so that bounds are kept."""
    low, high = space.bounds.T
    moves = step * (high - low) * rng.uniform(-1.0, 1.0, (LOCAL, len(low)))
    moves *= rng.random(moves.shape) < 0.6
    return np.clip(centre + moves, low, high)


def _distance(beliefs: Beliefs, points: Array) -> Array:
    """How far designs are from all that were evaluated or chosen, over the ranges, (n,)."""
    width = beliefs.space.bounds[:, 1] - beliefs.space.bounds[:, 0]
    others = np.vstack([beliefs.known.designs, beliefs.pending])
    steps = cdist(points / width, others / width, "chebyshev")
    return np.asarray(steps.min(axis=1))
