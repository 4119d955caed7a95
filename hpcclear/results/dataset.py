"""Result files: built from plain arrays and records, written whole, and checked when they are read.

The names, dimensions and units come from `hpcclear.results.names`; `hpcclear.results.netcdf` reads the bytes, and
`hpcclear.results.files` puts them on the disk. A file is built in memory, so the same content gives the same bytes and a full
disk meets a plain ``write`` instead of the HDF5 library. Written with h5py: a checkpoint every few seconds must cost next to
nothing, and this takes a fifth of the time of the general writers. Readers see a plain NetCDF-4 file.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base import outcome
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.results import netcdf
from hpcclear.results.content import Results, Variable
from hpcclear.results.faults import fault_of
from hpcclear.results.files import write_bytes
from hpcclear.results.names import DESIGN_VARIABLES, KINDS, LIMIT, ROLE
from hpcclear.results.rows import FileVariable, ResultKind

CONVENTIONS = "CF-1.11"

_NO_VARIABLE = f"{netcdf.BARE.decode()} but not a netCDF variable. %9d"
# bytes; HDF5 keeps at most 64 kB in an object header, longer text goes to the heap
_ATTRIBUTE_LIMIT = 30_000

# -----------------------------------------------------------------------------------------------
# Building


NOT_CHECKED = "not checked: no replicas were simulated"
"""Value of the attribute ``objective_half_width`` of files whose objective has none."""


def dataset(
    kind: str, coords: Mapping[str, ArrayLike], data: Mapping[str, ArrayLike], attributes: Mapping[str, object] | None = None,
    units: Mapping[str, str] | None = None, objective: Objective = MEAN_GAP, words: Mapping[str, str] | None = None, *,
    whole: bool = True,
) -> Results:  # fmt: skip
    """The content of one kind of result file (a key of `KINDS`), with every attribute the table knows.

    `coords`: all coordinates of the kind; `data`: its variables, and design variables under their names or scene paths, for
    Kriging models also their bounds, NAME_lower and NAME_upper; shapes as in the table. `attributes`: further global ones,
    text or numbers (`hpcclear.results.provenance.program`, `Scene.origin`). `units`, `words`: of design variables, their
    units and what they drive; those of the paper's (`DESIGN_VARIABLES`) are known. `objective`: of the study, its unit is
    that of everything that the table says has it, and its words say what f is, in a global attribute ``objective`` too where
    it is not the mean gap. What is drawn on the way need not be `whole`: it may lack some that a file has to have.

    Raises ValueError: a name, shape or type that is not in the table, or a required variable missing. Raises InputError: a
    design variable whose name cannot be one.
    """
    table = KINDS[kind]
    least = set(table.coords) - {*table.optional} if whole else set()
    if not least <= set(coords) <= set(table.coords):
        raise ValueError(f"{kind} has coordinates {sorted(table.coords)}, not {sorted(coords)}")
    missing = table.required - set(data)
    if whole and missing:
        raise ValueError(f"{kind} lacks {sorted(missing)}")
    there = {name: row for name, row in table.coords.items() if name in coords}
    sizes = {name: np.shape(coords[name])[0] for name in there}
    variables = {name: _variable(name, row, coords[name], sizes) for name, row in there.items()}
    for name, values in data.items():
        if name in table.data:
            variables[name] = _variable(name, table.data[name].of(objective), values, sizes)
        else:
            row, marks = _design_row(name, data, units or {}, words or {}, table)
            variable = _variable(name, row, values, sizes)
            variable.attrs.update(marks)
            variables[variable_name(name, kind)] = variable
    fixed = {"Conventions": CONVENTIONS, "title": table.title, "hpcclear_kind": kind}
    if objective.words != MEAN_GAP.words:
        fixed["objective"] = objective.words
    if "objective_uncertainty" in table.data:
        fixed["objective_half_width"] = _half_width(data)
    return Results(variables, {**fixed, **(attributes or {})})


def _variable(
    name: str, row: FileVariable, values: ArrayLike, sizes: Mapping[str, int]
) -> Variable:
    listed = row.dtype == "text" and not isinstance(values, np.ndarray)
    array = np.array(values, str) if listed else np.asarray(values)
    expected = tuple(sizes[dim] for dim in row.dims)
    if array.shape != expected:
        raise ValueError(f"{name} has shape {array.shape}, not {expected} {row.dims}")
    allowed = {"f8": "fiu", "i8": "iub", "i1": "iub", "text": "U"}[row.dtype]
    if array.dtype.kind not in allowed:
        raise ValueError(f"{name} has type {array.dtype}, not {row.dtype}")
    if row.dtype != "text":
        exact = array.astype(row.dtype)
        if row.dtype != "f8" and not np.array_equal(exact, array):
            raise ValueError(f"{name} does not fit into {row.dtype}")
        array = exact
    attributes: dict[str, object] = {"long_name": row.long_name}
    if row.units:
        attributes["units"] = row.units
    if row.codes is not None:
        attributes |= row.codes.attributes
    return Variable(row.dims, array, attributes)


def _design_row(
    name: str, data: Mapping[str, ArrayLike], units: Mapping[str, str], words: Mapping[str, str], table: ResultKind,
) -> tuple[FileVariable, dict[str, str]]:  # fmt: skip
    """Row and further attributes of a design variable, or of a limit of one."""
    dims, base, start, role = table.design_dims, name, "", ROLE
    if table.limit_dims is not None and name.endswith(("_lower", "_upper")) and name[:-6] in data:
        dims, base, start, role = table.limit_dims, name[:-6], f"{name[-5:]} limit of the ", LIMIT
    unit, long_name, _ = DESIGN_VARIABLES.get(base, (None, f"design variable {base}", ""))
    unit = units.get(base, unit)
    if unit is None or dims is None:
        raise ValueError(f"{name!r} is not in the table and is no design variable with a unit")
    row = FileVariable(dims, unit or "1", start + words.get(base, long_name), "f8")
    return row, {"role": role, "scene_path": base}


def variable_name(name: str, kind: str = "samples") -> str:
    """A design variable's name in a file, underscores for dots. Raises InputError: it is no name, or a result is called so."""
    plain = name.replace(".", "_")
    reason = "a result has this name" if plain in KINDS[kind].table else ""
    if re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", plain) is None:
        reason = "a name consists of letters, digits and underscores, a letter first"
    if reason:
        raise InputError("study.variables", name, reason, "Choose another name")
    return plain


