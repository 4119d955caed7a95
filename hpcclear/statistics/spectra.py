"""Spectra of a force over revolutions: orders, third-octave bands, and confidence intervals from revolution to revolution.

Each revolution has a spectrum of its own, so that orders are exact however long it lasts. Of a motion that repeats, the mean
squares of all orders add up to that of the force about its mean (Parseval). Bands by IEC 61260-1:2014, base ten; levels re
1e-6 N (ISO 1683:2015).
"""

import math

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.student import student
from hpcclear.statistics.random.replicates import FEWEST

REFERENCE = 1e-6
"""Force of 0 dB, N."""

BANDWIDTH = 2.56
"""Instants a period of the highest frequency that is reported, as analysers have it: beyond it more of a spectrum is folded."""

BATCHES = 20
"""Means of neighbouring revolutions that half-widths are taken from at most: longer batches hardly depend on each other."""

CONFIDENCE = 0.95

_STEP = 10.0**0.1  # from one band to the next


def orders(values: Array) -> Array:
    """Mean squares of the orders 1, 2 ... of revolutions: (r, n + 1) evenly spaced instants from start to end, to (r, n // 2).

    The last of an even number of intervals is that of half the sampling rate.

    Where a revolution does not end as it began, a straight line between its ends is taken off first: its jump would
    otherwise be seen at all frequencies, falling with their square, where the force itself has less by far.
    """
    count = values.shape[1] - 1
    jump = values[:, -1:] - values[:, :1]
    level = values[:, :-1] - jump * (np.arange(count) / count)
    lines = np.abs(np.fft.rfft(level, axis=1)[:, 1:] / count) ** 2
    doubled = np.full(lines.shape[1], 2.0)
    if count % 2 == 0:
        doubled[-1:] = 1.0
    return np.asarray(lines * doubled)


def highest(count: int) -> int:
    """Highest order that is reported of so many instants a revolution."""
    return int(count / BANDWIDTH)


def band_centres(lowest: float, largest: float) -> Array:
    """Middles in Hz of the third-octave bands from that of the lowest frequency up to the last that ends below the largest."""
    first = math.floor(10.0 * math.log10(lowest / 1000.0) + 0.5)
    last = math.floor(10.0 * math.log10(largest / 1000.0) - 0.5)
    return np.asarray(1000.0 * 10.0 ** (np.arange(first, last + 1) / 10.0))


def in_bands(squares: Array, periods: Array, centres: Array) -> Array:
    """Mean squares by third-octave bands, (r, orders) of revolutions that last so long (r,), s, to (r, bands)."""
    frequencies = np.arange(1, squares.shape[1] + 1) / periods[:, None]
    found = np.zeros((len(squares), len(centres)))
    for band, centre in enumerate(centres):
        inside = (frequencies >= centre / _STEP**0.5) & (frequencies < centre * _STEP**0.5)
        found[:, band] = np.where(inside, squares, 0.0).sum(axis=1)
    return found


def half_width(values: Array) -> Array:
    """Half-width of the 95 % confidence interval of means over revolutions, (r, ...) to (...); NaN of fewer than `FEWEST`.

    By means of batches of neighbouring revolutions and Student's t.
    """
    count = len(values)
    if count < FEWEST:
        return np.full(values.shape[1:], np.nan)
    batches = min(count, BATCHES)
    size = count // batches
    kept = values[count - batches * size :]
    means = kept.reshape(batches, size, *values.shape[1:]).mean(axis=1)
    error = means.std(axis=0, ddof=1) / math.sqrt(batches)
    return np.asarray(student(CONFIDENCE, batches - 1) * error)


def levels(squares: Array) -> tuple[Array, Array, Array]:
    """Levels in dB of the mean over revolutions of mean squares (r, ...), N^2, and the ends of its confidence interval; NaN of
    nothing, -inf of an end at nothing."""
    mean, reach = squares.mean(axis=0), half_width(squares)
    with np.errstate(divide="ignore", invalid="ignore"):
        level, lower, upper = (
            10.0 * np.log10(np.maximum(one, 0.0) / REFERENCE**2)
            for one in (mean, mean - reach, mean + reach)
        )
    known = mean > 0.0
    return tuple(np.where(known, one, np.nan) for one in (level, lower, upper))  # type: ignore[return-value]
