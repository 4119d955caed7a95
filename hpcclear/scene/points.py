"""Designs to simulate: arrays with a name and scene entries for each column; drawn or read from a table, and checked."""

import itertools
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.errors import InputError
from hpcclear.base.quantiles import Empirical
from hpcclear.base.remarks import remark
from hpcclear.scene.domain import box, to_physical
from hpcclear.scene.fields import nearest
from hpcclear.scene.named import SHORT_NAMES
from hpcclear.scene.paths import described, quantities
from hpcclear.scene.scene import Scene
from hpcclear.scene.slider_crank import SliderCrank
from hpcclear.scene.streams import generator, unit_lhs
from hpcclear.scene.study import Study
from hpcclear.scene.tables import SceneTables

if TYPE_CHECKING:
    from hpcclear.scene.delimited import SheetColumn
    from hpcclear.scene.sheets import Sheet


@dataclass(frozen=True)
class Points:
    """Designs to simulate, in SI."""

    names: tuple[str, ...]
    """Column names, length d."""
    values: Array
    """Shape (n, d): read-only, in the SI unit of each column."""
    paths: tuple[tuple[str, ...], ...]
    """Scene entries that each column drives."""
    labels: tuple[str, ...] = ()
    """Names of the rows, length n, where they have some."""
    sampling: str = ""
    """How a study drew them (`Study.method`); empty for designs that somebody chose, which are no random sample."""

    def __post_init__(self) -> None:
        values, count = np.array(self.values, dtype=np.float64), len(self.names)
        if values.ndim != 2 or values.shape[1] != count or len(self.paths) != count:
            reason = "one column per name is needed"
            raise InputError("points", values.shape, reason, "Give an (n, d) array")
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each column, "" for none, by its name."""
        named = zip(self.names, self.paths, strict=True)
        return {name: quantities()[paths[0]].unit if paths else "" for name, paths in named}

    @property
    def words(self) -> dict[str, str]:
        """What each column is, by its name: a file's long names."""
        named = zip(self.names, self.paths, strict=True)
        return {name: described(paths) for name, paths in named if paths}

    def column(self, name: str) -> Array:
        """Values of one column, shape (n,)."""
        return self.values[:, self.names.index(name)]

    def take(self, rows: slice | ArrayLike) -> "Points":
        """Some of the points: a slice, indices or a mask."""
        chosen = rows if isinstance(rows, slice) else np.asarray(rows)
        labels = tuple(np.array(self.labels, object)[chosen]) if self.labels else ()
        return Points(self.names, self.values[chosen], self.paths, labels, self.sampling)


class Numbers:
    """The scene's numbers, a column of the points where one drives the entry: ``numbers("drive.speed")``."""

    def __init__(self, scene: SceneTables, points: Points | None) -> None:
        self.scene = scene
        self.points = points
        self.size = 1 if points is None else len(points)
        self._columns = {}
        if points is not None:
            for k, paths in enumerate(points.paths):
                self._columns.update(dict.fromkeys(paths, points.values[:, k]))

    def __call__(self, path: str) -> Array:
        """Values of an entry, shape (size,), SI."""
        column = self._columns.get(path)
        return np.full(self.size, self.scene.number(path)) if column is None else column

    def known(self, path: str) -> Array:
        """The same, 0 of an entry that the scene has not."""
        there = path in self._columns or path in self.scene.numeric_paths()
        return self(path) if there else np.zeros(self.size)


def snapped(study: Study, names: Sequence[str], coordinates: Array, model: bool = False) -> Array:
    """The nearest designs that exist, in sampling coordinates, SI, (n, d), a column a name.

    With `model`, variables about whose designs something is random keep their numbers: a surrogate needs them between
    designs, too.
    """
    found = np.array(coordinates, dtype=np.float64)
    about = {row.name for row in study.random if not row.absolute} if model else set[str]()
    for column, name in enumerate(names):
        options = study.variable(name).options
        if options is not None and name not in about:
            table = np.asarray(options)
            places = np.searchsorted((table[1:] + table[:-1]) / 2.0, found[:, column])
            found[:, column] = table[places]
    return found


def expanded(study: Study | None, points: Points) -> Points:
    """Designs with what rows of catalogues stand for in columns of their own, named by their paths."""
    if study is None:
        return points
    by_rows = {one.name: one for one in study.variables if one.rows}
    chosen = [(k, by_rows[name]) for k, name in enumerate(points.names) if name in by_rows]
    if not chosen:
        return points
    names, paths, columns = list(points.names), list(points.paths), list(points.values.T)
    driven = {path for own in points.paths for path in own}
    for k, variable in chosen:
        numbers = points.values[:, k].astype(int)
        for path in variable.entry_paths:
            if path in driven:  # a random clearance of the fit
                continue
            table = np.array([row.entries[path] for row in variable.rows], dtype=float)
            names.append(path)
            paths.append((path,))
            columns.append(table[numbers])
    values = np.column_stack(columns) if len(points) else np.empty((0, len(names)))
    return Points(tuple(names), values, tuple(paths), points.labels, points.sampling)


