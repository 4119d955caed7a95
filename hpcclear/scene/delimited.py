"""Rows of cells of a table in text: of any encoding, with any sign between cells, headings and remarks behind a #.

The largest sizes of tables stand here; `workbook` has the rows of a workbook, `sheets` makes columns of both.
"""

import codecs
import csv
import re
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from hpcclear.base.errors import InputError
from hpcclear.base.units import is_unit

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
Rows = list[tuple[int, list[str]]]
"""Line numbers and cells."""
Lines = list[tuple[int, str]]
"""Numbers, from 1 on, and texts of lines."""


def bytes_of(path: Path, what: str) -> bytes:
    """Bytes of a file that may be a table; raises InputError where it is too large, or of another kind."""
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
    if data.startswith(PACKED) and b"vnd.oasis.opendocument" in data[:200]:
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
