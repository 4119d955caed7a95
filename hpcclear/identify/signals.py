"""Signals by name, as harmonics of the crank: of a simulated response and of a table that was measured.

A signal is one of `hpcclear.results.signals`. Each revolution is resampled over the crank angle, so that order k is k cycles
per revolution whatever the speed does.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import Status
from hpcclear.base.plain import counted
from hpcclear.base.remarks import remark
from hpcclear.report.figures import motion
from hpcclear.results.content import Results
from hpcclear.results.signals import signal
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of

ORDERS = 64
"""Highest harmonic of a revolution that is kept."""

INSTANTS = 1024
"""Instants of a revolution: simulated contact forces have content beyond the highest harmonic, which must not alias into it."""

GAP = 0.05
"""Share of a revolution between two rows beyond which it is left out, unless rows are as sparse elsewhere."""

PARTS = 3
"""Numbers kept of a harmonic: real and imaginary part of its mean over revolutions, variance between revolutions."""


@dataclass(frozen=True)
class Sensor:
    """What a sensor makes of a signal.

    `band`: frequencies that pass, Hz, the upper one that of the anti-aliasing filter; `resonance`, `quality`: mounting
    resonance, Hz, and its quality factor; `gain_error`, `angle_error`: standard deviations of the calibration factor
    (relative) and of the crank-angle reference (rad).
    """

    band: tuple[float, float] = (0.0, np.inf)
    resonance: float = np.inf
    quality: float = 10.0
    gain_error: float = 0.0
    angle_error: float = 0.0

    def response(self, frequency: Array) -> Array:
        """Return the complex response of the mounting at frequencies, Hz."""
        ratio = frequency / self.resonance
        return 1.0 / (1.0 - ratio**2 + 1j * ratio / self.quality)


@dataclass(frozen=True)
class Spectrum:
    """Harmonics (..., orders) of one or more signals: complex means over the revolutions, from order 0 on, and variances
    between them, real and imaginary part together.
    """

    mean: Array
    variance: Array
    revolutions: int

    @classmethod
    def of(cls, turns: Array) -> "Spectrum":
        """Return that of the harmonics (revolutions, ..., orders) of single revolutions."""
        count = len(turns)
        variance = np.var(turns, axis=0, ddof=1) if count > 1 else np.full(turns.shape[1:], np.nan)
        return cls(turns.mean(axis=0), variance, count)

    def packed(self) -> Array:
        """Return it as real numbers (..., PARTS, orders)."""
        return np.stack([self.mean.real, self.mean.imag, self.variance], axis=-2)

    @classmethod
    def unpacked(cls, rows: Array, revolutions: int) -> "Spectrum":
        """Return that of the numbers of `packed`."""
        return cls(rows[..., 0, :] + 1j * rows[..., 1, :], rows[..., 2, :], revolutions)


USUAL = (
    "crank_moment", "slider_acceleration", "followed_acceleration_x", "followed_acceleration_y",
    "frame_force_x", "frame_force_y",
)  # fmt: skip
"""Signals that people measure first."""


def names_of(response: Results) -> list[str]:
    """Return the signals that a mechanism has, those that people measure first."""
    speeds = response["crank_speed"].to_numpy() if "crank_speed" in response else np.zeros(1)
    free = ["crank_speed"] if np.ptp(speeds) > 1e-9 * abs(float(speeds[0])) else []
    return [*(one for one in USUAL if one in response), *free]


def harmonics(turns: Array, values: Array, count: bool = False) -> Array:
    """Complex harmonics (revolutions, ORDERS + 1) of each whole revolution without a gap; order k > 0 with the amplitude of its
    cosine and sine.

    `turns` (t,): revolutions of the crank, rising; whole numbers are at angle 0. `count`: the values (t,) are events.
    """
    slack = 2.0 * float(np.median(np.diff(turns)))
    first, last = int(np.ceil(turns[0] - slack)), int(np.floor(turns[-1] + slack))
    if count:
        edges = first + np.arange((last - first) * INSTANTS + 1) / INSTANTS
        grid = np.diff(np.interp(edges, turns, np.cumsum(values))) * INSTANTS
    else:
        places = first + np.arange((last - first) * INSTANTS) / INSTANTS
        grid = make_interp_spline(turns, values, k=3)(np.clip(places, turns[0], turns[-1]))
    found = np.fft.rfft(grid.reshape(-1, INSTANTS), axis=1)[:, : ORDERS + 1] / INSTANTS
    found[:, 1:] *= 2.0
    wide = np.diff(turns) > (np.inf if count else max(GAP, 2.0 * slack))
    number = np.arange(first, last)[:, None]
    holed = ((turns[:-1][wide] < number + 1) & (turns[1:][wide] > number)).any(axis=1)
    if holed.any():  # a curve through the ends of a gap is not what was measured
        remark(f"Note: {counted(int(holed.sum()), 'revolution')} with gaps left out")
    return np.asarray(found[~holed])


def revolutions_of(scene: Scene, response: Results) -> Array:
    """Return the crank angle of a response in revolutions of its drive (t,), rising."""
    angle, _ = motion.crank_angle(response)
    return angle / (2.0 * np.pi * turns_of(scene.linkage))


def spectra(scene: Scene, response: Results, names: Sequence[str]) -> Array:
    """Return the packed harmonics of signals of one response, shape (signals, PARTS, ORDERS + 1); NaN if it failed."""
    shape = (len(names), PARTS, ORDERS + 1)
    if not Status(int(response["status"])).valid:
        return np.full(shape, np.nan)
    turns = revolutions_of(scene, response)
    cycle = turns_of(scene.linkage)
    begin = turns[0] + float(response.attrs["transient_turns"]) / cycle - 1e-6
    kept = turns >= begin - 2.0 / INSTANTS
    found = []
    for name in names:
        one = signal(response, name, "--of")
        found.append(Spectrum.of(harmonics(turns[kept], one.values[kept], one.counted)).packed())
    return np.array(found)
