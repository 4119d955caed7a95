"""The search for a response surface that is accurate enough (section 4.2, step 1)."""

from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate import response_surface as surfaces
from hpcclear.statistics.surrogate.metrics import Accuracy, accuracy
from hpcclear.statistics.surrogate.response_surface import ResponseSurface


@dataclass(frozen=True)
class Attempt:
    """One surface that was tried: its order, the points it had, and what came of it.

    `accuracy` is None where no surface could be fitted; `note` then says why.
    """

    order: int
    n_points: int
    accuracy: Accuracy | None
    note: str


@dataclass(frozen=True)
class SurfaceSearch:
    """Outcome of a `search`.

    Attributes
    ----------
    surface : ResponseSurface
        The accepted surface, or the one with the least RMSE on the test points if none was.
    accuracy : Accuracy
        Its accuracy on the test points.
    accepted : bool
        Whether it met the targets.
    reason : str
        The verdict in one sentence.
    attempts : tuple of Attempt
        Everything that was tried, in order.
    """

    surface: ResponseSurface
    accuracy: Accuracy
    accepted: bool
    reason: str
    attempts: tuple[Attempt, ...]


@dataclass(frozen=True)
class SearchSettings:
    """What is tried, in which order, and when it is enough; the defaults follow the paper."""

    orders: Sequence[int] = (3, 2, 4)  # total orders, the preferred one first
    n_points: int = 45  # first training sample
    n_test: int = 5
    max_points: int = 360  # largest training sample
    r2_min: float = 0.9  # targets, see `hpcclear.statistics.surrogate.metrics.Accuracy.meets`
    rmae_max: float = 0.5
    chosen: bool = False  # whether surfaces choose their terms (`fit_response_surface`)


Search = Generator[Array, Array, SurfaceSearch]
"""A search under way: yields points, shape (n, d), and is sent the true function there, (n,)."""


def fit_until_accepted(
    evaluate: Callable[[Mapping[int, Array]], Mapping[int, Array]], searches: Sequence[Search]
) -> list[SurfaceSearch]:
    """Carry out searches in one batch: what all of them request is evaluated at once, round by round.

    Parameters
    ----------
    evaluate : callable
        From points by number of the search to values.
    searches : sequence of `search`

    Raises
    ------
    InputError
        As `search`.
    """
    found: dict[int, SurfaceSearch] = {}
    asked = {number: next(one) for number, one in enumerate(searches)}
    while asked:
        values, more = evaluate(asked), {}
        for number in asked:
            try:
                more[number] = searches[number].send(values[number])
            except StopIteration as ended:
                found[number] = ended.value
        asked = more
    return [found[number] for number in range(len(searches))]


def search(
    bounds: ArrayLike,
    rng: np.random.Generator,
    settings: SearchSettings,
    sample: surfaces.Sampler = surfaces.latin_hypercube,
) -> Search:
    """Raise the sample or change the order until a surface passes, or say that none does.

    At each sample size the orders are tried as listed and the first that passes is taken (section
    4.2, step 1: 45 points, 5 test points, a cubic). If none does, the sample is doubled by new
    points, up to `max_points`. The test points are drawn once and never trained on: fresh ones in
    each round would let a poor surface pass by luck.

    Parameters
    ----------
    bounds : array_like, shape (d, 2)
    sample : callable
        ``sample(n, bounds, rng)`` -> points of shape (n, d).

    Returns
    -------
    SurfaceSearch

    Raises
    ------
    InputError
        If no order can be fitted at any allowed sample, or fewer than two test values are finite.
    """
    limits = np.asarray(bounds, float)
    orders, targets = settings.orders, (settings.r2_min, settings.rmae_max)
    test = sample(settings.n_test, limits, rng)
    true = _test_values((yield test))
    attempts: list[Attempt] = []
    best: tuple[ResponseSurface, Accuracy] | None = None
    points, values = np.empty((0, len(limits))), np.empty(0)
    while len(points) < settings.max_points:
        # doubled each time by new points
        more = min(len(points) or settings.n_points, settings.max_points - len(points))
        fresh = sample(more, limits, rng)
        points, values = np.vstack([points, fresh]), np.append(values, (yield fresh))
        for order in orders:
            try:
                surface = surfaces.fit_response_surface(
                    points, values, limits, order, chosen=settings.chosen
                )
            except InputError as refusal:
                attempts.append(Attempt(order, len(points), None, str(refusal)))
                continue
            reached = accuracy(true, surface.predict(test))
            attempts.append(Attempt(order, len(points), reached, ""))
            if reached.meets(*targets):
                reason = f"order {order} on {len(points)} points meets the targets"
                return SurfaceSearch(surface, reached, True, reason, tuple(attempts))
            if best is None or reached.rmse < best[1].rmse:
                best = surface, reached
    if best is None:
        raise InputError(
            "surrogate",
            tuple(orders),
            f"no surface could be fitted: {attempts[-1].note}",
            "raise max_points, lower the orders, or correct the failing simulations",
        )
    reason = (
        f"no order of {tuple(orders)} reaches R2 >= {targets[0]:g} and RMAE <= {targets[1]:g} "
        f"with up to {attempts[-1].n_points} points; the best has R2 = {best[1].r2:.3g}, "
        f"RMAE = {best[1].rmae:.3g}"
    )
    return SurfaceSearch(*best, False, reason, tuple(attempts))


def _test_values(values: Array) -> Array:
    """The test values, refused before anything is spent on training if most of them failed."""
    if np.count_nonzero(np.isfinite(values)) < 2:
        raise InputError(
            "test points",
            len(values),
            "fewer than two of them have a finite value",
            "use more test points or correct the failing simulations",
        )
    return values
