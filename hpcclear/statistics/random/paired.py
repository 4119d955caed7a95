"""By how much a mean or a standard deviation changes between two functions of the same random points, with confidence
intervals.

Points come in replicates, each a design with its scatter, or a few points. A change is a ratio of sums over replicates less 1;
what each replicate would move it by (its influence) is all that is known about its error. Where a motion is chaotic single
differences say nothing, and the intervals are wide for it.

Source: W. G. Cochran, "Sampling Techniques", 3rd ed. (Wiley 1977), sections 6.3 to 6.5: ratio estimates and their errors.
"""

from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.student import student
from hpcclear.base.verdict import Verdict
from hpcclear.statistics.random.replicates import FEWEST, spread

LEAST_KNOWN = 0.9
"""Share of the pairs that must have a value on both sides: those that fail may be the ones that differ."""


class Change(NamedTuple):
    """A relative change: its value and the half-width of its confidence interval; NaN where it is not known."""

    value: float
    limit: float

    def verdict(self, tolerance: float) -> Verdict:
        """Whether it is within a tolerance, significantly; undecided where it is not known."""
        if abs(self.value) - self.limit > tolerance:
            return Verdict.FAILS
        return Verdict.HOLDS if abs(self.value) + self.limit <= tolerance else Verdict.UNDECIDED


UNKNOWN = Change(np.nan, np.nan)


def mean_change(on: Array, off: Array, confidence: float) -> Change:
    """Change of the mean from `on` to `off`, values (r, s) at the same points; NaN where one failed."""
    on, off = _pairs(on, off)
    if not _enough(on):
        return UNKNOWN
    kept = np.isfinite(on).any(axis=1)
    return _ratio(np.nansum(on[kept], axis=1), np.nansum(off[kept], axis=1), confidence)


def deviation_change(on: Array, off: Array, confidence: float) -> Change:
    """The same of the standard deviation inside replicates, values (r, s), of which each has two at least."""
    on, off = _pairs(on, off)
    kept = np.isfinite(on).sum(axis=1) > 1
    if not _enough(on) or kept.sum() < FEWEST:
        return UNKNOWN
    first, second = (np.nanstd(one[kept], axis=1, ddof=1) for one in (on, off))
    return _ratio(first, second, confidence)


def point_change(on: Array, off: Array) -> float:
    """Root mean square of the changes at single points (r, s), relative to the mean of `on`; chaos is in it."""
    on, off = _pairs(on, off)
    mean = abs(np.nanmean(on)) if np.isfinite(on).any() else np.nan
    step = np.sqrt(np.nanmean((off - on) ** 2)) if np.isfinite(on).any() else np.nan
    return 0.0 if step == 0.0 else float(step / mean) if mean > 0.0 else np.nan


def _pairs(on: Array, off: Array) -> tuple[Array, Array]:
    """Both, NaN where either is."""
    known = np.isfinite(on) & np.isfinite(off)
    return np.where(known, on, np.nan), np.where(known, off, np.nan)


def _enough(values: Array) -> bool:
    known = np.isfinite(values)
    return bool(known.mean() >= LEAST_KNOWN and known.any(axis=1).sum() >= FEWEST)


def _ratio(on: Array, off: Array, confidence: float) -> Change:
    """Change of a sum over replicates (r,)."""
    total = on.sum()
    if total == 0.0:
        return Change(0.0, 0.0) if not off.any() else UNKNOWN
    ratio = off.sum() / total
    shifts = (off - ratio * on) / on.mean()
    limit = student(confidence, len(on) - 1) * float(spread(shifts[None])[0])
    return Change(float(ratio - 1.0), limit)
