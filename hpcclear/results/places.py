"""Where a run puts its results, what belongs to it there, and whether another run is there already."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from hpcclear.base.errors import InputError, refused
from hpcclear.base.lock import Lock
from hpcclear.results import files, netcdf
from hpcclear.results.checkpoint import unfinished
from hpcclear.results.keys import check_key, key_of

_IN_DIRECTORIES = ("run", "accuracy", "sample --statistics")
"""Commands, as keys name them, that have a directory of their own."""

_SIGNS = ("timing.nc", "front.nc", "accuracy.nc", "samples-00000000.nc")
"""Files by which a directory of theirs is known, small ones."""


@dataclass(frozen=True)
class Place:
    """Where a run puts its results, and what belongs to it there."""

    output: Path
    """The file, or the directory, of the results."""
    parts: Path
    """Directory of what is unfinished."""
    timing: Path
    lock: Path
    folders: tuple[Path, ...]
    """Where a killed run may have left half a file."""
    shared: bool = True
    """Whether results of other runs may lie beside these, each with a lock of its own: not in a run's directory."""
    guest: bool = False
    """Whether a file may also lie in a directory of another run."""
    apart: tuple[str, ...] = ()
    """Files of the directory that a stage with a key of its own writes."""
    needed: re.Pattern[str] | None = None
    """Names of files that an earlier command left and that are not written again: a damaged one is refused."""

    @classmethod
    def of_file(cls, output: Path, fresh: bool) -> Self:
        """A single file, with a hidden directory beside it; `fresh`: another one, if anything is there.

        Raises InputError, StorageError: nothing can be written there.
        """
        if not (fresh and output.is_file()):  # which stays as it is
            files.refuse_foreign(output, netcdf.SEAL)
        if fresh and any(os.path.lexists(path) for path in (output, _parts_of(output))):
            output = _fresh_sibling(output)
        files.probe(output, netcdf.SEAL)
        parent, timing = output.parent, output.with_name(f"{output.stem}.timing.nc")
        files.refuse_foreign(timing, netcdf.SEAL)
        return cls(output, _parts_of(output), timing, parent / f".{output.name}.lock", (parent,))

    @classmethod
    def of_response(cls, output: Path) -> Self:
        """The file of a single response, which any directory may hold, a run's as well."""
        return replace(cls.of_file(output, fresh=False), guest=True)

    @classmethod
    def of_directory(
        cls,
        directory: Path,
        fresh: bool,
        folders: Sequence[str] = (),
        apart: Sequence[str] = (),
        needed: re.Pattern[str] | None = None,
    ) -> Self:
        """A directory of one run, made if its parent exists; `fresh`: another one, if anything is in it.

        Raises InputError, StorageError: it cannot be made.
        """
        try:
            if fresh and directory.exists() and any(directory.iterdir()):
                directory = _fresh_sibling(directory)
            directory.mkdir(exist_ok=True)
        except OSError as error:
            raise refused(directory, error) from None
        inside = tuple(directory / name for name in folders)
        lock = directory / ".hpcclear.lock"
        return cls(
            directory, directory / "checkpoint", directory / "timing.nc", lock, (directory, *inside),
            shared=False, apart=tuple(apart), needed=needed,
        )  # fmt: skip

    def refuse_others(self, key: Mapping[str, str]) -> None:
        """Refuse a directory in which another run is at work or has left results; call it with the lock held.

        A file goes into any directory but that of another run; a run's directory holds results with its own key only. Both
        sides take their own lock before they look at those of others, so that of two at least one sees the other. Raises
        InputError.
        """
        folder = self.lock.parent
        if self.guest:
            return
        if self.shared:
            owner = Lock(folder)
            if owner.is_ours():  # this is a stage of that run
                return
            owner.refuse_others()
            why = _occupied(folder, key)
            if why:
                raise InputError("output", str(self.output), why, "Choose another directory")
            return
        for path in sorted(folder.glob(".*.lock")):
            Lock(folder, path.name).refuse_others()
        for path in sorted(folder.glob("*.nc")):
            if path.name in self.apart:
                continue
            try:
                content = netcdf.load(path)
            except InputError:  # somebody else's, unless it has to be whole
                if self.needed is not None and self.needed.fullmatch(path.name):
                    raise
                continue
            if key_of(content):
                check_key(content, key, path)


def _parts_of(output: Path) -> Path:
    """Where the finished samples of a single result file are kept until it is written."""
    return output.with_name(f".{output.name}.parts")


def _fresh_sibling(path: Path) -> Path:
    """The first free name beside `path`: DIR-2, DIR-3, ... or OUT-2.nc, OUT-3.nc, ...

    A directory is made at once, so that two runs never get the same one; for a file (a name with
    a suffix) the lock of the run decides.
    """
    path = path.absolute()  # "." has no name
    number = 2
    while True:
        sibling = path.with_name(f"{path.stem}-{number}{path.suffix}")
        if path.is_dir() or path.suffix == "":
            sibling = path.with_name(f"{path.name}-{number}")
            try:
                sibling.mkdir()
                return sibling
            except FileExistsError:
                pass
            except OSError as error:
                raise refused(sibling, error) from None
        elif not any(os.path.lexists(place) for place in (sibling, _parts_of(sibling))):
            return sibling
        number += 1


def _occupied(folder: Path, key: Mapping[str, str]) -> str:
    """Why a directory belongs to another run than that of a key; nothing if it does not."""
    if unfinished(folder / "checkpoint"):
        return "an unfinished run is in that directory"
    for name in _SIGNS:
        try:
            found = key_of(netcdf.load(folder / name))
        except InputError:
            continue
        if found.get("command") in _IN_DIRECTORIES and found != dict(key):
            return f"that directory holds results of another run (hpcclear {found['command']})"
    return ""
