"""A user's own table of designs, as CSV."""

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.scene.fields import nearest
from hpcclear.scene.paths import quantities
from hpcclear.scene.points import Points, check_points
from hpcclear.scene.scene import Scene
from hpcclear.scene.units import UnitError, decimal, factor, note_turns, noting, to_si
from hpcclear.scene.variables import SHORT_NAMES

LONGEST_LINE = 100_000
"""Characters of a line of a table; a design has some ten numbers."""


def read_points(path: str | Path, scene: Scene) -> Points:
    """A user's table of designs, a CSV file.

    The first row names the columns: study variables, short names (m2, C, ...), or dotted
    scene paths, each with an optional unit, as in ``C [mm]``. Every further row is a design; lines
    that are empty or begin with # are left out.

    Parameters
    ----------
    path : path
        The file, in UTF-8.
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
    key = str(path)
    lines = csv_lines(Path(path))
    columns = [_column(cell, scene, key) for cell in lines[0][1]]
    names, paths = tuple(c.name for c in columns), tuple(c.paths for c in columns)
    driven = [path for column in paths for path in column]
    for path_ in driven:
        if driven.count(path_) > 1:
            raise InputError(
                key, ", ".join(names), f"two columns drive {path_}", "Remove one of them"
            )
    values = np.empty((len(lines) - 1, len(columns)))
    for row, (line, cells) in enumerate(lines[1:]):
        if len(cells) != len(columns):
            reason = f"has {len(cells)} cells instead of {len(columns)}"
            raise InputError(
                f"{key}, line {line}", ",".join(cells), reason, "Give each column a value"
            )
        for column, cell in enumerate(cells):
            where = f"{key}, line {line}, column {names[column]}"
            values[row, column] = columns[column].read(cell, where)
    points = Points(names, values, paths)
    check_points(scene, points, lambda row: f"{key}, line {lines[row + 1][0]}")
    return points


def csv_lines(path: Path, what: str = "table of points") -> list[tuple[int, list[str]]]:
    """Line numbers and cells of the header and of the rows below it; an InputError says `what` the file is."""
    remedy = "Give a CSV file in UTF-8"
    try:
        if not path.is_file():
            raise InputError(what, str(path), "there is no such regular file", remedy)
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(_short_lines(stream, path), strict=True)
            lines = [
                (reader.line_num, [cell.strip() for cell in cells])
                for cells in reader
                if any(cells) and not cells[0].lstrip().startswith("#")
            ]
    except InputError:
        raise
    except (OSError, ValueError, csv.Error) as error:
        reason = f"cannot be read ({getattr(error, 'strerror', None) or error})"
        raise InputError(what, str(path), reason, remedy) from None
    lines = [(line, cells) for line, cells in lines if any(cells)]  # not of blanks alone
    if len(lines) < 2:
        remedy = "Write a row of names, then a row for each point or value"
        raise InputError(what, str(path), "contains no points", remedy)
    return lines


def _short_lines(stream: TextIO, path: Path) -> Iterator[str]:
    """The lines of a file, each too short to fill the memory."""
    while line := stream.readline(LONGEST_LINE + 1):
        if len(line) > LONGEST_LINE:
            reason = f"a line has more than {LONGEST_LINE} characters"
            raise InputError("table of points", str(path), reason, "Write one line per point")
        yield line


@dataclass(frozen=True)
class _Column:
    name: str
    paths: tuple[str, ...]
    unit: str  # as written, "" for SI

    def read(self, cell: str, where: str) -> float:
        """The cell in SI, within the bounds of every entry it drives."""
        quantity = quantities()[self.paths[0]]
        try:
            value = decimal(cell)
            if self.unit:
                with noting(lambda *_: None):  # noted once, of the heading
                    value = to_si(f"{cell} {self.unit}", quantity.unit)
        except UnitError as error:
            raise InputError(where, cell, error.reason, error.remedy) from None
        for path in self.paths:
            if not quantities()[path].holds(value):
                reason = f"must be {quantities()[path].bounds()}"
                raise InputError(where, cell, reason, "Correct the value or the unit of its column")
        return value


def _column(cell: str, scene: Scene, key: str) -> _Column:
    """A header cell such as ``C [mm]``."""
    found = re.fullmatch(r"([^\s\[\]]{1,200})\s*(?:\[\s*([^\[\]]{0,40}?)\s*\])?", cell)
    if found is None:
        raise InputError(
            key, cell, "is not a column name", 'Write a name, and its unit as in "C [mm]"'
        )
    name, unit = found.group(1), found.group(2) or ""
    numbers = scene.numeric_paths()
    of_study = {} if scene.study is None else {v.name: v.paths for v in scene.study.variables}
    named = {**SHORT_NAMES, **of_study}
    paths = tuple(path for path in named.get(name, (name,)) if path in numbers)
    if not paths:
        remedy = nearest(name, (*named, *numbers))
        raise InputError(key, name, "is neither a variable nor a number of this scene", remedy)
    column = _Column(name, paths, unit)
    column_unit = quantities()[paths[0]].unit
    if unit and unit != column_unit:
        try:
            factor(unit, column_unit)
            note_turns(f"1 {unit} in {cell}", "1", unit, column_unit)
        except UnitError as error:
            raise InputError(key, cell, error.reason, error.remedy) from None
        return column
    return _Column(name, paths, "")
