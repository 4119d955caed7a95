"""Surrogates as they stand in a dataset of kind ``kriging``, a row for each subinterval's model."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate import kriging, regression
from hpcclear.statistics.surrogate.kernels import SQUARED_EXPONENTIAL
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.leaf import Leaf
from hpcclear.statistics.surrogate.piecewise import Piecewise


def rows_of(leaves: Sequence[Leaf], parameters: Sequence[str]) -> dict[str, np.ndarray]:
    """Variables of a dataset for models of one kind, in inputs of these names.

    Returns
    -------
    dict of arrays
        The first dimension is the model; behind it the training point, the parameter, or none.
    """
    points = max(len(leaf.values) for leaf in leaves)
    shapes = {"point": (len(leaves), points), "parameter": (len(leaves), len(parameters))}
    columns = leaves[0].columns

    def filled(dim: str) -> dict[str, np.ndarray]:
        return {
            name: np.full(shapes[dim], np.nan) for name, (of, _) in columns.items() if of == dim
        }

    data = {"training_output": np.full(shapes["point"], np.nan)} | filled("point")
    data |= {name: np.full(shapes["point"], np.nan) for name in parameters} | filled("parameter")
    data["used"] = np.zeros(shapes["parameter"], np.int8)
    for name in parameters:
        data |= {f"{name}_{end}": np.full(len(leaves), np.nan) for end in ("lower", "upper")}
    for row, leaf in enumerate(leaves):
        size, places = len(leaf.values), [parameters.index(name) for name in leaf.names]
        data["training_output"][row, :size] = leaf.values
        data["used"][row, places] = 1
        for name, (dim, attribute) in columns.items():
            if dim:
                data[name][row, slice(size) if dim == "point" else places] = getattr(
                    leaf, attribute
                )
        for column, name in enumerate(leaf.names):
            data[name][row, :size] = leaf.inputs[:, column]
            data[f"{name}_lower"][row] = leaf.lower[column]
            data[f"{name}_upper"][row] = leaf.upper[column]
    for name, (dim, attribute) in columns.items():
        if not dim:
            data[name] = np.array([getattr(leaf, attribute) for leaf in leaves])
    data["points"] = np.array([len(leaf.values) for leaf in leaves])
    return data


def models_in(content: xr.Dataset) -> dict[str, Piecewise]:
    """The models by their inputs ("m2 m3 u2 I2_ratio C").

    Kriging models are ready to predict; others have their training points, and what stands in the file of their predictions.

    Raises
    ------
    InputError
        The rows are no models, or do not fit together.
    """
    found: dict[str, list[int]] = {}
    for row, family in enumerate(content["family"].to_numpy()):
        found.setdefault(str(family), []).append(row)
    return {family: _family(content, family, rows) for family, rows in found.items()}


def _family(content: xr.Dataset, family: str, rows: Sequence[int]) -> Piecewise:
    names = family.split(" ")
    part = content.isel(model=list(rows))
    return Piecewise(
        tuple(_leaf(content.isel(model=row), family, names) for row in rows),
        part["r2"].to_numpy(),
        part["rmae"].to_numpy(),
        part["accepted"].to_numpy().astype(bool),
    )


def _leaf(one: xr.Dataset, family: str, names: Sequence[str]) -> Leaf:
    foreign = "surrogate" in one
    columns = regression.COLUMNS if foreign else {**kriging.COLUMNS, "kernel": ("", "kernel")}
    size, held = int(one["points"]), {"kernel"} | set(map(str, one.variables))
    if not set(names) <= set(one["parameter"].to_numpy().tolist()) or set(columns) - held:
        raise InputError("file", family, "the models do not fit together", "Use it as written")
    arrays = {
        "names": np.array(names),
        "lower": np.array([float(one[f"{name}_lower"]) for name in names]),
        "upper": np.array([float(one[f"{name}_upper"]) for name in names]),
        "inputs": np.column_stack([one[name].to_numpy()[:size] for name in names]),
        "values": one["training_output"].to_numpy()[:size],
        "kernel": np.array(SQUARED_EXPONENTIAL),  # unless the file has another
    }
    for name, (dim, attribute) in columns.items():
        if name in one:
            column = one[name].sel(parameter=names) if dim == "parameter" else one[name]
            arrays[attribute] = column.to_numpy()[:size] if dim == "point" else column.to_numpy()
    return regression.restored(arrays) if foreign else Kriging.from_arrays(arrays)
