"""Curves through the rows of tables: one cubic between two neighbouring rows, whatever their distance.

The kernel, time series, drawings and means all read these pieces, so that a short pulse has the area that its rows give it.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Integers

Rows = tuple[tuple[float, float], ...]


class Pieces(NamedTuple):
    """A curve over a share of its length from 0 to 1, where it repeats or stays level."""

    starts: Array
    """Where each cubic begins, shape (n,), a share of the length; the first at 0."""
    cubics: Array
    """Coefficients, shape (n, 4), by rising powers of the distance from there, a share too."""
    length: float
    """In the unit of the table's places: rad, s."""
    repeats: bool = True

    def at(self, place: Array) -> Array:
        """Values at places of any shape, in the unit of the length."""
        share = np.asarray(place, float) / self.length
        share = share - np.floor(share) if self.repeats else np.clip(share, 0.0, 1.0)
        k = np.searchsorted(self.starts, share, side="right") - 1
        return _values(self.cubics[k], share - self.starts[k])

    def mean(self) -> float:
        """Mean over the length, exact."""
        h = np.diff(self.starts, append=1.0)
        return float((self.cubics * h[:, None] ** np.arange(1, 5) / np.arange(1, 5)).sum())

    def moved(self, pieces: Integers, by: Array) -> Array:
        """Cubics (m, 4) of some pieces (m,) by powers of the distance from places further on by so much (m,)."""
        return _moved(self.cubics[pieces], by)

    def derivative(self) -> "Pieces":
        """The derivative by the place."""
        c = self.cubics * np.arange(4) / self.length
        return self._replace(cubics=np.column_stack([c[:, 1:], np.zeros(len(c))]))


def periodic(rows: Rows, length: float, interpolation: str = "smooth") -> Pieces:
    """A table that repeats after a length in the unit of its places.

    "smooth": monotone cubic between the given pairs (Fritsch and Carlson 1980, doi:10.1137/0717021), through every pair, no
    overshoot. "linear": straight between them, with a corner at each.
    """
    x, y = np.array(rows).T
    x = x / length
    if x[-1] - x[0] > 1.0 - 1e-12:
        x, y = x[:-1], y[:-1]
    inside = x - np.floor(x)
    inside[inside >= 1.0] = 0.0
    order = np.argsort(inside)
    x, y = inside[order], y[order]
    n = len(x)
    # three times side by side, so that the middle one sees its neighbours
    wide, values = np.concatenate([x - 1.0, x, x + 1.0]), np.tile(y, 3)
    cubics = _cubics(wide, values, interpolation)[n : 2 * n]
    if x[0] > 0.0:  # the last piece goes on at the beginning
        begun = _moved(cubics[-1:], 1.0 - x[-1])
        x, cubics = np.concatenate([[0.0], x]), np.concatenate([begun, cubics])
    return Pieces(x, cubics, length)


def level(rows: Rows, interpolation: str = "smooth") -> Pieces:
    """A table over places from 0 to its last, level before its first and behind its last pair."""
    x, y = np.array(rows).T
    length = float(x[-1])
    x = x / length
    wide = np.concatenate([[x[0] - 2.0, x[0] - 1.0], x, [2.0, 3.0]])
    values = np.concatenate([y[[0, 0]], y, y[[-1, -1]]])
    cubics = _cubics(wide, values, interpolation)[2 : 1 + len(x)]
    x = x[:-1]
    if x[0] > 0.0:
        x = np.concatenate([[0.0], x])
        cubics = np.concatenate([[[y[0], 0.0, 0.0, 0.0]], cubics])
    return Pieces(x, cubics, length, repeats=False)


def hinges(name: str, rows: Rows) -> dict[str, float]:
    """Parameters of a table that runs straight from row to row and stays level beyond: first value, places and bends."""
    x, y = np.array(rows).T
    slopes = np.diff(y) / np.diff(x)
    bends = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
    found = {f"{name}_first": float(y[0])}
    for k, (start, bend) in enumerate(zip(x, bends, strict=True)):
        found |= {f"{name}_start_{k}": float(start), f"{name}_bend_{k}": float(bend)}
    return found


