"""Sealed NetCDF-4 files, read into memory; `hpcclear.results.dataset` writes them.

A seal (SHA-256 of all bytes before it) stands after the HDF5 end of file, where every reader of NetCDF ignores it; `load`
verifies it before the HDF5 library sees a byte, so truncation, bit rot and tampering end in a message, never in a parser.
"""

import hashlib
import io
import os
import stat
from pathlib import Path

import h5py
import numpy as np

from hpcclear.base import host
from hpcclear.base.errors import InputError
from hpcclear.results.content import Results, Variable
from hpcclear.results.files import Buffer

SEAL = b"\nhpcclear seal sha256:"
"""Begin of what is put behind the content of every file."""

_SEAL_LENGTH = len(SEAL) + 64 + 1
DTYPES = ("<f8", "<f4", "|i1", "<i2", "<i4", "<i8", "|u1", "<u2", "<u4", "<u8")
BARE = b"This is a netCDF dimension"  # wording fixed by NetCDF-4
_HIDDEN = {"CLASS", "NAME", "REFERENCE_LIST", "DIMENSION_LIST", "_Netcdf4Dimid", "_FillValue"}


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


def load(path: Path) -> Results:
    """Read a file of `hpcclear.results.dataset.write` into memory; `InputError` for anything else (see `read_bytes`)."""
    content = read_bytes(path)
    try:
        return decode(content)
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, OverflowError) as error:
        # Only a file sealed by somebody else gets here. Damage cannot; malice can, and HDF5 itself
        # may then loop: the seal keeps out accidents and idle hands, not an attacker who forges it.
        reason = f"it does not have the structure of an hpcclear file ({str(error).splitlines()[0][:120]})"
        raise InputError("file", str(path), reason, "Name a file that hpcclear wrote") from None


def decode(content: bytes) -> Results:
    """What the bytes of `hpcclear.results.dataset.encode` hold; nothing outside these bytes is touched or evaluated.

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
            if source.is_scale and isinstance(label, bytes) and label.startswith(BARE):
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
    if not text and source.dtype.str not in DTYPES:
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
