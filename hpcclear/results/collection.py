"""Many files of samples that open as one: a file that refers to each of them.

Its variables are virtual datasets of HDF5: xarray, netCDF4 and h5py read them as if all samples were in it. Names are relative,
so that the directory may be moved. Opening thousands of files one by one takes minutes. Of more files than `LISTED` there is
none, and none is needed to find a sample: all files but the last are equally long.
"""

from collections.abc import Sequence
from pathlib import Path

import h5py

from hpcclear.base.errors import InputError
from hpcclear.results import netcdf
from hpcclear.results.content import Results, Variable

NAME = "samples.nc"
"""What it is called, in the directory of the others."""

LISTED = 4096
"""The most files it shows. A millisecond and 20 kB of memory each to write, as much time to open."""


def check_place(folder: Path) -> None:
    """Refuse a directory in which `NAME` is something else, such as samples of another run; raises InputError."""
    path = folder / NAME
    if not path.exists():
        return
    try:
        with h5py.File(path, "r") as file:
            ours = bool(file["sample"].is_virtual)
    except (OSError, KeyError, AttributeError):
        ours = False
    if not ours:
        reason = f"there is another {NAME} in it, which would be lost"
        raise InputError("--raw", str(folder), reason, "Choose a directory of its own")


def write(folder: Path, names: Sequence[str]) -> None:
    """Write `NAME` beside files of kind ``samples``, which stand in the order of `names`.

    Variables that only some of the files have are missing (NaN) in the others.

    Raises
    ------
    InputError
        One of the files is missing or damaged.
    StorageError
        The disk refuses.
    """
    pieces: dict[str, list[tuple[int, str, tuple[int, ...]]]] = {}
    known: dict[str, Variable] = {}
    ends: dict[str, tuple[int, ...]] = {}  # shapes beyond the samples
    attributes: dict[str, object] = {}
    total = 0
    for name in names:
        keys, samples = _variables(folder / name)
        if not keys <= set(known):
            content = netcdf.load(folder / name)
            of_samples = {k: v for k, v in content.variables.items() if v.dims[:1] == ("sample",)}
            known |= content.variables
            known |= {k: Variable(v.dims, v.values[:1], v.attrs) for k, v in of_samples.items()}
            ends |= {k: v.values.shape[1:] for k, v in of_samples.items()}
            attributes = content.attrs
        for key in keys & set(ends):
            pieces.setdefault(key, []).append((total, name, (samples, *ends[key])))
        total += samples
    elsewhere = {key: netcdf.Elsewhere((total, *ends[key]), rows) for key, rows in pieces.items()}
    netcdf.save(Results(known, attributes), folder / NAME, elsewhere)


def _variables(path: Path) -> tuple[set[str], int]:
    """Names in a file, and how many samples it has; raises InputError if it cannot be read."""
    try:
        with h5py.File(path, "r") as file:
            return set(file), file["sample"].shape[0]
    except (OSError, KeyError, ValueError) as error:
        remedy = "Run the command again with --fresh"
        raise InputError("file", str(path), f"it cannot be read ({error})", remedy) from None
