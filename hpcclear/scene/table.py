"""A user's own table of designs."""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene.delimited import Column
from hpcclear.scene.fields import nearest
from hpcclear.scene.named import SHORT_NAMES
from hpcclear.scene.paths import quantities
from hpcclear.scene.points import Points
from hpcclear.scene.sampling import check_points
from hpcclear.scene.scene import Scene
from hpcclear.scene.sheets import Sheet, read

LABELS = (
    "design", "name", "label", "part", "id", "no", "no.", "nr", "nr.", "number", "index", "run", "#",
)  # fmt: skip
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
    names, paths = tuple(c.column.name for c in columns), tuple(c.paths for c in columns)
    driven = [path for column in paths for path in column]
    for path_ in driven:
        if driven.count(path_) > 1:
            raise InputError(
                key, ", ".join(names), f"two columns drive {path_}", "Remove one of them"
            )
    values = np.column_stack([column.read(sheet) for column in columns])
    named = tuple(" ".join(cells) for cells in zip(*(one.cells for one in labels), strict=True))
    points = Points(names, values, paths, named if labels else ())
    check_points(scene, points, lambda row: f"{key}, line {sheet.lines[row]}")
    return points


class _Driven(NamedTuple):
    """A column of numbers of the scene, and the entries that it drives."""

    paths: tuple[str, ...]
    column: Column

    def read(self, sheet: Sheet) -> Array:
        """Its cells in SI, shape (n,), within the bounds of every entry it drives."""
        every = [quantities()[path] for path in self.paths]
        values = sheet.si(self.column, every[0].unit, sheet.path)
        for quantity in every:
            for row in np.flatnonzero(~np.asarray(quantity.holds(values)))[:1]:
                raise InputError(
                    sheet.place(self.column, row), self.column.cells[row], f"must be {quantity.bounds()}",
                    "Correct the value or the unit of its column",
                )  # fmt: skip
        return values


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
    return _Driven(paths, column)
