"""The life of a run, which `sample`, `sample --statistics` and `run` share.

The lock of its place, what a killed run left there, the key that says whether results are this run's, going on from
them, and at the end the times and the removal of what was unfinished.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from hpcclear.base.lock import Lock
from hpcclear.base.outcome import JOINTS, OUTCOME
from hpcclear.base.plain import plain
from hpcclear.ranks.schedule import COLUMNS
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style, clear
from hpcclear.results import dataset, files
from hpcclear.results.checkpoint import INTERVAL, Checkpoint, discard
from hpcclear.results.content import Results
from hpcclear.results.keys import check_key, key_attribute
from hpcclear.results.places import Place
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.scene import record_of


@dataclass(frozen=True)
class Options:
    """How a run is carried out, which changes no result."""

    fresh: bool = False
    """Start anew beside an earlier result."""
    interval: float = INTERVAL
    """Seconds between two checkpoints."""
    style: Style = "auto"
    """How progress is shown."""


DEFAULT_OPTIONS = Options()


class Finished(NamedTuple):
    """A command's results, for whoever prints them."""

    content: Results
    output: Path
    timing: Path
    """output and timing: files of the content and of the times."""


class Session:
    """One run at its place, on root: a context in which no other run works there.

    `key`: what makes the run what it is (`hpcclear.ensemble.identity`); `notify` gets what was found on disk and could not be
    used, a sentence at a time. `attributes`: of every file of results, what made them, and the key; empty before `describe`;
    `joints`, `record`: labels of the joints, and type of the records of samples.
    """

    def __init__(
        self,
        place: Place,
        key: Mapping[str, str],
        ranks: Ranks,
        options: Options,
        notify: Callable[[str], object] = lambda text: sys.stderr.write(f"{plain(text)}\n"),
    ) -> None:
        self.place, self.key, self.ranks, self.options = place, dict(key), ranks, options
        self.joints: tuple[str, ...] = JOINTS
        self.record: np.dtype = OUTCOME
        self.notify = notify
        self.attributes: dict[str, str] = {}
        self._checkpoint: Checkpoint | None = None
        self._reported = 0
        self._lock = Lock(place.lock.parent, place.lock.name)

    def __enter__(self) -> Self:
        self._lock.acquire()
        try:
            self.place.refuse_others(self.key)
            for folder in self.place.folders:
                files.remove_leftovers(folder)
        except BaseException:
            self._lock.release()
            raise
        return self

    def __exit__(self, *error: object) -> None:
        clear()
        self._lock.release()

    def finished(
        self,
        kind: str,
        make: Callable[[Session], Results],
        times: Callable[[Results], Mapping[str, str]] | None = None,
    ) -> Finished:
        """Return the file of this kind that a command writes: of an earlier run, else what `make` returns and has written.

        `times`: from new results to what the file of times says of them. Call it instead of entering the context.
        """
        with self:
            content, measured = self.found(kind), None
            if content is None:
                content = make(self)
                measured = None if times is None else times(content)
            self.close(measured)
        return Finished(content, self.place.output, self.place.timing)

    def found(self, kind: str) -> Results | None:
        """The file of an earlier run of the same command, if it is there; another run's is refused."""
        if not self.place.output.exists():
            return None
        content = dataset.read(self.place.output, kind)
        check_key(content, self.key, self.place.output)
        return content

    def has_all(self, names: Sequence[str]) -> bool:
        """Whether all these files of the directory are there; another run's are refused."""
        there = [path for name in names if (path := self.place.output / name).exists()]
        for path in there:
            check_key(dataset.read(path), self.key, path)
        return len(there) == len(names)

    def describe(self, scene: Scene, mapped: bool = False) -> None:
        """Set `attributes`, what made the files of this run, the labels of its joints, and the type of its samples' records
        (arguments as of `record_of`)."""
        self.joints, self.record = scene.joint_labels, record_of(scene, mapped)
        self.attributes = {**scene.origin, **program(), **key_attribute(self.key)}

    def opened(self, units: Mapping[str, str] | None = None) -> Checkpoint:
        """What an earlier run left unfinished; `units`: of its design variables, by their names."""
        with self.writing():
            self._checkpoint = Checkpoint(
                self.place.parts, self.key, interval=self.options.interval, units=units,
                attributes=self.attributes, joints=self.joints, record=self.record,
            )  # fmt: skip
        self.notify_problems()
        return self._checkpoint

    def notify_problems(self) -> None:
        """Report what was found in the checkpoint and could not be used, each once."""
        problems = [] if self._checkpoint is None else self._checkpoint.problems
        for problem in problems[self._reported :]:
            self.notify(problem)
        self._reported = len(problems)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Count the time inside as output of files."""
        with self.ranks.stage("files"), self.ranks.writing():
            yield

    def write(self, content: Results) -> Results:
        """Write the result file; returns what was written."""
        with self.writing():
            dataset.write(content, self.place.output)
        return content

    def close(self, attributes: Mapping[str, str] | None = None) -> None:
        """Write the times, and remove what was unfinished: all results are in place.

        Who found all done keeps the times that were measured. `attributes` are those of the times' file.
        """
        if self.ranks.stage_seconds or not self.place.timing.exists():
            dataset.write(timing_of(self.ranks, attributes), self.place.timing)
        if self._checkpoint is not None:
            self._checkpoint.finish()
        else:  # the run that finished may have been killed before it could
            discard(self.place.parts)


def timing_of(ranks: Ranks, attributes: Mapping[str, str] | None = None) -> Results:
    """Where the time of this job went, by rank and stage."""
    stages = list(ranks.stage_seconds) or ["none"]
    empty = np.zeros((ranks.size, len(COLUMNS)))
    seconds = np.stack([ranks.stage_seconds.get(stage, empty) for stage in stages], axis=1)
    data = {name: seconds[:, :, k] for k, name in enumerate(COLUMNS)}
    coords = {"rank": np.arange(ranks.size), "stage": np.array(stages, str)}
    return dataset.dataset("timing", coords, {**data, "command": command_line()}, attributes)


def command_line() -> str:
    """The command of this process as one would type it, however it was begun."""
    program = Path(sys.argv[0])
    ours = program.name == "__main__.py" and program.parent.name == "hpcclear"
    return shlex.join(["hpcclear" if ours else program.name, *sys.argv[1:]])
