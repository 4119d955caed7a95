"""Designs of a scene through the dynamics, on all ranks, checkpointed on the way; the `sample` command, which writes them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.base.errors import InputError
from hpcclear.base.objectives import MEAN_GAP, Objective
from hpcclear.base.outcome import JOINTS, recast
from hpcclear.dynamics.evaluation.steady.wording import recorded
from hpcclear.ensemble import simulate
from hpcclear.ensemble.identity import sample_key
from hpcclear.ensemble.session import DEFAULT_OPTIONS, Finished, Options, Session
from hpcclear.ensemble.split import Part, whole
from hpcclear.ranks import leading
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import Maker, Task
from hpcclear.ranks.stopping import Stopped
from hpcclear.ranks.team import Ranks
from hpcclear.results import dataset
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.results.keys import check_key
from hpcclear.results.places import Place
from hpcclear.scene import Scene
from hpcclear.scene.points import Points, expanded, latin_hypercube, read_points
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.scene import record_of

MEMORY = 2.3e-6
"""GB that root takes for a sample (`analysis/many_ranks.py`)."""

NOTABLE = 1.0
"""Memory (GB) above which a warning is printed."""


def design(scene: Scene, table: Path | None) -> Points:
    """The points to simulate: a user's table, or the study's sampling.

    Raises InputError if there is neither, or a point makes no mechanism.
    """
    if table is not None:
        return read_points(table, scene)
    if scene.study is None:
        remedy = "Add a [study] table, or give --points designs.csv"
        raise InputError("study", None, "the scene has no [study] table", remedy)
    if (method := scene.study.method) == "lhs":
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
    options: Options = DEFAULT_OPTIONS,
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
    return session.finished("samples", lambda here: _simulate(scene, chosen, here, rows.start))


def _simulate(scene: Scene, points: Points, session: Session, first: int) -> Results:
    """Simulate what is not finished yet, and write the dataset; the samples are numbered from `first`."""
    session.describe(scene)
    if (memory := len(points) * MEMORY) >= NOTABLE:
        text = f"root keeps all {len(points)} samples in memory, {memory:.1f} GB at the end; Monte Carlo samples it can write"
        session.notify(f"{text} as they come: --statistics --raw DIR")
    checkpoint = session.opened(points.units)
    progress = Progress("samples", session.options.style)
    records = sample_points(scene, points, session.ranks, checkpoint, progress, first=first)
    records["sample"] += first
    with saving(checkpoint.flush):  # what came since the last save, if the file cannot be written
        return _write(session, scene, points, records)


def _write(session: Session, scene: Scene, points: Points, records: Records) -> Results:
    """Write the file of samples; returns what was written."""
    attributes = session.attributes | recorded(scene, records)
    return session.write(samples_of(points, records, attributes, scene.objective, session.joints))


def samples_of(
    points: Points,
    records: Records,
    attributes: Mapping[str, str],
    objective: Objective = MEAN_GAP,
    joints: Sequence[str] = JOINTS,
) -> Results:
    """A dataset of kind ``samples`` of points and what became of them, a record each."""
    about = {**attributes, "sampling": points.sampling} if points.sampling else attributes
    return dataset.samples_dataset(
        points.names, points.values, points.units, records, about, objective,
        points.words, joints, points.labels,
    )  # fmt: skip


def run_merge(scene: Scene, points: Points, output: Path, ranks: Ranks) -> Finished:
    """Write the result of all parts of a design, as one run would have written it; the parts stay.

    `output`: the name that was given with each part.
    Raises InputError: parts are missing, damaged, or another run's. Raises StorageError: the disk refuses.
    """
    place = Place.of_file(output, False)
    with Session(place, sample_key(scene, points), ranks, DEFAULT_OPTIONS) as session:
        samples = session.found("samples")
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
    completed = recast(checkpoint.completed(first, len(points)), record)
    completed["sample"] -= first

    def take(records: np.ndarray) -> None:
        numbered = records.copy()
        numbered["sample"] += first
        checkpoint.add(numbered, points.values[records["sample"]])

    def save() -> None:
        with ranks.stage(stage), ranks.writing():
            checkpoint.flush()

    run = partial(
        leading.run_points, ranks, task, sent.values, completed=completed, on_records=take
    )
    with saving(save):
        return run(save=checkpoint.flush_when_due, progress=progress)
