"""How an accuracy that is asked of mean and deviation is shared out, so that it costs least.

A moment by n simulations at a tolerance is off by a bias, the tolerance's, and by the error of its samples:
error^2 = (t bias(tolerance))^2 + reach(n)^2, with Student's t of the confidence, and costs n times what a simulation costs
at that tolerance. A pilot tells both: the same points at several tolerances give biases in pairs, and replicates of a
sequence the error of samples and how it falls with n. So every tolerance leaves the samples a share, and has a price.

Sources: M. B. Giles, "Multilevel Monte Carlo methods", Acta Numerica 24 (2015), doi:10.1017/S096249291500001X (bias and
variance of paired samples); random-effects moments after R. DerSimonian and N. Laird (1986), doi:10.1016/0197-2456(86)90046-2.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.statistics.random.replicates import Estimate, moments, spread, student

SLOWEST, FASTEST = 0.5, 0.75
"""Powers that the error of samples may fall by: that of independent draws, and of sequences whose integrand has kinks; what a
few hundred points show beyond it does not last."""

ROOM = 0.75
"""Share of an accuracy that a tolerance may take at most, which leaves two thirds of it to the samples. Tighter tolerances
are cheap, and what little a looser one leaves makes designs dear whose samples need more than the pilot's."""

FALL = 0.5
"""What a tolerance ten times tighter leaves of a bias: so that of the tightest, which others are measured against, is not lost.
Medians of 80 designs (`analysis/error_budget.py`) are 0.8 from 1e-3 to 1e-4, where steps are as short as contacts and stability
want them, 0.7, 0.55 and 0.35 to 1e-7: against 1e-6 looser biases are told a tenth to a fifth too small, which Student's
quantile has room for; against less tight ones they would be by more."""

NOTHING = 1e-9
"""Share of the mean below which a deviation is round-off."""


@dataclass(frozen=True)
class Evidence:
    """What a pilot has measured; all errors relative, of mean and deviation."""

    rtol: Array
    """Shape (r,): loosest first; biases are against the last one that was looked at."""
    evaluations: Array
    """Shape (r,): of the equations of motion, a simulation."""
    bias: Array
    """Shape (r - 1, 2): root mean square over designs, without what chance adds to it; with that of the last one (`FALL`). NaN
    where it was not looked for."""
    doubt: Array
    """Shape (r - 1, 2): standard error of the mean bias of all designs."""
    pairs: int
    points: int
    """pairs and points: simulations of a design that biases, and `reach`, are of."""
    reach: Array
    """Shape (d, 2): half-widths of confidence limits of each design."""
    power: Array
    """Shape (2,): by which power of the simulations they fall."""
    confidence: float

    def tolerance_shares(self, doubtful: bool) -> Array:
        """What tolerances take of an accuracy, (r - 1, 2), with or without what is not known about them.

        By Student's quantile: how biases scatter from design to design is known from a few, and is told of others.
        """
        doubt = self.doubt if doubtful else 0.0
        return student(self.confidence, len(self.reach)) * np.hypot(self.bias, doubt)

    def points_for(self, reach: Array, least: int, most: int) -> float:
        """Simulations of a design, on average over the pilot's, that limits of these half-widths (2,) take by doubling."""
        with np.errstate(divide="ignore"):
            needed = self.points * (self.reach / reach) ** (1.0 / self.power)
        longest = np.nan_to_num(needed.max(axis=1), nan=most, posinf=most)
        doubled = 2.0 ** np.ceil(np.log2(np.clip(longest, least, most)))
        return float(np.minimum(doubled, most).mean())


@dataclass(frozen=True)
class Split:
    """One way to share out an accuracy."""

    rung: int
    """Of the evidence's tolerances."""
    rtol: float
    tolerance: Array
    samples: Array
    """tolerance and samples, shape (2,): what each may take of the accuracy, of mean and deviation; their squares add up."""
    points: float
    """Simulations that a verified design will take, on average."""
    evaluations: float
    """Of the equations of motion, in the whole study."""
    sure: bool
    """Whether what is not known about the tolerance's bias is within its share."""


