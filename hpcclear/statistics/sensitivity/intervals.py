"""First-order sensitivity from response surfaces over ever shorter intervals.

Section 4.2 of the paper. The derivative of the fitted surface at the midpoint of the design
interval is taken for each clearance, over intervals that are shortened together about their
midpoints. `hpcclear.statistics.sensitivity.convergence` says in which of them it can be trusted.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.metrics import accuracy
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


DEFAULTS = IntervalSettings()


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


@dataclass(frozen=True)
class SensitivityHistory:
    """Midpoint derivatives of every surface; NaN where too few simulations succeeded."""

    intervals: Array
    """Shape (k, d, 2): bounds of the variables, the widest first."""
    clearances: Array
    """Shape (c,)."""
    sensitivity: Array
    standard_error: Array
    """sensitivity and standard_error, shape (k, c, d): derivatives at the midpoint, in units of f per unit of the variable."""
    r2: Array
    rmae: Array
    """r2 and rmae, shape (k, c): accuracy on the test points (`hpcclear.statistics.surrogate.metrics`)."""
    leave_one_out_r2: Array
    """Shape (k, c)."""
    degrees_of_freedom: Integers
    failed: Integers
    """degrees_of_freedom and failed, shape (k, c): of the residuals (0 where no surface was fitted); simulations that
    failed."""
    order: int
    """Total order of the surfaces."""


def design_intervals(
    bounds: ArrayLike,
    clearances: ArrayLike,
    rng: np.random.Generator,
    settings: IntervalSettings = DEFAULTS,
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
    blocks = [
        np.column_stack([latin_hypercube(n, interval, rng), np.full(n, gap)])
        for interval in intervals
        for gap in gaps
        for n in (settings.n_points, settings.n_test)
    ]
    return IntervalDesign(np.vstack(blocks), intervals, gaps, settings)


def analyse_intervals(design: IntervalDesign, values: ArrayLike) -> SensitivityHistory:
    """Fit a surface for every interval and clearance and take its midpoint derivatives (eq. 14).

    `values` (n,): f at `design.points`; those that are not finite are failed simulations, counted in `failed`. A surface left
    with too few points is NaN in the history. Raises InputError if no surface at all can be fitted.
    """
    steps, n_variables, _ = design.intervals.shape
    shape = steps, len(design.clearances)
    y = np.asarray(values, float).reshape(*shape, -1)
    x = design.points[:, :-1].reshape(*y.shape, n_variables)
    slope, error = gradient = np.full((2, *shape, n_variables), np.nan)
    r2, rmae, left_out = quality = np.full((3, *shape), np.nan)
    freedom = np.zeros(shape, np.int64)
    for k, c in np.ndindex(*shape):
        surface = _surface(design, k, x[k, c], y[k, c])
        if surface is not None:
            gradient[:, k, c] = surface.gradient(design.intervals[k].mean(axis=1))
            quality[:, k, c] = *_tested(design, surface, x[k, c], y[k, c]), surface.leave_one_out_r2
            freedom[k, c] = surface.degrees_of_freedom
    failed = np.count_nonzero(~np.isfinite(y), axis=2)
    if not freedom.any():
        reason = "too many simulations failed to fit a surface"
        remedy = "look at their status, correct the cause, or use more points"
        raise InputError("values", int(failed.sum()), reason, remedy)
    where, order = (design.intervals, design.clearances), design.settings.order
    return SensitivityHistory(*where, slope, error, r2, rmae, left_out, freedom, failed, order)


def _surface(
    design: IntervalDesign, k: int, points: Array, values: Array
) -> ResponseSurface | None:
    """Surface over interval k on its training points; None if failures left too few of them."""
    limits, settings = design.intervals[k], design.settings
    values = values[: settings.n_points]
    if np.count_nonzero(np.isfinite(values)) <= settings.needed(len(limits)):
        return None
    at = points[: len(values)]
    return fit_response_surface(at, values, limits, settings.order, chosen=settings.chosen)


def _tested(
    design: IntervalDesign, surface: ResponseSurface, points: Array, values: Array
) -> tuple[float, float]:
    """R2 and RMAE on the test points; NaN if fewer than two of them succeeded."""
    points, values = points[design.settings.n_points :], values[design.settings.n_points :]
    if np.count_nonzero(np.isfinite(values)) < 2:
        return float("nan"), float("nan")
    reached = accuracy(values, surface.predict(points))
    return reached.r2, reached.rmae
