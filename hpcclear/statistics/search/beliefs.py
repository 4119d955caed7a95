"""Models of objectives and constraints over designs that were evaluated with errors, and of a trend that a cheaper model has.

All designs meet the same scatter, so that they have most of an error in common: neighbours nearly all of it, others less. What
each replicate shifts says how much. A model that knew variances only would take for true what few simulations flatter
throughout a region.

Sources: J. Sacks et al., "Design and analysis of computer experiments", Statistical Science 4 (1989),
doi:10.1214/ss/1177012413; of a trend M. C. Kennedy and A. O'Hagan, "Predicting the output from a complex computer code when
fast approximations are available", Biometrika 87 (2000), doi:10.1093/biomet/87.1.1; of common errors X. Chen, B. E. Ankenman
and B. L. Nelson, "The effects of common random numbers on stochastic kriging metamodels", ACM Trans. Model. Comput. Simul.
22 (2012), doi:10.1145/2133390.2133391.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import ndtr

from hpcclear.base.arrays import Array
from hpcclear.statistics.surrogate.fitting import fit_kriging
from hpcclear.statistics.surrogate.kernels import MATERN, Errors
from hpcclear.statistics.surrogate.kriging import Kriging

NOISE, APART = (1e-3, 2.0), (0.1, 2.0)
"""Between these factors on the variance of known errors is what a design has for itself, where nothing is known of what errors
have in common, and where that is known from replicates: too few of them to know it better."""

FLAT = 1e-9
"""Changes of a trend over its size that are no more than round-off: a slope of them would have no digit of the values left."""

LENGTHS = (0.1, 3.0)
"""Length scales in the unit cube: a statistic that changes faster is not found by some ten designs per variable."""

LIKELY = 0.5
"""Probability of keeping the constraints from which a design may be the best."""

DOUBT = 1.5
"""What is not known of a constraint over what its model says: length scales are estimates themselves, and where too long ones
say that a constraint is broken no design would show that it is not."""

OfDesigns = Callable[[Array], Array]
"""A function of designs (n, d)."""


@dataclass(frozen=True)
class Known:
    """What was evaluated: n designs (n, d)."""

    designs: Array
    values: Array
    errors: Array
    """values and errors, shape (n, m): objectives, all minimised, NaN where they failed; their standard errors."""
    excess: Array
    excess_errors: Array
    """excess and excess_errors, shape (n, c): by how much each constraint is broken, at most 0 where it is kept."""
    shifts: Array
    """By how much each of r replicates shifts objectives, (m, n, r). What constraints have in common is left to margins."""


@dataclass(frozen=True)
class Space:
    """Where designs are: within `bounds`, shape (d, 2)."""

    bounds: Array
    directions: Array
    """Weights (k, m) of the objectives in each sum whose least value counts; the first is what counts most."""
    exact: Sequence[OfDesigns | None]
    """Of each objective how it is known, (n,); None where it is not."""
    margins: Array
    """By how much each constraint is to be kept at least, so that it can be shown, (c,)."""
    snap: OfDesigns = np.asarray
    """The nearest designs that there are, (n, d): values from a catalogue, say."""
    trends: Sequence[OfDesigns] = ()
    """What a cheaper model says of objectives, then of constraints, (n,) each; empty without one."""

    def apart(self, designs: Array, one: Array) -> Array:
        """How far designs (n, d) are from one (d,), over the ranges, (n,): the largest of all coordinates."""
        return np.asarray((abs(designs - one) / np.ptp(self.bounds, axis=1)).max(axis=1))


@dataclass(frozen=True)
class Trended:
    """A Kriging model of what a multiple of a trend leaves."""

    rest: Kriging
    slope: float
    trend: OfDesigns

    def predict(self, points: Array) -> Array:
        """What is expected at points, (n, d) to (n,)."""
        return self.rest.predict(points) + self.slope * self.trend(points)


class Beliefs:
    """Models of all objectives and constraints over designs. Raises InputError: fewer than d + 3 finite values.

    Their length scales are sought from those of `before` on, of fewer designs, if there are any.

    `believed` (n, m): objectives of the designs that were evaluated; `allowed` (n,): which of them are likely to keep the
    constraints.
    """

    def __init__(
        self, known: Known, space: Space, rng: np.random.Generator, before: "Beliefs | None" = None
    ) -> None:
        self.known, self.space, self.rng = known, space, rng
        count, width = len(space.exact), known.excess.shape[1]
        none: list[Trended | None] = [None] * (count + width)
        found = list[Trended | None]()
        trends = space.trends or [lambda points: np.zeros(len(points))] * len(none)
        for exact, values, errors, shifts, trend, last in zip(
            [*space.exact, *[None] * width], np.hstack([known.values, known.excess]).T,
            np.hstack([known.errors, known.excess_errors]).T, [*known.shifts, *[None] * width], trends,
            [*before.models, *before.limits] if before else none, strict=True,
        ):  # fmt: skip
            made = _Evaluated(known.designs, values, errors, shifts)
            found.append(None if exact else _trended(made, space, trend, rng, last))
        self.models: list[Trended | None] = found[:count]
        self.limits: list[Trended] = [one for one in found[count:] if one]
        self.pending = known.designs[:0]
        self.finite = np.isfinite(known.values).all(axis=1) & np.isfinite(known.excess).all(axis=1)
        self.believed = self.means(known.designs)
        self.allowed = self.finite & (self.feasible(known.designs) >= LIKELY)

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
            [nothing if model is None else model.rest.variance(points) for model in self.models]
        )

    def apart(self, points: Array, one: Array | None = None) -> Array:
        """The same of the differences from one design, (d,), or from the nearest that is known, (n, d) to (n, m)."""
        nothing = np.zeros(len(points))
        return np.column_stack(
            [nothing if model is None else model.rest.apart(points, one) for model in self.models]
        )

    @property
    def noise(self) -> Array:
        """Variance of the error of one more design's objectives that no neighbour shares, (m,)."""
        return np.array([0.0 if one is None else _noise(one.rest) for one in self.models])

    def shortfalls(self, points: Array, margins: Array | None = None) -> tuple[Array, Array]:
        """By how much constraints are expected to be broken, margins included, and standard deviations, (n, c) each."""
        margins = self.space.margins if margins is None else margins
        none = np.empty((len(points), 0))
        means = [one.predict(points)[:, None] for one in self.limits]
        spreads = [np.sqrt(one.rest.variance(points))[:, None] for one in self.limits]
        return np.hstack([none, *means]) + margins, np.hstack([none, *spreads]) + 1e-12

    def feasible(self, points: Array) -> Array:
        """Probability of keeping the constraints, (n, d) to (n,), with `DOUBT` of their models."""
        means, spreads = self.shortfalls(points)
        return np.asarray(ndtr(-means / (DOUBT * spreads)).prod(axis=1))

    def take(self, point: Array) -> None:
        """A design as if it were evaluated, at what is expected of it."""
        self.models = [None if one is None else _extended(one, point) for one in self.models]
        self.limits = [_extended(one, point) for one in self.limits]
        self.pending = np.vstack([self.pending, point])

    def front(self) -> tuple[Array, Array]:
        """All designs that are likely to keep the constraints, (k, d), also those that are to be evaluated, and their
        objectives, (k, m)."""
        later = self.pending[self.feasible(self.pending) >= LIKELY]
        designs = np.vstack([self.known.designs[self.allowed], later])
        return designs, np.vstack([self.believed[self.allowed], self.means(later)])