Label = Callable[[int], str]
"""What a row of points is called in errors."""


def check_points(scene: Scene, points: Points, label: Label = "sample {}".format) -> None:
    """Refuse points that make no mechanism; errors name the row, by `label`, and the column.

    Raises InputError if a value is not finite, out of the bounds of its entry, a clearance reaches its bearing's radius,
    friction at rest is less than sliding, or a rod is not longer than its crank.
    """
    points = expanded(scene.study, points)

    def refuse(bad: Booleans, values: Array, unit: str, name: str, reason: str) -> None:
        if bad.any():
            row = int(np.argmax(bad))
            value = scene.in_unit(values[row], unit) if unit else float(values[row])
            remedy = "Narrow its range, or correct that row"
            raise InputError(f"{label(row)}, {name}", value, reason, remedy)

    for name, column, paths in zip(points.names, points.values.T, points.paths, strict=True):
        refuse(~np.isfinite(column), column, "", name, "must be finite")
        for path in paths:
            entry = quantities()[path]
            reason = f"must be finite and {entry.bounds() or 'within the physical range'}"
            refuse(~entry.holds(column), column, entry.unit, name, reason)
            if path.endswith("initial_speed"):
                usual = path.replace("initial_speed", "expected_speed")
                reason = f"starts from rest, and {usual} is not given"
                if usual not in scene.numeric_paths():
                    refuse(column == 0.0, column, entry.unit, name, reason)
    pairs, get = [], Numbers(scene, points)
    if isinstance(scene.mechanism, SliderCrank):
        reason = "the rod no longer than the crank"
        pairs.append(("mechanism.crank.length", "mechanism.rod.length", 1.0, reason))
    for joint in scene.clearance_joints():
        for small, large, times, reason in scene.clearance_joint(joint).ordered:
            key = scene.joint_key(joint)
            pairs.append((f"{key}.{small}", f"{key}.{large}", times, reason))
    for small, large, times, reason in pairs:
        word = "" if times == 1.0 else f"{times:g} "
        gap = get(large) - times * get(small)
        refuse(gap <= 0, gap, "m", f"{large} - {word}{small}", f"makes {reason}")
    _check_laws(get, points, label)


def _check_laws(get: Numbers, points: Points, label: Label) -> None:
    """Refuse values that a law does not take together."""
    driven = {path for paths in points.paths for path in paths}
    for kind in ("contact", "friction"):
        table = getattr(get.scene.effects, kind)
        if table is None or table.declared.check is None:
            continue
        paths = {name: f"effects.{kind}.{name}" for name in table.values()}
        columns = {name: get(path) for name, path in paths.items() if path in driven}
        for row in range(len(points)) if columns else ():
            own = {name: float(column[row]) for name, column in columns.items()}
            wrong = table.declared.check({**table.values(), **own})
            if wrong is not None:
                reason, remedy, name = wrong
                value = own.get(name, table.value(name))
                raise InputError(f"{label(row)}, {name}", value, reason, remedy)


def latin_hypercube(
    scene: Scene, samples: int | None = None, *, names: Sequence[str] | None = None, purpose: str = "train"
) -> Points:  # fmt: skip
    """The study's Latin hypercube over its variables, SI; a variable given as a ratio comes as the inertia it stands for.

    `names`: the variables that vary, in the order of the columns (all by default); the others stay as in the scene. Designs for
    different purposes are independent; the same purpose gives the same points. Raises InputError if the scene has no study, a
    name is unknown, or a point makes no mechanism.
    """
    study = scene.required_study
    count = count_of(study, samples)
    region = box(scene, names)
    unit = unit_lhs(count, len(region.names), generator(study.seed, f"lhs {purpose}"))
    coordinates = region.at(unit)
    for column, name in enumerate(region.names):
        if (options := study.variable(name).options) is not None:
            coordinates[:, column] = Empirical(options)(unit[:, column])
    points = points_at(scene, region.names, coordinates)
    check_points(scene, points)
    return points


def points_at(scene: Scene, names: tuple[str, ...], coordinates: Array) -> Points:
    """Designs at sampling coordinates (n, d) of variables of the scene's study; they may make no mechanism."""
    paths = tuple(scene.required_study.variable(name).paths for name in names)
    return Points(names, to_physical(scene, names, coordinates), paths)


