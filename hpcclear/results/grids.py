"""Maps: files of kind ``samples`` whose samples are the cells of a grid."""

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError

SHAPE = "map_shape"
"""Attribute of a map: cells along its entries, in the order of the design variables."""


def grid(content: xr.Dataset) -> xr.Dataset:
    """A map's cells with its entries as coordinates, in place of sample numbers.

    Raises
    ------
    InputError
        If the dataset is no map.
    """
    if SHAPE not in content.attrs:
        raise InputError(
            "map", content.attrs.get("hpcclear_kind"), "is no map", "Make one with hpcclear map"
        )
    shape = tuple(int(n) for n in str(content.attrs[SHAPE]).split())
    names = [
        str(v.name) for v in content.data_vars.values() if v.attrs.get("role") == "design_variable"
    ]
    coords: dict[str, object] = {}
    for k, name in enumerate(names):
        values = np.moveaxis(content[name].to_numpy().reshape(shape), k, 0).reshape(shape[k], -1)
        coords[name] = (name, values[:, 0], content[name].attrs)
    coords["joint"] = content["joint"]
    data = {}
    for key, variable in content.drop_vars(names).data_vars.items():
        rest = variable.dims[1:]
        folded = variable.to_numpy().reshape(*shape, *variable.shape[1:])
        data[key] = ((*names, *rest), folded, variable.attrs)
    return xr.Dataset(data, coords, content.attrs)
