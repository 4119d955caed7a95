"""Tables that people have, from any file: CSV of any spreadsheet program and measuring device, Excel workbooks.

`read` gives columns with names and units, cells as text; what can be read in two ways is refused with what was found there.
"""

import codecs
import csv
import gc
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError, nearest
from hpcclear.scene import clock
from hpcclear.scene.units import (
    UnitError,
    check_thousands,
    is_unit,
    may_be_thousands,
    mended,
    to_si,
)
from hpcclear.scene.workbook import cells_of

LARGEST_FILE = 200_000_000
MOST_CELLS = 4_000_000
"""Of a table of text: they take a gigabyte."""
LONGEST_LINE = 100_000
"""Characters of a line of a table; a design has some ten numbers."""

_PACKED = b"PK\x03\x04"
_FOREIGN = {
    b"\xd0\xcf\x11\xe0": "an old Excel file (.xls)",
    b"%PDF": "a PDF",
    b"{\\rtf": "a text with formats (.rtf)",
    b"\x89HDF": "an HDF5 file",
    b"CDF\x01": "a NetCDF file",
    b"MATLAB 5.0": "a MATLAB file (.mat)",
    b"\x1f\x8b": "a compressed file (.gz)",
    b"\x7fELF": "a program",
}
"""How files begin that are no table, and what they are."""
_SAVE = "Save it as CSV (UTF-8) or .xlsx"

_POINT = re.compile(r"[+-]?(?:\d+\.\d*|\.\d+|\d{1,3}(?:[,'’\s]\d{3})+\.\d*)(?:[eEdD][+-]?\d+)?")
_COMMA = re.compile(r"[+-]?(?:\d+,\d*|,\d+|\d{1,3}(?:[.'’\s]\d{3})+,\d*)(?:[eEdD][+-]?\d+)?")
_WHOLE = re.compile(r"[+-]?\d+(?:[eEdD][+-]?\d+)?")
_HEADING = re.compile(
    r"(.*?)\s*(?:\[\s*([^\[\]]{0,40}?)\s*\]|\(\s*([^()]{0,40}?)\s*\)|\s[/,]\s*(\S.{0,39}))?\s*",
    re.DOTALL,
)
_NOTHING = ("", "-", "–", "—", "na", "n/a", "nan", "null", "none")
"""Cells in which nothing stands, in small letters."""
LONGEST_CELL = 200
"""Characters of a heading or number, so that no pattern takes long over it."""
_SIGNS = tuple("+-.,0123456789\u2212")
"""How a number begins."""
_PLAIN = frozenset("0123456789.+-eE")
"""Characters of numbers that need no thought."""


