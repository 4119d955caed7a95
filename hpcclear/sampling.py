"""Points to simulate: Latin hypercubes, Monte Carlo samples, and a user's own table.

Every number follows from the study's seed, a purpose ("train", "test", ...) and, for Monte Carlo,
the index of the sample, so that nothing depends on how many points are drawn at a time, or by whom.
"""

import csv
import hashlib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hpcclear.errors import InputError
from hpcclear.scene import Scene
from hpcclear.scene.domain import box, entries, slender_inertias, study_of, to_physical
from hpcclear.scene.fields import nearest
from hpcclear.scene.paths import quantities
from hpcclear.scene.units import UnitError, decimal, factor, to_si
from hpcclear.scene.variables import PAPER_PATHS, TAIL, RandomInput

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Points:
    """Designs to simulate, in SI.

    Attributes
    ----------
    names : tuple of str
        Column names, length d.
    values : ndarray of float, shape (n, d)
        Read-only, in the SI unit of each column.
    paths : tuple of tuple of str
        Scene entries that each column drives.
    """

    names: tuple[str, ...]
    values: Array
    paths: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        if (
            values.ndim != 2
            or values.shape[1] != len(self.names)
            or len(self.paths) != len(self.names)
        ):
            raise InputError(
                "points", values.shape, "one column a name is needed", "Give an (n, d) array"
            )
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    def __len__(self) -> int:
        return len(self.values)

    @property
    def units(self) -> tuple[str, ...]:
        """SI unit of each column, "" for none."""
        return tuple(quantities()[paths[0]].unit for paths in self.paths)

    def column(self, name: str) -> Array:
        """Values of one column, shape (n,)."""
        return self.values[:, self.names.index(name)]

    def take(self, rows: slice | ArrayLike) -> "Points":
        """Some of the points: a slice, indices or a mask."""
        chosen = rows if isinstance(rows, slice) else np.asarray(rows)
        return Points(self.names, self.values[chosen], self.paths)


def unit_lhs(samples: int, dimensions: int, rng: np.random.Generator) -> Array:
    """A Latin hypercube in the unit cube: each of `samples` equal strata of each axis holds one
    point.

    Parameters
    ----------
    samples, dimensions : int
        Shape (n, d) of the result.
    rng : Generator
        Source of randomness; it is advanced.

    References
    ----------
    McKay, Beckman, Conover (1979), doi:10.1080/00401706.1979.10489755.
    """
    from scipy.stats import (
        qmc,
    )  # scipy.stats takes most of a second to import; a single response needs none of it

    return qmc.LatinHypercube(dimensions, rng=rng).random(samples)


def latin_hypercube(
    scene: Scene,
    samples: int | None = None,
    *,
    names: Sequence[str] | None = None,
    widen: Iterable[str] = (),
    purpose: str = "train",
) -> Points:
    """The study's Latin hypercube over its variables.

    Parameters
    ----------
    scene : Scene
        With a study.
    samples : int, optional
        Number of points, `study.samples` by default.
    names : sequence of str, optional
        The variables that vary, in the order of the columns, all by default; the others stay as in
        the scene.
    widen : iterable of str
        Random inputs by whose reach the box is widened.
    purpose : str
        Designs for different purposes are independent; the same purpose gives the same points.

    Returns
    -------
    Points
        In SI; a variable given as a ratio comes as the inertia it stands for.

    Raises
    ------
    InputError
        If the scene has no study, a name is unknown, or a point makes no mechanism.
    """
    study = study_of(scene)
    count = study.samples if samples is None else samples
    if count < 1:
        raise InputError("samples", count, "a design needs at least one point", "Ask for 1 or more")
    region = box(scene, names, widen)
    rng = np.random.default_rng(_seed(study.seed, f"lhs {purpose}"))
    unit = unit_lhs(count, len(region.names), rng)
    coordinates = region.lower + unit * (region.upper - region.lower)
    points = Points(
        region.names,
        to_physical(scene, region.names, coordinates),
        tuple(study.variable(name).paths for name in region.names),
    )
    check_points(scene, points)
    return points


