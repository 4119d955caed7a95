"""Result files as users open them, as datasets of xarray; read and written by the package, checks included."""

import os

import xarray as xr

from hpcclear.results import dataset
from hpcclear.results.content import Results


def read(path: str | os.PathLike[str], *more: str, **asked: str) -> xr.Dataset:
    """Read a file as `dataset.read` does."""
    return dataset.read(path, *more, **asked).to_xarray()


def write(content: xr.Dataset | Results, path: str | os.PathLike[str]) -> None:
    """Write a file as `dataset.write` does."""
    dataset.write(Results.of(content), path)
