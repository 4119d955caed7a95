"""What a scene takes from tables beside its file: curves against the crank angle or the time, samples of random inputs."""

import hashlib
import math
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, at
from hpcclear.base.plain import counted
from hpcclear.base.units import UnitError, factor, fits
from hpcclear.base.written import Reading
from hpcclear.scene.curves import LONGER
from hpcclear.scene.delimited import SheetColumn, parsed_heading
from hpcclear.scene.driving import MOST_TURNS
from hpcclear.scene.faults import explained
from hpcclear.scene.fields import LONGEST_CURVE, Quantity, Table, Tables, invalid, table_at
from hpcclear.scene.paths import curve_at, curves, files_named, replace
from hpcclear.scene.sheets import Sheet, place_of, plain_unit, read

TURN = 2 * math.pi
SEAM = 0.02
"""Of the range of a curve: how far its ends may differ where they are the same angle; both are then replaced by their mean."""
LARGEST_GAP = math.radians(20)
"""Angle that may be left out of a revolution, where steps are smaller."""
FINEST = math.radians(0.1)
"""Step to which longer tables are resampled, or a wider one that makes them short enough."""
_VALUES = {"pressure": "Pa", "force": "N", "torque": "N*m"}
_MOTIONS = {"angle": "rad", "speed": "rad/s"}
_KINDS = {unit: kind for kind, unit in (_VALUES | _MOTIONS).items()}
_OF_PISTON = ("bore", "area", "ambient", "pushes")
_IN_SI = "no piston is larger, and a number without a unit is in SI"


class FileCurve(Table):
    """A curve from a file: CSV or Excel workbook, in place of a table ``[[angle, value], ...]``."""

    file: str
    """Path relative to the scene file; "book.xlsx#Sheet" for one of several sheets."""
    angle: str | None = None
    """Unit or heading of the crank angles. Without it the headings of the file are used."""
    time: str | None = None
    """For tables over time: unit or heading of the times."""
    speed: str | None = None
    """For a run-up: unit or heading of the speeds."""
    pressure: str | None = None
    """Unit or heading of pressures on a piston of diameter `bore`."""
    force: str | None = None
    """Unit or heading of forces."""
    torque: str | None = None
    """Unit or heading of torques."""
    bore: Annotated[float, Quantity("m", above=0, most=5, why=_IN_SI)] | None = None
    """Diameter of the piston, m."""
    area: Annotated[float, Quantity("m**2", above=0, most=20, why=_IN_SI)] | None = None
    """Instead of `bore`: area on which the pressure acts, m2."""
    ambient: Annotated[float, Quantity("Pa", least=0)] | None = None
    """Pressure on the other side of the piston, Pa. Required with pressures; 0 if the file contains gauge pressures."""
    pushes: Literal["+x", "-x"] | None = None
    """Direction in which the pressure pushes a slider; default "-x", away from a cylinder head beyond the outer dead centre."""
    zero: Annotated[float, Quantity("rad")] = 0.0
    """Crank angle of the scene at which the angle of the file is 0, rad: that of the dead centre from which the file counts."""
    clockwise: bool = False
    """Whether the angles of the file count clockwise."""

    elsewhere: ClassVar = {
        "column": ("belongs to measured values of an input", 'Write pressure = "heading [bar]"')
    }

    def _check(self) -> None:
        given = [kind for kind in _VALUES if getattr(self, kind) is not None]
        if len(given) > 1:
            raise invalid(f"stands beside {given[0]}", "Keep one of them", given[1])
        piston = [key for key in _OF_PISTON if getattr(self, key) is not None]
        if given not in ([], ["pressure"]) and piston:
            reason = "belongs to a pressure"
            raise invalid(reason, f"Remove it, or write pressure in place of {given[0]}", piston[0])
        if given == ["pressure"] or piston:
            self.check_one_of('A pressure needs bore = "42 mm", or area', "bore", "area")

    @property
    def piston(self) -> float | None:
        """Area that a pressure pushes on, m2; None where there is no pressure."""
        return self.area if self.bore is None else math.pi / 4 * self.bore**2


