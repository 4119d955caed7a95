"""First-order sensitivity from response surfaces over ever shorter intervals.

Section 4.2 of the paper. The derivative of the fitted surface at the midpoint of the design
interval is taken for each clearance, over intervals that are shortened together about their
midpoints. `hpcclear.statistics.sensitivity.convergence` says in which of them it can be trusted.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.metrics import Accuracy, accuracy
from hpcclear.statistics.surrogate.polynomial import n_terms
from hpcclear.statistics.surrogate.response_surface import (
    ResponseSurface,
    fit_response_surface,
    latin_hypercube,
)
from hpcclear.statistics.surrogate.term_choice import least_points


@dataclass(frozen=True)
class IntervalSettings:
    """Size of an interval study; the defaults for a surface in two variables follow the paper."""

    steps: int = 6
    """Number of intervals; 1 gives the sensitivity over the global interval alone."""
    shrink: float = 0.3
    """Fraction of its length by which every interval is shortened from one step to the next, in (0, 1)."""
    n_points: int = 45
    n_test: int = 5
    order: int = 3
    """n_points, n_test and order: training points, test points and total order of each surface."""
    chosen: bool = False
    """Whether surfaces choose their terms (`fit_response_surface`)."""

    def needed(self, variables: int) -> int:
        """Points without which there is no surface in so many variables."""
        return least_points(variables) if self.chosen else n_terms(variables, self.order)


@dataclass(frozen=True)
class IntervalDesign:
    """Points to simulate for every interval and clearance, all known beforehand."""

    points: Array
    """Shape (n, d + 1): the d variables and, last, the clearance. By interval, then clearance, then the training points
    followed by the test points."""
    intervals: Array
    """Shape (k, d, 2): bounds of the variables, the widest first."""
    clearances: Array
    """Shape (c,)."""
    settings: IntervalSettings

    def by_surface(self, values: ArrayLike) -> tuple[Array, Array]:
        """Variables (k, c, n, d) and values (k, c, n) of the points of each surface, from f at all points."""
        shape = len(self.intervals), len(self.clearances), -1
        variables = self.points[:, :-1].reshape(*shape, self.intervals.shape[1])
        return variables, np.asarray(values, float).reshape(shape)

    def fitted(
        self, k: int, points: Array, values: Array, spare: int = 0
    ) -> tuple[ResponseSurface | None, Accuracy | None]:
        """The surface over interval k through its training points, and its accuracy on its test points.

        None where failures left less than the points that are needed and `spare` more, or fewer than two to test.
        """
        cut, limits, settings = self.settings.n_points, self.intervals[k], self.settings
        if np.isfinite(values[:cut]).sum() < settings.needed(len(limits)) + spare:
            return None, None
        order, chosen = settings.order, settings.chosen
        surface = fit_response_surface(points[:cut], values[:cut], limits, order, chosen=chosen)
        if np.isfinite(values[cut:]).sum() < 2:
            return surface, None
        return surface, accuracy(values[cut:], surface.predict(points[cut:]))


@dataclass(frozen=True)
class SensitivityHistory:
    """Midpoint derivatives of every surface; NaN where too few simulations succeeded."""

    intervals: Array
    """Shape (k, d, 2): bounds of the variables, the widest first."""
    sensitivity: Array
    standard_error: Array
    """sensitivity and standard_error, shape (k, c, d): derivatives at the midpoint, in units of f per unit of the variable."""
    r2: Array
    rmae: Array
    """r2 and rmae, shape (k, c): accuracy on the test points (`hpcclear.statistics.surrogate.metrics`)."""
    leave_one_out_r2: Array
    """Shape (k, c)."""
    degrees_of_freedom: Integers
    """Of the residuals, shape (k, c); 0 where no surface was fitted."""
    order: int
    """Total order of the surfaces."""


def design_intervals(
    bounds: ArrayLike,
    clearances: ArrayLike,
    rng: np.random.Generator,
    settings: IntervalSettings,
) -> IntervalDesign:
    """Lay out the samples of every interval at every clearance.

    `bounds` (d, 2): the global interval of every variable, in its own unit. Raises InputError: there would be too few points
    for a standard error.
    """
    limits, gaps = np.asarray(bounds, float), np.asarray(clearances, float)
    needed = settings.needed(len(limits))
    if settings.n_points <= needed:
        reason = f"a surface that takes {needed} points leaves nothing to estimate the scatter from"
        remedy = f"take at least {needed + 1}, better {2 * needed}"
        raise InputError("n_points", settings.n_points, reason, remedy)
    fractions = (1.0 - settings.shrink) ** np.arange(settings.steps)
    middle, half = limits.mean(axis=1), np.ptp(limits, axis=1) / 2.0
    lower = middle - fractions[:, np.newaxis] * half
    upper = middle + fractions[:, np.newaxis] * half
    intervals = np.stack([lower, upper], axis=2)
    intervals[0] = limits  # bit for bit
    each = product(intervals, gaps, (settings.n_points, settings.n_test))
    blocks = ((latin_hypercube(n, one, rng), np.full(n, gap)) for one, gap, n in each)
    points = np.vstack([np.column_stack(block) for block in blocks])
    return IntervalDesign(points, intervals, gaps, settings)


def analyse_intervals(design: IntervalDesign, values: ArrayLike) -> SensitivityHistory:
    """Fit a surface for every interval and clearance and take its midpoint derivatives (eq. 14).

    `values` (n,): f at `design.points`; those that are not finite are failed simulations. A surface left with too few points is
    NaN in the history. Raises InputError if no surface at all can be fitted.
    """
    x, y = design.by_surface(values)
    shape = y.shape[:2]
    slope, error = gradient = np.full((2, *shape, x.shape[-1]), np.nan)
    r2, rmae, left_out = np.full((3, *shape), np.nan)
    freedom = np.zeros(shape, np.int64)
    for k, c in np.ndindex(*shape):
        surface, tested = design.fitted(k, x[k, c], y[k, c], 1)
        if surface is not None:
            gradient[:, k, c] = surface.gradient(design.intervals[k].mean(axis=1))
            left_out[k, c] = surface.leave_one_out_r2
            freedom[k, c] = surface.degrees_of_freedom
        if tested is not None:
            r2[k, c], rmae[k, c] = tested.r2, tested.rmae
    if not freedom.any():
        failed = int(np.count_nonzero(~np.isfinite(y)))
        reason = "too many simulations failed to fit a surface"
        remedy = "look at their status, correct the cause, or use more points"
        raise InputError("values", failed, reason, remedy)
    surfaces = r2, rmae, left_out, freedom, design.settings.order
    return SensitivityHistory(design.intervals, slope, error, *surfaces)
