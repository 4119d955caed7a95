"""What was measured: a table of one or more signals, as harmonics of the crank."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, at
from hpcclear.base.remarks import remark
from hpcclear.ensemble.maps import number_of
from hpcclear.identify.signals import ORDERS, Spectrum, harmonics
from hpcclear.results.signals import is_counted
from hpcclear.scene import Scene
from hpcclear.scene.delimited import SheetColumn
from hpcclear.scene.planar import turns_of
from hpcclear.scene.sheets import Sheet, read_series, unwrapped

FEWEST = 4
"""Whole revolutions that a table needs: their scatter is the measure of its noise."""

NYQUIST = 0.4
"""Share of the sampling rate up to which harmonics are used: anti-aliasing filters take what is left."""

DRIFT = 0.03
"""Relative difference of the crank's speed from the scene's that the search for its period covers."""

FAR = 0.1
"""The same from which on a table is not of the scene's machine, or its times are wrong."""

ALIKE = "Sort its rows, and keep one of those that are alike"

PAIRS = 180
"""Pairs of the curve of a measured pressure."""


@dataclass(frozen=True)
class Measured:
    """One signal of one table.

    `synchronised`: the crank angle was recorded, so that phases are known; `frequency`: of the crank, Hz, NaN where the table
    has no time; `highest`: order below the sampling rate's; `samples`: of a revolution.
    """

    name: str
    spectrum: Spectrum
    synchronised: bool
    frequency: float
    highest: int
    samples: float = 1024.0


def read_measured(
    path: Path, name: str, unit: str, frequency: float, turns: int = 1, sense: int = 1, key: str = "--signal",
    given: bool = True,
) -> Measured:  # fmt: skip
    """Read a signal from a table: columns ``time [s]`` or ``crank_angle [deg]``, or both, and signals by their names.

    `frequency`: of a revolution of the drive in the scene, Hz; `turns`, `sense`: turns of the crank in it, and -1 where the
    crank turns clockwise; `key`: the option, for errors; `given`: whether the drive keeps to that frequency. Raises InputError:
    the table cannot be read, lacks the signal, has too few revolutions, or contradicts the frequency.
    """
    sheet = read_series(path)
    angle, time = (sheet.axes.get(kind) for kind in ("angle", "time"))
    values = sheet.si(_column(sheet, name, key), unit, "heading")
    seconds = None if time is None else sheet.si(time, "s", "heading")
    count = is_counted(name)
    if seconds is not None and (np.diff(seconds) <= 0.0).any():
        raise InputError(key, str(path), "its times do not rise", ALIKE)
    if angle is not None:
        place = unwrapped(sense * sheet.si(angle, "rad", "heading")) / (2.0 * np.pi * turns)
    elif seconds is not None:
        with at(key, str(path)):
            place = (seconds - seconds[0]) * _frequency(seconds, values, frequency)
    else:
        remedy = 'Call the first column "time [s]" or "crank_angle [deg]"'
        raise InputError(key, str(path), "has neither time nor crank angle", remedy)
    if (np.diff(place) <= 0.0).any():
        remedy = f"{ALIKE}. If its angle falls, reverse the speed of the scene's drive"
        raise InputError(key, str(path), "its time or angle does not rise", remedy)
    if not np.isfinite(values).all():
        raise InputError(key, str(path), "has cells without a number", "Remove these rows")
    found = harmonics(place, values, count) if place[-1] - place[0] >= 1.0 else np.empty((0, 1))
    if len(found) < FEWEST:
        reason = f"holds {len(found)} whole revolutions"
        remedy = f"Record {FEWEST} or more: their scatter is its noise"
        raise InputError(key, str(path), reason, remedy)
    rate = len(place) / float(place[-1] - place[0])
    known = frequency
    if seconds is not None:
        known = float((place[-1] - place[0]) / (seconds[-1] - seconds[0]))
    if given and abs(known - frequency) > FAR * frequency:
        speeds = f"{60 * known:.4g} rpm, and the scene {60 * frequency:.4g} rpm"
        remedy = "Correct the unit of its time, or the drive's speed"
        raise InputError(key, str(path), f"its time and angle give {speeds}", remedy)
    highest = min(ORDERS, int(NYQUIST * rate))
    return Measured(name, Spectrum.of(found), angle is not None, known, highest, rate)


def loaded(scene: Scene, path: Path, words: str) -> Scene:
    """A slider-crank whose slider bears a measured pressure, towards the crank: its mean over the revolutions, by the crank
    angle.

    `words`: ``COLUMN=AREA``. Raises InputError: they are another thing, the table lacks the angle or the column, or the scene
    is of another mechanism.
    """
    name, _, size = words.partition("=")
    if not size:
        raise InputError("--pressure", words, "is not COLUMN=AREA", 'For example pressure="12 cm2"')
    if scene.template is None:
        remedy = "Write the load of a linkage as a curve in its scene"
        raise InputError("--pressure", words, "only a slider-crank has a piston", remedy)
    area = number_of("--pressure", size, "m^2", above=0.0)
    found = read_measured(path, name, "Pa", np.nan, turns_of(scene.linkage), key="--pressure")
    if not found.synchronised:
        raise InputError("--pressure", str(path), "has no crank angle", 'Add "crank_angle [deg]"')
    share = np.arange(PAIRS) / PAIRS
    order = np.arange(float(found.highest + 1))
    mean = found.spectrum.mean[: found.highest + 1]
    pressure = (mean * np.exp(2j * np.pi * order * share[:, None])).real.sum(axis=1)
    angle = 2.0 * np.pi * turns_of(scene.linkage) * share
    pairs = [[float(a), float(-area * p)] for a, p in zip(angle, pressure, strict=True)]
    return scene.with_({"effects.slider_load": pairs})


def _column(sheet: Sheet, name: str, key: str) -> SheetColumn:
    """The column of an option; a table of one signal may call it as it likes."""
    named = [one for one in sheet.columns if one.name.strip() == name]
    found = named or (sheet.signals if key == "--signal" else [])
    if len(found) == 1:
        return found[0]
    remedy = f"Call one so. It has: {', '.join(one.heading for one in sheet.signals)}"
    reason = f"has {len(named) or 'no'} columns {name!r}"
    raise InputError(key, sheet.path, reason.replace("no columns", "no column"), remedy)


def _frequency(time: Array, values: Array, nominal: float) -> float:
    """Frequency of the crank, Hz: the one near the nominal at which the revolutions are most alike."""
    span = float(time[-1] - time[0])
    own = values - values.mean()
    if span * nominal > len(time):
        reason = f"{len(time)} rows for {span * nominal:.3g} revolutions: less than one each"
        raise InputError("", "", reason, "Check its unit, or measure more often")
    if span * nominal < FEWEST or not own.any():
        return nominal
    orders = np.arange(1, 13)

    def power(frequency: float) -> float:
        wave = np.exp(-2j * np.pi * frequency * time)
        total, phasor = 0.0, np.ones_like(wave)
        for _ in orders:
            phasor = phasor * wave
            total += float(abs(own @ phasor)) ** 2
        return total

    step = 1.0 / (4.0 * span * len(orders))
    count = int(DRIFT * nominal / step)
    best = max((nominal + step * np.arange(-count, count + 1)).tolist(), key=power)
    if abs(best - nominal) > DRIFT * nominal - step:
        remark(
            f"Warning: its revolutions are most alike {100 * DRIFT:g} % or more from the scene's speed"
        )
    return float(max((best + step * np.linspace(-1.0, 1.0, 41)).tolist(), key=power))
