"""Points of a linkage from a table: names and places, and the bodies that each of them belongs to."""

import itertools
import re
from collections import Counter
from collections.abc import Sequence

from hpcclear.base.errors import InputError, at, nearest
from hpcclear.base.units import factor, to_si
from hpcclear.scene.delimited import SheetColumn
from hpcclear.scene.importers.file import GROUND, File, Names, limit
from hpcclear.scene.importers.points import Drawing, DrawnPoint
from hpcclear.scene.sheets import Sheet, read

_COLUMNS = {
    "name": ("name", "point", "joint", "label", "punkt"),
    "x": ("x",),
    "y": ("y",),
    "bodies": ("bodies", "body", "links", "link", "parts", "members"),
    "slide": ("slide", "guide", "angle"),
    "remark": ("remark", "remarks", "comment", "comments", "note", "notes", "description"),
}
"""Headings, in small letters, of what a table may have; another one is refused, since it may hold the bodies."""
_GROUNDS = (GROUND, "frame", "base", "fixed", "0")


def begins(data: bytes) -> bool:
    """True: a table is tried last, and takes what is left."""
    return True


def drawing_of(file: File) -> Drawing:
    """Points of a CSV file or workbook with the columns name, x, y (with their unit) and bodies.

    Points that bodies such as "crank coupler" share are pins; without bodies the points are a chain of bars between two
    that stand still. `slide` is the angle of a guide.
    """
    sheet = read(file.path, "table of points")
    limit(len(sheet.lines), file.key)
    columns = _columns(sheet, file)
    x, y = (_lengths(sheet, columns.get(axis), file) for axis in ("x", "y"))
    rows = range(len(sheet.lines))
    points, bodies = Names("point", "P"), Names("body", "body")
    names = [_name(sheet, columns["name"], row, points) for row in rows]
    belonging = _bodies(columns.get("bodies"), names, file, bodies)
    slides = [_slide(sheet, columns.get("slide"), row) for row in rows]
    _check_apart([own for own, slide in zip(belonging, slides, strict=True) if slide is None], file)
    notes = [*points.notes(), *bodies.notes()]
    if "remark" in columns:
        notes.append(f"Column {columns['remark'].heading!r} is not taken over")
    made = [DrawnPoint(*one) for one in zip(names, x, y, belonging, slides, strict=True)]
    return Drawing(made, {}, notes)


def _columns(sheet: Sheet, file: File) -> dict[str, SheetColumn]:
    """Columns by what they are; InputError where one is not known, stands twice or is missing."""
    known = [word for words in _COLUMNS.values() for word in words]
    found: dict[str, SheetColumn] = {}
    for column in sheet.columns:
        word = column.name.strip().lower()
        kind = next((kind for kind, words in _COLUMNS.items() if word in words), None)
        if kind is None:
            reason = "is no column of a table of points"
            remedy = f"{nearest(word, known)}. Known: {', '.join(_COLUMNS)}"
            file.refuse(column.heading, reason, remedy)
        if kind in found:
            reason = f"stands beside {found[kind].heading}, which is the same"
            file.refuse(column.heading, reason, "Keep one of them")
        found[kind] = column
    for needed in ("name", "x", "y"):
        if needed not in found:
            remedy = "Write the headings name, x [mm], y [mm] and bodies"
            file.refuse(", ".join(sheet.names)[:200], f"has no column {needed}", remedy)
    return found


def _name(sheet: Sheet, column: SheetColumn, row: int, points: Names) -> str:
    text = column.cells[row].strip()
    where = f"{sheet.path}, line {sheet.lines[row]}"
    if not text:
        raise InputError(where, text, "the point has no name", "Name each point")
    if text in column.cells[:row]:
        raise InputError(where, text, "a point of this name stands above", "Name each once")
    return points.given(text)


def _lengths(sheet: Sheet, column: SheetColumn | None, file: File) -> list[float]:
    assert column is not None  # looked for before
    if not sheet.states_unit(column) and not file.unit:
        file.refuse(column.heading, "nothing says its unit", f'Write "{column.name} [mm]", say')
    values = sheet.si(column, "m", file.key, file.unit)
    if file.unit and column.unit:
        file.scale(to_si(f"1 {column.unit}", "m"), column.heading)
    return [round(value, 12) for value in values.tolist()]


def _bodies(
    column: SheetColumn | None, names: Sequence[str], file: File, given: Names
) -> list[tuple[str, ...]]:
    """Bodies of each point; of a file without them bars from each point to the next, the first and the last on the ground."""
    if column is None:
        if len(names) < 4:
            reason = "a closed chain of bars has at least 4 points"
            file.refuse(len(names), reason, "Add a column bodies")
        bars = [GROUND, *(f"bar{k}" for k in range(1, len(names))), GROUND]
        return list(itertools.pairwise(bars))
    known = dict.fromkeys(_GROUNDS, GROUND)
    found = []
    for row, cell in enumerate(column.cells):
        words = re.findall(r"[^\s,;+/&|-]+", cell.lower())
        if not words:
            file.refuse(cell, f"{names[row]} belongs to no body", 'Write, say, "crank coupler"')
        for word in words:
            if word not in known:
                known[word] = given.given(word)
        found.append(tuple(dict.fromkeys(known[word] for word in words)))
    return found


def _check_apart(pins: Sequence[tuple[str, ...]], file: File) -> None:
    """InputError where two bodies share two pins, as the two words of "rocker arm" do."""
    pairs = Counter(pair for own in pins for pair in itertools.combinations(sorted(own), 2))
    for (first, second), count in pairs.items():
        if count > 1:
            reason = f"and {second} share {count} points, so neither moves against the other"
            file.refuse(first, reason, "Write one name for one body, such as rocker_arm")


def _slide(sheet: Sheet, column: SheetColumn | None, row: int) -> float | None:
    if column is None or column.cells[row].strip() in ("", "-"):
        return None
    with at(sheet.path, column.heading):
        size = factor(column.unit or "deg", "rad")
    return sheet.number(column, row, "rad", size)