def samples_dataset(
    names: Sequence[str], values: ArrayLike, units: Mapping[str, str], records: np.ndarray,
    attributes: Mapping[str, object] | None = None, objective: Objective = MEAN_GAP, words: Mapping[str, str] | None = None,
    joints: Sequence[str] = outcome.JOINTS, labels: Sequence[str] = (),
) -> Results:  # fmt: skip
    """Outcome records (n,), in any order, and the designs they belong to (n, k), SI, as results of kind ``samples``, by
    growing sample number.

    `names`: design variables, by name or scene path, with the `units` and `words` of those that are not the paper's; `joints`:
    labels of the joints of the records; `labels`: names of the designs, where they have some; others as of `dataset`.
    Raises ValueError: shapes that do not match, a sample twice, a design that is not finite.
    """
    values = np.asarray(values, dtype=float)
    if values.shape != (len(records), len(names)):
        raise ValueError(f"designs have shape {values.shape}, not {(len(records), len(names))}")
    if not np.isfinite(values).all():
        raise ValueError("a design is not finite")
    order = np.argsort(records["sample"], kind="stable")
    if np.any(np.diff(order) < 0):
        records, values = records[order], values[order]
    if np.any(np.diff(records["sample"]) == 0):
        raise ValueError("a sample occurs twice")
    if len(set(map(variable_name, names))) != len(names):
        raise ValueError(f"two of the names {list(names)} are the same in a file")
    data = {name: values[:, i] for i, name in enumerate(names)}
    fields, further = records.dtype.names or (), {*outcome.ON_REQUEST, *outcome.JUDGED}
    optional = (further - {"regime"}) & {*fields}
    asked = {name for name in optional if np.isfinite(records[name]).any()}
    if records["regime"].any() or {*outcome.MAPPED} & {*fields}:  # no period is an answer as well
        asked |= {*outcome.JUDGED}
    left_out = {"sample", "band", *(further - asked)}
    kept = [name for name in fields if name not in left_out]
    bands = _bands_of(records)
    data |= {name: records[name] for name in kept}
    if len(labels):
        data["label"] = np.array(labels, dtype=str)[order]
    coords: dict[str, ArrayLike] = {"sample": records["sample"], "joint": joints}
    if "sliding_waves" in kept:
        coords["wave"] = np.arange(outcome.WAVE_ROWS)
    if len(bands):
        coords["band"] = bands
    return dataset("samples", coords, data, attributes, units, objective, words)


