"""Tables that people have, from any file: CSV of any spreadsheet program and measuring device, Excel workbooks.

`read` gives columns with names and units, cells as text; what can be read in two ways is refused with what was found there.
Whoever reads a table says which columns it wants (`Sheet.column`, `axes`, `signals`, `likely`) and their SI units (`Sheet.si`).
"""

import gc
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np

from hpcclear.base import units
from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, at, nearest
from hpcclear.base.remarks import remark
from hpcclear.scene import clock, delimited
from hpcclear.scene.delimited import NOTHING, SheetColumn, Stored, columns_of, decimal_of
from hpcclear.scene.fields import LARGEST
from hpcclear.scene.workbook import cells_of

_GAUGE = re.compile(r"(m?bar|psi|[kM]?Pa)\s*\(?(?:gauge|g|ü)\)?", re.IGNORECASE)
"""Units of gauge pressures."""
AXES = {"time": "s", "angle": "rad"}
"""What a table of signals may run along, and its SI unit."""
_NAMES = {"time": ("time", "t"), "angle": ("angle", "crank angle", "crankangle", "phi")}
"""Headings of these, in small letters and without signs."""
_BEGIN = {
    "angle": ("angle", "deg", "phi", "φ", "crank", "winkel", "kw", "ca", "theta", "θ", "kurbelwinkel"),
    "speed": ("speed", "drehzahl", "omega", "n"), "time": ("time", "zeit", "t"), "pressure": ("pressure", "druck", "p_", "p"),
    "force": ("force", "kraft", "f"), "torque": ("torque", "moment", "drehmoment", "m"),
}  # fmt: skip
"""How headings begin, in small letters, of columns whose unit says nothing."""
_BEGINS = re.compile(r"\s*[-+.,0-9\u2212]")
"""How a number begins."""
_PLAIN = frozenset("0123456789.+-eE")
"""Characters of numbers that need no thought."""
_ONE = Fraction(1)