def monte_carlo(
    scene: Scene,
    samples: int | None = None,
    *,
    random: Sequence[str] | None = None,
    design: Mapping[str, float] | None = None,
    purpose: str = "train",
    first: int = 0,
) -> Points:
    """Samples `first` to `first + samples` of the study's random inputs.

    Sample k is the same however many are drawn, and each input has a stream of its own, so that a
    further random input leaves the others as they were.

    Parameters
    ----------
    scene : Scene
        With a study.
    samples : int, optional
        Number of points, `study.samples` by default.
    random : sequence of str, optional
        Random inputs in use, all by default; a case's `random` to verify its designs.
    design : mapping of variable name to SI value, optional
        Where the design is: columns that are not random hold it, and inputs that follow the design
        scatter about it. Left out, variables without a distribution are uniform over their range,
        and inputs scatter about the scene.
    purpose, first
        Which stream, and where in it to begin.

    Returns
    -------
    Points
        In SI.

    Raises
    ------
    InputError
        If the scene has no study, a name is unknown, or a point makes no mechanism.
    """
    study = study_of(scene)
    count = study.samples if samples is None else samples
    if count < 1 or first < 0:
        reason = "at least one sample, from index 0 on, is needed"
        raise InputError("samples", count, reason, "Ask for 1 or more")
    inputs = {row.name: row for row in study.random}
    chosen = tuple(inputs) if random is None else tuple(random)
    for name, known in [
        *((n, tuple(inputs)) for n in chosen),
        *((n, study.names) for n in design or ()),
    ]:
        if name not in known:
            raise InputError("study", name, "is not one of its inputs", f"Use {', '.join(known)}")
    free = tuple(name for name in study.names if design is None or name in design)
    names = (*free, *(name for name in chosen if name not in free))
    paths = tuple(inputs[n].paths if n in chosen else study.variable(n).paths for n in names)
    values = np.empty((count, len(names)))
    for column, name in enumerate(names):
        uniform = _uniform(study.seed, f"monte-carlo {purpose}", name, first, count)
        if name in chosen:
            centre = design[name] if design and name in design else scene.number(paths[column][0])
            values[:, column] = _quantile(inputs[name], centre, uniform)
        elif design is not None:
            values[:, column] = design[name]
        else:
            lower, upper = study.variable(name).bounds
            values[:, column] = lower + uniform * (upper - lower)
    for column, name in enumerate(names):
        if name not in chosen and design is None and study.variable(name).ratio is not None:
            values[:, column] *= slender_inertias(scene, paths, values, paths[column][0])
    points = Points(names, values, paths)
    check_points(scene, points, lambda row: f"sample {first + row}")
    return points


def _words(text: str) -> tuple[int, ...]:
    """A text as words of a spawn key."""
    return tuple(int(word) for word in np.frombuffer(hashlib.sha256(text.encode()).digest(), "<u4"))


def _seed(seed: int, *labels: str) -> np.random.SeedSequence:
    return np.random.SeedSequence(seed, spawn_key=sum((_words(label) for label in labels), ()))