class Column(NamedTuple):
    """One column: its heading, its unit as written, "" for none, and its cells."""

    name: str
    unit: str
    heading: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Sheet:
    """A table of named columns, all of one length."""

    path: str
    columns: tuple[Column, ...]
    lines: tuple[int, ...]
    """Where each row stands in the file, counted from 1."""
    found: str
    """What it was read as: encoding, separator, decimal sign."""
    comma: bool
    """Whether decimals have a comma."""

    def number(self, column: Column, row: int, unit: str | None = None) -> float:
        """A cell as a number in the unit of its column, or in `unit` where one stands with the number in the cell.

        Raises
        ------
        InputError
            If there is none; it names line and column.
        """
        cell = column.cells[row]
        text = cell.strip()
        if column.unit == "%" and text.endswith("%"):
            text = text[:-1].rstrip()
        try:
            return _number(text, self.comma)
        except ValueError:
            pass
        where = self.place(column, row)
        of_unit = text[:1] in _SIGNS and text[-1:] not in tuple("0123456789.")
        if unit is not None and not column.unit and of_unit:
            try:
                return to_si(text.replace(",", ".") if self.comma else text, unit, self.comma)
            except UnitError as error:
                raise InputError(where, cell, error.reason, error.remedy) from None
        reason, remedy = "is not a finite decimal number", "Write a number such as 0.21"
        if text.lower() in _NOTHING:
            reason, remedy = f"the cell is empty: it {reason}", "Give each column a value"
        elif text.startswith("#"):
            reason, remedy = "is an error of the spreadsheet", "Mend its formula"
        elif clock.is_clock(text):
            reason = "is a date or time: spreadsheet programs make dates of numbers such as 1.3"
            remedy = "Format the cell as a number and write it again"
        else:
            remedy = mended(text) or remedy
            try:
                check_thousands(text)
            except UnitError as error:
                reason, remedy = error.reason, error.remedy
        raise InputError(where, cell, reason, remedy)

    def numbers(self, column: Column, unit: str | None = None) -> Array:
        """All cells of a column, shape (n,), as `number` has each."""
        if not self.comma and all(map(_PLAIN.issuperset, column.cells)):
            try:
                values = np.array(column.cells, dtype=float)
            except ValueError:  # said below, with its place
                pass
            else:
                if np.isfinite(values).all():
                    return values
        return np.array([self.number(column, row, unit) for row in range(len(self.lines))])

    def place(self, column: Column, row: int) -> str:
        """Where a cell stands, in errors."""
        return f"{self.path}, line {self.lines[row]}, column {column.name}"

    def is_clock(self, column: Column) -> bool:
        """Whether the column has clock times or dates, by its first cell that is not empty."""
        return clock.is_clock(next(filter(None, column.cells), ""))

    def seconds(self, column: Column) -> Array:
        """Clock times or dates of a column as seconds since the first row, shape (n,); InputError says which is none."""
        return np.array(clock.seconds(column.cells, lambda row: self.place(column, row)))

    def clock(self) -> Column | None:
        """The column of clock times, with the dates of a column beside it; None where no column has any."""
        found = [one for one in self.columns if self.is_clock(one)]
        if len(found) > 1 and not any(":" in cell for cell in found[0].cells):  # dates, then times
            joined = zip(found[0].cells, found[1].cells, strict=True)
            return found[1]._replace(cells=tuple(f"{day} {time}" for day, time in joined))
        return next(iter(found), None)

    def column(self, name: str, key: str) -> Column:
        """The column of that name or heading; InputError says which there are."""
        found = [one for one in self.columns if name in (one.name, one.heading)]
        if len(found) > 1:
            raise InputError(key, name, f"{len(found)} columns have this heading", "Name each once")
        if found:
            return found[0]
        names = tuple(one.name for one in self.columns)
        raise InputError(key, name, f"is no column of {self.path}", nearest(name, names))

    def is_text(self, column: Column) -> bool:
        """Whether no cell of the column begins as a number does, or all are dates: names of parts, times, remarks."""
        return self.is_clock(column) or not any(
            cell.lstrip()[:1] in _SIGNS for cell in column.cells
        )

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return tuple(one.name for one in self.columns)


def _number(cell: str, comma: bool) -> float:
    """A number as text; raises ValueError."""
    text = cell.strip().replace("\u2212", "-")
    pattern, other = (_COMMA, ".") if comma else (_POINT, ",")
    if pattern.fullmatch(text):
        text = re.sub(rf"[{other}'’\s]", "", text).replace(",", ".")
    elif not _WHOLE.fullmatch(text):
        raise ValueError(cell)
    number = float(text.lower().replace("d", "e"))
    if abs(number) == float("inf"):
        raise ValueError(cell)
    return number


