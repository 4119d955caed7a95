"""What revolutions of several copies say: periods, whether they have settled, means with limits. Plain arrays, no mechanism."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from hpcclear.base.arrays import Array
from hpcclear.dynamics.revolutions import objective

LEVEL = 0.97
"""Of the limits that are called 95 %: a mean is looked at several times until its limits are narrow enough, and each look is
one more chance to stop on limits that are too narrow."""

DRIFT = 3.5
"""Standard errors of a drift, or of a difference between tolerances, that is no chance."""


@dataclass(frozen=True)
class Windows:
    """Averages over the latest revolutions of a few copies, and what they still may be off by, m.

    Attributes
    ----------
    period : int or None
        Revolutions after which every copy repeats itself, to a quarter of the target; None: none was found.
    length : int
        Revolutions of the later window: about half of them, whole periods.
    gaps : ndarray, shape (copies, 2)
        Mean gaps over it.
    settling : float
        How far the average may still move if it goes on as it did.
    moved : float
        How far it moved over the latest quarter of the revolutions.
    apart : float
        How far the copies' averages are apart, over the latest quarter.
    joining : bool
        Whether that is much less than over the quarter before.
    """

    period: int | None
    length: int
    gaps: Array
    settling: float
    moved: float
    apart: float
    joining: bool


def period_of(f: Array, tolerance: float) -> int | None:
    """Least period of series f (revolutions, copies) over their later half, at most a quarter of them; None if none is."""
    half = len(f) // 2
    for period in range(1, len(f) // 4 + 1):
        if np.abs(f[half:] - f[half - period : -period]).max() <= tolerance:
            return period
    return None


def windows(gaps: Array, tolerance: float) -> Windows:
    """Judge mean gaps (revolutions, copies, 2 joints) of four revolutions or more; `tolerance` for a period, m."""
    period = period_of(objective(gaps), tolerance)
    whole = period or 1
    length = max(len(gaps) // 4 // whole, 1) * whole  # of a quarter
    quarters = [gaps[len(gaps) - (k + 1) * length : len(gaps) - k * length] for k in range(4)]
    means = np.stack([quarter.mean(axis=0) for quarter in quarters[::-1]])  # (4, copies, 2)
    steps = np.abs(np.diff(objective(means), axis=0)).max(axis=1)
    ratio = min(steps[2] / max(steps[1], 1e-300), 0.9)  # of a geometric approach
    settling = float(steps[2]) * 0.5 * (1.0 + ratio) / (1.0 - ratio)
    before, apart = np.ptp(objective(means[2:]), axis=1)
    late = means[2:].mean(axis=0)
    return Windows(
        period,
        2 * length,
        late,
        settling,
        float(steps[2]),
        float(apart),
        bool(apart < 0.3 * before),
    )


def student(values: Array) -> tuple[float, float, float]:
    """Mean of independent values (n,), its standard error, and the half-width of its limits."""
    error = float(np.std(values, ddof=1) / np.sqrt(len(values)))
    return (
        float(np.mean(values)),
        error,
        float(stats.t.ppf(0.5 + 0.5 * LEVEL, len(values) - 1)) * error,
    )


def projected(gaps: Array) -> Array:
    """Mean gaps, shape (..., 2), as numbers, shape (...), whose mean is the objective of the mean gaps, to first order."""
    mean = gaps.reshape(-1, 2).mean(axis=0)
    return gaps @ (mean / np.hypot(*mean))


def spin_up(series: Array) -> int:
    """Values at the start of a series (n,) to leave out, at most half of them: those that widen the limits of its mean.

    MSER: the cut that makes the standard error of what is left least (White 1997, doi:10.1177/003754979706900601).
    """
    n = len(series)
    errors = [np.var(series[d:]) / (n - d) for d in range(n // 2 + 1)]
    return int(np.argmin(errors))


def parted(between: Array) -> int:
    """First of the stretches from which on copies are as far apart as they get: variances between copies (n,) to an index."""
    lasting = np.median(between[len(between) // 2 :])
    return int(np.argmax(between >= 0.3 * lasting))


def approach(series: Array) -> tuple[float, float]:
    """How far the mean of copies still moves, from series (n, copies), n at least 4: over the latest quarter, and in the end.

    Each copy is compared with itself, so that copies which differ for good do not hide a common drift. Both are 0 where the
    movement is no more than chance.
    """
    quarters = np.stack([part.mean(axis=0) for part in np.array_split(series, 4)])
    steps = np.diff(quarters, axis=0)  # (3, copies)
    moved = float(abs(steps[2].mean()))
    if moved <= DRIFT * steps[2].std(ddof=1) / np.sqrt(series.shape[1]):
        return 0.0, 0.0
    ratio = min(moved / max(abs(float(steps[1].mean())), 1e-300), 0.9)  # of a geometric approach
    return moved, moved * 0.5 * (1.0 + ratio) / (1.0 - ratio)
