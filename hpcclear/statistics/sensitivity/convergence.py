"""The interval in which a first-order sensitivity no longer changes.

"No longer changes" is a statement about numbers with errors. In a wide interval the polynomial
cannot follow f (truncation, falling as the length to the power of the order); a short one amplifies
the scatter of f (standard error, growing as 1/length). The rule, for each clearance and each
variable on its own:

1. Two estimates agree if they differ by no more than t * sqrt(SE_i^2 + SE_j^2), t being Student's
   quantile for the stated confidence, or by no more than a stated fraction of the derivative. Every
   interval has points of its own, so that the errors are independent.
2. The plateau begins at the widest interval from which on *all* estimates agree with each other.
   Agreement of two neighbours alone comes by chance, or from a truncation that changes slowly.
   (Lepski's choice of a bandwidth, DOI 10.1137/1135065.)
3. The uncertainty of an estimate joins its standard error with the truncation that may be left: the
   change since the interval before it, extrapolated to length 0.
4. A derivative is determined in an interval if it differs from 0 by more than t' uncertainties, and
   in the interval before it by more than t' standard errors (of the same sign, or they would not
   agree). t' is t corrected for the number of intervals looked at (Bonferroni).
5. The convergence interval is the widest one after the beginning of the plateau in which the
   derivative is determined. As in the paper, it is the second of two that agree.

Pure noise agrees with itself in every interval, but fails step 4: "not determined". So does a
derivative that is 0; its standard error then says how large it could be.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.statistics.sensitivity.intervals import SensitivityHistory

CONFIDENCE = 0.99
"""Of each comparison, which is two-sided."""
TOLERANCE = 0.02
"""Relative change of a derivative that counts as none. It matters for an f without scatter, whose standard errors are small;
the change is part of the uncertainty."""


@dataclass(frozen=True)
class ConvergenceIntervals:
    """Where the sensitivities stopped changing; the rule is in the module's text."""

    found: Booleans
    """Shape (c, d): interval found and derivative determined; False is "not determined"."""
    interval: Integers
    """Shape (c, d): index of the convergence interval in the history, -1 where not determined."""
    plateau: Integers
    """Shape (c, d): index of the widest interval from which on the estimates agree, -1 if not even the last two do. Not
    determined with a plateau: not distinguishable from 0. Without: still changing."""
    sensitivity: Array
    uncertainty: Array
    """sensitivity and uncertainty, shape (c, d): there, in units of f per unit of the variable; the uncertainty holds the
    standard error and the truncation that may be left. NaN where not determined."""


def convergence_intervals(history: SensitivityHistory) -> ConvergenceIntervals:
    """Find where each sensitivity stopped changing (rule: module text; paper: 4.2, step 1)."""
    _, *shape = history.sensitivity.shape
    interval, plateau = np.full((2, *shape), -1, np.int64)
    estimate = np.full((2, *shape), np.nan)
    lengths = np.ptp(history.intervals[:, 0], axis=1)
    for c, j in np.ndindex(*shape):
        usable = np.flatnonzero(np.isfinite(history.standard_error[:, c, j]))
        slope, error = history.sensitivity[usable, c, j], history.standard_error[usable, c, j]
        freedom = history.degrees_of_freedom[usable, c]
        start = _plateau_start(slope, error, _student(freedom, 1.0 - CONFIDENCE))
        if start >= len(usable) - 1:
            continue  # a plateau needs two
        plateau[c, j] = usable[start]
        uncertainty = _uncertainty(slope, error, lengths[usable] ** history.order)
        critical = _student(freedom, (1.0 - CONFIDENCE) / (len(usable) - 1))
        sure = np.abs(slope) > critical * uncertainty
        sure_before = np.abs(slope[:-1]) > critical[:-1] * error[:-1]
        determined = start + 1 + np.flatnonzero((sure[1:] & sure_before)[start:])
        if determined.size:
            at = determined[0]
            interval[c, j] = usable[at]
            estimate[:, c, j] = slope[at], uncertainty[at]
    return ConvergenceIntervals(interval >= 0, interval, plateau, *estimate)


def best_estimates(
    history: SensitivityHistory, intervals: ConvergenceIntervals
) -> tuple[Array, Array]:
    """One derivative and its uncertainty for each clearance and variable, (c, d) each, to rank and select by.

    Taken in the convergence interval of the same history; where the derivative is not distinguishable from 0, at the
    beginning of its plateau, where the standard error says how large it could be; NaN where it
    never stopped changing.
    """
    start = np.maximum(intervals.plateau, 0)[np.newaxis]
    bounded = ~intervals.found & (intervals.plateau >= 0)

    def best(each: Array, there: Array) -> Array:
        return np.where(bounded, np.take_along_axis(each, start, axis=0)[0], there)

    slope = best(history.sensitivity, intervals.sensitivity)
    return slope, best(history.standard_error, intervals.uncertainty)


def _student(freedom: Integers, doubt: float) -> Array:
    """Two-sided Student quantiles that chance passes with probability `doubt`."""
    return np.asarray(stdtrit(freedom, 1.0 - doubt / 2.0))


def _plateau_start(slope: Array, error: Array, critical: Array) -> int:
    """The widest interval from which on all estimates agree: the last if none does."""
    start = len(slope) - 1
    while start > 0:
        wide, short = start - 1, slice(start, None)
        quantile = np.maximum(critical[wide], critical[short])
        chance = quantile * np.hypot(error[wide], error[short])
        allowed = np.maximum(chance, TOLERANCE * np.abs(slope[short]))
        if np.any(np.abs(slope[wide] - slope[short]) > allowed):
            break
        start -= 1
    return start


def _uncertainty(slope: Array, error: Array, truncation: Array) -> Array:
    """Standard errors joined with the truncation left; NaN in the widest interval.

    All arrays run over the intervals, the widest first. `truncation` is what the truncation error
    is proportional to; the change between two intervals, extrapolated to length 0, is what is left.
    """
    left = np.abs(np.diff(slope)) * truncation[1:] / -np.diff(truncation)
    return np.append(np.nan, np.hypot(error[1:], left))
