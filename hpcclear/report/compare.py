"""A simulated response against measured series: aligned in phase, with error norms for each quantity."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from hpcclear.base import markup
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, nearest
from hpcclear.base.remarks import remark
from hpcclear.base.units import fits
from hpcclear.report import bearings
from hpcclear.report.figures import motion
from hpcclear.results.content import Results
from hpcclear.results.signals import Signal, signals_in
from hpcclear.scene.delimited import SheetColumn
from hpcclear.scene.sheets import AXES, Sheet, plain_name, read_series, unwrapped

if TYPE_CHECKING:
    import xarray as xr

Alignment = Literal["auto", "angle", "correlation", "none"]

Curve = Callable[[Array], Array]
"""Values of a series at places (n,) along the axis."""

Places = tuple[Array, Callable[[Array], Array]]
"""Places of instants along an axis, (t,), and what gives those of measured values."""

LONGEST, SPARSE = 1e5, 100.0
"""Revolutions of a table, and to each of its rows, beyond which its times are taken for a slip of units."""

OTHERWISE = 0.1
"""Difference of the revolutions that time and angle of a table say, over these, from which they contradict each other."""

SHIFTS = 720
"""Shifts of a revolution that are tried for the largest correlation; the best is refined between its neighbours."""

NOT_ALIGNED = "not aligned"

MOST_POINTS = 4000
"""Measured points that the search for a shift uses."""


@dataclass(frozen=True)
class ComparedSignal:
    """One quantity, measured and simulated at the measured points; SI."""

    name: str
    """As headings of exported tables have it, without the unit."""
    label: str
    """Its words."""
    unit: str
    shown: str
    """The unit of the measured column."""
    measured: Array
    simulated: Array
    series: Array
    """All of the simulated series over the measured range, at `Comparison.series_x`."""
    by_revolution: Array
    """RMS error, had the first measured point been in each of the simulated revolutions; shape (revolutions,)."""

    @property
    def norms(self) -> dict[str, float]:
        """RMS and largest error, errors of mean and peak (simulated less measured), SI, and correlation: at measured points."""
        difference = self.simulated - self.measured
        peaks = [float(np.abs(one).max()) for one in (self.simulated, self.measured)]
        off, own = (float(np.sqrt(np.mean(x**2))) for x in (difference, self.measured))
        return {
            "rms": off,
            "relative_rms": off / (own or np.nan),
            "largest": float(np.abs(difference).max()),
            "mean": float(difference.mean()),
            "peak": peaks[0] - peaks[1],
            "correlation": _correlation(self.simulated, self.measured),
        }


@dataclass(frozen=True)
class Comparison:
    """A response against measurements."""

    axis: str
    """"angle" or "time"."""
    shown: str
    """Unit of the measured axis."""
    x: Array
    """Measured angle, rad, or time, s; shape (n,)."""
    shift: float
    """What was added to the measured axis, rad or s."""
    aligned: str
    """How: in words."""
    revolutions: int
    """Simulated revolutions, continued periodically."""
    revolution: int
    """Which of them, from 1, the first measured point was compared with."""
    series_x: Array
    """Measured angle, rad, or time, s, of the whole simulated series; shape (t,)."""
    quantities: tuple[ComparedSignal, ...]

    def _repr_html_(self) -> str:
        """What a notebook shows: the norms of each quantity, SI."""
        rows = [
            (f"{one.name} ({one.unit})", *(f"{value:.4g}" for value in one.norms.values()))
            for one in self.quantities
        ]
        header = ("quantity", "RMS error", "relative", "largest", "mean", "peak", "correlation")
        return markup.table(f"Comparison, {self.aligned}", rows, header)


def compare(
    response: xr.Dataset | Results,
    path: str | Path,
    align: Alignment = "auto",
    names: Mapping[str, str] | None = None,
) -> Comparison:
    """Compare a response with a table of measured series.

    Parameters
    ----------
    response : xarray.Dataset
        Kind ``response``; its averaged revolutions are used, continued periodically.
    path : path
        CSV file or workbook. A column is ``time`` or an angle of the crank (`hpcclear.scene.sheets.Sheet.axes`), the others are
        quantities as exported tables name them: ``contact_force crank_rod [kN]``. Without a unit, numbers are SI.
    align : {"auto", "angle", "correlation", "none"}
        By the crank angle of the table (modulo one revolution), or shifted to the largest correlation of all columns
        together. "auto": by angle where there is one. "none": time and angle as they stand.
    names : mapping of str to str, optional
        Quantities by headings of the table, where these have names of their own.

    Raises
    ------
    InputError
        The table cannot be read, names what the response has not, or has units of another kind.
    """
    response, sheet = Results.of(response), read_series(Path(path))
    axis, along = _axis(sheet)
    given = sheet.si(along, AXES[axis], "heading")
    if axis == "time" and (np.diff(given) < 0.0).any():
        raise InputError("measured table", str(path), "its times do not rise", "Sort its rows")
    inside = bearings.averaged(response)
    if inside.sum() < 3:
        reason = "no averaged revolution is stored in it"
        raise InputError("response", int(inside.sum()), reason, "Give a response that succeeded")
    shown = response.isel(time=np.flatnonzero(inside))
    turns = max(round(float(np.ptp(motion.turns(shown)))), 1)
    place, to_place = _places(shown, axis)
    times = [sheet.axes["time"]] if "time" in sheet.axes else []
    _check_names(names or {}, sheet.signals, times)
    pairs = [(column, _signal(shown, column, names or {})) for column in sheet.signals]
    measured = [sheet.si(column, one.unit.removesuffix("1"), "heading") for column, one in pairs]
    simulated = [_curve(place, one) for _, one in pairs]
    how = ("angle" if axis == "angle" else "correlation") if align == "auto" else align
    if how == "angle" and axis != "angle":
        remedy = 'Give a column "crank_angle [deg]" first, or align by correlation'
        raise InputError("--align", how, f"{path} has no angle", remedy)
    span = float(place[-1])
    _check_rounds(sheet, {kind: _places(shown, kind) for kind in sheet.axes}, turns)
    shift, words = _aligned(how, to_place(given), simulated, measured, span, turns)
    at = to_place(given) + shift
    revolution = int(np.mod(at[0], span) / span * turns + 1e-9) % turns + 1
    others = span / turns * (np.arange(turns) + 1 - revolution)
    every = _every(place, at)
    quantities = []
    for (column, one), own, curve in zip(pairs, measured, simulated, strict=True):
        errors = np.array([np.sqrt(np.mean((curve(at + step) - own) ** 2)) for step in others])
        series = own, curve(at), curve(every), errors
        quantities.append(ComparedSignal(one.name, one.label, one.unit, column.unit, *series))
    series_x = _measured_axis(shown, axis, given, at, every)
    unit, found = "s" if sheet.is_clock(along) else along.unit, (shift, words, turns, revolution)
    return Comparison(axis, unit, given, *found, series_x, tuple(quantities))


def _aligned(
    how: str, at: Array, simulated: list[Curve], measured: list[Array], span: float, turns: int
) -> tuple[float, str]:
    """What to add to the measured places `at` (n,), and how that was found, in words."""
    if how == "angle":
        # the table says where in a revolution, not in which of the simulated ones
        steps: Array = 2.0 * np.pi * np.arange(float(turns))
        return _best(at, simulated, measured, steps), "by crank angle"
    if how == "correlation" and any(map(np.ptp, measured)):  # else all shifts are alike
        shifts = np.linspace(0, span, SHIFTS * turns, endpoint=False)
        best = _best(at, simulated, measured, shifts)
        fine = shifts[1] * np.linspace(-1.0, 1.0, 41)  # between its neighbours
        return _best(at, simulated, measured, best + fine), "by the largest correlation"
    return 0.0, NOT_ALIGNED


def _every(place: Array, at: Array) -> Array:
    """Places of all instants within the range of the measured ones, the series being continued periodically."""
    span = float(place[-1])
    rounds = np.arange(np.floor(at.min() / span), np.floor(at.max() / span) + 1.0)
    every = (place[None, :-1] + span * rounds[:, None]).ravel()
    rounding = 1e-9 * span
    return every[(every >= at.min() - rounding) & (every <= at.max() + rounding)]


def _measured_axis(response: Results, axis: str, given: Array, at: Array, every: Array) -> Array:
    """What the measured axis shows at places of the simulation; angles within a turn where it has them so."""
    sense = motion.crank_angle(response)[1] if axis == "angle" else 1
    x: Array = given[0] + sense * (every - at[0])
    if axis == "angle" and np.ptp(at) > np.ptp(given) + 1e-9:
        x = given.min() + np.mod(x - given.min(), 2.0 * np.pi)
    return x


def _check_names(
    names: Mapping[str, str], columns: list[SheetColumn], times: list[SheetColumn]
) -> None:
    """InputError unless each named column is one of the table's, by its heading or without its unit, and no two are alike;
    `times`: the column of times, if there is one."""
    for k, one in enumerate(columns):
        if one.name in (other.name for other in [*times, *columns[:k]]):
            reason = f"another column is {one.name} as well"
            raise InputError("heading", one.heading, reason, "Keep one, or name one otherwise")
    known = [name for one in columns for name in dict.fromkeys((one.name, one.heading))]
    for name, quantity in names.items():
        if name not in known:
            reason = f"the table has no column {name!r}"
            raise InputError("--name", f"{name}={quantity}", reason, nearest(name, known))


def _check_rounds(sheet: Sheet, places: Mapping[str, Places], turns: int) -> None:
    """InputError where the first axis of a table has far too many revolutions for its rows; a remark where it has many, or
    where another axis has others. `places`: by axis, of `turns` revolutions."""
    found = {
        kind: float(np.ptp(to_place(sheet.si(sheet.axes[kind], AXES[kind], "heading"))) / place[-1]) * turns
        for kind, (place, to_place) in places.items()
    }  # fmt: skip
    (axis, rounds), *others = found.items()
    rows, path = len(sheet.axes[axis].cells), sheet.path
    reason = f"has {rows} rows for {rounds:.3g} revolutions"
    if rounds > min(LONGEST, SPARSE * rows):
        raise InputError("measured table", path, reason, "Check the unit of its first column")
    if rounds > rows:
        remark(f"Warning: {path} {reason}: is the unit of its first column right?")
    for kind, other in others:
        if abs(other - rounds) > OTHERWISE * rounds:
            several = f"{rounds:.3g} revolutions by its {axis}, which is taken, and {other:.3g} by its {kind}"
            remark(f"Warning: {path} has {several}, at the simulated speed.")


def _axis(sheet: Sheet) -> tuple[str, SheetColumn]:
    """Kind and column of what a table runs along: the first, where it has time and angle."""
    if not sheet.axes:
        reason = "the first column is neither time nor angle"
        remedy = 'Call it "time [s]" or "crank_angle [deg]"'
        raise InputError("heading", sheet.columns[0].heading, reason, remedy)
    return next(iter(sheet.axes.items()))


def _places(response: Results, axis: str) -> Places:
    """Places (t,) of the instants along the axis, which rise, and what gives those of measured values."""
    if axis == "time":
        time = response["time"].values
        return time - time[0], lambda given: given - time[0]
    angle, sense = motion.crank_angle(response)  # times its sense, so that it rises
    first = sense * angle[0]
    return angle - angle[0], lambda given: unwrapped(sense * (given - first))


def _signal(response: Results, column: SheetColumn, names: Mapping[str, str]) -> Signal:
    wanted = names.get(column.heading, names.get(column.name, column.name))
    found = signals_in(response)
    match = {plain_name(name): name for name in found}.get(plain_name(wanted))
    if match is None:
        alike = [name for name in found if name.startswith(f"{wanted} ")]
        fitting = [name for name in found if column.unit and fits(column.unit, found[name].unit)]
        known = nearest(wanted, fitting or list(found))
        remedy = f"Use one of: {', '.join(alike)}" if alike else known
        remedy += ". --name COLUMN=QUANTITY names the quantity of a column"
        reason = f"the response has no quantity {wanted!r}"
        raise InputError("heading", column.heading, reason, remedy)
    return found[match]


def _curve(place: Array, signal: Signal) -> Callable[[Array], Array]:
    """A series between its places (t,), continued with the period of them all; of events (t,) how many there are between the
    place before and each place."""
    span, values = float(place[-1]), signal.values
    if not signal.counted:
        return lambda at: np.interp(np.mod(at, span), place, values)
    passed = np.cumsum(values)

    def since(at: Array) -> Array:
        return passed[-1] * np.floor(at / span) + np.interp(np.mod(at, span), place, passed)

    return lambda at: np.diff(since(at), prepend=since(at[:1]))


def _best(at: Array, simulated: list[Curve], measured: list[Array], shifts: Array) -> float:
    """The shift with the largest sum of correlation coefficients."""
    few = np.unique(np.linspace(0, len(at) - 1, min(len(at), MOST_POINTS)).astype(int))

    def agreement(shift: float) -> float:
        pairs = zip(simulated, measured, strict=True)
        return sum(_correlation(curve(at[few] + shift), own[few]) for curve, own in pairs)

    return float(max(shifts, key=agreement)) if len(shifts) > 1 else float(shifts[0])


def _correlation(first: Array, second: Array) -> float:
    """Correlation coefficient; 0 where one of them is constant."""
    one, other = first - first.mean(), second - second.mean()
    size = float(np.sqrt((one @ one) * (other @ other)))
    return float(one @ other) / size if size > 0.0 else 0.0
