"""What a script or notebook calls beside `load_scene` and `simulate`: many designs at once, in this process."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import asked
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.steady.wording import recorded
from hpcclear.ensemble.session import samples_of
from hpcclear.results.content import Results
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.points import Points, check_apart, check_points, entries_of, expanded

if TYPE_CHECKING:
    import xarray as xr


def as_points(scene: Scene, points: Points | Mapping[str, ArrayLike]) -> Points:
    """Designs from a mapping of name or scene path to values, shape (n,) or a scalar, SI.

    Raises InputError if a name is unknown or a design makes no mechanism.
    """
    if isinstance(points, Points):
        return points
    given = dict(points)  # of tables of pandas the columns
    if not given:
        raise InputError("points", {}, "no entry is varied", "Give a name and its values")
    names = tuple(map(str, given))
    try:
        columns = [np.atleast_1d(_numbers(x)) for x in given.values()]
        values = np.column_stack(np.broadcast_arrays(*columns))
    except ValueError as error:
        remedy = "Give numbers in SI, one or as many as the others have, for each name"
        raise InputError("points", list(given), str(error).removesuffix("."), remedy) from None
    every = () if scene.study is None else scene.study.variables
    others = {one.name: range(len(one.rows)) for one in every if not one.paths}
    for name, column in zip(names, values.T, strict=True):
        if (rows := others.get(name)) and not np.isin(column, rows).all():
            raise InputError("points", name, "is no number of a row", f"Write 0 to {rows[-1]}")
    paths = tuple(() if name in others else paths_of(scene, name) for name in names)
    made = Points(names, values, paths)
    check_apart("points", "columns", names, made.paths)
    check_points(scene, made)
    return made


def _numbers(given: ArrayLike) -> np.ndarray:
    found: np.ma.MaskedArray = np.ma.asarray(given)
    if found.dtype.kind in "bc":  # numpy would take true for 1, and drop the imaginary part
        raise ValueError("truth values and complex numbers are no real numbers")
    return np.ma.filled(found.astype(float), np.nan)


def paths_of(scene: Scene, name: str) -> tuple[str, ...]:
    """Scene entries that a name drives: the study's, a short name's, or a path itself.

    Raises InputError if it is not one of these.
    """
    if not (found := entries_of(scene, name)):
        scene.number(name)  # refuses what is no number of this scene
    return found


def evaluate(scene: Scene, points: Points | Mapping[str, ArrayLike]) -> xr.Dataset:
    """Simulate many designs of a scene in this process.

    Parameters
    ----------
    scene : Scene
    points : Points or mapping of str to array
        Designs: short names (``m2``, ``C``), those of the study, or dotted scene paths; values in SI, shape (n,)
        or scalars.

    Returns
    -------
    xarray.Dataset
        Kind ``samples``: objective, its spread, forces, status of each design. Failed numbers are NaN.

    Raises
    ------
    InputError
        If a name is unknown, a design makes no mechanism, or the scene requests what the kernel cannot do.
    """
    return evaluated(scene, as_points(scene, points)).to_xarray()


def evaluated(scene: Scene, points: Points) -> Results:
    """Simulate points as `evaluate` does; the content of a file of samples."""
    sent = expanded(scene.study, points)
    records = asked(evaluate_records(scene, sent), scene.objective)
    about = scene.origin | program() | recorded(scene, records)
    return samples_of(scene, points, records, about)