def evidence(
    rtol: Array, evaluations: Array, pairs: Array, points: Array, confidence: float
) -> Evidence:
    """Biases and errors from a pilot's values.

    Parameters
    ----------
    rtol, evaluations : array, shape (r,)
        Evaluations are NaN at tolerances that were not looked at: they go by those of the others.
    pairs : array, shape (r, d, replicates, n)
        The same points of d designs at every tolerance; NaN where a simulation failed, and at tolerances that were not
        looked at, whose biases are NaN. Two were at least.
    points : array, shape (d, replicates, m)
        Of one of them, m a multiple of 4.
    confidence : float
    """
    seen = np.flatnonzero(np.isfinite(pairs).any(axis=(1, 2, 3)))
    bias, error = np.full((2, len(rtol) - 1, pairs.shape[1], 2), np.nan)
    bias[seen[:-1]], error[seen[:-1]] = biases(rtol[seen], pairs[seen])
    square, chance = _mean(bias**2), _mean(error**2)
    designs = np.isfinite(bias).sum(axis=1)
    reach = np.array([_reach(one, confidence) for one in points])
    early = np.array([_reach(one[:, : one.shape[1] // 4], confidence) for one in points])
    with np.errstate(divide="ignore", invalid="ignore"):
        fall = np.log(early / reach) / np.log(4.0)
    fall = np.where(np.isfinite(fall), fall, np.nan)
    power = np.clip(np.nan_to_num(_mean(fall[None])[0], nan=SLOWEST), SLOWEST, FASTEST)
    return Evidence(
        np.asarray(rtol), _all_evaluations(rtol, evaluations),
        np.sqrt(np.maximum(square - chance, 0.0)), np.sqrt(chance / np.maximum(designs, 1)),
        pairs[0, 0].size, points[0].size, reach, power, confidence,
    )  # fmt: skip


def _all_evaluations(rtol: Array, evaluations: Array) -> Array:
    """Evaluations, (r,), where NaN by the power of the tolerance that fits the others."""
    known = np.isfinite(evaluations)
    if known.all():
        return np.asarray(evaluations)
    fitted = np.polyfit(np.log(rtol[known]), np.log(evaluations[known]), 1)
    return np.where(known, evaluations, np.exp(np.polyval(fitted, np.log(rtol))))


def biases(rtol: Array, pairs: Array) -> tuple[Array, Array]:
    """Relative biases of mean and deviation at all tolerances but the tightest, that of this one included (`FALL`), and
    their standard errors.

    Parameters
    ----------
    rtol : array, shape (r,)
        Loosest first.
    pairs : array, shape (r, d, replicates, n)
        The same points of d designs at every tolerance; NaN where a simulation failed.

    Returns
    -------
    tuple of arrays, shape (r - 1, d, 2) each
    """
    known = [[_biases(one, best) for one, best in zip(row, pairs[-1], strict=True)] for row in pairs[:-1]]  # fmt: skip
    whole = 1.0 / (1.0 - FALL ** np.log10(np.asarray(rtol)[:-1] / rtol[-1]))
    bias, error = np.moveaxis(np.array(known), 2, 0) * whole[:, None, None]
    return bias, error


def cheapest(
    found: Evidence,
    asked: Array,
    price: Callable[[int, float], float],
    limits: tuple[int, int],
    *,
    doubtful: bool = True,
) -> Split | None:
    """The split of least cost; None if no tolerance leaves the samples anything.

    Parameters
    ----------
    found : Evidence
    asked : array, shape (2,)
        Of mean and deviation, relative.
    price : callable
        Evaluations of the equations of motion in the whole study, by a tolerance's rung and the simulations of a verified
        design.
    limits : (int, int)
        Simulations of a verified design, at least and at most.
    doubtful : bool
        Whether what is not known about a bias counts as such.
    """
    taken = found.tolerance_shares(doubtful)
    ways = []
    for rung, share in enumerate(taken):
        if not (share < ROOM * asked).all():
            continue
        samples = np.sqrt(asked**2 - share**2)
        points = found.points_for(samples, *limits)
        rtol, spent = float(found.rtol[rung]), price(rung, points)
        ways.append(Split(rung, rtol, share, samples, points, spent, doubtful))
    return min(ways, key=lambda way: way.evaluations, default=None)


def _biases(values: Array, best: Array) -> tuple[list[float], list[float]]:
    """Relative differences of the moments of paired values (replicates, n), and their standard errors."""
    both = np.isfinite(values) & np.isfinite(best)
    ours, theirs = (moments(np.where(both, one, np.nan)) for one in (values, best))
    triples = list(zip(ours, theirs, _scales(theirs), strict=True))
    apart = [(one.value - other.value) / scale for one, other, scale in triples]
    errors = [float(spread((a.shifts - b.shifts)[None])[0]) / scale for a, b, scale in triples]
    return apart, errors


def _reach(values: Array, confidence: float) -> list[float]:
    """Relative half-widths of the limits of both moments."""
    found = moments(values)
    return [
        one.error * student(confidence, one.freedom) / scale if one.freedom > 0 else np.nan
        for one, scale in zip(found, _scales(found), strict=True)
    ]


def _scales(found: tuple[Estimate, Estimate]) -> tuple[float, float]:
    """What errors of mean and deviation are relative to; a deviation of nothing but round-off counts as some."""
    mean = abs(found[0].value) or np.nan
    return mean, max(found[1].value, NOTHING * mean)


def _mean(values: Array) -> Array:
    """Over the designs, (r, d, 2) to (r, 2), of those that are known; NaN where none is."""
    known = np.isfinite(values)
    total = np.where(known, values, 0.0).sum(axis=1)
    count = known.sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