@dataclass(frozen=True)
class Sheet:
    """A table of named columns, all of one length."""

    path: str
    columns: tuple[SheetColumn, ...]
    lines: tuple[int, ...]
    """Where each row stands in the file, counted from 1."""
    found: str
    """What it was read as: encoding, separator, decimal sign."""
    comma: bool
    """Whether decimals have a comma."""

    def number(self, column: SheetColumn, row: int, unit: str = "", size: Fraction = _ONE) -> float:
        """A cell in SI: `size` times its number, or by its own unit. Raises InputError with line and column if it is none."""
        cell = column.cells[row]
        text = cell.strip()
        comma, stored = self._signs(cell)
        if column.unit and (stored or column.unit == "%"):  # shown with the unit of the heading
            text = text.removesuffix(column.unit).rstrip()
        try:
            number: float | None = decimal_of(text, comma)
        except ValueError:
            number = None
        reason, remedy = "is not a finite decimal number", "Write a number such as 0.21"
        try:
            if number is not None and abs(number) <= LARGEST:
                return units.scaled(number, size)
            if not column.unit and self._has_unit(text):
                pointed = text.replace(",", ".") if comma else text
                return units.to_si(pointed, unit, comma or stored)
            if text.lower() in NOTHING:
                reason, remedy = f"the cell is empty: it {reason}", "Give each column a value"
            elif text.startswith("#"):
                reason, remedy = "is an error of the spreadsheet", "Mend its formula"
            elif number is not None:
                reason, remedy = f"is beyond {LARGEST:g}", "Check its digits and its exponent"
            elif clock.is_clock(text):
                reason = "is a date or time: spreadsheet programs make dates of numbers such as 1.3"
                remedy = "Format the cell as a number and write it again"
            else:
                remedy = units.mended(text) or remedy
                units.check_thousands(text)
        except units.UnitError as error:
            reason, remedy = error.reason, error.remedy
        raise InputError(self.place(column, row), cell, reason, remedy)

    def _signs(self, cell: str) -> tuple[bool, bool]:
        """Whether decimals of a cell have a comma, and whether it is a number of a workbook."""
        stored = isinstance(cell, Stored)
        return self.comma and not stored, stored

    @staticmethod
    def _has_unit(text: str) -> bool:
        return bool(_BEGINS.match(text)) and text[-1:] not in tuple("0123456789.")

    def states_unit(self, column: SheetColumn) -> bool:
        """Whether the heading of a column has a unit, each of its cells, or they are clock times."""
        return bool(column.unit) or self.is_clock(column) or all(map(self._has_unit, column.cells))

    def si(self, column: SheetColumn, unit: str, key: str, default: str = "") -> Array:
        """All cells of a column in the SI unit `unit`, shape (n,), each the nearest float of what is written.

        The unit of the heading counts, without the g of gauge pressures, else that of a cell, else `default`, "" for SI.
        Clock times are seconds since the first row.

        Raises InputError: a cell is no number, or a unit is of another quantity; `key` names what the column is read for.
        """
        if unit == "s" and self.is_clock(column):
            return np.array(clock.seconds(column.cells, lambda row: self.place(column, row)))
        own, size = plain_unit(column.unit or default, unit), _ONE
        if own not in ("", unit):
            with at(key, column.heading):
                size = units.factor(own, unit)
            units.note_turns(f"1 {own} in {column.heading}", "1", own, unit)
        if not self.comma and all(map(_PLAIN.issuperset, column.cells)):
            try:
                values = np.array(column.cells, dtype=float)
                if (np.abs(values) <= LARGEST).all():
                    exact = (units.scaled(one, size) for one in values.tolist())
                    return values if size == 1 else np.array(list(exact))
            except ValueError:  # said below, with its place
                pass
        return np.array([self.number(column, row, unit, size) for row in range(len(self.lines))])

    def entries(self, column: SheetColumn) -> list[float | str]:
        """Cells of a column as entries of a scene: numbers, or texts with a unit. Raises InputError if one is no number."""
        if column.unit or not all(map(self._has_unit, column.cells)):
            values = self.si(column, column.unit, "").tolist()
            return [units.written(value, column.unit) for value in values]
        made = list[float | str]()
        for row, cell in enumerate(column.cells):
            comma, stored = self._signs(cell)
            pointed = cell.replace(",", ".") if comma else cell
            with at(self.place(column, row), cell):
                number, unit = units.quantity(pointed, "", decided=comma or stored)
            made.append(units.written(float(number), unit))
        return made

    def place(self, column: SheetColumn, row: int) -> str:
        """Where a cell stands, in errors."""
        return f"{self.path}, line {self.lines[row]}, column {column.name}"

    def is_clock(self, column: SheetColumn) -> bool:
        """Whether the column has clock times or dates, by its first cell that is not empty."""
        return clock.is_clock(next(filter(None, column.cells), ""))

    @cached_property
    def axes(self) -> dict[str, SheetColumn]:
        """The columns of `AXES` by what they are: from their headings, in their order.

        Besides, clock times with the dates of a column beside them. Without any of these, the first column, if its
        unit or how its heading begins says what it is.
        """
        words = {word: kind for kind, words in _NAMES.items() for word in words}
        named = [(words.get(plain_name(one.name), ""), one) for one in reversed(self.columns)]
        found = dict(one for one in named if one[0])
        found = {kind: found[kind] for kind in reversed(found)}
        clocks = [one for one in self.columns if self.is_clock(one)]
        if clocks and "time" not in found:
            first, last = clocks[0], clocks[:2][-1]
            if ":" in "".join(first.cells) or first is last:
                found["time"] = first
            else:  # dates, then times
                both = map(" ".join, zip(first.cells, last.cells, strict=True))
                found["time"] = last._replace(cells=tuple(both))
        first = self.columns[0]
        for kind, unit in AXES.items() if not found else ():
            begins = not first.unit and plain_name(first.name).startswith(_BEGIN[kind])
            if begins or units.fits(first.unit, unit):
                return {kind: first}
        return found

    @property
    def of_numbers(self) -> list[SheetColumn]:
        """Columns of numbers."""
        return [one for one in self.columns if not self.is_text(one)]

    @property
    def signals(self) -> list[SheetColumn]:
        """Columns of numbers that are no axis."""
        return [one for one in self.of_numbers if one not in self.axes.values()]

    def likely(self, kind: str, unit: str, key: str, taken: Sequence[SheetColumn]) -> SheetColumn:
        """The column of a kind of quantity: the axis, else by its unit, its heading, or because no other is left.

        Raises InputError if none or several of them may be meant.
        """
        if kind in self.axes:
            return self.axes[kind]
        free = [one for one in self.of_numbers if one not in taken]
        named = [one for one in free if one.unit]
        by_unit = [one for one in named if units.fits(plain_unit(one.unit, unit), unit)]
        by_name = [one for one in free if one.name.lower().startswith(_BEGIN[kind])]
        for found in (by_unit, by_name if not by_unit else [], free):
            if len(found) == 1 or (found and kind in AXES and found is free):
                return found[0]
            if len(found) > 1:
                break
        listed = ", ".join(one.heading for one in (by_unit or by_name or free))
        listed = listed or "none with numbers"
        reason = f"which column of {self.path} it is does not follow from its headings: {listed}"
        raise InputError(key, None, reason, f'Name it, as in {kind} = "heading"')

    def column(self, name: str, key: str) -> SheetColumn:
        """The column of that name or heading; InputError says which there are."""
        found = [one for one in self.columns if name in (one.name, one.heading)]
        if len(found) > 1:
            raise InputError(key, name, f"{len(found)} columns have this heading", "Name each once")
        if found:
            return found[0]
        raise InputError(key, name, f"is no column of {self.path}", nearest(name, self.names))

    def is_text(self, column: SheetColumn) -> bool:
        """Whether no cell of the column begins as a number does, or all are dates: names of parts, times, remarks."""
        return self.is_clock(column) or not any(map(_BEGINS.match, column.cells))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return tuple(one.name for one in self.columns)


