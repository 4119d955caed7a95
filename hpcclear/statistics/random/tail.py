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

from hpcclear.base.arrays import Array

WINDOW, FEWEST = 0.15, 12
"""Share of the values that a line goes through, and how many at least."""

MOST = 12.0
"""Largest index that is reported: normal numbers of double precision reach no further."""


def index(values: Array, limit: float) -> Array:
    """Reliability index of staying at or below a limit.

    Parameters
    ----------
    values : array, shape (k, n)
        n values of each of k random numbers.

    Returns
    -------
    array, shape (k,)
        Larger is safer, within -`MOST` and `MOST`.
    """
    ranked = np.sort(values, axis=1)
    count = ranked.shape[1]
    size = min(max(round(WINDOW * count), FEWEST), count)
    below = (ranked <= limit).sum(axis=1)
    first = np.clip(below - size // 2, 0, count - size)
    places = first[:, None] + np.arange(size)
    x = np.take_along_axis(ranked, places, axis=1)
    scores = ndtri((places + 0.5) / count)
    middle, level = scores.mean(axis=1), x.mean(axis=1)
    steps = x - level[:, None]
    slope = ((scores - middle[:, None]) * steps).sum(axis=1)
    square = ((scores - middle[:, None]) ** 2).sum(axis=1)
    flat = slope <= 1e-12 * square * np.maximum(abs(level), 1e-300)  # values that hardly scatter
    side = np.where(level <= limit, MOST, -MOST)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        found = middle + (limit - level) * square / slope
    return np.asarray(np.clip(np.where(flat, side, found), -MOST, MOST))


def of_share(share: float) -> float:
    """The index of a probability."""
    return float(np.clip(-ndtri(share), -MOST, MOST))
