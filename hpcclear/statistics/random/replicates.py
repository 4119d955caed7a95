"""Mean, standard deviation, quantiles and probabilities from independent replicates, with confidence intervals.

A replicate is one randomised Sobol sequence, or one draw of plain Monte Carlo: what differs
between replicates is all that is known about the error, whatever is inside them. So one
set of formulas serves both, and the intervals take Student's t by the number of replicates.

Sources: A. B. Owen, "Monte Carlo variance of scrambled net quadrature", SIAM J. Numer. Anal. 34
(1997), doi:10.1137/S0036142994277468; P. L'Ecuyer and C. Lemieux, "Recent advances in randomized
quasi-Monte Carlo methods" (2002), doi:10.1007/0-306-48102-2_20; for the quantile R. S. Woodruff,
"Confidence intervals for medians and other position measures", J. Amer. Stat. Assoc. 47 (1952),
doi:10.1080/01621459.1952.10483443, and R. R. Bahadur, "A note on quantiles in large samples", Ann. Math. Stat. 37 (1966),
doi:10.1214/aoms/1177699450; for the probability E. L. Korn and B. I. Graubard, "Confidence intervals for proportions with small
expected number of positive counts estimated from survey data", Survey Methodology 24 (1998), 193-201, and L. D. Brown,
T. T. Cai, A. DasGupta, "Interval estimation for a binomial proportion", Statistical Science 16 (2001),
doi:10.1214/ss/1009213286.
"""

from dataclasses import dataclass

import numpy as np
import scipy  # its part `special` is loaded at first use: a fifth of a start

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.student import student
from hpcclear.statistics.random.survival import share_interval

FEWEST = 4
"""Replicates, or values, from which on an error is reported."""

ROUND_OFF = 1e-12
"""Difference of two numbers, relative, up to which they are one."""


@dataclass(frozen=True)
class Estimate:
    """A number that was estimated from replicates."""

    value: float
    shifts: Array
    """Shape (r,): by how much each replicate would move it (its influence), of mean 0; NaN for a replicate without a value."""

    @property
    def error(self) -> float:
        """Standard error."""
        return float(spread(self.shifts[None])[0])

    @property
    def freedom(self) -> int:
        """Degrees of freedom of the error."""
        return int(np.isfinite(self.shifts).sum()) - 1


FEW = 100.0
"""Values that carry a standard deviation, below which its interval is widened: few values do not show their scatter."""


@dataclass(frozen=True)
class Deviation(Estimate):
    """A standard deviation."""

    carriers: float
    """How many equal squares its values are worth: the square of the sum of squares over the sum of fourth powers."""


def limits(one: Estimate, confidence: float) -> tuple[float, float]:
    """Confidence interval of an estimate, by Student's t; NaN where it has no error.

    That of a standard deviation is symmetric in its logarithm, and wider where a few values carry it: of 512 lognormal values
    of shape 1, say 20 carriers, intervals without that held 82 % of the time instead of 95 %.
    """
    if one.freedom < 1:
        return np.nan, np.nan
    reach = one.error * student(confidence, one.freedom)
    if not (isinstance(one, Deviation) and one.value > 0.0):
        return one.value - reach, one.value + reach
    factor = 1.0 + max(_WIDER * (1.0 / one.carriers - 1.0 / FEW), 0.0)
    width = float(np.exp(min(factor * reach / one.value, _WIDEST)))
    return one.value / width, one.value * width


_WIDER, _WIDEST = 15.0, 3.0


def spread(shifts: Array) -> Array:
    """Standard errors of what replicates shift so, (n, r) to (n,); NaN of fewer than two."""
    known = np.isfinite(shifts)
    count = known.sum(axis=1)
    squares = np.where(known, shifts, 0.0) ** 2
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(count > 1, np.sqrt(squares.sum(axis=1) / (count * (count - 1.0))), np.nan)


def moments(values: Array) -> tuple[Estimate, Deviation]:
    """Mean and standard deviation, free of bias to the order of their errors, of s values of each of r replicates, (r, s).

    A failed simulation is NaN and left out; all is NaN where fewer than `FEWEST` values or replicates are left.
    """
    known, counts, few = _counted(values)
    if few:
        none = np.full(len(values), np.nan)
        return Estimate(np.nan, none), Deviation(np.nan, none, np.nan)
    filled = np.where(known, values, 0.0)
    mean = filled.sum() / counts.sum()
    steps = np.where(known, values - mean, 0.0)
    squares = steps**2
    variance = squares.sum() / counts.sum()
    average = _shifts(steps.sum(axis=1), counts)
    # the mean was fitted to the same values: that took its own variance from theirs
    whole = variance + float(spread(average[None])[0]) ** 2
    deviation = np.sqrt(whole)
    twice = 2.0 * deviation if deviation > 0.0 else 1.0
    second = _shifts((squares - np.where(known, variance, 0.0)).sum(axis=1), counts) / twice
    fourth = float((squares**2).sum())
    carriers = float(squares.sum()) ** 2 / fourth if fourth > 0.0 else np.inf
    return Estimate(float(mean), average), Deviation(float(deviation), second, carriers)


