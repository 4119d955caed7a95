"""Surrogates as they stand in a dataset of kind ``kriging``, a row for each subinterval's model."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate import kriging, regression
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.leaf import Columns
from hpcclear.statistics.surrogate.piecewise import Leaf, Piecewise
from hpcclear.statistics.surrogate.regression import Regression


def rows_of(
    leaves: Sequence[Leaf], parameters: Sequence[str], columns: Columns | None = None
) -> dict[str, np.ndarray]:
    """Variables of a dataset for models of one kind, in inputs of these names; `columns`: by default what a file holds.

    The first dimension is the model; behind it the training point, the parameter, or none.
    """
    points = max(len(leaf.values) for leaf in leaves)
    shapes = {"point": (len(leaves), points), "parameter": (len(leaves), len(parameters))}
    columns = leaves[0].columns if columns is None else columns

    def filled(dim: str) -> dict[str, np.ndarray]:
        return {n: np.full(shapes[dim], np.nan) for n, (of, _) in columns.items() if of == dim}

    data = {"training_output": np.full(shapes["point"], np.nan)} | filled("point")
    data |= {name: np.full(shapes["point"], np.nan) for name in parameters} | filled("parameter")
    data["used"] = np.zeros(shapes["parameter"], np.int8)
    for name in parameters:
        data |= {f"{name}_{end}": np.full(len(leaves), np.nan) for end in ("lower", "upper")}
    for row, leaf in enumerate(leaves):
        size, places = len(leaf.values), [parameters.index(name) for name in leaf.names]
        data["training_output"][row, :size] = leaf.values
        data["used"][row, places] = 1
        within = {"point": slice(size), "parameter": places}
        for name, (dim, attribute) in columns.items():
            if dim:
                data[name][row, within[dim]] = getattr(leaf, attribute)
        for column, name in enumerate(leaf.names):
            data[name][row, :size] = leaf.inputs[:, column]
            data[f"{name}_lower"][row] = leaf.lower[column]
            data[f"{name}_upper"][row] = leaf.upper[column]
    for name, (dim, attribute) in columns.items():
        if not dim:
            data[name] = np.array([getattr(leaf, attribute) for leaf in leaves])
    data["points"] = np.array([len(leaf.values) for leaf in leaves])
    return data


def arrays_of(model: Piecewise) -> dict[str, np.ndarray]:
    """All of a model, for `models_in` of a checkpoint: it predicts the same to the last bit."""
    leaves, names = model.leaves, model.names
    columns = regression.RESTORED if isinstance(leaves[0], Regression) else None
    family = np.full(len(leaves), " ".join(names))
    about = {"accepted": model.accepted, "family": family, "parameter": np.array(names)}
    return rows_of(leaves, list(names), columns) | about


def models_in(columns: Mapping[str, ArrayLike]) -> dict[str, Piecewise]:
    """The models of the variables of a file, by their inputs ("m2 m3 u2 I2_ratio C").

    Kriging models are ready to predict; others have their training points, and what stands in the file of their predictions.
    Raises InputError: the rows are no models, or do not fit together.
    """
    arrays = {name: np.asarray(one) for name, one in columns.items()}
    of = arrays["family"].astype(str)
    rows = {family: np.flatnonzero(of == family).tolist() for family in dict.fromkeys(of.tolist())}
    return {family: _family(arrays, family, own) for family, own in rows.items()}


def _family(arrays: Mapping[str, np.ndarray], family: str, rows: list[int]) -> Piecewise:
    known = arrays["parameter"].tolist()
    if not set(family.split(" ")) <= set(known):
        raise _unfit(family)
    own = ({name: one[row] for name, one in arrays.items() if len(one) > row} for row in rows)
    leaves = tuple(_leaf(one, family, known) for one in own)
    return Piecewise(leaves, arrays["accepted"][rows].astype(bool))


def _unfit(family: str) -> InputError:
    return InputError("file", family, "the models do not fit together", "Use it as written")


def _leaf(one: Mapping[str, np.ndarray], family: str, known: list[str]) -> Leaf:
    """The model of a row; `known`: names along the dimension of the parameters."""
    foreign, names = "surrogate" in one, tuple(family.split(" "))
    columns = regression.RESTORED if foreign else kriging.COLUMNS
    size, places = int(one["points"]), [known.index(name) for name in names]
    if set(regression.COLUMNS if foreign else columns) - {"kernel", *one}:
        raise _unfit(family)
    within: dict[str, slice | list[int]] = {"point": slice(size), "parameter": places}
    found: dict[str, Any] = {
        attribute: one[name][within[dim]] if dim else one[name].item()
        for name, (dim, attribute) in columns.items()
        if name in one
    }
    ends = [[float(one[f"{name}_{end}"]) for name in names] for end in ("lower", "upper")]
    lower, upper = np.array(ends)
    inputs = np.column_stack([one[name][:size] for name in names])
    values = one["training_output"][:size]
    if not foreign:
        return Kriging(names, lower, upper, inputs=inputs, values=values, **found)
    stored = {name: found.pop(name) for name in regression.PREDICTED if name in found}
    return Regression(names, lower, upper, inputs, values, **found, stored=stored)
