"""Kriging models as they stand in a dataset of kind ``kriging``."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.statistics.surrogate.kernels import SQUARED_EXPONENTIAL
from hpcclear.statistics.surrogate.kriging import Kriging
from hpcclear.statistics.surrogate.piecewise import PiecewiseKriging

SCALARS = {
    "signal_variance": "signal_variance",
    "noise_variance": "noise_variance",
    "output_mean": "mean",
    "output_scale": "scale",
    "dropped": "dropped",
}
"""Variables of the dataset and the attributes of `Kriging` they hold."""
KERNEL = "kernel"
"""The same of its kernel; left out where all models have the squared exponential."""


def models_in(content: xr.Dataset) -> dict[str, PiecewiseKriging]:
    """The models by their inputs ("m2 m3 u2 I2_ratio C"), ready to predict.

    Raises
    ------
    InputError
        The rows are no models, or do not fit together.
    """
    found: dict[str, list[int]] = {}
    for row, family in enumerate(content["family"].to_numpy()):
        found.setdefault(str(family), []).append(row)
    return {family: _family(content, family, rows) for family, rows in found.items()}


def _family(content: xr.Dataset, family: str, rows: Sequence[int]) -> PiecewiseKriging:
    names = family.split(" ")
    leaves = []
    for row in rows:
        one = content.isel(model=row)
        size = int(one["points"])
        if not set(names) <= set(one["parameter"].to_numpy().tolist()):
            raise InputError("file", family, "the models do not fit together", "Use it as written")
        arrays = {
            "names": np.array(names),
            "lower": np.array([float(one[f"{name}_lower"]) for name in names]),
            "upper": np.array([float(one[f"{name}_upper"]) for name in names]),
            "length_scales": one["length_scale"].sel(parameter=names).to_numpy(),
            "inputs": np.column_stack([one[name].to_numpy()[:size] for name in names]),
            "values": one["training_output"].to_numpy()[:size],
            "alpha": one["weight"].to_numpy()[:size],
            "kernel": one[KERNEL].to_numpy() if KERNEL in one else np.array(SQUARED_EXPONENTIAL),
        }
        arrays |= {field: one[name].to_numpy() for name, field in SCALARS.items()}
        leaves.append(Kriging.from_arrays(arrays))
    part = content.isel(model=list(rows))
    return PiecewiseKriging(
        tuple(leaves),
        part["r2"].to_numpy(),
        part["rmae"].to_numpy(),
        part["accepted"].to_numpy().astype(bool),
    )