def _half_width(data: Mapping[str, ArrayLike]) -> str:
    """Where the half-width of the objective stands, or that there is none."""
    for name in ("objective_limit", "objective_uncertainty"):
        if np.isfinite(np.asarray(data.get(name, np.nan), float)).any():
            return name
    return NOT_CHECKED


def _bands_of(records: np.ndarray) -> np.ndarray:
    """Middles of the bands that records have levels of, Hz, shape (bands,)."""
    if "band" not in (records.dtype.names or ()):
        return np.zeros(0)
    known = records["band"][np.isfinite(records["band"]).any(axis=1)]
    return known[0][np.isfinite(known[0])] if len(known) else np.zeros(0)


def records(samples: Results) -> np.ndarray:
    """The outcome records in results of kind ``samples``, shape (n,), with the fields that it has."""
    asked = {outcome.FIELDS[name].when for name in samples.variables if name in outcome.FIELDS}
    kind = outcome.record_type(samples.sizes["joint"], samples.sizes.get("band", 0), asked)
    found = outcome.unknown(samples.sizes["sample"], kind)
    for name in kind.names or ():
        if name in samples:
            found[name] = samples[name].to_numpy()
    if "band" in samples:
        heard = np.isfinite(found["contact_force_level"]).any(axis=(1, 2))
        found["band"][~heard] = np.nan  # of failed samples
    return found


# -----------------------------------------------------------------------------------------------
# Files


def write(content: Results, path: str | os.PathLike[str]) -> None:
    """Write results as sealed NetCDF-4, whole or not at all; equal content gives equal bytes.

    The file is written under a temporary name in the same directory, synced, and renamed. Raises InputError: the place cannot
    be written to. Raises StorageError: the disk is full or fails; what stood at `path` before still does.
    """
    image = encode(content)
    with image.getbuffer() as written:
        ending = netcdf.seal(written)
    image.seek(0, io.SEEK_END)
    image.write(ending)  # behind it, in place: of a large file no second copy is made
    with image.getbuffer() as written:
        write_bytes(_path(path), written, netcdf.SEAL)


def encode(content: Results) -> io.BytesIO:
    """Results as a NetCDF-4 file, in the memory it was built in; equal content gives equal bytes.

    Variables are numbers or text; coordinates are one-dimensional and named as their dimension. Floating-point data variables
    carry ``_FillValue = NaN``, coordinates and integers carry none. Raises ValueError: a type or a coordinate that the file
    cannot hold.
    """
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", track_order=True) as file:
        for number, name in enumerate(content.sizes):
            _encode_dimension(file, name, number, content)
        for name, variable in content.variables.items():
            if name not in content.sizes:
                target = _encode_variable(file, name, variable, filled=True)
                for axis, dimension in enumerate(variable.dims):
                    target.dims[axis].attach_scale(file[dimension])
        _encode_attributes(file, content.attrs)
    return buffer


