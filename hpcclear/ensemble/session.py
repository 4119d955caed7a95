"""One run, from its place to its result: the session, in which no other run works there, and the designs that it simulates.

Every command has a session: it looks for what is finished already, goes on from what a killed run left, and at the end writes
where the time went. `sample_points` simulates designs on all ranks, checkpointed on the way; `sample` writes just these.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.base.errors import InputError
from hpcclear.base.lock import Lock
from hpcclear.base.objectives import Objective
from hpcclear.base.outcome import JOINTS, OUTCOME, recast
from hpcclear.base.plain import plain
from hpcclear.dynamics.evaluation.steady.wording import recorded
from hpcclear.ensemble import simulate
from hpcclear.ensemble.identity import sample_key
from hpcclear.ensemble.split import Part, whole
from hpcclear.ranks import leading
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import COLUMNS, Maker, Task
from hpcclear.ranks.stopping import Stopped
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style, clear
from hpcclear.results import dataset, files
from hpcclear.results.checkpoint import INTERVAL, Checkpoint, discard
from hpcclear.results.content import Results
from hpcclear.results.keys import check_key, key_attribute
from hpcclear.results.names import KINDS
from hpcclear.results.places import Place
from hpcclear.results.provenance import program
from hpcclear.scene import Scene
from hpcclear.scene.points import Points, expanded, latin_hypercube, read_points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.scene import record_of
from hpcclear.scene.study import Study


@dataclass(frozen=True)
class Options:
    """How a run is carried out, which changes no result."""

    fresh: bool = False
    """Start anew beside an earlier result."""
    interval: float = INTERVAL
    """Seconds between two checkpoints."""
    style: Style = "auto"
    """How progress is shown."""


class Finished(NamedTuple):
    """A command's results, for whoever prints them."""

    content: Results
    output: Path
    timing: Path
    """output and timing: files of the content and of the times."""


class Session:
    """One run at its place, on root: a context in which no other run works there.

    `key`: what makes the run what it is (`hpcclear.ensemble.identity`); `notify` gets what was found on disk and could not be
    used, a sentence at a time. `attributes`: of every file of results, what made them, and the key; empty before `opened`;
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
        make: Callable[[Session], Results],
        times: Callable[[Results], Mapping[str, str]] | None = None,
    ) -> Finished:
        """Return the file that a command writes: of an earlier run, else what `make` returns and has written.

        `times`: from new results to what the file of times says of them. Call it instead of entering the context.
        """
        with self:
            content, measured = self.found(), None
            if content is None:
                content = make(self)
                measured = None if times is None else times(content)
            self.close(measured)
        return Finished(content, self.place.output, self.place.timing)

    def found(self) -> Results | None:
        """The file of an earlier run of the same command, if it is there; another run's is refused."""
        if not self.place.output.exists():
            return None
        content = dataset.read(self.place.output)
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

    def opened(
        self, scene: Scene, units: Mapping[str, str] | None = None, mapped: bool = False
    ) -> Checkpoint:
        """What an earlier run left unfinished; `units`: of its design variables, by their names; others as of `describe`."""
        self.describe(scene, mapped)
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


@contextmanager
def saving(save: Callable[[], object]) -> Iterator[None]:
    """Save what is finished when an exception ends the block, even if a save itself was what failed.

    A fault may be gone a moment later. When the last save fails as well, its own error says so after
    a stop, for which all was to be saved; after an error, that error is what the caller hears of.
    """
    try:
        yield
    except Stopped:
        save()
        raise
    except BaseException as error:  # noqa: BLE001 - raised again
        try:
            save()
        finally:
            raise error from error.__cause__  # without the context: it is the failed save, if any


def sample_points(
    scene: Scene,
    points: Points,
    ranks: Ranks,
    checkpoint: Checkpoint | None = None,
    progress: Progress | None = None,
    *,
    stage: str = "samples",
    first: int = 0,
    maker: Maker | None = None,
    record: np.dtype | None = None,
) -> np.ndarray:
    """Simulate designs (SI) on all ranks; call it on root. Returns records (n,) in the points' order, numbered from 0.

    The checkpoint, whose names are those of `points`, knows the samples finished earlier, and gets each new one; its numbers
    begin at `first`, for designs that come one after the other. When this raises, everything finished is on disk, unless the
    disk refused it twice. `stage`: name for reports and timing; `maker` makes a rank's worker (`make_evaluator`), and `record`
    is the type of its records (`hpcclear.scene.scene.record_of`).
    Raises Stopped, RankFailed, InputError as `hpcclear.ranks.leading.run_points`. Raises StorageError: the disk refuses.
    """
    sent = expanded(scene.study, points)  # rows of catalogues as the numbers they stand for
    record = record_of(scene) if record is None else record
    payload = simulate.payload_of(scene, sent)
    task = Task(stage, maker or simulate.make_evaluator, payload, record)
    if checkpoint is None:
        return leading.run_points(ranks, task, sent.values, progress=progress)
    before = recast(checkpoint.completed(first, len(points)), record)
    before["sample"] -= first

    def take(records: np.ndarray) -> None:
        numbered = records.copy()
        numbered["sample"] += first
        checkpoint.add(numbered, points.values[records["sample"]])

    def save() -> None:
        with ranks.stage(stage), ranks.writing():
            checkpoint.flush()

    run = partial(leading.run_points, ranks, task, sent.values, completed=before, on_records=take)
    with saving(save):
        return run(save=checkpoint.flush_when_due, progress=progress)


