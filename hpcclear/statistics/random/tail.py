"""Reliability indices from few values: how rare it is to lie beyond a limit that hardly any of them reaches.

The index of a probability p is -Phi^-1(p): 2.3 for 1e-2, 3.1 for 1e-3. Against the normal scores of their ranks values of a
smooth function of many inputs nearly lie on a line, also in their tail. So a line through the values next to the limit gives
the index, between them or beyond the largest of them, and it changes smoothly with a design where a count of exceedances is
0 or jumps. It steers a search; it decides nothing.

Source: P. Ramu, N. H. Kim and R. T. Haftka, "Multiple tail median approach for high reliability estimation", Structural Safety
32 (2010) 124-137, doi:10.1016/j.strusafe.2009.09.002.
"""

import numpy as np
from scipy.special import ndtri

from hpcclear.base.arrays import Array, Integers

WINDOW, FEWEST = 0.15, 12
"""Share of the values that a line goes through, and how many at least."""

MOST = 12.0
"""Largest index that is reported: normal numbers of double precision reach no further."""

ALL = 3.0
"""Index below the negative of which all values exceed the limit, for what samples show: 1 in 740 does not."""


def index(values: Array, limit: float) -> Array:
    """Reliability indices (k,) of staying at or below a limit, of n values of each of k random numbers (k, n).

    Larger is safer, within -`MOST` and `MOST`.
    """
    ranked = np.sort(values, axis=1)
    below = (ranked <= limit).sum(axis=1)
    middle, level, rise = _line(ranked, below)
    side = np.where(level <= limit, MOST, -MOST)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = middle + (limit - level) / rise
    return np.asarray(np.clip(np.where(rise > 0.0, found, side), -MOST, MOST))


def beyond(values: Array, limit: float) -> Array:
    """How far even the lowest values of random numbers (k, n) lie above a limit, over the limit, (k,); 0 where some do not.

    Where all values exceed the limit their share says no more, and the index mixes their distance with their scatter: of two
    such numbers the one nearer to the limit is better. The lowest value is that of the index -`ALL`.
    """
    middle, level, rise = _line(np.sort(values, axis=1), np.zeros(len(values), int))
    lowest = level + (-ALL - middle) * rise
    return np.asarray(np.maximum(lowest - limit, 0.0) / (abs(limit) or 1.0))


def _line(ranked: Array, below: Integers) -> tuple[Array, Array, Array]:
    """Lines through rising values (k, n) about those of these numbers (k,): normal score and value of the middle, and the
    rise of the value with the score, 0 of values that hardly scatter."""
    count = ranked.shape[1]
    size = min(max(round(WINDOW * count), FEWEST), count)
    first = np.clip(below - size // 2, 0, count - size)
    places = first[:, None] + np.arange(size)
    x = np.take_along_axis(ranked, places, axis=1)
    scores = ndtri((places + 0.5) / count)
    middle, level = scores.mean(axis=1), x.mean(axis=1)
    slope = ((scores - middle[:, None]) * (x - level[:, None])).sum(axis=1)
    square = ((scores - middle[:, None]) ** 2).sum(axis=1)
    flat = slope <= 1e-12 * square * np.maximum(abs(level), 1e-300)
    with np.errstate(divide="ignore", invalid="ignore"):
        return middle, level, np.where(flat, 0.0, slope / square)


def of_share(share: float) -> float:
    """The index of a probability."""
    return float(np.clip(-ndtri(share), -MOST, MOST))
