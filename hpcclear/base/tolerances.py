"""Clearance of a bore and a pin that are made apart, each within its own tolerance: one distribution of both.

Sources: ISO 22514-2:2017 for Cp = T / (6 s) and Cpk, the smaller distance of the mean from a limit over 3 s.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.quantiles import TAIL

FINE = 2048
"""Pins over which the distribution of a clearance is summed."""
POINTS = 1025
"""Clearances at which it is known; between them it is straight."""


@dataclass(frozen=True)
class PartSize:
    """Diameters of a part: normal, cut off at both ends; with an infinite `deviation` uniform."""

    lower: float
    upper: float
    mean: float
    deviation: float

    def nodes(self) -> tuple[Array, Array]:
        """Diameters at equal steps, (FINE,), and the shares of parts that they stand for."""
        places = self.lower + (self.upper - self.lower) * (np.arange(FINE) + 0.5) / FINE
        weights = np.exp(-0.5 * ((places - self.mean) / self.deviation) ** 2)
        return places, weights / weights.sum()

    def chance(self, diameter: Array) -> Array:
        """Share of parts below a diameter, of any shape."""
        if np.isinf(self.deviation):
            return np.clip((diameter - self.lower) / (self.upper - self.lower), 0.0, 1.0)
        from scipy.special import ndtr  # as in `normal`

        ends = np.array([self.lower, self.upper])
        below, above = ndtr((ends - self.mean) / self.deviation)
        found = (ndtr((diameter - self.mean) / self.deviation) - below) / (above - below)
        return np.clip(found, 0.0, 1.0)


Limits = tuple[float, float]


def part(limits: Limits, cp: float, cpk: float, towards: str, inspected: bool) -> PartSize:
    """A part whose diameters, between two `limits` (m), are normally distributed, by its capability.

    Where `cpk`, its capability with the mean off the middle, is less than `cp`, the mean lies `towards` "upper" or "lower".
    Parts beyond the limits are sorted out where `inspected`; else they are met up to `TAIL` standard deviations.
    """
    lower, upper = limits
    deviation = (upper - lower) / (6.0 * cp)
    shift = 3.0 * (cp - cpk) * deviation * (1.0 if towards == "upper" else -1.0)
    mean = (lower + upper) / 2.0 + shift
    if not inspected:
        lower, upper = mean - TAIL * deviation, mean + TAIL * deviation
    return PartSize(lower, upper, mean, deviation)


@dataclass(frozen=True)
class FitClearance:
    """Radial clearances of any bore with any pin; where `lower` and `upper` lie within what is met, cut off there."""

    bore: PartSize
    pin: PartSize
    lower: float = -np.inf
    upper: float = np.inf

    @property
    def _reach(self) -> Limits:
        return (self.bore.lower - self.pin.upper) / 2.0, (self.bore.upper - self.pin.lower) / 2.0

    @property
    def span(self) -> Limits:
        """Least and largest value."""
        low, high = self._reach
        return max(low, self.lower), min(high, self.upper)

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        """Clearances, close together at both ends, and the shares below them; (POINTS,) each."""
        low, high = self._reach
        places = low + (high - low) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, POINTS)))
        pins, weights = self.pin.nodes()
        shares = np.array([weights @ self.bore.chance(pins + 2.0 * place) for place in places])
        shares[0], shares[-1] = 0.0, 1.0
        return places, np.maximum.accumulate(shares)

    def __call__(self, chance: Array) -> Array:
        """Quantiles, of any shape."""
        places, shares = self._table
        below, above = np.interp(self.span, places, shares)
        return np.clip(np.interp(below + chance * (above - below), shares, places), *self.span)
