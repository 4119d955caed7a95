"""First-order sensitivity from response surfaces: intervals it can be trusted in, and selection.

Section 4.2 of the paper, steps 1 to 4. The derivative of the fitted surface at the midpoint of the
design interval is taken for each clearance; the interval is shortened about its midpoint until the
derivative no longer changes; the variables with great influence form X_G-I.

"No longer changes" is a statement about numbers with errors. A wide interval bends the polynomial
(truncation, falling as the length to the power of the order), a short one amplifies the scatter of f
(standard error growing as 1/length). The rule, for each clearance and each variable on its own:

1. Two estimates agree if they differ by no more than t * sqrt(SE_i^2 + SE_j^2), t being Student's
   quantile for the stated confidence, or by no more than a stated fraction of the derivative. (Every
   interval has its own points, so their errors are independent.)
2. The plateau begins at the widest interval whose estimate agrees with those of *all* shorter ones,
   and all of these with each other. Agreement of two neighbours alone would be met by chance, or
   by a truncation that changes slowly. (The choice of Lepski, DOI 10.1137/1135065.)
3. The convergence interval is the one after the beginning, as in the paper's comparison of two: the
   truncation is then smaller still. The change seen between the two, as far as it exceeds its own
   standard error, bounds the truncation that is left; it enters the uncertainty.
4. The derivative is determined if it differs from 0 by more than t uncertainties there and had the
   same sign, t standard errors away from 0, at the beginning of the plateau. Pure noise agrees with
   itself everywhere and fails here: "not determined". So does a derivative that is 0.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import stdtrit

from hpcclear.errors import InputError
from hpcclear.surrogate.metrics import accuracy
from hpcclear.surrogate.response_surface import (
    Evaluate,
    FloatArray,
    Sampler,
    check_bounds,
    fit_response_surface,
    latin_hypercube,
    n_terms,
)


@dataclass(frozen=True)
class IntervalDesign:
    """Points to simulate for every interval and clearance, all known beforehand.

    Attributes
    ----------
    points : numpy.ndarray, shape (n, d + 1)
        The d variables and, last, the clearance. By interval, then clearance, then the training
        points followed by the test points.
    intervals : numpy.ndarray, shape (k, d, 2)
        Limits of the variables, the widest first.
    clearances : numpy.ndarray, shape (c,)
    n_points, n_test : int
        Training and test points of each surface.
    order : int
        Total order of the surfaces.
    """

    points: FloatArray
    intervals: FloatArray
    clearances: FloatArray
    n_points: int
    n_test: int
    order: int


@dataclass(frozen=True)
class SensitivityHistory:
    """Midpoint derivatives of every surface; NaN where too few simulations succeeded.

    Attributes
    ----------
    intervals : numpy.ndarray, shape (k, d, 2)
        Limits of the variables, the widest first.
    clearances : numpy.ndarray, shape (c,)
    sensitivity, standard_error : numpy.ndarray, shape (k, c, d)
        Derivatives at the midpoint, in units of f per unit of the variable.
    r2, rmae : numpy.ndarray, shape (k, c)
        Accuracy on the test points (`hpcclear.surrogate.metrics`).
    leave_one_out_r2 : numpy.ndarray, shape (k, c)
    degrees_of_freedom, failed : numpy.ndarray of int, shape (k, c)
        Of the residuals (0 where no surface was fitted); simulations that failed.
    order : int
        Total order of the surfaces.
    """

    intervals: FloatArray
    clearances: FloatArray
    sensitivity: FloatArray
    standard_error: FloatArray
    r2: FloatArray
    rmae: FloatArray
    leave_one_out_r2: FloatArray
    degrees_of_freedom: NDArray[np.int64]
    failed: NDArray[np.int64]
    order: int


@dataclass(frozen=True)
class ConvergenceIntervals:
    """Where the sensitivities stopped changing; the rule is in the module's text.

    Attributes
    ----------
    found : numpy.ndarray of bool, shape (c, d)
        Interval found and derivative determined; False is "not determined".
    interval : numpy.ndarray of int, shape (c, d)
        Index of the convergence interval in the history, -1 where not determined.
    sensitivity, uncertainty : numpy.ndarray, shape (c, d)
        There, in units of f per unit of the variable; the uncertainty holds the standard error and
        the truncation that may be left. NaN where not determined.
    converged : numpy.ndarray of bool, shape (k, c, d)
        The convergence interval and all shorter ones.
    confidence, tolerance : float
        The rule's settings.
    """

    found: NDArray[np.bool_]
    interval: NDArray[np.int64]
    sensitivity: FloatArray
    uncertainty: FloatArray
    converged: NDArray[np.bool_]
    confidence: float
    tolerance: float


def design_intervals(
    bounds: ArrayLike,
    clearances: ArrayLike,
    rng: np.random.Generator,
    *,
    steps: int = 8,
    shrink: float = 0.2,
    n_points: int = 45,
    n_test: int = 5,
    order: int = 3,
    sample: Sampler = latin_hypercube,
) -> IntervalDesign:
    """Lay out the samples of every interval at every clearance.

    Parameters
    ----------
    bounds : array_like, shape (d, 2)
        The global interval of every variable, in its own unit.
    clearances : array_like, shape (c,)
    rng : numpy.random.Generator
    steps : int
        Number of intervals; 1 gives the sensitivity over the global interval alone.
    shrink : float
        Fraction of the length by which all variables' intervals are shortened from one step to the
        next, in (0, 1).
    n_points, n_test, order : int
        Of each surface (the paper: 45, 5 and a cubic, for two variables).
    sample : callable
        ``sample(n, bounds, rng)`` -> points of shape (n, d).

    Returns
    -------
    IntervalDesign

    Raises
    ------
    InputError
        If a setting is out of range, or there would be too few points for a standard error.
    """
    limits = check_bounds(bounds)
    gaps = np.asarray(clearances, float)
    _check_design(gaps, steps, shrink, n_points, n_test, n_terms(len(limits), order))
    fractions = (1.0 - shrink) ** np.arange(steps)
    middle, half = limits.mean(axis=1), np.ptp(limits, axis=1) / 2.0
    lower = middle - fractions[:, np.newaxis] * half
    upper = middle + fractions[:, np.newaxis] * half
    intervals = np.stack([lower, upper], axis=2)
    intervals[0] = limits  # bit for bit
    blocks = [
        np.column_stack([sample(n, interval, rng), np.full(n, gap)])
        for interval in intervals
        for gap in gaps
        for n in (n_points, n_test)
    ]
    return IntervalDesign(np.vstack(blocks), intervals, gaps, n_points, n_test, order)


def analyse_intervals(design: IntervalDesign, values: ArrayLike) -> SensitivityHistory:
    """Fit a surface for every interval and clearance and take its midpoint derivatives (eq. 14).

    Parameters
    ----------
    design : IntervalDesign
    values : array_like, shape (n,)
        f at `design.points`; those that are not finite are failed simulations, counted in `failed`.
        A surface left with too few points is NaN in the history.

    Returns
    -------
    SensitivityHistory

    Raises
    ------
    InputError
        If the number of values does not fit, or no surface at all can be fitted.
    """
    y = np.asarray(values, float)
    if y.shape != (len(design.points),):
        raise InputError(
            "values", y.shape, f"not one for {len(design.points)} points", "match them"
        )
    steps, n_variables, _ = design.intervals.shape
    shape = steps, len(design.clearances)
    y = y.reshape(*shape, -1)
    x = design.points[:, :-1].reshape(*y.shape, n_variables)
    gradient = np.full((2, *shape, n_variables), np.nan)
    quality = np.full((3, *shape), np.nan)
    freedom = np.zeros(shape, np.int64)
    train, test = slice(design.n_points), slice(design.n_points, None)
    for k, c in np.ndindex(shape):
        enough = n_terms(n_variables, design.order) < np.count_nonzero(np.isfinite(y[k, c, train]))
        if not enough:
            continue
        limits = design.intervals[k]
        surface = fit_response_surface(x[k, c, train], y[k, c, train], limits, design.order)
        gradient[:, k, c] = surface.gradient(limits.mean(axis=1))
        freedom[k, c] = surface.degrees_of_freedom
        quality[2, k, c] = surface.leave_one_out_r2
        if np.count_nonzero(np.isfinite(y[k, c, test])) >= 2:
            reached = accuracy(y[k, c, test], surface.predict(x[k, c, test]))
            quality[:2, k, c] = reached.r2, reached.rmae
    failed = np.count_nonzero(~np.isfinite(y), axis=2)
    if not freedom.any():
        raise InputError(
            "values",
            int(failed.sum()),
            "so many simulations failed that no surface can be fitted",
            "look at their status, mend them, or take more points",
        )
    return SensitivityHistory(
        design.intervals, design.clearances, *gradient, *quality, freedom, failed, design.order
    )


def sensitivity_history(
    evaluate: Evaluate,
    bounds: ArrayLike,
    clearances: ArrayLike,
    rng: np.random.Generator,
    *,
    steps: int = 8,
    shrink: float = 0.2,
    n_points: int = 45,
    n_test: int = 5,
    order: int = 3,
    sample: Sampler = latin_hypercube,
) -> SensitivityHistory:
    """Design, evaluate and analyse in one call; `evaluate` gets all points at once.

    Parameters
    ----------
    evaluate : callable
        Points of shape (n, d + 1), the clearance last -> values of shape (n,), NaN where failed.
    bounds, clearances, rng, steps, shrink, n_points, n_test, order, sample
        See `design_intervals`.

    Returns
    -------
    SensitivityHistory

    Raises
    ------
    InputError
        See `design_intervals` and `analyse_intervals`.
    """
    design = design_intervals(
        bounds,
        clearances,
        rng,
        steps=steps,
        shrink=shrink,
        n_points=n_points,
        n_test=n_test,
        order=order,
        sample=sample,
    )
    return analyse_intervals(design, evaluate(design.points))


def convergence_intervals(
    history: SensitivityHistory, *, confidence: float = 0.99, tolerance: float = 0.02
) -> ConvergenceIntervals:
    """Find where each sensitivity stopped changing (rule: module text; paper: 4.2, step 1).

    Parameters
    ----------
    history : SensitivityHistory
    confidence : float
        Two-sided, of each comparison, in (0, 1).
    tolerance : float
        Relative change of a derivative that counts as none, at least 0. It matters for an f
        without scatter, whose standard errors are small; the change is part of the uncertainty.

    Returns
    -------
    ConvergenceIntervals

    Raises
    ------
    InputError
        If a setting is out of range.
    """
    check_confidence(confidence)
    if not 0.0 <= tolerance < 1.0:
        raise InputError("tolerance", tolerance, "not a fraction", "take 0 <= tolerance < 1")
    n_steps, *shape = history.sensitivity.shape
    interval = np.full(shape, -1, np.int64)
    estimate = np.full((2, *shape), np.nan)
    lengths = np.ptp(history.intervals[:, 0], axis=1)
    for c, j in np.ndindex(*shape):
        usable = np.flatnonzero(np.isfinite(history.standard_error[:, c, j]))
        interval_found = _converged_at(
            history.sensitivity[usable, c, j],
            history.standard_error[usable, c, j],
            _critical(history.degrees_of_freedom[usable, c], confidence),
            lengths[usable] ** history.order,
            tolerance,
        )
        if interval_found is not None:
            at, uncertainty = interval_found
            interval[c, j] = usable[at]
            estimate[:, c, j] = history.sensitivity[usable[at], c, j], uncertainty
    found = interval >= 0
    later = np.arange(n_steps)[:, np.newaxis, np.newaxis] >= interval
    return ConvergenceIntervals(found, interval, *estimate, found & later, confidence, tolerance)


def _converged_at(
    slope: FloatArray,
    error: FloatArray,
    critical: FloatArray,
    truncation: FloatArray,
    tolerance: float,
) -> tuple[int, float] | None:
    """Index of the convergence interval and the uncertainty there, or None.

    All arrays run over the intervals, the widest first; `truncation` is proportional to the
    truncation error expected in each.
    """
    start = _plateau_start(slope, error, critical, tolerance)
    if start is None:
        return None
    at = start + 1
    change, noise = slope[start] - slope[at], np.hypot(error[start], error[at])
    excess = np.sqrt(max(change**2 - noise**2, 0.0))
    left = excess * truncation[at] / (truncation[start] - truncation[at])
    uncertainty = float(np.hypot(error[at], left))
    determined = (
        abs(slope[at]) > critical[at] * uncertainty
        and abs(slope[start]) > critical[start] * error[start]
        and slope[at] * slope[start] > 0.0
    )
    return (at, uncertainty) if determined else None


def _plateau_start(
    slope: FloatArray, error: FloatArray, critical: FloatArray, tolerance: float
) -> int | None:
    """The widest interval from which on all estimates agree; None if not even the last two do."""
    last = len(slope) - 1
    start = last
    while start > 0:
        wide, short = start - 1, slice(start, None)
        quantile = np.maximum(critical[wide], critical[short])
        allowed = np.maximum(
            quantile * np.hypot(error[wide], error[short]), tolerance * np.abs(slope[short])
        )
        if np.any(np.abs(slope[wide] - slope[short]) > allowed):
            break
        start -= 1
    return start if start < last else None


def check_confidence(confidence: float) -> None:
    """Refuse a confidence that is not in (0, 1)."""
    if not 0.0 < confidence < 1.0:
        raise InputError("confidence", confidence, "not a probability", "take 0.99, for example")


def _critical(freedom: NDArray[np.int64], confidence: float) -> FloatArray:
    """Two-sided Student quantile for each number of degrees of freedom."""
    return np.asarray(stdtrit(freedom, 0.5 + confidence / 2.0))


def _check_design(
    clearances: FloatArray, steps: int, shrink: float, n_points: int, n_test: int, terms: int
) -> None:
    if clearances.ndim != 1 or clearances.size == 0 or not np.isfinite(clearances).all():
        raise InputError(
            "clearances",
            clearances.tolist(),
            "not a list of numbers",
            "give at least one clearance",
        )
    if steps < 1:
        raise InputError("steps", steps, "no interval at all", "take at least 1")
    if not 0.0 < shrink < 1.0:
        raise InputError("shrink", shrink, "not a fraction of the length", "take 0 < shrink < 1")
    if n_points <= terms:
        raise InputError(
            "n_points",
            n_points,
            f"a surface of {terms} terms leaves nothing to estimate the scatter from",
            f"take at least {terms + 1}, better {2 * terms}",
        )
    if n_test < 2:
        raise InputError("n_test", n_test, "R2 needs two test points", "take at least 2")