def _uniform(seed: int, purpose: str, name: str, first: int, count: int) -> Array:
    """Numbers `first` to `first + count` of one stream, strictly between 0 and 1, shape
    (count,)."""
    # Philox is counter-based: it can start anywhere. One step of its counter gives four numbers.
    bits = np.random.Philox(_seed(seed, purpose, name))
    bits.advance(first // 4)
    numbers = np.random.Generator(bits).random(first % 4 + count)[first % 4 :]
    return (
        numbers + 2.0**-54
    )  # multiples of 2^-53 from 0 on, moved off 0, where quantiles are infinite


def _quantile(row: RandomInput, centre: float, uniform: Array) -> Array:
    """Values of a random input about `centre` (or its own) at the given probabilities."""
    middle = centre if row.centre is None else row.centre
    if row.distribution == "uniform":
        return middle + row.reach * (2 * uniform - 1)
    from scipy.special import (
        ndtr,
        ndtri,
    )  # a quarter of a second to import, which "lhs" does not need

    deviation = row.deviation
    assert deviation is not None  # by validation
    if row.distribution == "normal":
        return middle + deviation * np.clip(ndtri(uniform), -TAIL, TAIL)
    cut = row.reach / deviation
    below = ndtr(-cut)
    return middle + deviation * np.clip(ndtri(below + uniform * (1 - 2 * below)), -cut, cut)


def check_points(
    scene: Scene, points: Points, label: Callable[[int], str] = "sample {}".format
) -> None:
    """Refuse points that make no mechanism; errors name the row, by `label`, and the column.

    Raises
    ------
    InputError
        If a value is not finite, out of the bounds of its entry, a clearance reaches its bearing's
        radius, or a rod is not longer than its crank.
    """
    for name, column, paths in zip(points.names, points.values.T, points.paths, strict=True):
        for path in paths:
            bounds = quantities()[path].bounds()
            reason = f"must be finite and {bounds}" if bounds else "must be finite"
            _refuse(~quantities()[path].holds(column), column, name, reason, label)
    pairs = [("mechanism.crank.length", "mechanism.rod.length", "the rod no longer than the crank")]
    for joint in scene.clearance_joints():
        key, reason = f"joints.{joint}", "the clearance as large as the bearing"
        pairs.append((f"{key}.clearance", f"{key}.bearing_radius", reason))
    for small, large, reason in pairs:
        lower, upper = (
            entries(scene, points.paths, points.values, path) for path in (small, large)
        )
        gap = np.broadcast_to(np.asarray(upper - lower), len(points))
        _refuse(gap <= 0, gap, f"{large} - {small}", f"makes {reason}", label)


def _refuse(
    bad: NDArray[np.bool_], values: Array, name: str, reason: str, label: Callable[[int], str]
) -> None:
    if bad.any():
        row = int(np.argmax(bad))
        key = f"{label(row)}, {name}"
        raise InputError(key, float(values[row]), reason, "Narrow its range, or mend that row")


def read_points(path: str | Path, scene: Scene) -> Points:
    """A user's table of designs, a CSV file.

    The first row names the columns: study variables, the paper's names (m2, C, ...), or dotted
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
    lines = _csv_lines(Path(path))
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


def _csv_lines(path: Path) -> list[tuple[int, list[str]]]:
    """Line numbers and cells of the header and the points."""
    remedy = "Give a CSV file in UTF-8"
    try:
        if not path.is_file():
            raise InputError("table of points", str(path), "there is no such regular file", remedy)
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(stream, strict=True)
            lines = [(reader.line_num, [cell.strip() for cell in cells]) for cells in reader]
    except (OSError, UnicodeError, csv.Error) as error:
        reason = f"cannot be read ({error})"
        raise InputError("table of points", str(path), reason, remedy) from None
    lines = [(line, cells) for line, cells in lines if any(cells) and cells[0][:1] != "#"]
    if len(lines) < 2:
        remedy = "Write a row of names, then a row for each point"
        raise InputError("table of points", str(path), "holds no points", remedy)
    return lines


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
                value = to_si(f"{cell} {self.unit}", quantity.unit)
        except UnitError as error:
            raise InputError(where, cell, error.reason, error.remedy) from None
        for path in self.paths:
            if not quantities()[path].holds(value):
                reason = f"must be {quantities()[path].bounds()}"
                raise InputError(where, cell, reason, "Mend the value or the unit of its column")
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
    named = {**PAPER_PATHS, **of_study}
    paths = tuple(path for path in named.get(name, (name,)) if path in numbers)
    if not paths:
        remedy = nearest(name, (*named, *numbers))
        raise InputError(key, name, "is neither a variable nor a number of this scene", remedy)
    column = _Column(name, paths, unit)
    column_unit = quantities()[paths[0]].unit
    if unit and unit != column_unit:
        try:
            factor(unit, column_unit)
        except UnitError as error:
            raise InputError(key, cell, error.reason, error.remedy) from None
        return column
    return _Column(name, paths, "")