Read = tuple[list[list[float]], str]
"""Pairs, and what was read in words."""


def pairs_of(curve: FileCurve, folder: Path, unit: str, key: str, turns: int = 1) -> Read:
    """The pairs of a curve against the crank angle, rad and `unit` (N or N*m), rising, and what was read in words.

    `key`: the entry that it stands for; `turns`: after which that repeats, a file of fewer is repeated until then.
    Raises InputError if the file is no such curve; it says what was found.
    """
    sheet = read(folder / curve.file, f"{key}.file", headed=False)
    kind = _KINDS[unit] if curve.pressure is None and curve.piston is None else "pressure"
    first, angles = _column(sheet, "angle", curve.angle, "rad", key)
    second, values = _column(sheet, kind, getattr(curve, kind), _VALUES[kind], key, (first,))
    rows = counted(len(angles), "row")
    shown = f"{sheet.found}, {rows}, {second.name} from {_span(values, second)}"
    if kind == "pressure":
        values = _forces(curve, second, values, unit, key)
    if curve.clockwise:
        angles = -angles
    where = f"{key}.file", str(folder / curve.file)
    angles, values = _revolution(angles, values, where)
    own = 1 if angles[-1] - angles[0] < TURN else 2
    if turns % own:
        reason = f"has two turns, and the entry repeats after {counted(turns, 'turn')}"
        raise InputError(*where, reason, f"Give one turn. {LONGER}")
    if len(angles) * turns // own > (most := LONGEST_CURVE - 1):
        count = min(round(TURN / FINEST), most // turns) * own
        fine = angles[0] + own * TURN / count * np.arange(count)
        angles, values = fine, np.interp(fine, angles, values, period=own * TURN)
    angles = np.concatenate([angles + k * TURN for k in range(0, turns, own)])
    values = np.tile(values, turns // own)
    return [[float(a), float(v)] for a, v in zip(angles + curve.zero, values, strict=True)], shown


def against_time(curve: FileCurve, folder: Path, unit: str, key: str) -> Read:
    """The pairs of a curve against the time, s and `unit`, as `pairs_of` does; the motion of a drive begins at 0 s."""
    sheet = read(folder / curve.file, f"{key}.file", headed=False)
    kind = _KINDS[unit]
    first, times = _column(sheet, "time", curve.time, "s", key)
    _, values = _column(sheet, kind, getattr(curve, kind), unit, key, (first,))
    start = times[0] if kind in _MOTIONS else 0.0
    made = np.column_stack([times - start, values]).tolist()
    since = f", of which {start:.6g} s counts as 0 s" if start else ""
    since = f", {first.heading} since {first.cells[0]}" if sheet.is_clock(first) else since
    return made, f"{sheet.found}, {counted(len(times), 'row')}{since}"


def _span(values: Array, column: SheetColumn) -> str:
    try:
        size = float(factor(plain_unit(column.unit, "Pa"), "Pa"))
    except UnitError:
        return f"{values.min():.6g} to {values.max():.6g} in SI"
    return f"{values.min() / size:.6g} to {values.max() / size:.6g} {column.unit}"


def _column(
    sheet: Sheet, kind: str, given: str | None, target: str, key: str, taken: Sequence[SheetColumn] = (),
) -> tuple[SheetColumn, Array]:  # fmt: skip
    """The column of a kind, and its numbers in SI, shape (n,)."""
    key = f"{key}.{kind}"
    # such as "bar", "cylinder 1" or "cylinder 1 [bar]"
    bare = given is None or fits(given, target)
    name, unit = ("", given or "") if bare else parsed_heading(given or "")
    column = sheet.column(name, key) if name else sheet.likely(kind, target, key, taken)
    if unit and column.unit and _size(unit, target, key) != _size(column.unit, target, key):
        reason = f"the heading {column.heading!r} has the unit {column.unit}"
        raise InputError(key, given, reason, "Remove one of the two")
    if not unit and not sheet.states_unit(column):
        raise InputError(
            key, given, f"nothing says the unit of the column {column.heading!r} of {sheet.path}",
            f'Write {kind} = "{ {"rad": "deg", "Pa": "bar", "s": "s", "N": "N"}.get(target, "Nm") }", say',
        )  # fmt: skip
    return column, sheet.si(column, target, key, unit)


def _size(unit: str, target: str, key: str) -> Fraction:
    with at(key, unit):
        return factor(plain_unit(unit, target), target)


def _forces(curve: FileCurve, column: SheetColumn, values: Array, unit: str, key: str) -> Array:
    gauge = plain_unit(column.unit, "Pa") != column.unit
    if gauge and curve.ambient:
        reason, remedy = f"the heading {column.heading!r} is of gauge pressures", 'Write "0 bar"'
        raise InputError(f"{key}.ambient", f"{curve.ambient:g} Pa", reason, remedy)
    assert curve.piston is not None  # by validation
    if curve.ambient is None and not gauge:
        reason = "is missing: nothing says whether these are absolute or gauge pressures"
        remedy = 'Add ambient = "1 bar" for absolute, "0 bar" for gauge pressures'
        raise InputError(f"{key}.ambient", None, reason, remedy)
    on_slider = key == "effects.slider_load"
    if curve.pushes is not None and not on_slider:
        reason, remedy = "belongs to the load on a slider", "Write direction of this load"
        raise InputError(f"{key}.pushes", curve.pushes, reason, remedy)
    if curve.ambient and values.min() < 0.0:
        reason, remedy = "no absolute pressure is below 0", "For gauge pressures set ambient = 0"
        raise InputError(f"{key}.pressure", _span(values, column), reason, remedy)
    sign = -1.0 if on_slider and curve.pushes != "+x" else 1.0
    found: Array = sign * curve.piston * (values - (curve.ambient or 0.0))
    return found


def _revolution(angles: Array, values: Array, where: tuple[str, str]) -> tuple[Array, Array]:
    """Rising angles over one or two turns without the end point repeated, and their values."""
    if len(angles) < 2:
        raise InputError(*where, "has less than two rows", "Give a whole revolution")
    if angles[-1] < angles[0] and (np.diff(angles) < 0).sum() > len(angles) / 2:
        angles, values = angles[::-1], values[::-1]
    falls = np.flatnonzero(np.diff(angles) <= 0)
    # begins within a revolution: 180 to 359, 0 to 179
    if len(falls) == 1 and angles[-1] <= angles[0] + 1e-9:
        period = TURN * max(1, math.ceil((angles.max() - angles.min()) / TURN - 1e-6))
        angles = angles + period * (np.arange(len(angles)) > falls[0])
        falls = np.flatnonzero(np.diff(angles) <= 0)
    if len(falls):
        row = int(falls[0])
        pair = ", ".join(f"{math.degrees(one):.6g}" for one in angles[row : row + 2])
        reason = f"the angles do not rise from row to row: {pair} deg"
        raise InputError(*where, reason, "Sort the rows, each angle once; average cycles first")
    span = angles[-1] - angles[0]
    if span > 2 * TURN * (1 + 1e-6):
        reason = f"goes over {math.degrees(span):.6g} deg, more than two turns"
        remedy = "Give one turn, or the two of a four-stroke engine; average cycles first"
        raise InputError(*where, reason, remedy)
    turns = 1 if span <= TURN * (1 + 1e-6) else 2
    steps = np.diff(angles)
    gaps = np.append(steps, max(turns * TURN - span, 0.0))
    most = np.append(np.full(len(steps), 4 * np.median(steps)), 1.5 * steps.max())
    worst = int(np.argmax(excess := gaps - np.maximum(most, LARGEST_GAP)))
    if excess[worst] > 0.0:
        begin = math.degrees(angles[worst])
        reason = f"leaves out {begin:.6g} to {begin + math.degrees(gaps[worst]):.6g} deg of {360 * turns} deg"
        raise InputError(*where, reason, "Give the whole revolution")
    if gaps[-1] < 1e-6 * TURN:  # the end point repeats the first
        if abs(values[-1] - values[0]) > SEAM * np.ptp(values):
            ends = f"ends at {values[-1]:.6g} and begins at {values[0]:.6g}"
            reason = f"{ends} (SI), at the same angle"
            raise InputError(*where, reason, "Give a curve that repeats, or leave the last row out")
        values = np.append((values[0] + values[-1]) / 2, values[1:-1])
        angles = angles[:-1]
    return angles, values


def with_values(content: Tables, folder: Path) -> tuple[Tables, list[Reading]]:
    """A parsed scene with what its files in `folder` hold, and how each was read. Raises InputError if one cannot be read."""
    read_as: list[Reading] = []
    for key, row in files_named(content).items():
        file = row["file"]
        if not isinstance(file, str) or not file:
            raise InputError(f"{key}.file", file, "is no name of a table", "Write it in quotes")
        made: object
        if key.startswith("study.random."):
            made, shown = _with_values(row, file, key, folder)
        else:
            made, shown = _curve(content, row, key, folder)
        content = replace(content, key, made)
        digest = hashlib.sha256(place_of(folder / file)[0].read_bytes()).hexdigest()
        read_as.append(Reading(key, file, f"{shown}, SHA-256 {digest[:16]}"))
    return content, read_as


def _with_values(row: Tables, file: str, key: str, folder: Path) -> tuple[Tables, str]:
    column = row.get("column")
    if "values" in row:
        raise InputError(f"{key}.file", file, "values are given too", "Keep one of them")
    if column is not None and not isinstance(column, str):
        raise InputError(f"{key}.column", column, "is no name of a column", "Write it in quotes")
    path = folder / file
    sheet = read(path, f"{key}.file")
    of_numbers = sheet.of_numbers or sheet.columns
    if column is None and len(of_numbers) > 1:
        listed = ", ".join(sheet.names[:20])
        remedy = f"Name one as column = {sheet.columns[0].name!r}: it has {listed}"
        raise InputError(f"{key}.column", None, f"{path} has {len(of_numbers)} columns", remedy)
    chosen = of_numbers[0] if column is None else sheet.column(column, f"{key}.column")
    kept = {name: entry for name, entry in row.items() if name not in ("file", "column")}
    values = sheet.entries(chosen)
    return {**kept, "values": values}, f"{sheet.found}, {len(values)} values of {chosen.heading}"


def _curve(content: Tables, row: Tables, key: str, folder: Path) -> Read:
    pairs = curve_at(key)
    if pairs is None:
        listed = ", ".join(curves()).replace("*", "NAME")
        remedy = f"Files stand in study.random.NAME, {listed}"
        raise InputError(f"{key}.file", row["file"], "no file is read here", remedy)
    with at(key), explained(row):
        curve = FileCurve.model_validate(row)
        own = _KINDS[pairs.unit]
        known = {"file", own} | ({"time"} if pairs.x == "s" else {"angle", "zero", "clockwise"})
        known |= {"pressure", *_OF_PISTON} if own == "force" and pairs.x == "rad" else set()
        for entry in row.keys() - known:
            raise invalid(f"has no meaning here, where a {own} is read", "Remove it", entry)
    if pairs.x == "s":
        return against_time(curve, folder, pairs.unit, key)
    return pairs_of(curve, folder, pairs.unit, key, _turns(content, key))


def _turns(content: Tables, key: str) -> int:
    """Turns after which a curve against the angle repeats, by a parsed scene that is not validated yet."""
    if "angle_of" in table_at(content, key.rpartition(".")[0]):
        return 1
    rows = table_at(content, "mechanism.drives")
    drives = [table_at(rows, str(name)) for name in rows] or [table_at(content, "drive")]
    turns = next((row for row in drives if row.get("period") is True), drives[0]).get("turns", 1)
    return turns if type(turns) is int and 1 <= turns <= MOST_TURNS else 1
