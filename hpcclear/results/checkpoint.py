"""Finished work on disk as it finishes, so that a killed run goes on where it stopped.

Samples are written every few seconds as part files, each a whole dataset of kind ``samples``;
eight parts of one size are merged into one of the next, so that their number grows with the
logarithm of the run time and each record is rewritten a few times at most. Results of stages are
files of plain arrays. Every file carries the key of its run, and only the same run goes on from it.
"""

import re
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.errors import InputError, refused
from hpcclear.base.outcome import JOINTS, OUTCOME, recast
from hpcclear.results import dataset, files, netcdf
from hpcclear.results.content import Results, Variable
from hpcclear.results.keys import check_key, key_attribute
from hpcclear.results.names import designs_in

INTERVAL = 5.0
"""Seconds between two part files: what a kill costs at most."""

_FANOUT = 8
_KEPT = 50_000  # samples of a part that stay in memory, too: some MB; more are read from its file when they are asked for
_PART = re.compile(r"part-(\d{2})-(\d{6,12})\.nc")
_STAGE = re.compile(r"stage-([A-Za-z0-9_-]+)\.nc")
_DONE = "done.nc"  # all that follows from the other files is written, and they are being removed


Samples = tuple[np.ndarray, np.ndarray]
"""Records (n,) and designs (n, k)."""


def unfinished(directory: Path) -> bool:
    """Whether a directory holds work to go on from: files of a `Checkpoint` that was not finished."""
    names = [path.name for path in directory.glob("*.nc")]
    return _DONE not in names and any(_PART.fullmatch(n) or _STAGE.fullmatch(n) for n in names)


def discard(directory: Path) -> None:
    """Remove what a `Checkpoint` wrote in a directory, and the directory unless more is in it.

    The mark of `Checkpoint.finish` goes last: half of what was there is never taken for all of it. Raises InputError,
    StorageError: the disk refuses.
    """
    try:
        if directory.is_symlink() or not directory.is_dir():
            return
        for path in sorted(directory.iterdir()):
            if any(form.fullmatch(path.name) for form in (_PART, _STAGE, files.TEMPORARY)):
                path.unlink(missing_ok=True)
        (directory / _DONE).unlink(missing_ok=True)
        if not any(directory.iterdir()):
            directory.rmdir()
    except OSError as error:
        raise refused(directory, error) from None


@dataclass
class _Part:
    """One file; `span`: its least and largest sample; `held`: its samples, None of so many that only the file has them."""

    level: int
    path: Path
    span: tuple[int, int]
    held: Samples | None


