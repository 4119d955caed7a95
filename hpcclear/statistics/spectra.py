"""Spectra of a force over revolutions: orders, third-octave bands, and confidence intervals from revolution to revolution.

Orders are multiples of the revolution's frequency, however long each revolution lasts. Three revolutions at a time have Hann's
window: of a motion that repeats, all of an order stays within half an order of it, so that mean squares are exact and add up
to that of the force about its mean (Parseval); of one that does not, next to nothing of an order is seen at others. Bands by
IEC 61260-1:2014, base ten; levels re 1e-6 N (ISO 1683:2015).
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

WINDOW = 3
"""Revolutions that a spectrum is taken of: the fewest whose window leaves an order where it is."""

OVERSAMPLING = 8
"""Instants at which forces are taken, over those a revolution that are stored: what impacts have beyond half of that rate is
folded into a spectrum. Of a compressor, levels then differ from those of twice as many instants by 0.02 dB."""

BATCHES = 20
"""Means of neighbouring revolutions that half-widths are taken from at most: longer batches hardly depend on each other."""

CONFIDENCE = 0.95

_STEP = 10.0**0.1  # from one band to the next


def orders(values: Array) -> Array:
    """Mean squares of the orders 1, 2 ... of neighbouring revolutions, (r, n, c) to (n // 2 - 1, c): evenly spaced instants
    from the start of each revolution, without its end.

    Of fewer revolutions than `WINDOW` there is no window, and they count as a motion that repeats.
    """
    count, size, width = values.shape
    flat = values.reshape(count * size, width)
    if count < WINDOW:
        lines = np.abs(np.fft.rfft(flat, axis=0) / len(flat)) ** 2
        kept = lines[count : count * (size // 2) : count]
        return np.asarray(2.0 * kept)
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(len(flat)) / len(flat))
    lines = np.abs(np.fft.rfft(flat * window[:, None], axis=0) / len(flat)) ** 2
    # an order, and all bins nearer to it than to another
    reach = count // 2
    middles = count * np.arange(1, size // 2)
    kept = sum(lines[middles + k] for k in range(-reach, reach + 1))
    return np.asarray(2.0 / np.mean(window**2) * kept)


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


def half_width(values: Array, overlap: int = 1) -> Array:
    """Half-width of the 95 % confidence interval of means over revolutions, (r, ...) to (...); NaN of fewer than `FEWEST`.

    By means of batches of neighbouring revolutions and Student's t; `overlap`: how many revolutions each value is of.
    """
    count = len(values)
    if count // overlap < FEWEST:
        return np.full(values.shape[1:], np.nan)
    batches = min(count // overlap, BATCHES)
    size = count // batches
    kept = values[count - batches * size :]
    means = kept.reshape(batches, size, *values.shape[1:]).mean(axis=1)
    error = means.std(axis=0, ddof=1) / math.sqrt(batches)
    return np.asarray(student(CONFIDENCE, batches - 1) * error)


def levels(squares: Array) -> tuple[Array, Array, Array]:
    """Levels in dB of the mean of mean squares (r, ...), N^2, of windows of `WINDOW` revolutions, and the ends of its
    confidence interval; NaN of nothing, -inf of an end at nothing."""
    mean, reach = squares.mean(axis=0), half_width(squares, WINDOW)
    ends = np.maximum([mean, mean - reach, mean + reach], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        level, lower, upper = np.where(mean > 0.0, 10.0 * np.log10(ends / REFERENCE**2), np.nan)
    return level, lower, upper