def count_of(study: Study, samples: int | None, first: int = 0) -> int:
    """How many samples to draw, by default those of the study; raises InputError if there are none, or `first` is negative."""
    count = study.samples if samples is None else samples
    if count < 1 or first < 0:
        reason = "at least one sample, from index 0 on, is needed"
        raise InputError("samples", count, reason, "Request 1 or more")
    return count


LABELS = ("design", "name", "label", "part", "id", "no", "no.", "nr", "nr.", "number", "index", "run", "#")  # fmt: skip
"""Headings, in small letters, of columns that name the rows."""


def read_points(path: str | Path, scene: Scene, results: Collection[str] = ()) -> Points:
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
    results : collection of str
        Columns to leave out: those of results, in a table that `export` wrote.

    Returns
    -------
    Points
        In SI.

    Raises InputError if the file cannot be read, or a cell is no number; it names row (line of the file) and column.
    """
    from hpcclear.scene.sheets import read  # with the readers of all kinds of files

    key, sheet = str(path), read(Path(path))
    made = {one for one in sheet.columns if one.name.split(" ")[0] in {*results} - {*LABELS}}
    if made:
        remark(f"Note: the results in {path} are left out")
    driven = [(one, _driven(one, scene, key, sheet)) for one in sheet.columns if one not in made]
    labels = [column for column, paths in driven if not paths]
    columns = [column for column, paths in driven if paths]
    if not columns:
        reason = "no column has numbers of this scene"
        raise InputError(key, ", ".join(sheet.names), reason, "Name one such as m2 [g]")
    names, paths = tuple(c.name for c in columns), tuple(paths for _, paths in driven if paths)
    check_apart(key, "columns", names, paths)
    values = np.column_stack(list(map(_read, itertools.repeat(sheet), columns, paths)))
    named = tuple(" ".join(cells) for cells in zip(*(one.cells for one in labels), strict=True))
    points = Points(names, values, paths, named if labels else ())
    check_points(scene, points, lambda row: f"{key}, line {sheet.lines[row]}")
    return points


def _read(sheet: "Sheet", column: "SheetColumn", paths: Sequence[str]) -> Array:
    """Cells of a column in SI, shape (n,), within the bounds of every entry that it drives."""
    every = [quantities()[path] for path in paths]
    values = sheet.si(column, every[0].unit, sheet.path)
    for quantity in every:
        for row in np.flatnonzero(~np.asarray(quantity.holds(values)))[:1]:
            reason = f"must be {quantity.bounds() or 'within the physical range'}"
            remedy = "Correct the value or the unit of its column"
            raise InputError(sheet.place(column, row), column.cells[row], reason, remedy)
    return values


def _driven(column: "SheetColumn", scene: Scene, key: str, sheet: "Sheet") -> tuple[str, ...]:
    """Entries that a column such as ``C [mm]`` drives, none if it names the rows."""
    paths = entries_of(scene, column.name)
    if not paths:
        if scene.study is not None and column.name in scene.study.names:
            reason = "is a choice of the study, by rows or of random inputs"
            raise InputError(key, column.name, reason, "Give the numbers of the scene that it sets")
        of_scene = any(column.name.startswith(f"{table}.") for table in Scene.model_fields)
        if column.name.lower() in LABELS or (sheet.is_text(column) and not of_scene):
            return ()
        if re.search(r"[\s\[\]]", column.name):
            remedy = 'Write a name, and its unit as in "C [mm]"'
            raise InputError(key, column.heading, "is not a column name", remedy)
        reason = "is neither a variable nor a number of this scene"
        names = (*SHORT_NAMES, *(() if scene.study is None else scene.study.names))
        known = [name for name in dict.fromkeys(names) if entries_of(scene, name)]
        remedy = nearest(column.name, (*known, *scene.numeric_paths()))
        raise InputError(key, column.name, reason, remedy)
    return paths


def check_apart(key: str, what: str, names: Sequence[str], paths: Iterable[Sequence[str]]) -> None:
    """Raise InputError at `key` where two of what has these names drive the same entry of a scene."""
    twice = [path for path, count in Counter(itertools.chain(*paths)).items() if count > 1]
    if twice:
        raise InputError(key, ", ".join(names), f"two {what} drive {twice[0]}", "Remove one")


def entries_of(scene: Scene, name: str) -> tuple[str, ...]:
    """Scene entries that a name drives: the study's, a short name's, or a path itself; none where the scene lacks them."""
    of_study = {} if scene.study is None else {v.name: v.paths for v in scene.study.variables}
    known = scene.numeric_paths()
    return tuple(path for path in {**SHORT_NAMES, **of_study}.get(name, (name,)) if path in known)