# ---- what `sample` writes ----

MEMORY = 2.3e-6
"""GB that root takes for a sample (`analysis/many_ranks.py`)."""

NOTABLE = 1.0
"""Memory (GB) above which a warning is printed."""


def design(scene: Scene, table: Path | None) -> Points:
    """The points to simulate: a user's table, or the study's sampling.

    Raises InputError if there is neither, or a point makes no mechanism.
    """
    if table is not None:
        return read_points(table, scene, KINDS["samples"].table)
    if (method := scene.required_study.method) == "lhs":
        points = latin_hypercube(scene)
    else:
        sequence = 0 if method == "qmc" else None
        points = monte_carlo(scene, replicate=sequence, stratified=method == "random-lhs")
    return replace(points, sampling=method)


def run_sample(
    scene: Scene,
    output: Path,
    ranks: Ranks,
    *,
    table: Path | None = None,
    part: Part | None = None,
    options: Options = Options(),
) -> Finished:
    """Simulate a design, or a table of designs, on all ranks and write it; on root.

    NAME.timing.nc goes beside the output, finished samples into a hidden directory until it is written; those of a `part`
    into a file of their own. Raises InputError, StorageError, Stopped, RankFailed.
    """
    points = design(scene, table)
    if part is None:
        rows, key = range(len(points)), sample_key(scene, points)
        place = Place.of_file(output, options.fresh)
    else:
        rows, key = part.rows(len(points)), part.key(scene, points)
        place = Place.of_file(part.place(output), False)
    chosen = points.take(slice(rows.start, rows.stop))
    session = Session(place, key, ranks, options)
    return session.finished(lambda here: _simulate(scene, chosen, here, rows.start))


def _simulate(scene: Scene, points: Points, session: Session, first: int) -> Results:
    """Simulate what is not finished yet, and write the dataset; the samples are numbered from `first`."""
    if (memory := len(points) * MEMORY) >= NOTABLE:
        text = f"root keeps all {len(points)} samples in memory, {memory:.1f} GB at the end; Monte Carlo samples it can write"
        session.notify(f"{text} as they come: --statistics --raw DIR")
    checkpoint = session.opened(scene, points.units)
    progress = Progress("samples", session.options.style)
    records = sample_points(scene, points, session.ranks, checkpoint, progress, first=first)
    records["sample"] += first
    with saving(checkpoint.flush):  # what came since the last save, if the file cannot be written
        return _write(session, scene, points, records)


def _write(session: Session, scene: Scene, points: Points, records: Records) -> Results:
    """Write the file of samples; returns what was written."""
    attributes = session.attributes | recorded(scene, records)
    return session.write(samples_of(scene, points, records, attributes))


def describe_variables(content: Results, study: Study | None) -> Results:
    """Describe the design variables that are no number of the mechanism: unit, rows to choose from, random inputs they set."""
    for variable in () if study is None else study.variables:
        own = content.get(variable.name)
        if own is not None and (variable.rows or variable.silent):
            own.attrs |= {"units": variable.unit or "1", "long_name": variable.words}
            if variable.rows:
                own.attrs["options"] = "; ".join(row.name for row in variable.rows)
            if variable.silent:
                own.attrs["of_random_inputs"] = ", ".join(variable.input_paths)
    return content


def samples_of(
    scene: Scene, points: Points, records: Records, attributes: Mapping[str, str], objective: Objective | None = None
) -> Results:  # fmt: skip
    """A dataset of kind ``samples`` of points and what became of them, a record each; `objective`: by default the scene's."""
    about = {**attributes, "sampling": points.sampling} if points.sampling else attributes
    content = dataset.samples_dataset(
        points.names, points.values, points.units, records, about, objective or scene.objective,
        points.words, scene.joint_labels, points.labels,
    )  # fmt: skip
    return describe_variables(content, scene.study)


def run_merge(scene: Scene, points: Points, output: Path, ranks: Ranks) -> Finished:
    """Write the result of all parts of a design, as one run would have written it; the parts stay.

    `output`: the name that was given with each part.
    Raises InputError: parts are missing, damaged, or another run's. Raises StorageError: the disk refuses.
    """
    place = Place.of_file(output, False)
    with Session(place, sample_key(scene, points), ranks, Options()) as session:
        samples = session.found()
        if samples is None:
            parts = [_records(part, scene, points, output) for part in whole(output)]
            records = np.concatenate(parts)
            session.describe(scene)
            samples = _write(session, scene, points, records)
    return Finished(samples, place.output, place.timing)


def _records(part: Part, scene: Scene, points: Points, output: Path) -> np.ndarray:
    """The records of one part, all of them."""
    path = part.place(output)
    content = dataset.read(path, "samples")
    check_key(content, part.key(scene, points), path)
    records = dataset.records(content)
    if not np.array_equal(records["sample"], part.rows(len(points))):
        reason = "it does not contain the samples of its part"
        raise InputError("file", str(path), reason, "Remove it, and run that part again")
    return recast(records, record_of(scene))
