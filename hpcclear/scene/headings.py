"""Columns of a table from its rows: names and units of headings, cells as text, and the sign before decimals."""

import re
from pathlib import Path
from typing import NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.base.units import is_unit, may_be_thousands
from hpcclear.scene import clock
from hpcclear.scene.delimited import COMMA, POINT, Rows, cut_unit, is_number

_HEADING = re.compile(
    r"(.*?)\s*(?:\[\s*([^\[\]]{0,40}?)\s*\]|\(\s*([^()]{0,40}?)\s*\)|\s[/,]\s*(\S.{0,39}))?\s*",
    re.DOTALL,
)
NOTHING = ("", "-", "–", "—", "na", "n/a", "nan", "null", "none")
"""Cells in which nothing stands, in small letters."""


class Column(NamedTuple):
    """One column: its heading, its unit as written, "" for none, and its cells."""

    name: str
    unit: str
    heading: str
    cells: tuple[str, ...]


def columns_of(
    path: Path, what: str, rows: Rows, found: str, separator: str, headed: bool
) -> tuple[tuple[Column, ...], tuple[int, ...], bool]:
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
        raise InputError(
            f"{path}, line {line}", ", ".join(header)[:200], f"no heading stands above the numbers ({found})",
            "Write a row of names first, such as m2 [g]",
        )  # fmt: skip
    sideways = len(header) > 2 and all(map(is_number, header[1:]))
    if sideways and not any(is_number(cells[0]) for _, cells in rows):
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
        column = Column(name, unit, heading, tuple(row[place] for row in cells))
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
    filled = [cell for cell in bare if cell not in NOTHING]
    return bool(filled) and all(is_unit(cell) for cell in filled)


def _has_commas(path: Path, columns: list[Column], lines: list[int], separator: str) -> bool:
    """Whether decimals have a comma; InputError where some have a comma and some a point."""
    seen: dict[bool, str] = {}
    doubtful = ""
    for column in columns:
        for line, cell in zip(lines, column.cells, strict=True):
            if "," not in cell and (False in seen or "." not in cell):
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
