"""NetCDF-4 files of results: an image in memory, sealed, written whole.

A file is built in memory, so the same content gives the same bytes and a full disk meets a plain
``write`` instead of the HDF5 library. A seal (SHA-256 of all bytes before it) is appended after
the HDF5 end of file, where every reader of NetCDF ignores it; `load` verifies it before the HDF5
library sees a byte, so truncation, bit rot and tampering end in a message, never in a parser.

Written with h5py: a checkpoint every few seconds must cost next to nothing, and this takes a fifth
of the time of the general writers. Readers see a plain NetCDF-4 file.
"""

import hashlib
import io
import os
import stat
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from hpcclear.base import host
from hpcclear.base.errors import InputError
from hpcclear.results.content import Results, Variable
from hpcclear.results.files import Buffer, write_bytes

SEAL = b"\nhpcclear seal sha256:"
"""Begin of what is put behind the content of every file."""

_SEAL_LENGTH = len(SEAL) + 64 + 1
_DTYPES = ("<f8", "<f4", "|i1", "<i2", "<i4", "<i8", "|u1", "<u2", "<u4", "<u8")
_BARE = b"This is a netCDF dimension"
_NO_VARIABLE = f"{_BARE.decode()} but not a netCDF variable. %9d"  # wording fixed by NetCDF-4
_HIDDEN = {"CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Dimid", "_FillValue"}
# bytes; HDF5 keeps at most 64 kB in an object header, longer text goes to the heap
_ATTRIBUTE_LIMIT = 30_000


def read_bytes(path: Path) -> bytes:
    """The sealed content of `path`, seal verified and removed.

    Raises InputError: the file cannot be read, is no regular file, was never sealed, or changed since.
    """

    def bad(reason: str, remedy: str) -> InputError:
        return InputError("file", str(path), reason, remedy)

    again = "Remove it or restore a copy, and run the command that makes it again"
    try:
        # non-blocking: opening a pipe must not hang
        with open(os.open(path, host.flags("O_RDONLY", "O_NONBLOCK")), "rb") as file:
            about = os.fstat(file.fileno())
            if not stat.S_ISREG(about.st_mode):
                raise bad("it is not a regular file", "Name a file that hpcclear wrote")
            if about.st_size < _SEAL_LENGTH:
                raise bad("it is empty or cut off", again)
            file.seek(about.st_size - _SEAL_LENGTH)
            found = file.read(_SEAL_LENGTH)
            # looked at first, so that a foreign giant is not read into memory
            if not found.startswith(SEAL):
                foreign = "hpcclear did not write it, or it was cut off or changed afterwards"
                raise bad(foreign, again)
            file.seek(0)
            content = file.read(about.st_size - _SEAL_LENGTH)
    except OSError as error:
        raise bad(os.strerror(error.errno or 0), "Check the name and the permissions") from None
    if found != seal(content):
        raise bad("its content changed after it was written (checksum differs)", again)
    return content


def seal(content: Buffer) -> bytes:
    """What is put behind the content of a file."""
    return SEAL + hashlib.sha256(content).hexdigest().encode() + b"\n"


def save(content: Results, path: Path) -> None:
    """Write content as a sealed NetCDF-4 file (see `write_bytes`, `encode`)."""
    image = encode(content)
    with image.getbuffer() as written:
        ending = seal(written)
    image.seek(0, io.SEEK_END)
    image.write(ending)  # behind it, in place: of a large file no second copy is made
    with image.getbuffer() as written:
        write_bytes(path, written, SEAL)


def load(path: Path) -> Results:
    """Read a file of `save` into memory; `InputError` for anything else (see `read_bytes`)."""
    content = read_bytes(path)
    try:
        return decode(content)
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError) as error:
        # Only a file sealed by somebody else gets here. Damage cannot; malice can, and HDF5 itself
        # may then loop: the seal keeps out accidents and idle hands, not an attacker who forges it.
        reason = f"it does not have the structure of an hpcclear file ({str(error).splitlines()[0][:120]})"
        raise InputError("file", str(path), reason, "Name a file that hpcclear wrote") from None


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
    elif dtype.str not in _DTYPES:
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


def decode(content: bytes) -> Results:
    """What the bytes of `encode` hold; nothing outside these bytes is touched or evaluated.

    Raises ValueError, OSError, RuntimeError, KeyError, TypeError, OverflowError: the bytes are not of this form.
    """
    coordinates, data = {}, {}
    with h5py.File(io.BytesIO(content), "r") as file:
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name!r} is a link")
            source = file[name]
            if not isinstance(source, h5py.Dataset):
                raise ValueError(f"{name!r} is a group")
            label = source.attrs.get("NAME", b"")
            if source.is_scale and isinstance(label, bytes) and label.startswith(_BARE):
                continue
            values, attributes = _decode_values(source), _decode_attributes(source)
            if source.is_scale:
                coordinates[name] = Variable((name,), values, attributes)
            else:
                dims = [scale[0].name for scale in source.dims]
                if None in dims:
                    raise ValueError(f"{name!r} has a dimension without a name")
                data[name] = Variable(tuple(dim.lstrip("/") for dim in dims), values, attributes)
        return Results({**data, **coordinates}, _decode_attributes(file))


def _decode_values(source: h5py.Dataset) -> np.ndarray:
    text = h5py.check_string_dtype(source.dtype) is not None and source.dtype.kind == "O"
    if not text and source.dtype.str not in _DTYPES:
        raise ValueError(f"{source.name!r} has type {source.dtype}")
    # Data stored elsewhere would read other files; not stored in full, fill the memory.
    if source.is_virtual or source.external or source.chunks is not None:
        raise ValueError(f"{source.name!r} is not stored in one piece")
    if source.id.get_storage_size() < source.nbytes:
        raise ValueError(f"{source.name!r} is not stored in full")
    if text:
        return np.array(source.asstr()[...], dtype=str)
    return np.asarray(source[...])


def _decode_attributes(source: h5py.Dataset | h5py.File) -> dict[str, object]:
    found: dict[str, object] = {}
    for name in source.attrs:
        if name in _HIDDEN:
            continue
        value = source.attrs[name]
        if isinstance(value, bytes):
            value = value.decode()
        elif not isinstance(value, str):
            value = np.asarray(value)
            if value.dtype.kind not in "iuf" or value.ndim > 1:
                raise ValueError(f"attribute {name!r} is neither text nor numbers")
            value = value.flat[0] if value.size == 1 else value
        found[name] = value
    return found
