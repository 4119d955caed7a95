"""What a user gives a figure: results, datasets of xarray, or plain arrays by their names."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.results.content import Results
from hpcclear.results.names import DESIGN_VARIABLES, KINDS


def taken(kind: str, given: Any) -> Any:
    """Return results for what is given to a figure's argument, which is called as the `kind` of its file. Raises InputError
    for arrays that are not those of a file of the kind."""
    if hasattr(given, "data_vars"):
        return Results.of(given)
    if not isinstance(given, Mapping) or kind not in (*KINDS, "responses"):
        return given
    if all(isinstance(one, Mapping | Results) for one in given.values()):
        return {str(name): taken(kind, one) for name, one in given.items()}
    return _of_arrays(kind, {str(name): np.asarray(one) for name, one in given.items()})


def _of_arrays(kind: str, arrays: Mapping[str, np.ndarray]) -> Results:
    """Results of arrays that are named as in a file of the kind; places along dimensions without a coordinate are numbered."""
    from hpcclear.results.dataset import dataset

    table = KINDS[kind]
    data = {name: one for name, one in arrays.items() if name not in table.coords}
    coords = {name: one for name, one in arrays.items() if name in table.coords}
    for name, one in data.items():
        dims = table.data[name].dims if name in table.data else table.design_dims or ()
        for dim, size in zip(dims, one.shape, strict=False):
            number = np.arange(1, size + 1)
            words = table.coords[dim].dtype == "text"
            coords.setdefault(dim, number.astype(str) if words else number)
    units = {name: "1" for name in data if name not in DESIGN_VARIABLES}
    try:
        return dataset(kind, coords, data, units=units, whole=False)
    except ValueError as error:
        reason = f"the arrays are not those of a {kind} ({error})"
        remedy = "Name them as variables of such a file, of the same shapes"
        raise InputError(kind, sorted(arrays), reason, remedy) from None


def several(response: Any) -> dict[str, Results]:
    """Return several responses by the names of their designs; none where there is only one."""
    if isinstance(response, Results) and "design" in response.sizes:
        names = response.labels.get("design", np.arange(1, response.sizes["design"] + 1))
        return {str(name): response.isel(design=k) for k, name in enumerate(names)}
    return response if isinstance(response, dict) else {}
