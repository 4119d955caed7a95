"""A design of any scene through the dynamics, on all ranks: what `sample` and `run` share.

The kernel, scenes and files are imported where they are used: inside the rank boundary, where an import
that fails on one rank ends them all.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from hpcclear.base.objectives import Objective, asked
from hpcclear.base.outcome import recast
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.stopping import Stopped
from hpcclear.ranks.team import Ranks, Task

if TYPE_CHECKING:
    from hpcclear.ranks.schedule import Worker
    from hpcclear.results.checkpoint import Checkpoint
    from hpcclear.scene import Scene
    from hpcclear.scene.points import Points


Compiled = TypeVar("Compiled", bound="Worker")


def content_of(scene: "Scene") -> dict[str, Any]:
    """A scene as it travels to ranks. Its study is left out: they simulate, whatever for.

    Requests of the study for each sample become part of the numerics.
    """
    content = scene.resolved()
    content.pop("study", None)
    content["numerics"] |= {
        "responses": scene.responses_asked(),
        "impacts": scene.impacts_asked(),
        "levels": scene.bands(),
        "objective": scene.objective.name,
    }
    return content


def payload_of(scene: "Scene", points: "Points") -> dict[str, Any]:
    """What a rank needs to know before it gets points: plain content, small, the same everywhere."""
    from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES

    return {
        "scene": content_of(scene),
        "names": points.names,
        "paths": points.paths,
        "lanes": DEFAULT_LANES,
    }


_COMPILED: list[Mapping[str, Any]] = []
"""Payloads whose evaluators were made in this process before: small stages need not wait for ranks to meet again."""

_MOST_COMPILED = 8


class Judge:
    """A rank's worker: an evaluator whose records contain the requested objective; see `ranks.schedule.Worker`."""

    def __init__(self, evaluator: "Worker", objective: Objective) -> None:
        self._evaluator, self._objective = evaluator, objective
        self.lanes = evaluator.lanes
        self.submit = evaluator.submit

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""
        return self._evaluator.pending

    def advance(self, seconds: float) -> np.ndarray:
        """Work for about `seconds`; records of what finished meanwhile."""
        return asked(self._evaluator.advance(seconds), self._objective)


def make_evaluator(payload: Mapping[str, Any], ranks: Ranks) -> Judge:
    """A rank's worker."""
    from hpcclear.dynamics.evaluation import evaluator_of
    from hpcclear.scene import load_scene
    from hpcclear.scene.points import Points

    nothing = np.empty((0, len(payload["names"])))
    columns = Points(payload["names"], nothing, payload["paths"])
    scene = load_scene(payload["scene"], trust=True)
    evaluator = evaluator_of(scene, columns, payload["lanes"])
    # All ranks have made the same ones before, so all wait for each other or none does.
    if payload not in _COMPILED:
        first_compiled(evaluator, ranks)
        _COMPILED[:] = [*_COMPILED[1 - _MOST_COMPILED :], payload]
    return Judge(evaluator, scene.objective)


def first_compiled(worker: Compiled, ranks: Ranks) -> Compiled:
    """The worker, compiled by one rank of each node and loaded by the others."""
    ranks.first_on_node(lambda: worker.advance(0.0))  # without samples it only compiles
    return worker


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
    scene: "Scene",
    points: "Points",
    ranks: Ranks,
    checkpoint: "Checkpoint | None" = None,
    progress: Progress | None = None,
    *,
    stage: str = "samples",
    first: int = 0,
    maker: "Callable[[Mapping[str, Any], Ranks], Worker] | None" = None,
    record: np.dtype | None = None,
) -> np.ndarray:
    """Simulate a design on all ranks; call it on root.

    Parameters
    ----------
    points : Points
        Designs, SI.
    checkpoint : Checkpoint, optional
        Knows the samples finished earlier, and gets each new one; its names are those of `points`.
        When this raises, everything finished is on disk, unless the disk refused it twice.
    stage : str
        Name for reports and timing.
    first : int
        Number of the first point in the checkpoint, for designs that come one after the other.
    maker : function of a payload and the ranks, optional
        Makes a rank's worker; by default `make_evaluator`.
    record : dtype, optional
        Type of the records; by default that of the scene (`hpcclear.scene.record.record_of`).

    Returns
    -------
    structured ndarray of `record`, shape (n,)
        In the points' order; samples numbered from 0.

    Raises
    ------
    Stopped, RankFailed, InputError
        As `Ranks.run_points`.
    StorageError
        The disk refuses.
    """
    from hpcclear.scene.points import expanded
    from hpcclear.scene.record import record_of

    sent = expanded(
        scene.study, points
    )  # columns of rows of catalogues as the numbers they stand for
    record = record_of(scene) if record is None else record
    task = Task(stage, maker or make_evaluator, payload_of(scene, sent), record)
    if checkpoint is None:
        return ranks.run_points(task, sent.values, progress=progress)
    completed = recast(checkpoint.completed(first, len(points)), record)
    completed["sample"] -= first

    def take(records: np.ndarray) -> None:
        numbered = records.copy()
        numbered["sample"] += first
        checkpoint.add(numbered, points.values[records["sample"]])

    def save() -> None:
        with ranks.stage(stage), ranks.writing():
            checkpoint.flush()

    with saving(save):
        return ranks.run_points(
            task,
            sent.values,
            completed=completed,
            on_records=take,
            save=checkpoint.flush_when_due,
            progress=progress,
        )