def read(place: Path, what: str = "table of points", headed: bool = True) -> Sheet:
    """Read a table.

    Parameters
    ----------
    place : Path
        A CSV file, or a workbook (.xlsx); "book.xlsx#Sheet" for one of several sheets.
    what : str
        What it is for, in errors.
    headed : bool
        Whether headings are needed; else columns without them have the names "1", "2" and so on.

    Raises
    ------
    InputError
        If it is none, or holds what can be read in two ways: the message says what was found, and where.
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
    data = _bytes(path, what)
    if data.startswith(_PACKED):
        rows = cells_of(path, data, what, page)
        return _sheet(path, what, rows, "Excel workbook", ";", headed)
    text, encoding = _decoded(path, what, data)
    rows, separator = _cells(path, what, text)
    return _sheet(path, what, rows, f"{encoding}, {_NAMED[separator]}", separator, headed)


def place_of(place: Path) -> tuple[Path, str | None]:
    """The file that a place such as "book.xlsx#Sheet" names, and its sheet."""
    name, _, page = str(place).partition("#")
    return (place, None) if place.exists() or not page else (Path(name), page)


def _bytes(path: Path, what: str) -> bytes:
    remedy = "Give a CSV or .xlsx file"
    try:
        if not path.is_file():
            raise InputError(what, str(path), "there is no such regular file", remedy)
        with path.open("rb") as stream:
            data = stream.read(min(path.stat().st_size, LARGEST_FILE) + 1)
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        raise InputError(what, str(path), reason, remedy) from None
    if len(data) > LARGEST_FILE:
        raise InputError(what, str(path), f"is larger than {LARGEST_FILE} bytes", "Split it")
    for begin, kind in _FOREIGN.items():
        if data.startswith(begin):
            raise InputError(what, str(path), f"is {kind}", _SAVE)
    if data.startswith(_PACKED) and b"vnd.oasis.opendocument" in data[:200]:
        raise InputError(what, str(path), "is an OpenDocument file (.ods)", _SAVE)
    if re.match(rb"\s*<(!doctype|html|\?xml|table)", data[:200], re.IGNORECASE):
        raise InputError(what, str(path), "is a page of markup (HTML or XML)", _SAVE)
    return data


def _decoded(path: Path, what: str, data: bytes) -> tuple[str, str]:
    """Text of a file, and its encoding in words."""
    for mark, encoding in (
        (codecs.BOM_UTF8, "UTF-8"), (codecs.BOM_UTF32_LE, "UTF-32"), (codecs.BOM_UTF32_BE, "UTF-32"),
        (codecs.BOM_UTF16_LE, "UTF-16"), (codecs.BOM_UTF16_BE, "UTF-16"),
    ):  # fmt: skip
        if data.startswith(mark):
            codec = "utf-8-sig" if encoding == "UTF-8" else encoding
            break
    else:
        nulls = data[:2000].count(0)
        codec = encoding = "UTF-8"
        if nulls and nulls * 4 >= min(len(data), 2000):  # every other byte of Latin letters
            codec, encoding = ("UTF-16-LE" if data[1:2] == b"\0" else "UTF-16-BE"), "UTF-16"
    try:
        text = data.decode(codec)
    except UnicodeDecodeError as error:
        try:
            text, encoding = data.decode("cp1252"), "Windows-1252"
        except UnicodeDecodeError:
            reason = f"is text of no encoding that is known (byte {error.start})"
            raise InputError(what, str(path), reason, _SAVE) from None
    if any(ord(sign) < 32 and sign not in "\t\r\n\f" for sign in text[:100_000]):
        raise InputError(what, str(path), "is no text: it has control characters", _SAVE)
    return text.replace("\r\n", "\n").replace("\r", "\n"), encoding


Rows = list[tuple[int, list[str]]]
"""Line numbers and cells."""


_NAMED = {
    "\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", "  ": "spaces", " ": "spaces", "": "one column",
}  # fmt: skip
_COMMENT = re.compile(r"\s*(?:#|%|//|!)\s*(.*)")


Lines = list[tuple[int, str]]
"""Numbers, from 1 on, and texts of lines."""


def _cells(path: Path, what: str, text: str) -> tuple[Rows, str]:
    """Rows of a text that are not empty, and the separator of their cells."""
    lines, comments, separator = Lines(), Lines(), ""
    number, counted = 1, 0
    # one after the other: a file may be of line ends alone
    for found in re.finditer(r"[^\n]+", text):
        line = found[0]
        number, counted = number + text.count("\n", counted, found.start()), found.start()
        if len(line) > LONGEST_LINE:
            reason = f"a line has more than {LONGEST_LINE} characters"
            raise InputError(what, str(path), reason, "Write a line for each point")
        if line.isspace():
            continue
        if number == 1 and (stated := re.fullmatch(r'"?sep=(.)"?', line.strip())):
            separator = stated[1]
        elif comment := _COMMENT.match(line):
            comments.append((number, comment[1]))
        else:
            lines.append((number, line))
    separator = separator or _separator([line for _, line in lines[:2000]])
    rows = _rows(path, what, lines, separator)
    above = [one for one in comments if rows and one[0] < rows[0][0]]
    if above and all(map(_is_number, rows[0][1])):  # NumPy writes headings behind a #
        headings = _rows(path, what, above[-1:], separator)
        if headings and len(headings[0][1]) == len(rows[0][1]):
            rows = [*headings, *rows]
    return rows, separator


def _rows(path: Path, what: str, lines: Lines, separator: str) -> Rows:
    if separator.isspace() and separator != "\t":  # runs of them stand between columns
        runs = _between(separator)
        lines = [
            (number, runs.sub("\x1f", re.sub(r"\s+(?=[\[(])", "", line.strip())))
            for number, line in lines
        ]
        separator = "\x1f"
    try:
        cut = csv.reader(
            (line + "\n" for _, line in lines),
            delimiter=separator or "\x1f", strict=True, skipinitialspace=True,
        )  # fmt: skip
        rows, count = Rows(), 0
        for cells in cut:
            rows.append((lines[cut.line_num - 1][0], [cell.strip() for cell in cells]))
            count += len(cells)
            if count > MOST_CELLS:
                reason = f"has more than {MOST_CELLS} cells"
                raise InputError(
                    what, str(path), reason, "Keep the rows and columns that are needed"
                )
    except csv.Error as error:
        raise InputError(what, str(path), f"cannot be read ({error})", _SAVE) from None
    for line, cells in rows:
        if max(map(len, cells), default=0) > LONGEST_CELL:
            reason = f"a cell has more than {LONGEST_CELL} characters ({_NAMED.get(separator, 'spaces')})"
            raise InputError(f"{path}, line {line}", cells[0][:40], reason, _SAVE)
    return [(line, cells) for line, cells in rows if any(cells)]


def _between(sign: str) -> re.Pattern[str]:
    """A separator as an expression: of spaces so many or more."""
    spaces = sign.isspace() and sign != "\t"
    return re.compile(f"[ \u00a0]{{{len(sign)},}}" if spaces else re.escape(sign))


def _separator(lines: Sequence[str]) -> str:
    """What stands between cells: the sign that cuts most lines into one number of cells, several; "" for one column."""
    filled = [re.sub(r'"[^"]*"', '""', line.strip(" ")) for line in lines]
    best, share = "", 0.0
    for sign in ("\t", ";", "|", ",", "  ", " "):
        counts = Counter(len(_between(sign).findall(line)) + 1 for line in filled)
        if sign == "," and filled and "," not in filled[0] and all(map(_is_comma, filled[1:])):
            continue  # one column with decimal commas
        severals = [times for cells, times in counts.items() if cells > 1]
        found = max(severals, default=0) / max(len(filled), 1)
        if found > share + (0.3 if share else 0.0):
            best, share = sign, found
    return best


def _is_comma(text: str) -> bool:
    return _COMMA.fullmatch(text.strip()) is not None


def _is_number(cell: str) -> bool:
    text = cell.strip().replace("\u2212", "-")
    return any(one.fullmatch(text) for one in (_POINT, _COMMA, _WHOLE))


def _sheet(path: Path, what: str, rows: Rows, found: str, separator: str, headed: bool) -> Sheet:
    """Columns of rows: headings, units in them or in a row below, and cells."""
    if len(rows) < 2:
        remedy = "Write a row of names, then a row for each point or value"
        raise InputError(what, str(path), f"contains no points ({found})", remedy)
    width = max(len(cells) for _, cells in rows)
    while width > 1 and all(len(cells) < width or not cells[width - 1] for _, cells in rows):
        width -= 1  # separators at the end of each line
    first = _header(rows)
    (line, header), body = rows[first], rows[first + 1 :]
    header = header[:width]
    bare = all(_is_number(cell) or clock.is_clock(cell) for cell in header if cell)
    if bare and not headed:
        header, body = [str(1 + k) for k in range(width)], rows[first:]
    elif bare:
        raise InputError(
            f"{path}, line {line}", ", ".join(header)[:200], f"no heading stands above the numbers ({found})",
            "Write a row of names first, such as m2 [g]",
        )  # fmt: skip
    sideways = len(header) > 2 and all(map(_is_number, header[1:]))
    if sideways and not any(_is_number(cells[0]) for _, cells in rows):
        raise InputError(
            f"{path}, line {line}", ", ".join(header)[:200], f"the headings stand in the first column ({found})",
            "Transpose the table, so that they stand in the first row",
        )  # fmt: skip
    units: list[str | None] = [None] * width
    if body and _are_units(body[0][1]):
        units = [re.sub(r"[\[\]()]", "", cell).strip() for cell in body[0][1]]
        body = body[1:]
    cells = [
        one
        if len(one) == len(header)
        else _row(path, number, header, one[:width], one[width:], separator)
        for number, one in body
    ]
    if not cells:
        raise InputError(
            what, str(path), f"contains no points ({found})", "Write a row for each point or value"
        )
    columns = []
    for place, heading in enumerate(header):
        name, unit = parsed_heading(heading)
        if place < len(units) and units[place] is not None:
            unit = units[place] or unit
        columns.append(Column(name, unit, heading, tuple(row[place] for row in cells)))
    _check_headings(path, line, [one for one in columns if one.heading or any(one.cells)])
    columns = [one for one in columns if one.heading or any(one.cells)]
    comma = _has_commas(path, columns, [number for number, _ in body], separator)
    named = f"{found}, decimal {'commas' if comma else 'points'}"
    return Sheet(str(path), tuple(columns), tuple(number for number, _ in body), named, comma)


def _header(rows: Rows) -> int:
    """Which row has the headings: of those above the first number the fullest, which titles and remarks are not."""
    above = next((k for k, (_, cells) in enumerate(rows) if any(map(_is_number, cells))), 1)
    filled = [sum(map(bool, cells)) for _, cells in rows[: max(above, 1)]]
    return filled.index(max(filled))


def _row(
    path: Path, line: int, header: list[str], cells: list[str], more: list[str], separator: str
) -> list[str]:
    """Cells of a row, as many as headings."""
    count = len(cells) + len(more)
    if len(cells) < len(header) and len(header) > 1 and separator in (",", ""):
        reason = f"has {count} cells instead of {len(header)}"
        raise InputError(
            f"{path}, line {line}", ",".join(cells)[:200], reason, "Give each column a value"
        )
    if any(more) or len(cells) > len(header):
        reason, remedy = f"has {count} cells instead of {len(header)}", "Give each column a value"
        if separator == "," and count == 2 * len(header):
            reason += ": commas seem to stand between cells and in decimals"
        if separator == ",":
            remedy = "Where decimals have commas, save it with semicolons between cells"
        raise InputError(f"{path}, line {line}", ",".join([*cells, *more])[:200], reason, remedy)
    return cells + [""] * (len(header) - len(cells))


def parsed_heading(heading: str) -> tuple[str, str]:
    """Name and unit of a heading: ``C [mm]``, ``C (mm)``, ``C / mm``, ``C, mm``, ``C in mm``; the unit as written."""
    found = _HEADING.fullmatch(heading)
    assert found is not None  # it takes anything
    name, bracket, round_, rest = found.groups()
    if bracket is not None:
        return name, bracket
    unit = round_ if round_ is not None else rest
    if unit is not None and (is_unit(unit) or not unit):
        return name, unit
    behind = re.fullmatch(r"(.+?)\s+in\s+(\S.*)", heading)
    if behind and is_unit(behind[2]):
        return behind[1], behind[2]
    attached = re.fullmatch(r"(.+)_([^_]+)", heading)
    if attached and attached[2] in ("deg", "bar", "kPa", "MPa", "mm", "rpm", "Nm", "ms"):
        return attached[1], attached[2]
    return heading, ""


def _are_units(cells: list[str]) -> bool:
    """Whether a row below the headings has units: no number, and some cell that is a unit, or nothing."""
    bare = [re.sub(r"[\[\]()]", "", cell).strip() for cell in cells]
    filled = [cell for cell in bare if cell not in _NOTHING]
    return bool(filled) and all(is_unit(cell) for cell in filled)


def _check_headings(path: Path, line: int, columns: list[Column]) -> None:
    where = f"{path}, line {line}"
    for column in columns:
        if not column.heading:
            raise InputError(where, "", "a column has no heading", "Name it, or remove the column")


def _has_commas(path: Path, columns: list[Column], lines: list[int], separator: str) -> bool:
    """Whether decimals have a comma; InputError where some have a comma and some a point."""
    seen: dict[bool, str] = {}
    doubtful = ""
    for column in columns:
        for line, cell in zip(lines, column.cells, strict=True):
            if "," not in cell and (False in seen or "." not in cell):
                continue  # neither a decimal comma nor the first point
            text = cell.replace("\u2212", "-")
            for comma, pattern in ((False, _POINT), (True, _COMMA)):
                if pattern.fullmatch(text):
                    shown = f"{cell!r} in line {line}, column {column.name}"
                    if may_be_thousands(text) and (comma or separator not in (",", "")):
                        doubtful = doubtful or shown
                    else:
                        seen.setdefault(comma, shown)
    if len(seen) == 2:
        reason = f"has decimal points ({seen[False]}) and decimal commas ({seen[True]})"
        raise InputError("table", str(path), reason, "Write all decimals in one way")
    if doubtful and not seen and separator not in (",", ""):
        reason = f"has {doubtful}, which may be a decimal or have a sign for thousands"
        raise InputError("table", str(path), reason, "Write numbers without a sign for thousands")
    return True in seen