def read(place: Path, what: str = "table of points", headed: bool = True) -> Sheet:
    """Read a table: a CSV file, or a workbook (.xlsx); "book.xlsx#Sheet" for one of several sheets.

    `what` it is for, in errors; where it need not be `headed`, columns without headings have the names "1", "2" and so on.
    Raises InputError if it is none, or holds what can be read in two ways: the message says what was found, and where.
    """
    path, page = place_of(place)
    collected = gc.isenabled()
    gc.disable()  # a list a row, none of them garbage: looking for it takes half of the time
    try:
        return _read(path, page, what, headed)
    finally:
        if collected:
            gc.enable()


def _read(path: Path, page: str | None, what: str, headed: bool) -> Sheet:
    data = delimited.bytes_of(path, what)
    if data.startswith(delimited.PACKED):
        rows, separator, found = cells_of(path, data, what, page), ";", "Excel workbook"
    elif page is not None:
        raise InputError(what, f"{path}#{page}", "is text, without sheets", f"Drop #{page}")
    else:
        rows, separator, found = delimited.rows_of(path, what, data)
    columns, lines, comma = columns_of(path, what, rows, found, separator, headed)
    named = f"{found}, decimal {'commas' if comma else 'points'}"
    return Sheet(str(path), columns, lines, named, comma)


def place_of(place: Path) -> tuple[Path, str | None]:
    """The file that a place such as "book.xlsx#Sheet" names, and its sheet."""
    name, _, page = str(place).partition("#")
    return (place, None) if place.exists() or not page else (Path(name), page)


def read_series(path: Path) -> Sheet:
    """Read a table of measured signals along time or an angle; raises InputError where there is no series."""
    sheet = read(path, "measured table")
    if len(sheet.axes) + len(sheet.signals) < 2 or len(sheet.lines) < 3:
        reason = "has no series: an axis, a quantity and three rows are needed"
        raise InputError("measured table", str(path), reason, "Give time or angle, then quantities")
    for column in sheet.columns:
        if delimited.is_unit(column.unit) and sheet.is_text(column) and not sheet.is_clock(column):
            if not any(column.cells):
                remark(f"Note: column {column.heading} of {path} is empty")
            else:
                sheet.number(column, next(k for k, cell in enumerate(column.cells) if cell))
    return sheet


def unwrapped(angle: Array) -> Array:
    """Angles (n,), rad, that go on beyond a turn: as they are where they rise all along, however large their steps."""
    return angle if (np.diff(angle) > 0.0).all() else np.unwrap(angle)


def plain_unit(unit: str, target: str) -> str:
    """A unit without the g of gauge pressures, where it is one, or without the sign of a number that has none: [-]."""
    if not target and unit in ("-", "1"):
        return ""
    return _GAUGE.sub(r"\1", unit) if target == "Pa" else unit


def plain_name(name: str) -> str:
    """A heading in small letters, without signs between its words."""
    return re.sub(r"[\s_.]+", " ", name).strip().lower()