class Checkpoint:
    """Finished samples and stages of one run, in a directory of their own; a part file every `interval` seconds.

    Opening it makes the directory (not its parent), removes rubbish that a kill left, and reads what is there. One process
    uses it at a time: hold a `hpcclear.base.lock.Lock`. `key`: what makes the run what it is, see `check_key`; `units`:
    of the design variables whose values `add` gets, by name or scene path, in its order; `attributes`:
    of the part files; `joints`: labels of the joints of the records, whose type is `record`
    (`hpcclear.scene.scene.record_of`). `problems`: what was found on disk and could not be used, a sentence each.

    Raises InputError: the directory holds another run's results, is a link, or cannot be written to. Raises StorageError: the
    disk fails.
    """

    def __init__(
        self, directory: Path, key: Mapping[str, str], *, interval: float = INTERVAL, units: Mapping[str, str] | None = None,
        attributes: Mapping[str, object] | None = None, joints: Sequence[str] = JOINTS, record: np.dtype = OUTCOME,
    ) -> None:  # fmt: skip
        self.directory = directory
        self.key = dict(key)
        self.interval = interval
        self.units = dict(units or {})
        self.joints, self.record = tuple(joints), record
        self.attributes = {**(attributes or {}), **key_attribute(key)}
        self.problems: list[str] = []
        self._parts: list[_Part] = []
        self._buffer: list[tuple[np.ndarray, np.ndarray]] = []
        try:
            self._number = self._open()
        except OSError as error:
            raise refused(directory, error) from None
        self._written = time.monotonic()

    # -- samples --------------------------------------------------------------------------------

    def add(self, records: np.ndarray, values: ArrayLike | None = None) -> None:
        """Take finished samples into memory; the flushes write them.

        `records`, shape (n,), may be of a variant of the scene that requests less than the checkpoint keeps; `values`,
        shape (n, k), are their designs, a column for each of `units`.
        """
        columns = np.empty((len(records), 0)) if values is None else np.asarray(values, float)
        if columns.shape != (len(records), len(self.units)):
            raise ValueError(f"designs have shape {columns.shape}, names are {tuple(self.units)}")
        if len(records):
            self._buffer.append((recast(records, self.record).copy(), columns.copy()))

    def flush_when_due(self) -> None:
        """Write what has gathered when the interval is over; raises as `flush`."""
        if time.monotonic() - self._written >= self.interval:
            self.flush()

    def flush(self) -> None:
        """Write what has gathered. Raises InputError, StorageError if the disk refuses: the samples stay for another try."""
        if self._buffer:
            records, values = zip(*self._buffer, strict=True)
            self._write_part(0, np.concatenate(records), np.concatenate(values))
            self._buffer.clear()
            self._merge()
        self._written = time.monotonic()

    def completed(self, first: int = 0, count: int | None = None) -> np.ndarray:
        """Samples on disk and in memory, by growing number, each once; shape (n,): all, or those of `count` from `first` on."""
        return self.contents(first, count)[0]

    def contents(self, first: int = 0, count: int | None = None) -> Samples:
        """The same samples with their designs: shapes (n,) and (n, k), a column for each name."""
        last = np.inf if count is None else first + count
        parts = [part for part in self._parts if part.span[1] >= first and part.span[0] < last]
        pieces = [self._held(part) for part in parts] + self._buffer
        rows = [(r["sample"] >= first) & (r["sample"] < last) for r, _ in pieces]
        records, values = (
            [piece[k][inside] for piece, inside in zip(pieces, rows, strict=True)] for k in (0, 1)
        )
        if not records:
            return np.empty(0, self.record), np.empty((0, 0))
        return _join(records, values)

    def _write_part(self, level: int, records: np.ndarray, values: np.ndarray) -> None:
        records, values = _join([records], [values])
        content = dataset.samples_dataset(
            tuple(self.units), values, self.units, records, self.attributes, joints=self.joints
        )
        path = self.directory / f"part-{level:02d}-{self._number:06d}.nc"
        dataset.write(content, path)
        self._keep(level, path, records, values)
        self._number += 1

    def _keep(self, level: int, path: Path, records: np.ndarray, values: np.ndarray) -> None:
        if not len(records):
            return
        held = (records, values) if len(records) <= _KEPT else None
        numbers = records["sample"]
        self._parts.append(_Part(level, path, (int(numbers.min()), int(numbers.max())), held))

    def _held(self, part: _Part) -> Samples:
        """A part's samples, from memory or from its file; raises InputError if that was damaged meanwhile."""
        return part.held or self._samples(dataset.read(part.path, "samples"))

    def _samples(self, content: Results) -> Samples:
        """Those that a part file has, a column of designs for each name."""
        records, designs = recast(dataset.records(content), self.record), designs_in(content)
        columns = [designs[name] for name in self.units]
        return records, np.stack(columns, 1) if columns else np.empty((len(records), 0))

    def _merge(self) -> None:
        while True:
            counts = Counter(part.level for part in self._parts)
            level = next((level for level in sorted(counts) if counts[level] >= _FANOUT), None)
            if level is None:
                return
            old = [part for part in self._parts if part.level == level]
            records, values = zip(*map(self._held, old), strict=True)
            self._write_part(level + 1, *_join(records, values))
            # a kill in between leaves samples twice, which `_join` mends
            for part in old:
                part.path.unlink(missing_ok=True)
            self._parts = [part for part in self._parts if part.level != level]

    # -- stages ---------------------------------------------------------------------------------

    def save_stage(self, name: str, data: Mapping[str, ArrayLike]) -> None:
        """Write a stage: arrays of numbers, truth values, text. `name`: of letters, digits, ``_``, ``-``. Raises as `flush`."""
        variables = {key: _stage_variable(key, values) for key, values in data.items()}
        content = Results(variables, {**self.attributes, "stage": name})
        dataset.write(content, self._stage_path(name))

    def load_stage(self, name: str) -> dict[str, np.ndarray] | None:
        """What `save_stage` wrote; None if not there or damaged (`problems`). Raises InputError: it is another run's."""
        path = self._stage_path(name)
        if not path.exists():
            return None
        try:
            content = netcdf.load(path)
        except InputError as error:
            self.problems.append(f"{path.name} is done again: {error.reason}")
            return None
        check_key(content, self.key, path)
        return {
            key: one.values.astype(bool) if "truth" in one.attrs else one.values
            for key, one in content.variables.items()
        }

    def _stage_path(self, name: str) -> Path:
        path = self.directory / f"stage-{name}.nc"
        if _STAGE.fullmatch(path.name) is None:
            raise ValueError(f"{name!r} is no name of a stage")
        return path

    # -- opening and closing --------------------------------------------------------------------

    def finish(self) -> None:
        """Remove all that was written here; call it when the final files are in place."""
        dataset.write(Results({}, self.attributes), self.directory / _DONE)
        discard(self.directory)
        self._parts.clear()
        self._buffer.clear()

    def _open(self) -> int:
        """Read the parts that are there; the number of the next one."""
        if (self.directory / _DONE).exists():
            discard(self.directory)
        self.directory.mkdir(exist_ok=True)
        if self.directory.is_symlink():  # results are written where the user said, nowhere else
            raise InputError("output", str(self.directory), "is a symbolic link", "Remove the link")
        number = 0
        for path in sorted(self.directory.iterdir()):
            match = _PART.fullmatch(path.name)
            if match is not None:
                number = max(number, int(match[2]) + 1)
                self._read_part(path, int(match[1]))
            elif files.TEMPORARY.fullmatch(path.name):
                self.problems.append(f"{path.name} was never finished and is removed")
                path.unlink(missing_ok=True)
        return number

    def _read_part(self, path: Path, level: int) -> None:
        try:
            content = dataset.read(path, "samples")
        except InputError as error:
            self.problems.append(f"samples of {path.name} are done again: {error.reason}")
            return
        check_key(content, self.key, path)
        if set(designs_in(content)) != set(self.units):
            self.problems.append(f"samples of {path.name} are done again: other design variables")
            return
        self._keep(level, path, *self._samples(content))


def _join(records: Sequence[np.ndarray], values: Sequence[np.ndarray]) -> Samples:
    """One array of each, by growing sample number, each sample once."""
    whole = len(records) == 1
    joined, designs = (one[0] if whole else np.concatenate(one) for one in (records, values))
    numbers = joined["sample"]
    if (numbers[1:] > numbers[:-1]).all():  # as a rule; copies count
        return joined, designs
    first = np.unique(numbers, return_index=True)[1]
    return joined[first], designs[first]


def _stage_variable(name: str, values: ArrayLike) -> Variable:
    array = np.asarray(values)
    dims = tuple(f"{name}_{axis}" for axis in range(array.ndim))
    if array.dtype.kind == "b":  # NetCDF knows no truth values
        return Variable(dims, array.astype(np.int8), {"truth": "0 false, 1 true"})
    return Variable(dims, array)
