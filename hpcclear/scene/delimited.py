"""Rows of cells of a table in text, of any encoding, and their columns: headings with units, decimal signs, remarks behind a #.

The largest sizes of tables stand here; `workbook` has the rows of a workbook, `sheets` reads columns of both."""

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from hpcclear.base.errors import InputError, content_of
from hpcclear.base.plain import counted
from hpcclear.base.units import factor, fits, is_unit, may_be_thousands
from hpcclear.scene import clock

LARGEST_FILE = 200_000_000
"""Bytes of a table, unpacked."""
MOST_CELLS = 4_000_000
"""Of a table: they take a gigabyte."""
LONGEST_LINE = 100_000
"""Characters of a line of a table; a design has some ten numbers."""

PACKED = b"PK\x03\x04"
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

LONGEST_CELL = 200
"""Characters of a cell, so that no pattern takes long over it."""
POINT = re.compile(r"[+-]?(?:\d+\.\d*|\.\d+|\d{1,3}(?:[,'’\s]\d{3})+\.\d*)(?:[eEdD][+-]?\d+)?")
COMMA = re.compile(r"[+-]?(?:\d+,\d*|,\d+|\d{1,3}(?:[.'’\s]\d{3})+,\d*)(?:[eEdD][+-]?\d+)?")
_BEGIN = re.compile(r"[+-]?\d{0,40}[.,]?\d{1,40}(?:[eE][+-]?\d{1,3})?(?![.,'’\d])")
_WHOLE = re.compile(r"[+-]?\d+(?:[eEdD][+-]?\d+)?")

_NAMED = {
    "\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", "  ": "spaces", " ": "spaces", "": "one column",
}  # fmt: skip
_COMMENT = re.compile(r"\s*(?:#|%|//|!)\s*(.*)")


class Stored(str):
    """A number as a workbook stores it, and the unit with which it is shown: its point says nothing of those in texts."""


Rows = list[tuple[int, list[str]]]
"""Line numbers and cells."""
Lines = list[tuple[int, str]]
"""Numbers, from 1 on, and texts of lines."""


_MARKS = {
    codecs.BOM_UTF8: "UTF-8", codecs.BOM_UTF32_LE: "UTF-32", codecs.BOM_UTF32_BE: "UTF-32", codecs.BOM_UTF16_LE: "UTF-16",
    codecs.BOM_UTF16_BE: "UTF-16",
}  # fmt: skip
"""How texts begin whose first bytes state their encoding."""


def bytes_of(path: Path, what: str) -> bytes:
    """Bytes of a file that may be a table; raises InputError where it is too large, or of another kind."""
    data = content_of(path, what, LARGEST_FILE, "Give a CSV or .xlsx file", "Split it")
    kind = next((kind for begin, kind in _FOREIGN.items() if data.startswith(begin)), "")
    if data.startswith(PACKED) and b"vnd.oasis.opendocument" in data[:200]:
        kind = "an OpenDocument file (.ods)"
    if re.match(rb"\s*<(!doctype|html|\?xml|table)", data[:200], re.IGNORECASE):
        kind = "a page of markup (HTML or XML)"
    if kind:
        raise InputError(what, str(path), f"is {kind}", _SAVE)
    return data


def _decoded(path: Path, what: str, data: bytes) -> tuple[str, str]:
    """Text of a file, and its encoding in words."""
    nulls = data[:2000].count(0)
    codec = encoding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), "")
    # every other byte of Latin letters
    if not encoding and nulls and nulls * 4 >= min(len(data), 2000):
        codec, encoding = ("UTF-16-LE" if data[1:2] == b"\0" else "UTF-16-BE"), "UTF-16"
    encoding = encoding or "UTF-8"
    codec = "utf-8-sig" if encoding == "UTF-8" else codec
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


def rows_of(path: Path, what: str, data: bytes) -> tuple[Rows, str, str]:
    """Rows of a text that are not empty, the separator of their cells, and what it was read as in words; raises InputError."""
    text, encoding = _decoded(path, what, data)
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
    if above and all(map(is_number, rows[0][1])):  # NumPy writes headings behind a #
        headings = _rows(path, what, above[-1:], separator)
        if headings and len(headings[0][1]) == len(rows[0][1]):
            rows = [*headings, *rows]
    return rows, separator, f"{encoding}, {_NAMED[separator]}"


