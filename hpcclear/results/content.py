"""What a result file holds, as plain arrays with names, dimensions and attributes.

A dataset of xarray holds the same and can do far more with it. A command that writes one file, or looks whether a file is its
own, does without: xarray and pandas take a quarter of a second to load.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import xarray as xr


class Variable:
    """An array with names of its dimensions and with attributes; ValueError where these do not match.

    Attributes
    ----------
    dims : tuple of str
    values : ndarray
    attrs : dict
    """

    def __init__(
        self, dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, object] | None = None
    ) -> None:
        if len(dims) != values.ndim:
            raise ValueError(f"an array of shape {values.shape} has not the dimensions {dims}")
        self.dims, self.values, self.attrs = dims, values, dict[str, Any](attrs or {})

    def to_numpy(self) -> np.ndarray:
        """Return the values, of the shape of the dimensions."""
        return self.values

    def __array__(
        self, dtype: np.typing.DTypeLike | None = None, copy: bool | None = None
    ) -> np.ndarray:
        return np.array(self.values, dtype, copy=copy)

    def __float__(self) -> float:
        return float(self.values)

    def __int__(self) -> int:
        return int(self.values)


class Content:
    """Variables by their names, and global attributes. A variable that is called as its dimension is a coordinate.

    Raises ValueError where two variables do not agree on the size of a dimension.

    Attributes
    ----------
    variables : dict of str to Variable
    attrs : dict
    sizes : dict of str to int
        Of the dimensions, in the order in which the variables have them.
    """

    def __init__(
        self,
        variables: Mapping[str, Variable],
        attrs: Mapping[str, object] | None = None,
        sizes: Mapping[str, int] | None = None,
    ) -> None:
        self.variables, self.attrs = dict(variables), dict[str, Any](attrs or {})
        self.sizes = dict(sizes or {})
        for name, one in variables.items():
            for dim, size in zip(one.dims, one.values.shape, strict=True):
                if self.sizes.setdefault(dim, size) != size:
                    raise ValueError(f"{name!r} has {size} of {dim}, others {self.sizes[dim]}")
        for name in self.sizes.keys() & self.variables.keys():
            if self.variables[name].dims != (name,):
                raise ValueError(f"{name!r} names a dimension and a data variable")

    @classmethod
    def of(cls, dataset: Results) -> Content:
        """Return what a file keeps of a dataset: its coordinates are those of dimensions."""
        if isinstance(dataset, Content):
            return dataset
        kept = {
            str(name): Variable(tuple(map(str, one.dims)), one.to_numpy(), one.attrs)
            for name, one in dataset.variables.items()
            if name in dataset.sizes or name not in dataset.coords
        }
        return cls(kept, dataset.attrs, {str(dim): n for dim, n in dataset.sizes.items()})

    def to_xarray(self) -> xr.Dataset:
        """Return the same as a dataset of xarray, which shares the arrays."""
        import xarray as xr

        made = {name: xr.Variable(v.dims, v.values, v.attrs) for name, v in self.variables.items()}
        return xr.Dataset(made, attrs=self.attrs)

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]


Results: TypeAlias = "xr.Dataset | Content"
"""What is read by names alone, be it of xarray or not."""
