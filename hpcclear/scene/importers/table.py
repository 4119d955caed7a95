"""Points of a linkage from a table: names and places, and the bodies that each of them belongs to."""

import itertools
import re
from collections.abc import Sequence
from pathlib import Path

from hpcclear.base.errors import InputError
from hpcclear.scene.importers.points import GROUND, NAME, Drawing, Point
from hpcclear.scene.sheets import Column, Sheet, read
from hpcclear.scene.units import UnitError, of_unit, to_si

_COLUMNS = {
    "name": ("name", "point", "joint", "label", "punkt"),
    "x": ("x",),
    "y": ("y",),
    "bodies": ("bodies", "body", "links", "link", "parts", "members"),
    "slide": ("slide", "guide", "angle"),
}
"""Headings, in small letters, of what a table may have."""


def drawing_of(path: Path, unit: str) -> Drawing:
    """Points of a CSV file or workbook with the columns name, x, y (with their unit) and bodies.

    Points that bodies such as "crank coupler" share are pins; without bodies the points are a chain of bars between two
    that stand still. `slide` is the angle of a guide.
    """
    return Drawing(_points(read(path, "table of points"), str(path), unit))


def _points(sheet: Sheet, key: str, unit: str) -> list[Point]:
    columns = {
        kind: next((one for one in sheet.columns if one.name.strip().lower() in words), None)
        for kind, words in _COLUMNS.items()
    }
    for needed in ("name", "x", "y"):
        if columns[needed] is None:
            remedy = "Write the headings name, x [mm], y [mm] and bodies"
            raise InputError(key, ", ".join(sheet.names), f"has no column {needed}", remedy)
    x, y = (_lengths(sheet, columns[axis], key, unit) for axis in ("x", "y"))
    rows = range(len(sheet.lines))
    names = [_cell(columns["name"], row) for row in rows]
    for row, name in enumerate(names):
        where = f"{key}, line {sheet.lines[row]}"
        if not NAME.fullmatch(name):
            raise InputError(
                where,
                name,
                "is no name of a point",
                "Begin with a letter; use letters, digits, - and _",
            )
        if name in names[:row]:
            raise InputError(where, name, "a point of this name stands above", "Name each once")
    bodies = _bodies(columns["bodies"], names, key)
    slides = [_slide(sheet, columns["slide"], row) for row in rows]
    return [Point(*one) for one in zip(names, x, y, bodies, slides, strict=True)]


def _cell(column: Column | None, row: int) -> str:
    return "" if column is None else column.cells[row].strip()


def _lengths(sheet: Sheet, column: Column | None, key: str, unit: str) -> list[float]:
    assert column is not None  # looked for before
    unit = column.unit or unit
    if not unit:
        raise InputError(
            key, column.heading, "nothing says its unit", f'Write "{column.name} [mm]", say'
        )
    try:
        size = to_si(f"1 {unit}", "m")
    except UnitError as error:
        raise InputError(key, column.heading, error.reason, error.remedy) from None
    return [round(size * sheet.number(column, row), 12) for row in range(len(sheet.lines))]


def _bodies(column: Column | None, names: Sequence[str], key: str) -> list[tuple[str, ...]]:
    """Bodies of each point; of a file without them bars from each point to the next, the first and the last on the ground."""
    if column is None:
        if len(names) < 4:
            raise InputError(
                key,
                len(names),
                "a closed chain of bars has at least 4 points",
                "Add a column bodies",
            )
        bars = [GROUND, *(f"bar{k}" for k in range(1, len(names))), GROUND]
        return list(itertools.pairwise(bars))
    found = []
    for row, cell in enumerate(column.cells):
        bodies = tuple(dict.fromkeys(re.split(r"[\s,;+/&|-]+", cell.strip().lower())))
        wrong = next((one for one in bodies if not NAME.fullmatch(one)), None)
        if wrong is not None:
            raise InputError(
                key, cell, f"{names[row]} belongs to no body", 'Write, say, "crank coupler"'
            )
        found.append(
            tuple(GROUND if one in ("frame", "base", "fixed", "0") else one for one in bodies)
        )
    return found


def _slide(sheet: Sheet, column: Column | None, row: int) -> float | None:
    if column is None or _cell(column, row) in ("", "-"):
        return None
    value = sheet.number(column, row, "rad")
    return of_unit(repr(value), column.unit or "deg", "rad")