def _encode_dimension(file: h5py.File, name: str, number: int, content: Results) -> None:
    if name in content:
        scale = _encode_variable(file, name, content[name], filled=False)
        scale.make_scale(name)
    else:
        size = content.sizes[name]
        scale = file.create_dataset(name, shape=(size,), dtype=">f4", track_order=True)
        scale.make_scale(_NO_VARIABLE % size)
    scale.attrs["_Netcdf4Dimid"] = np.int32(number)


def _encode_variable(file: h5py.File, name: str, variable: Variable, filled: bool) -> h5py.Dataset:
    values = variable.values
    dtype = values.dtype.newbyteorder("<")
    fill = None
    if dtype.kind == "U":
        dtype, values = h5py.string_dtype(), values.astype(object)
    elif dtype.str not in netcdf.DTYPES:
        raise ValueError(f"{name!r} has type {dtype}, which a dataset cannot hold")
    elif dtype.kind == "f" and filled:
        fill = dtype.type(np.nan)
    target = file.create_dataset(name, data=values, dtype=dtype, fillvalue=fill, track_order=True)
    if fill is not None:
        target.attrs["_FillValue"] = np.array([fill], dtype)
    _encode_attributes(target, variable.attrs)
    return target


def _encode_attributes(target: h5py.Dataset | h5py.File, attributes: Mapping[str, object]) -> None:
    for name, value in attributes.items():
        if isinstance(value, str):
            data = value.encode()
            if 0 < len(data) < _ATTRIBUTE_LIMIT:  # NetCDF char, which every tool reads
                kind = h5py.string_dtype("ascii" if data.isascii() else "utf-8", len(data))
                target.attrs.create(str(name), np.array(data, kind), dtype=kind)
            else:
                target.attrs[str(name)] = value
        else:
            target.attrs[str(name)] = np.atleast_1d(np.asarray(value))


def read(
    path: str | os.PathLike[str], kind: str | None = None, scene_hash: str | None = None
) -> Results:
    """Read a result file into memory and check it against the table; of a kind and made from a scene, if these are given.

    Raises InputError: the file is missing, cut off, changed, foreign, of another kind or scene, or says what cannot be.
    """
    place = _path(path)
    content = netcdf.load(place)
    fault = fault_of(content, kind)
    if fault is not None:
        raise InputError(
            "file", str(place), fault, f"Name a file of {kind or 'results'} that hpcclear wrote"
        )
    found = content.attrs.get("scene_hash")
    if scene_hash is not None and found != scene_hash:
        reason = f"it was made from another scene (hash {str(found)[:12]}, not {scene_hash[:12]})"
        raise InputError("file", str(place), reason, "Use the results of this scene")
    return content


def files_in(directory: Path) -> list[Path]:
    """Result files of a directory and of its folder ``responses``, in order. Raises InputError where there are none."""
    found = [*sorted(directory.glob("*.nc")), *sorted((directory / "responses").glob("*.nc"))]
    if not found:
        reason = "this is a file" if directory.exists() else "there is no such directory"
        reason = "there is no result file in it" if directory.is_dir() else reason
        raise InputError("directory", str(directory), reason, "Name the directory a run wrote to")
    return found


def each_in(directory: Path) -> Iterator[tuple[Path, Results | InputError]]:
    """Read `files_in` a directory, one after the other: what each holds, or why it cannot be read; errors as there."""
    for path in files_in(directory):
        try:
            yield path, read(path)
        except InputError as error:
            yield path, error


def _path(path: str | os.PathLike[str]) -> Path:
    text = os.fspath(path)
    if "\0" in text:
        raise InputError("file", text, "contains a NUL character", "Choose another name")
    return Path(text)
