"""Periods, steady state and means with confidence intervals, from revolutions of several copies. Plain arrays, no mechanism."""

from dataclasses import dataclass

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.student import student

LEVEL = 0.97
"""Of intervals that are called 95 %: a mean is looked at until its interval is narrow enough, and each look is
one more chance to stop on intervals that are too narrow."""

PARTS = 8  # of a copy's segments, at most, whose scatter gives that of its mean: each as long as it can be
APART = 1.5  # variance between means of copies over that which their parts explain, from which on it alone counts

NEARLY = 1.1  # square of a standard error over the least, that is as good
SLOWEST = 0.97  # ratio of a geometric approach beyond which nobody knows where it ends
DRIFT = 3.5  # standard errors of a drift, or of a difference between tolerances, that is no chance


def objective(gaps: Array) -> Array:
    """f (eq. 13), m, from mean gaps of all joints, m: shape (..., joints) to (...)."""
    found: Array = np.hypot.reduce(gaps, axis=-1)  # by 0 it stays what it is, to the last bit
    return found


@dataclass(frozen=True)
class Windows:
    """Averages over the latest revolutions of a few copies, and what they still may be off by, m."""

    period: int | None
    """Revolutions after which every copy repeats itself, to a quarter of the target."""
    length: int  # revolutions of the later window: about half of them, whole periods
    gaps: Array  # mean gaps over it, (copies, joints)
    settling: float  # how far the average may still move if it goes on as it did
    moved: float  # how far it moved over the latest quarter of the revolutions
    restless: float  # how far it moved over that or over the quarter before, the larger of the two
    apart: float  # how far the copies' averages are apart, over the latest quarter
    joining: bool  # whether that is much less than over the quarter before