def _rows(path: Path, what: str, lines: Lines, separator: str) -> Rows:
    if separator.isspace() and separator != "\t":  # runs of them stand between columns
        runs, bracket = _between(separator), re.compile(r"\s+(?=[\[(])")
        lines = [(n, runs.sub("\x1f", bracket.sub("", line.strip()))) for n, line in lines]
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
                remedy = "Keep the rows and columns that are needed"
                raise InputError(what, str(path), reason, remedy)
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
        if sign in ", " and filled and sign not in filled[0] and all(map(_is_cell, filled[1:])):
            continue  # one column with decimal commas or units
        severals = [times for cells, times in counts.items() if cells > 1]
        found = max(severals, default=0) / max(len(filled), 1)
        least = 0.4 if sign == " " else 0.0  # one column may have words
        if found > max(share + 0.3 if share else 0.0, least):
            best, share = sign, found
    return best


def _is_cell(line: str) -> bool:
    """Whether a line is a single cell: a unit, or a number that has a comma or a unit."""
    if COMMA.fullmatch(line.strip()):
        return True
    number, unit = cut_unit(line)
    return COMMA.fullmatch(number) is not None or is_unit(re.sub(r"[\[\]()]", "", unit))


def cut_unit(cell: str) -> tuple[str, str]:
    """The number that a cell begins with, and what stands behind it."""
    found = _BEGIN.match(text := cell.strip().replace("\u2212", "-"))
    return ("", text) if found is None else (found[0], text[found.end() :].lstrip())


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma."""
    text = cell.strip().replace("\u2212", "-")
    return any(one.fullmatch(text) for one in (POINT, COMMA, _WHOLE))


def decimal_of(cell: str, comma: bool) -> float:
    """The finite number that a cell holds; raises ValueError."""
    text = cell.strip().replace("\u2212", "-")
    pattern, other = (COMMA, ".") if comma else (POINT, ",")
    if pattern.fullmatch(text):
        text = re.sub(rf"[{other}'’\s]", "", text).replace(",", ".")
    elif not _WHOLE.fullmatch(text):
        raise ValueError(cell)
    number = float(text.lower().replace("d", "e"))
    if abs(number) == float("inf"):
        raise ValueError(cell)
    return number


_HEADING = re.compile(
    r"(.*?)\s*(?:\[\s*([^\[\]]{0,40}?)\s*\]|\(\s*([^()]{0,40}?)\s*\)|\s[/,]\s*(\S.{0,39}))?\s*",
    re.DOTALL,
)
NOTHING = ("", "-", "–", "—", "na", "n/a", "nan", "null", "none")
"""Cells in which nothing stands, in small letters."""


class SheetColumn(NamedTuple):
    """One column: its heading, its unit as written, "" for none, and its cells."""

    name: str
    unit: str
    heading: str
    cells: tuple[str, ...]


def columns_of(
    path: Path, what: str, rows: Rows, found: str, separator: str, headed: bool
) -> tuple[tuple[SheetColumn, ...], tuple[int, ...], bool]:
    """Columns of rows, the lines of the cells, and whether decimals have a comma.

    Headings stand above the first number, units in them or in a row below; InputError says what is amiss.
    """
    if len(rows) < 2:
        remedy = "Write a row of names, then a row for each point or value"
        raise InputError(what, str(path), f"contains no points ({found})", remedy)
    width = max(len(cells) for _, cells in rows)
    while width > 1 and all(len(cells) < width or not cells[width - 1] for _, cells in rows):
        width -= 1  # separators at the end of each line
    first = _header(rows)
    (line, header), body = rows[first], rows[first + 1 :]
    header = header[:width]
    bare = all(is_number(cell) or clock.is_clock(cell) for cell in header if cell)
    if bare and not headed:
        header, body = [str(1 + k) for k in range(width)], rows[first:]
    elif bare:
        reason = f"no heading stands above the numbers ({found})"
        remedy = "Write a row of names first, such as m2 [g]"
        raise InputError(f"{path}, line {line}", ", ".join(header)[:200], reason, remedy)
    sideways = len(header) > 2 and all(map(is_number, header[1:]))
    if sideways and not any(is_number(cells[0]) for _, cells in rows):
        reason = f"the headings stand in the first column ({found})"
        remedy = "Transpose the table, so that they stand in the first row"
        raise InputError(f"{path}, line {line}", ", ".join(header)[:200], reason, remedy)
    units: list[str] = []
    below = [re.sub(r"[\[\]()]", "", cell).strip() for cell in body[0][1]] if body else []
    filled = [cell for cell in below if cell not in NOTHING]
    if filled and all(map(is_unit, filled)):
        units = below
        for own, heading in zip(units, header, strict=False):
            stated = parsed_heading(heading)[1]
            alike = own in NOTHING or not stated or (fits(own, stated) and factor(own, stated) == 1)
            if not alike:
                reason = f"is the unit below {heading!r}"
                raise InputError(f"{path}, line {body[0][0]}", own, reason, "Keep one unit")
        body = body[1:]
    cells = [_row(path, number, header, one, width, separator) for number, one in body]
    if not cells:
        raise InputError(what, str(path), f"contains no points ({found})", "Give each point a row")
    columns = []
    for place, heading in enumerate(header):
        name, unit = parsed_heading(heading)
        unit = "".join(units[place : place + 1]) or unit
        column = SheetColumn(name, unit, heading, tuple(row[place] for row in cells))
        if not heading and any(column.cells):
            reason = "a column has no heading"
            raise InputError(f"{path}, line {line}", "", reason, "Name it, or remove the column")
        columns += [column] if heading else []
    comma = _has_commas(path, columns, [number for number, _ in body], separator)
    return tuple(columns), tuple(number for number, _ in body), comma


def _header(rows: Rows) -> int:
    """Which row has the headings: of those above the first number the fullest, which titles and remarks are not."""
    above = next((k for k, (_, cells) in enumerate(rows) if any(map(is_number, cells))), 1)
    filled = [sum(map(bool, cells)) for _, cells in rows[: max(above, 1)]]
    return filled.index(max(filled))


def _row(
    path: Path, line: int, header: list[str], found: list[str], width: int, separator: str
) -> list[str]:
    """Cells of a row, as many as headings; the columns of a table are as many as `width`."""
    if len(found) == len(header):
        return found
    cells, remedy = found[:width], "Give each column a value"
    reason = f"has {counted(len(found), 'cell')} instead of {len(header)}"
    few = len(cells) < len(header) and len(header) > 1 and separator in (",", "")
    many = any(found[width:]) or len(cells) > len(header)
    if many and not few and separator == ",":
        if len(found) == 2 * len(header):
            reason += ": commas seem to stand between cells and in decimals"
        remedy = "Where decimals have commas, save it with semicolons between cells"
    if few or many:
        raise InputError(f"{path}, line {line}", ",".join(found)[:200], reason, remedy)
    return cells + [""] * (len(header) - len(cells))


def parsed_heading(heading: str) -> tuple[str, str]:
    """Name and unit of a heading: ``C [mm]``, ``C (mm)``, ``C / mm``, ``C/mm``, ``C , mm``, ``C in mm``, as written."""
    found = _HEADING.fullmatch(heading)
    assert found is not None  # it takes anything
    name, bracket, round_, rest = found.groups()
    if bracket is not None:
        return name, bracket
    unit = round_ if round_ is not None else rest
    if unit is not None and (is_unit(unit) or not unit):
        return name, unit
    behind = re.fullmatch(r"(.+?)\s+in\s+(\S.*)", heading)
    if not behind and not any("/" in word and is_unit(word) for word in heading.split()):
        behind = re.fullmatch(r"([^/]+)/(\S.*)", heading)  # and "speed m/s" is a name
    if behind and is_unit(behind[2]):
        return behind[1], behind[2]
    attached = re.fullmatch(r"(.+)_([^_]+)", heading)
    if attached and attached[2] in ("deg", "bar", "kPa", "MPa", "mm", "rpm", "Nm", "ms"):
        return attached[1], attached[2]
    return heading, ""


def _has_commas(path: Path, columns: list[SheetColumn], lines: list[int], separator: str) -> bool:
    """Whether decimals have a comma; InputError where some have a comma and some a point."""
    seen: dict[bool, str] = {}
    doubtful = ""
    for column in columns:
        for line, cell in zip(lines, column.cells, strict=True):
            if isinstance(cell, Stored) or ("," not in cell and (False in seen or "." not in cell)):
                continue  # neither a decimal comma nor the first point
            text, behind = cut_unit(cell)
            text = cell.strip().replace("\u2212", "-") if behind and not is_unit(behind) else text
            for comma, pattern in ((False, POINT), (True, COMMA)):
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