def _counted(values: Array) -> tuple[Booleans, Array, bool]:
    """Which values are known, how many of each replicate, and whether values or replicates are fewer than `FEWEST`."""
    known = np.isfinite(values)
    counts = known.sum(axis=1)
    return known, counts, bool(known.sum() < FEWEST or (counts > 0).sum() < FEWEST)


def _shifts(sums: Array, counts: Array) -> Array:
    """Influence of each replicate on a ratio of sums whose remainders are `sums`."""
    return np.where(counts > 0, sums / counts[counts > 0].mean(), np.nan)


@dataclass(frozen=True)
class Limited(Estimate):
    """An estimate whose confidence interval is not symmetric."""

    lower: float
    upper: float
    """lower and upper: confidence intervals; NaN where the sample does not reach that far."""


def quantile(values: Array, order: float, confidence: float) -> Limited:
    """A quantile (`order`: probability of staying below) and its confidence interval: that of its order, converted into values
    (Woodruff 1952). Values as in `moments`.

    Its shifts are those of the order times the slope of the quantile function between the ends of the interval (Bahadur).
    """
    known, counts, few = _counted(values)
    if few:
        return Limited(np.nan, np.full(len(values), np.nan), np.nan, np.nan)
    ranked = np.sort(values[known])
    total = len(ranked)
    value = float(np.quantile(ranked, order, method="hazen"))
    below = (known & (values <= value)).sum(axis=1)
    shifts = _shifts(below - counts * (below.sum() / total), counts)
    places = np.arange(total) + 0.5
    ends = np.array(_interval_of_share(order, shifts, counts, confidence)) * total
    lower, upper = np.interp(ends, places, ranked, left=np.nan, right=np.nan)
    low, high = np.clip(ends, places[0], places[-1])
    slope = float(np.diff(np.interp([low, high], places, ranked))[0] / (high - low)) * total
    return Limited(value, -slope * shifts, float(lower), float(upper))


def exceedance(values: Array, limit: float, confidence: float) -> Limited:
    """Probability of lying above `limit`, within [0, 1]; its interval is that of as many independent draws as have its error
    (Korn, Graubard). Values as in `moments`.
    """
    known, counts, few = _counted(values)
    if few:
        return Limited(np.nan, np.full(len(values), np.nan), np.nan, np.nan)
    above = (known & (values > limit)).sum(axis=1)
    share = float(above.sum() / counts.sum())
    shifts = _shifts(above - counts * share, counts)
    lower, upper = _interval_of_share(share, shifts, counts, confidence)
    return Limited(share, shifts, lower, upper)


def _interval_of_share(
    share: float, shifts: Array, counts: Array, confidence: float
) -> tuple[float, float]:
    """Interval of a probability: that of as many independent draws as have the error of `shifts` (Korn and Graubard 1998).

    By Jeffreys's prior (Brown, Cai, DasGupta 2001), as its error is known from replicates: the limits of Clopper and Pearson
    never hold less often than they say, and so are wider by half a hit on each side.
    """
    total = int(counts.sum())
    if not 0.0 < share < 1.0:
        lower, upper = share_interval(share * total, total, confidence)
        return float(lower), float(upper)
    # between two values nothing is known
    error = np.hypot(float(spread(shifts[None])[0]), 0.5 / total)
    # as many independent draws, fewer for an error of few degrees of freedom
    worth = (student(confidence, total - 1) / student(confidence, int((counts > 0).sum()) - 1)) ** 2
    draws = share * (1.0 - share) / error**2 * worth
    hits = share * draws
    tails = ((1.0 - confidence) / 2.0, (1.0 + confidence) / 2.0)
    lower, upper = scipy.special.betaincinv(hits + 0.5, draws - hits + 0.5, tails)
    return float(lower), float(upper)


def surely_less(values: Array, shifts: Array, confidence: float) -> Booleans:
    """Whether number i is significantly less than number j, (n, n); False where it is undecided, each comparison two-sided.

    Replicates are paired: designs that meet the same scatter differ by less than their own errors. `shifts` (n, r): of
    `Estimate`, of all numbers from the same replicates. Numbers that differ by round-off only are one.
    """
    error = np.array([spread(row - shifts) for row in shifts])
    reach = student(confidence, shifts.shape[1] - 1) * error
    return values[:, None] - values < -np.maximum(reach, ROUND_OFF * abs(values))
