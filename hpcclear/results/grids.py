"""Maps: files of kind ``samples`` whose samples are the cells of a grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.results.content import Results, Variable

if TYPE_CHECKING:
    import xarray as xr

SHAPE = "map_shape"
"""Attribute of a map: cells along its entries, in the order of the design variables."""


def grid(content: xr.Dataset) -> xr.Dataset:
    """A map's cells with its entries as coordinates, in place of sample numbers.

    Raises InputError if the dataset is no map.
    """
    return cells_of(Results.of(content)).to_xarray()


def cells_of(content: Results) -> Results:
    """Return what `grid` does, of results; raises InputError as it does."""
    if SHAPE not in content.attrs:
        kind = content.attrs.get("hpcclear_kind")
        raise InputError("map", kind, "is no map", "Make one with hpcclear map")
    shape = tuple(int(n) for n in str(content.attrs[SHAPE]).split())
    names = [k for k, v in content.data_vars.items() if v.attrs.get("role") == "design_variable"]
    found = {}
    for name, one in content.data_vars.items():
        if name not in names:
            folded = one.values.reshape(*shape, *one.shape[1:])
            found[name] = Variable((*names, *one.dims[1:]), folded, one.attrs)
    for k, name in enumerate(names):
        values = np.moveaxis(content[name].values.reshape(shape), k, 0).reshape(shape[k], -1)
        found[name] = Variable((name,), values[:, 0], content[name].attrs)
    return Results({**found, "joint": content["joint"]}, content.attrs)
