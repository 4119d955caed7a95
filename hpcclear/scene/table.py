"""A user's own table of designs."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.scene.fields import nearest
from hpcclear.scene.named import SHORT_NAMES
from hpcclear.scene.paths import quantities
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import check_points
from hpcclear.scene.scene import Scene
from hpcclear.scene.sheets import Column, Sheet, read
from hpcclear.scene.units import UnitError, factor, note_turns, of_unit

LABELS = (
    "design",
    "name",
    "label",
    "part",
    "id",
    "no",
    "no.",
    "nr",
    "nr.",
    "number",
    "index",
    "run",
    "#",
)
"""Headings, in small letters, of columns that name the rows."""


def read_points(path: str | Path, scene: Scene) -> Points:
    """A user's table of designs: a CSV file of any spreadsheet program, or an Excel workbook.

    The first row names the columns: study variables, short names (m2, C, ...), or dotted
    scene paths, each with an optional unit, as in ``C [mm]`` or in a row below. Every further row is a design; lines
    that are empty or begin with # are left out. A column of text names the rows.

    Parameters
    ----------
    path : path
        The file.
    scene : Scene
        What the columns change; a study is not needed.

    Returns
    -------
    Points
        In SI.

    Raises
    ------
    InputError
        If the file cannot be read, or a cell is no number; it names row (line of the file) and
        column.
    """
    key, sheet = str(path), read(Path(path))
    labels, columns = [], []
    for column in sheet.columns:
        found = _driven(column, scene, key, sheet)
        if found is None:
            labels.append(column)
        else:
            columns.append(found)
    if not columns:
        raise InputError(
            key,
            ", ".join(sheet.names),
            "no column has numbers of this scene",
            "Name one such as m2 [g]",
        )
    names, paths = tuple(c.name for c in columns), tuple(c.paths for c in columns)
    driven = [path for column in paths for path in column]
    for path_ in driven:
        if driven.count(path_) > 1:
            raise InputError(
                key, ", ".join(names), f"two columns drive {path_}", "Remove one of them"
            )
    rows = range(len(sheet.lines))
    values = np.array([[column.read(sheet, row) for column in columns] for row in rows])
    named = tuple(" ".join(column.cells[row] for column in labels) for row in rows)
    points = Points(names, values, paths, named if labels else ())
    check_points(scene, points, lambda row: f"{key}, line {sheet.lines[row]}")
    return points


@dataclass(frozen=True)
class _Driven:
    """A column of numbers of the scene."""

    name: str
    paths: tuple[str, ...]
    unit: str  # as written, "" for SI
    column: Column

    def read(self, sheet: Sheet, row: int) -> float:
        """The cell in SI, within the bounds of every entry it drives."""
        quantity = quantities()[self.paths[0]]
        value = sheet.number(self.column, row, quantity.unit)
        if self.unit:
            value = of_unit(repr(value), self.unit, quantity.unit)
        for path in self.paths:
            if not quantities()[path].holds(value):
                reason = f"must be {quantities()[path].bounds()}"
                where = f"{sheet.path}, line {sheet.lines[row]}, column {self.name}"
                raise InputError(
                    where,
                    self.column.cells[row],
                    reason,
                    "Correct the value or the unit of its column",
                )
        return value


def _driven(column: Column, scene: Scene, key: str, sheet: Sheet) -> _Driven | None:
    """What a column such as ``C [mm]`` drives, None if it names the rows."""
    numbers = scene.numeric_paths()
    of_study = {} if scene.study is None else {v.name: v.paths for v in scene.study.variables}
    named = {**SHORT_NAMES, **of_study}
    paths = tuple(path for path in named.get(column.name, (column.name,)) if path in numbers)
    if not paths:
        if column.name.lower() in LABELS or sheet.is_text(column):
            return None
        if re.search(r"[\s\[\]]", column.name):
            raise InputError(
                key,
                column.heading,
                "is not a column name",
                'Write a name, and its unit as in "C [mm]"',
            )
        remedy = nearest(column.name, (*named, *numbers))
        raise InputError(
            key, column.name, "is neither a variable nor a number of this scene", remedy
        )
    unit, own = column.unit, quantities()[paths[0]].unit
    if not unit or unit == own:
        return _Driven(column.name, paths, "", column)
    try:
        factor(unit, own)
        note_turns(f"1 {unit} in {column.heading}", "1", unit, own)
    except UnitError as error:
        raise InputError(key, column.heading, error.reason, error.remedy) from None
    return _Driven(column.name, paths, unit, column)
