"""What a result file holds, as plain arrays with names, dimensions and attributes.

Inside the package there is nothing else. A dataset of xarray holds the same and can do far more with it: users get one from
functions of Python (`Results.to_xarray`) or by opening a file, and give one to figures (`Results.of`). Commands do without,
because xarray and pandas take a quarter of a second to load.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

Place: TypeAlias = "int | np.integer | slice | list[int] | np.ndarray"
"""Where to look along a dimension: at one place, which takes the dimension away, or at several."""


class Variable:
    """An array with names of its dimensions and with attributes, ``units`` and ``long_name``; ValueError where these do not
    match.

    `name`: of a variable of `Results`, "" of another one; `labels`: coordinates of these results, by dimension.
    """

    def __init__(
        self, dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, object] | None = None, name: str = "",
        labels: Mapping[str, np.ndarray] | None = None,
    ) -> None:  # fmt: skip
        if len(dims) != values.ndim:
            raise ValueError(f"an array of shape {values.shape} has not the dimensions {dims}")
        self.dims, self.values, self.attrs = dims, values, dict[str, Any](attrs or {})
        self.name, self.labels = name, labels or {}

    def to_numpy(self) -> np.ndarray:
        """Return the values, of the shape of the dimensions."""
        return self.values

    def item(self) -> Any:
        """Return the only value as a number or text of Python; raises ValueError where there are several."""
        return self.values.item()

    def isel(self, places: Mapping[str, Place] | None = None, **more: Place) -> Variable:
        """Return what stands at places along dimensions."""
        dims, values, labels = list(self.dims), self.values, dict(self.labels)
        for dim, place in {**(places or {}), **more}.items():
            values = values[(*[slice(None)] * dims.index(dim), place)]
            if dim in labels:
                labels[dim] = labels[dim][place]
            if isinstance(place, int | np.integer):
                dims.remove(dim)
        return Variable(tuple(dims), np.asarray(values), self.attrs, self.name, labels)

    def sel(self, **labels: Any) -> Variable:
        """Return what stands at labels of coordinates, one or several of each; raises KeyError where there are none."""
        return self.isel({dim: place_of(self.labels[dim], one) for dim, one in labels.items()})

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the dimensions."""
        return self.values.shape

    def __getitem__(self, place: Place | tuple[Place, ...]) -> Any:
        return self.values[place]

    def __len__(self) -> int:
        return len(self.values)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.array(self.values, dtype, copy=copy)

    def __float__(self) -> float:
        return float(self.values)

    def __int__(self) -> int:
        return int(self.values)


def place_of(known: np.ndarray, wanted: Any) -> Place:
    """Return where labels stand in a coordinate (n,), one or several; raises KeyError where one does not."""
    found = [np.flatnonzero(known == one)[:1] for one in np.atleast_1d(wanted)]
    if not all(map(len, found)):
        raise KeyError(wanted)
    return np.concatenate([*found, np.zeros(0, int)]) if np.ndim(wanted) else int(found[0][0])


class Results:
    """Variables by their names, and global attributes. A variable that is called as its dimension is a coordinate.

    Its methods are called as those of a dataset of xarray and do the same. `sizes`: of the dimensions, in the order in which
    the variables have them; `labels`: coordinates, of a dimension that a selection took away the label that was chosen.
    Raises ValueError where two variables do not agree on the size of a dimension.
    """

    def __init__(
        self, variables: Mapping[str, Variable], attrs: Mapping[str, object] | None = None, chosen: Sequence[str] = ()
    ) -> None:  # fmt: skip
        self.attrs, self.sizes = dict[str, Any](attrs or {}), dict[str, int]()
        for name, one in variables.items():
            for dim, size in zip(one.dims, one.values.shape, strict=True):
                if self.sizes.setdefault(dim, size) != size:
                    raise ValueError(f"{name!r} has {size} of {dim}, others {self.sizes[dim]}")
        for name in self.sizes.keys() & variables.keys():
            if variables[name].dims != (name,):
                raise ValueError(f"{name!r} names a dimension and a data variable")
        coords = self.sizes.keys() | set(chosen)
        self.labels = {name: one.values for name, one in variables.items() if name in coords}
        self.variables = {
            name: Variable(one.dims, one.values, one.attrs, name, self.labels)
            for name, one in variables.items()
        }

    @classmethod
    def of(cls, dataset: Results | xr.Dataset) -> Results:
        """Return what a dataset of xarray, or these results, hold."""
        if isinstance(dataset, Results):
            return dataset
        found = {
            str(name): Variable(tuple(map(str, one.dims)), one.to_numpy(), one.attrs)
            for name, one in dataset.variables.items()
        }
        return cls(found, dataset.attrs, [str(n) for n in dataset.coords if not dataset[n].dims])

    def to_xarray(self) -> xr.Dataset:
        """Return the same as a dataset of xarray, which shares the arrays."""
        import xarray as xr

        made = {name: xr.Variable(v.dims, v.values, v.attrs) for name, v in self.variables.items()}
        return xr.Dataset(made, attrs=self.attrs).set_coords(list(self.labels))

    @property
    def data_vars(self) -> dict[str, Variable]:
        """Variables that are no coordinates."""
        return {name: one for name, one in self.variables.items() if name not in self.labels}

    def isel(self, places: Mapping[str, Place] | None = None, **more: Place) -> Results:
        """Return what stands at places along dimensions."""
        wanted = {**(places or {}), **more}
        found = {
            name: one.isel({dim: place for dim, place in wanted.items() if dim in one.dims})
            for name, one in self.variables.items()
        }
        return Results(found, self.attrs, tuple(self.labels))

    def sel(self, **labels: Any) -> Results:
        """Return what stands at labels of coordinates, one or several of each; raises KeyError where there are none."""
        return self.isel({dim: place_of(self.labels[dim], one) for dim, one in labels.items()})

    def assign_attrs(self, **attrs: object) -> Results:
        """Return these results with further global attributes."""
        return Results(self.variables, {**self.attrs, **attrs}, tuple(self.labels))

    def get(self, name: str, default: Any = None) -> Any:
        """Return a variable, or the default where this name is missing."""
        return self.variables.get(name, default)

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __getitem__(self, name: str) -> Variable:
        return self.variables[name]


def each(content: Results, dim: str) -> list[Results]:
    """Return what stands at each place along a dimension."""
    return [content.isel({dim: k}) for k in range(content.sizes[dim])]


def text_in(content: Results, name: str) -> str:
    """Return the only value of a variable as text; "" where this name is missing."""
    return str(content[name].item()) if name in content else ""


def number_in(content: Results, name: str) -> float:
    """Return the only value of a variable as a number; NaN where this name is missing."""
    return float(content[name]) if name in content else np.nan


def texts_in(content: Results, name: str) -> list[str]:
    """Return the values (n,) of a variable as texts, such as the labels of a dimension."""
    return [str(one) for one in content[name].values]
