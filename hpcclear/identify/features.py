"""Features of a signal: harmonics, third octaves, and their scatter between revolutions.

A revolution of a chaotic motion does not repeat, so no instant of it is a feature. Means over revolutions are, and the variance
between revolutions says how well they are known.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.errors import InputError
from hpcclear.identify.measured import Measured
from hpcclear.identify.signals import ORDERS, Sensor, Spectrum

LOW = 24
"""Third octaves beyond this order are features, besides the single harmonics: phases of high harmonics may be lost in chaos."""

SUMS = ("acceleration", "frame_force")
"""Signals without a mean: it is zero over whole revolutions, and sensors do not pass it."""


@dataclass(frozen=True)
class Layout:
    """Which features a signal has: harmonics of `orders`, with phases where it is `synchronised`, and third octaves above
    `LOW`.

    `bands`: first and last order of each; `noise`: standard deviation of the sensor's noise in a single harmonic, with which
    the scatter between revolutions is a feature.
    """

    name: str
    orders: tuple[int, ...]
    bands: tuple[tuple[int, int], ...]
    synchronised: bool = True
    noise: float | None = None

    @classmethod
    def of(cls, measured: Measured, sensor: Sensor, noise: float | None = None) -> "Layout":
        """Return that of a measured signal; raises InputError where its band holds no harmonic."""
        frequency, name = measured.frequency, measured.name
        bare = any(word in name for word in SUMS)
        lowest = max(int(bare), int(np.ceil(sensor.band[0] / frequency - 1e-9)))
        highest = min(measured.highest, int(min(sensor.band[1] / frequency, ORDERS)))
        if highest <= max(lowest, 1):
            reason = f"no harmonic of {frequency:.4g} Hz in {name} passes"
            band = "{:g}:{:g}".format(*sensor.band)
            raise InputError("--band", band, reason, "Widen the band, or sample faster")
        orders = tuple(range(lowest, highest + 1))
        return cls(name, orders, _thirds(LOW + 1, highest), measured.synchronised, noise)

    @cached_property
    def scattered(self) -> tuple[tuple[int, int], ...]:
        """Bands whose scatter is a feature."""
        last = self.bands[-1][1] if self.bands else self.orders[-1]
        return () if self.noise is None else _thirds(1, last)

    @cached_property
    def highest(self) -> Integers:
        """Highest order in each feature."""
        parts = 2 if self.synchronised else 1
        own = [k for k in self.orders for _ in range(parts if k else 1)]
        return np.array([*own, *(b for _, b in (*self.bands, *self.scattered))])

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Names of the features."""
        parts = ("cosine", "sine") if self.synchronised else ("amplitude",)
        own: list[str] = []
        for k in self.orders:
            shown = [f"{part} of harmonic {k}" for part in parts] if k else ["mean"]
            own += [f"{one} of {self.name}" for one in shown]
        for words, bands in (("", self.bands), ("scatter of ", self.scattered)):
            own += [f"{words}harmonics {a} to {b} of {self.name}" for a, b in bands]
        return tuple(own)

    def values(self, seen: Spectrum, measured: bool = False) -> tuple[Array, Array]:
        """Return the features (..., p) of a spectrum and their variances (..., p).

        A `measured` one has the sensor's noise, and its variances are those of few revolutions.
        """
        mean, between = seen.mean, np.nan_to_num(seen.variance)
        own = (known_scatter(seen).variance if measured else between) / seen.revolutions
        noise = float(self.noise or 0.0) if measured else 0.0
        power = np.maximum(np.abs(mean) ** 2 - own, 0.0)
        found: list[Array] = []
        spread: list[Array] = []
        for k in self.orders:
            if k == 0 or not self.synchronised:
                found.append(mean[..., 0].real if k == 0 else np.sqrt(power[..., k]))
                spread.append(own[..., k] if k == 0 else 0.5 * own[..., k])
            else:
                found += [mean[..., k].real, -mean[..., k].imag]
                spread += 2 * [0.5 * own[..., k]]
        for a, b in self.bands:
            total = power[..., a : b + 1].sum(-1)
            weight = (power * own)[..., a : b + 1].sum(-1)
            floor = own[..., a : b + 1].sum(-1)
            found.append(np.sqrt(total))
            spread.append(0.5 * weight / np.maximum(total, 1e-300) + 0.5 * floor / (b + 1 - a))
        freedom = max(seen.revolutions - 1, 1)
        for a, b in self.scattered:
            width, total = b + 1 - a, between[..., a : b + 1].sum(-1)
            found.append(np.sqrt(np.maximum(total - width * noise**2, 0.0)))
            spread.append(0.5 * total / (freedom * width))
        return np.stack(found, -1), np.stack(spread, -1)


def _thirds(first: int, last: int) -> tuple[tuple[int, int], ...]:
    """Third octaves from one order to another, both included."""
    found, begin = [], first
    while begin <= last:
        end = min(max(begin, int(begin * 2.0 ** (1.0 / 3.0))), last)
        found.append((begin, end))
        begin = end + 1
    return tuple(found)


def sensed(seen: Spectrum, sensor: Sensor, frequency: float, gain: Array, angle: Array) -> Spectrum:
    """Return simulated spectra (n, orders) as a sensor has them; `gain` and `angle` (n,): its own errors, relative and rad."""
    order = np.arange(float(seen.mean.shape[-1]))
    passed = sensor.response(order * frequency) * (1.0 + gain[:, None])
    mean = seen.mean * passed * np.exp(1j * order * angle[:, None])
    return replace(seen, mean=mean, variance=seen.variance * np.abs(passed) ** 2)


def known_scatter(seen: Spectrum) -> Spectrum:
    """Return a measured spectrum whose variances are smoothed over neighbouring orders, and enlarged for few revolutions."""
    own = seen.variance
    width = min(3, len(own) // 2)
    padded = np.pad(own[1:], width, mode="reflect") if len(own) > 2 * width + 1 else own[1:]
    kernel = np.full(2 * width + 1, 1.0 / (2 * width + 1))
    near = np.convolve(padded, kernel, mode="valid") if len(padded) > len(own) - 1 else own[1:]
    few = (seen.revolutions - 1) / max(seen.revolutions - 3, 1)
    smooth = np.concatenate([own[:1], 0.5 * (own[1:] + near)])
    return replace(seen, variance=few * smooth)
