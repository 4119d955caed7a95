"""Designs to simulate: an array with a name and scene entries for each column."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.scene.paths import described, quantities
from hpcclear.scene.study import Study
from hpcclear.scene.tables import SceneTables


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
        values = np.array(self.values, dtype=np.float64)
        if (
            values.ndim != 2
            or values.shape[1] != len(self.names)
            or len(self.paths) != len(self.names)
        ):
            raise InputError(
                "points", values.shape, "one column per name is needed", "Give an (n, d) array"
            )
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each column, "" for none."""
        return tuple(quantities()[paths[0]].unit if paths else "" for paths in self.paths)

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


def snapped(
    study: Study, names: Sequence[str], coordinates: Array, *, model: bool = False
) -> Array:
    """The nearest designs that exist, in sampling coordinates, SI, (n, d), a column a name.

    With `model`, variables about whose designs something is random keep their numbers: a surrogate needs them between
    designs, too.
    """
    found = np.array(coordinates, dtype=np.float64)
    about = {row.name for row in study.random if not row.absolute} if model else set[str]()
    for column, name in enumerate(names):
        options = study.variable(name).options
        if options is not None and name not in about:
            found[:, column] = nearest_of(options, found[:, column])
    return found


def nearest_of(options: Sequence[float], values: Array) -> Array:
    """The nearest of some rising numbers, SI, (n,)."""
    table = np.asarray(options)
    middles = (table[1:] + table[:-1]) / 2.0
    return np.asarray(table[np.searchsorted(middles, values)])


def expanded(study: Study | None, points: Points) -> Points:
    """Designs with what rows of catalogues stand for in columns of their own, named by their paths."""
    if study is None:
        return points
    chosen = [
        (k, study.variable(name))
        for k, name in enumerate(points.names)
        if name in study.names and study.variable(name).rows
    ]
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