def period_of(f: Array, tolerance: float) -> int | None:
    """Least period of series f (revolutions, copies) over their later half, at most a quarter of them; None if none is."""
    half = len(f) // 2
    for period in range(1, len(f) // 4 + 1):
        if np.abs(f[half:] - f[half - period : -period]).max() <= tolerance:
            return period
    return None


def windows(gaps: Array, tolerance: float) -> Windows:
    """Judge mean gaps (revolutions, copies, joints) of four revolutions or more; `tolerance` for a period, m."""
    period = period_of(objective(gaps), tolerance)
    whole = period or 1
    length = max(len(gaps) // 4 // whole, 1) * whole  # of a quarter
    quarters = [gaps[len(gaps) - (k + 1) * length : len(gaps) - k * length] for k in range(4)]
    means = np.stack([quarter.mean(axis=0) for quarter in quarters[::-1]])  # (4, copies, joints)
    steps = np.abs(np.diff(objective(means), axis=0)).max(axis=1)
    settling = remaining(float(steps[2]), float(steps[1]), believed=0.9)
    before, apart = np.ptp(objective(means[2:]), axis=1)
    late = means[2:].mean(axis=0)
    moved, restless, joining = float(steps[2]), float(steps[1:].max()), bool(apart < 0.3 * before)
    return Windows(period, 2 * length, late, settling, moved, restless, float(apart), joining)


def remaining(moved: float, before: float, believed: float = np.inf) -> float:
    """How far an average of two quarters still moves that moved so far over the latest one, and over the one before.

    The ratio of a geometric approach is taken for `believed` where it is more: such movements scatter. Else what moves on
    nearly as before (`SLOWEST`) has no end: infinite.
    """
    ratio = min(moved / max(before, 1e-300), believed)
    return moved * 0.5 * (1.0 + ratio) / (1.0 - ratio) if ratio <= SLOWEST else np.inf


def speed_settling(speeds: Array, tolerance: float) -> float:
    """How far the mean speed of copies of a free crank still moves, relative, from speeds (n, copies), n at least 4.

    Movements below a thousandth of the tolerance are none.
    """
    quarters = np.stack([part.mean() for part in np.array_split(speeds, 4)])
    steps = np.abs(np.diff(quarters)) / abs(quarters[-1])
    if steps[2] <= 1e-3 * tolerance:
        return 0.0
    return remaining(float(steps[2]), float(steps[1]))


def with_limit(values: Array) -> tuple[float, float]:
    """Mean of independent values (n,), and the half-width of its confidence interval."""
    error = float(np.std(values, ddof=1) / np.sqrt(len(values)))
    return float(np.mean(values)), student(LEVEL, len(values) - 1) * error


def variance_of_mean(groups: list[Array]) -> tuple[float, float]:
    """Variance of the mean over time of one copy, and its degrees of freedom, from groups of copies that share a mean.

    Copies are independent of each other: how their means differ needs no model of how segments depend on one another. Parts of
    them say the same with more degrees of freedom where only neighbours depend on each other: variance of a part and twice
    the covariance of two. Both count by their degrees of freedom; where copies differ by more than parts explain, they alone.
    Groups are (segments, copies), all of as many segments.
    """
    off = np.concatenate([group - group.mean() for group in groups], axis=1)
    n, copies = off.shape
    means, free = off.mean(axis=0), copies - len(groups)
    between = float((means**2).sum()) / free
    length = -(-n // PARTS)
    count = n // length
    if count < 3:
        return between, free
    parts = off[n - count * length :].reshape(count, length, copies).mean(axis=1)
    own = float((parts**2).mean())
    shared = float((parts[1:] * parts[:-1]).mean())
    within = (own + 2.0 * (1.0 - 1.0 / count) * shared) * length / n
    if between > APART * within:
        return between, free
    more = count * copies / 3.0
    return (between * free + within * more) / (free + more), free + more


def projected(gaps: Array) -> Array:
    """Mean gaps, shape (..., joints), as numbers, shape (...), whose mean is the objective of the mean gaps, to first order."""
    mean = gaps.reshape(-1, gaps.shape[-1]).mean(axis=0)
    return gaps @ (mean / objective(mean))


def spin_up(series: Array, noise: float = 0.0) -> int:
    """Values at the start of a series (n,) to leave out, at most half: those that widen the confidence interval of its mean.

    MSER: the cut that makes the standard error of what is left least (White 1997, doi:10.1177/003754979706900601); the
    first that makes it nearly so, since in noise the least is anywhere. No cut makes the scatter of what is left less than
    the variance of its noise, where that is known.
    """
    n = len(series)
    errors = np.array([max(float(np.var(series[d:])), noise) / (n - d) for d in range(n // 2 + 1)])
    return int(np.argmax(errors <= NEARLY * errors.min()))


def parted(between: Array) -> int:
    """First of the segments from which on copies are as far apart as they get, by distances or variances (n,), to an index."""
    lasting = np.median(between[len(between) // 2 :])
    return int(np.argmax(between >= 0.3 * lasting))


def approach(series: Array) -> tuple[float, float]:
    """How far copies moved over the latest quarter, and how far from their mean they end: series (n, copies), n at least 3.

    Each copy is compared with itself, so that copies which differ for good do not hide a common drift. Both are 0 where the
    movement is no more than chance; the second is infinite where it does not slow down.
    """
    parts = np.stack([part.mean(axis=0) for part in np.array_split(series, min(4, len(series)))])
    steps = np.diff(parts, axis=0)  # (2 or 3, copies)
    last = float(steps[-1].mean())
    if abs(last) <= DRIFT * steps[-1].std(ddof=1) / np.sqrt(series.shape[1]):
        return 0.0, 0.0
    ratio = abs(last) / max(abs(float(steps[-2].mean())), 1e-300)  # of a geometric approach
    if ratio > SLOWEST:
        return abs(last), np.inf
    end = float(parts[-1].mean()) + last * ratio / (1.0 - ratio)
    return abs(last), abs(end - float(series.mean()))
