"""The search for a response surface that is accurate enough (section 4.2, step 1)."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.metrics import Accuracy, accuracy
from hpcclear.statistics.surrogate.response_surface import (
    ResponseSurface,
    fit_response_surface,
    latin_hypercube,
)


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


class SurfaceSearch:
    """The search for one surface.

    At each sample size the orders are tried as listed and the first that passes is taken (section
    4.2, step 1: 45 points, 5 test points, a cubic). If none does, the sample is doubled by new
    points, up to `max_points`. The test points are drawn once and never trained on: fresh ones in
    each round would let a poor surface pass by luck.

    `best`: the accepted surface, or the one with the least RMSE on the test points if none was, and its accuracy on these;
    `accepted`: whether it met the targets.
    """

    def __init__(
        self, bounds: ArrayLike, rng: np.random.Generator, settings: SearchSettings
    ) -> None:
        self._bounds, self._rng, self._settings = np.asarray(bounds, float), rng, settings
        self._test = latin_hypercube(settings.n_test, self._bounds, rng)
        self._true: Array | None = None
        self._points, self._values = np.empty((0, len(self._bounds))), np.empty(0)
        self._refusal: InputError | None = None
        self.best: tuple[ResponseSurface, Accuracy] | None = None
        self.accepted = False

    @property
    def over(self) -> bool:
        """Whether no more points are needed, or allowed."""
        return self.accepted or len(self._points) >= self._settings.max_points

    def wanted(self) -> Array:
        """Points (n, d) to evaluate next: the test points first."""
        if self._true is None:
            return self._test
        count = len(self._points)
        more = min(count or self._settings.n_points, self._settings.max_points - count)
        fresh = latin_hypercube(more, self._bounds, self._rng)
        self._points = np.vstack([self._points, fresh])
        return fresh

    def take(self, values: Array) -> None:
        """Take the true function (n,) at the points that were wanted; raises InputError as `fit_until_accepted`."""
        if self._true is not None:
            self._values = np.append(self._values, values)
            self._try()
            return
        self._true = values
        if np.count_nonzero(np.isfinite(values)) < 2:  # before anything is spent on training
            reason = "fewer than two of them have a finite value"
            remedy = "use more test points or correct the failing simulations"
            raise InputError("test points", len(values), reason, remedy)

    def _try(self) -> None:
        settings, training = self._settings, (self._points, self._values, self._bounds)
        for order in settings.orders:
            try:
                surface = fit_response_surface(*training, order, chosen=settings.chosen)
            except InputError as refusal:
                self._refusal = refusal
                continue
            assert self._true is not None  # the test points come first
            reached = accuracy(self._true, surface.predict(self._test))
            self.accepted = reached.meets(settings.r2_min, settings.rmae_max)
            if self.accepted or self.best is None or reached.rmse < self.best[1].rmse:
                self.best = surface, reached
            if self.accepted:
                return
        if self.over and self.best is None:
            reason = f"no surface could be fitted: {self._refusal}"
            remedy = "raise max_points, lower the orders, or correct the failing simulations"
            raise InputError("surrogate", tuple(settings.orders), reason, remedy)


def fit_until_accepted(
    evaluate: Callable[[Mapping[int, Array]], Mapping[int, Array]],
    searches: Sequence[SurfaceSearch],
) -> None:
    """Carry out searches in one batch: what all of them request is evaluated at once, round by round.

    `evaluate`: from points by number of the search to values. The searches know the surfaces afterwards.
    Raises InputError if no order can be fitted at any allowed sample, or fewer than two test values are finite.
    """
    while going := {number: one for number, one in enumerate(searches) if not one.over}:
        values = evaluate({number: one.wanted() for number, one in going.items()})
        for number, one in going.items():
            one.take(values[number])