def _cubics(x: Array, y: Array, interpolation: str) -> Array:
    """Coefficients (n - 1, 4) of the pieces between pairs (n,), by rising powers of the distance from the left one."""
    width = np.diff(x)
    rise = np.diff(y) / width
    none = np.zeros(len(rise))
    if interpolation == "linear":
        return np.column_stack([y[:-1], rise, none, none])
    first, second = rise[:-1], rise[1:]
    near, far = width[:-1] + 2 * width[1:], 2 * width[:-1] + width[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        harmonic = (near + far) / (near / first + far / second)
    slope = np.zeros(len(x))  # those of the two ends are not needed
    slope[1:-1] = np.where(np.sign(first) * np.sign(second) > 0, harmonic, 0.0)
    m0, m1 = slope[:-1], slope[1:]
    square, cube = (3 * rise - 2 * m0 - m1) / width, (m0 + m1 - 2 * rise) / width**2
    return np.column_stack([y[:-1], m0, square, cube])


def _moved(cubics: Array, by: Array | float) -> Array:
    """The same cubics (n, 4) by powers of the distance from places further on."""
    c0, c1, c2, c3 = cubics.T
    value, slope = c0 + by * (c1 + by * (c2 + by * c3)), c1 + by * (2 * c2 + by * 3 * c3)
    return np.column_stack([value, slope, c2 + 3 * by * c3, c3])


# ---- where steps of an integration end ---------------------------------------------------------
_INSIDE = np.linspace(0.0, 1.0, 5)  # of each piece: what is compared with a cubic
_CHEBYSHEV = 0.5 - 0.5 * np.cos(np.arange(5) * np.pi / 4)  # on [0, 1]; differences there are
_WEIGHTS = np.array([1.0, -2.0, 2.0, -2.0, 1.0]) / 8.0  # what no cubic can follow

_APPROACH = 1e6
"""Times the width of a jump: length of steps before and behind it (they end within 1e-7 of it, `control.ROW_REACH`)."""


def breaks(curve: Pieces, tolerance: float) -> Array:
    """Rows, as shares of the length, between which a cubic follows the curve within a part of its range.

    Between two of them there is nothing that a Runge-Kutta step could pass over unseen. None where the curve is constant.
    """
    starts, cubics = curve.starts, curve.cubics
    ends = np.append(starts[1:], 1.0)
    h = ends - starts
    places = starts[:, None] + h[:, None] * _INSIDE
    inside = np.column_stack([_values(cubics, h * one) for one in _INSIDE])
    size = tolerance * float(np.ptp(np.append(inside, _values(cubics[-1:], h[-1:]))))
    if not size > 0.0:
        return np.zeros(0)
    forced = _bends(curve, starts, ends) > size
    found = [0.0] if curve.repeats else []
    edges = [0, *(np.flatnonzero(forced) + 1), len(starts)]
    for first, last in pairwise(edges):
        if first:
            found.append(starts[first])
        while (end := _followed(places, inside, first, last, size)) < last:
            found.append(starts[end])
            first = end
    if curve.repeats:
        third = np.arange(3) / 3.0  # no step is longer than half of the length
        extra = [one for one in third[1:] if not any(abs(one - b) < 0.1 for b in found)]
        found = sorted([*found, *extra])
        return np.unique(_approached(found, found[-1] - 1.0, found[0] + 1.0) % 1.0)
    return _approached([*found, 1.0], 0.0, 2.0)


def _approached(found: list[float], first: float, last: float) -> Array:
    """Rows between two others, and further ones around jumps, which make steps to them short: long ones end too far off."""
    wide = np.array([first, *found, last])
    gaps = np.diff(wide)
    rising = np.flatnonzero(_APPROACH * gaps[1:-1] < gaps[:-2]) + 1
    falling = np.flatnonzero(_APPROACH * gaps[1:-1] < gaps[2:]) + 1
    around = wide[rising] - _APPROACH * gaps[rising], wide[falling + 1] + _APPROACH * gaps[falling]
    return np.sort(np.concatenate([found, *around]))


def _values(cubics: Array, s: Array) -> Array:
    c0, c1, c2, c3 = np.moveaxis(cubics, -1, 0)
    return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)))


def _bends(curve: Pieces, starts: Array, ends: Array) -> Array:
    """How far two neighbouring pieces (n - 1,) are off the best cubic, at least."""
    begin, wide = starts[:-1], ends[1:] - starts[:-1]
    total = np.zeros(len(begin))
    for node, weight in zip(_CHEBYSHEV, _WEIGHTS, strict=True):
        place = begin + node * wide
        right = place >= starts[1:]
        k = np.arange(len(begin)) + right
        total += weight * _values(curve.cubics[k], place - starts[k])
    return np.abs(total)


def _followed(places: Array, values: Array, first: int, last: int, size: float) -> int:
    """The last piece (not included) up to which one cubic follows those from `first` on within a size."""

    def follows(end: int) -> bool:
        x, y = places[first:end].ravel(), values[first:end].ravel()
        s = (x - x[0]) * (2.0 / (x[-1] - x[0])) - 1.0
        basis = np.polynomial.chebyshev.chebvander(s, 3)
        left = y - basis @ np.linalg.lstsq(basis, y, rcond=None)[0]
        return bool(np.abs(left).max() <= size)

    good, step = first + 1, 1
    while good < last and follows(min(good + step, last)):
        good = min(good + step, last)
        step *= 2
    while step > 1:
        step //= 2
        if good + step <= last and follows(good + step):
            good += step
    return good