class _Evaluated(NamedTuple):
    """One objective or constraint of n designs, as `Known` has them."""

    designs: Array
    values: Array
    errors: Array
    shifts: Array | None


def _trended(
    made: _Evaluated, space: Space, trend: OfDesigns, rng: np.random.Generator, last: Trended | None
) -> Trended:
    """A model with the trend or without it: the one with the smaller leave-one-out errors."""
    guess, known = trend(made.designs), np.isfinite(made.values)
    steps = guess[known] - guess[known].mean() if known.any() else guess[known]
    squares = float(steps @ steps)
    moves = squares > FLAT**2 * float(np.square(guess[known]).sum())
    slopes = [0.0, float(steps @ made.values[known]) / squares] if moves else [0.0]
    like = last.rest if last else None
    models = [
        Trended(_fitted(made._replace(values=made.values - slope * guess), space.bounds, rng, like), slope, trend)
        for slope in slopes
    ]  # fmt: skip
    return min(models, key=lambda one: np.square(one.rest.values - one.rest.leave_one_out()).sum())


def _fitted(
    made: _Evaluated, bounds: Array, rng: np.random.Generator, like: Kriging | None
) -> Kriging:
    designs, values = made.designs, made.values
    known = np.isfinite(values)
    size = float(np.std(values[known])) if known.any() else 0.0
    with np.errstate(invalid="ignore"):
        squares = np.where(made.errors > 0.0, made.errors, np.nan)[known] ** 2
    if not (size > 0.0 and np.isfinite(squares).any()):
        return fit_kriging(
            designs, values, bounds, rng=rng, restarts=like is None, kernel=MATERN, like=like
        )
    middle = float(np.nanmedian(squares))
    own = np.ones(len(values))
    own[known] = np.clip(np.nan_to_num(squares / middle, nan=1.0), 1e-3, 1e3)
    common = _common(made)
    factors = NOISE if common is None else APART
    low, high = (max(factor * middle / size**2, 1e-8) for factor in factors)
    return fit_kriging(
        designs, values, bounds, rng=rng, restarts=like is None, lengths=LENGTHS, kernel=MATERN,
        noise=(low, max(high, 10.0 * low)), errors=Errors(own, common), like=like,
    )  # fmt: skip


def _common(made: _Evaluated) -> Array | None:
    """Covariance of what errors have in common, (n, n), by what replicates shift; None where that is not known."""
    if made.shifts is None:
        return None
    shifts = np.nan_to_num(made.shifts)
    sizes = np.sqrt(np.square(shifts).sum(axis=1))
    shifts *= (np.nan_to_num(made.errors) / np.where(sizes > 0.0, sizes, np.inf))[:, None]
    return np.asarray(shifts @ shifts.T)


def _noise(model: Kriging) -> float:
    """Variance of the error that one more value has beyond what it shares with its neighbour, as a rule."""
    if model.errors is None:
        return float(model.scale**2 * model.noise_variance)
    own, common = model.noise_variance * float(np.median(model.errors.own)), model.errors.common
    if common is not None:
        away = cdist(*[model.to_unit(model.inputs) / model.length_scales] * 2)
        np.fill_diagonal(away, np.inf)
        rows, near, sizes = np.arange(len(away)), away.argmin(axis=1), np.diag(common)
        shared = common[rows, near] ** 2 / np.where(sizes[near] > 0.0, sizes[near], np.inf)
        own += float(np.median(sizes - shared))
    return float(model.scale**2 * own)


def _extended(model: Trended, point: Array) -> Trended:
    """A model with one more value, the one that it expects: which changes no other expectation, and has no weight."""
    rest = model.rest
    errors = rest.errors and rest.errors.extended()
    more = replace(
        rest,
        inputs=np.vstack([rest.inputs, point]),
        values=np.append(rest.values, rest.predict(point[None])),
        alpha=np.append(rest.alpha, 0.0),
        errors=errors,
    )
    return replace(model, rest=more)
