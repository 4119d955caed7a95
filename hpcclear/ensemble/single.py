"""Single responses of variants of a scene, on all ranks: of each what it boils down to."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics.response import simulate_together
from hpcclear.ensemble.session import saving
from hpcclear.ensemble.simulate import content_of
from hpcclear.ranks import leading
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks
from hpcclear.results.checkpoint import Checkpoint
from hpcclear.results.content import Results
from hpcclear.scene import Scene, load_scene
from hpcclear.scene.fields import Content

SHORTEST = {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 1}
"""Entries of a scene whose response is one revolution: for names and units of its series, or to compile."""

TOGETHER = 8
"""Responses in a batch, which share the memory of a rank; results do not depend on it."""


def responses_of(
    scene: Scene,
    variants: Sequence[Mapping[str, object]],
    evaluate: Callable[[Scene, Results], Array],
    shape: tuple[int, ...],
    ranks: Ranks,
    stage: str,
    copies: int = 1,
    checkpoint: Checkpoint | None = None,
    kept: str = "",
) -> Array:
    """What each response comes to (variants, copies, *shape), NaN where `evaluate` returns it; call it on root.

    A variant is what is other in the scene, by paths; the study is left out. `evaluate`: a function of a module, of a variant
    and its response, which returns values of `shape`. `copies`: starts of each variant; all but the first are perturbed.
    The checkpoint has those that were finished earlier, and gets each new one as its stage `kept`, by default `stage`, the
    name for reports and timing.
    Raises Stopped, RankFailed, InputError. Raises StorageError: the disk refuses a checkpoint.
    """
    dtype = np.dtype([("sample", "i8"), ("values", "f8", (int(np.prod(shape)),))])
    payload = ResponsesPayload(content_of(scene), variants, evaluate, dtype)
    rows = np.indices((len(variants), copies)).reshape(2, -1).T.astype(float)
    task = Task(stage, Responses, payload, dtype)
    if checkpoint is None:
        records = leading.run_points(ranks, task, rows)
    else:
        keeper = _Keeper(checkpoint, kept or stage, dtype)
        run = partial(leading.run_points, ranks, task, rows, completed=keeper.records)
        with saving(keeper.flush):
            records = run(on_records=keeper.take, save=keeper.flush_when_due)
    return records["values"].reshape(len(variants), copies, *shape)


class _Keeper:
    """Keeps finished records in a checkpoint, as a stage that is written again with each save."""

    def __init__(self, checkpoint: Checkpoint, name: str, dtype: np.dtype) -> None:
        self._checkpoint, self._name = checkpoint, name
        self._saved_at, self._new = time.monotonic(), False
        known = checkpoint.load_stage(name) or {key: np.zeros(0) for key in dtype.names or ()}
        self.records = np.zeros(len(known["sample"]), dtype)
        for key in dtype.names or ():
            self.records[key] = known[key].reshape(self.records[key].shape)

    def take(self, records: np.ndarray) -> None:
        """Take new ones."""
        self.records, self._new = np.concatenate([self.records, records]), True

    def flush_when_due(self) -> None:
        """Save what is new when the interval is over; raises as `flush`."""
        if time.monotonic() - self._saved_at >= self._checkpoint.interval:
            self.flush()

    def flush(self) -> None:
        """Save what is new; raises as `Checkpoint.save_stage`."""
        if self._new:
            data = {key: self.records[key] for key in self.records.dtype.names or ()}
            self._checkpoint.save_stage(self._name, data)
            self._saved_at, self._new = time.monotonic(), False


class ResponsesPayload(NamedTuple):
    """What a rank needs to know of responses, as `responses_of` has it."""

    content: Content
    variants: Sequence[Mapping[str, object]]
    evaluate: Callable[[Scene, Results], Array]
    dtype: np.dtype


class Responses:
    """A rank's worker; see `hpcclear.ranks.schedule.Worker`."""

    def __init__(self, payload: ResponsesPayload, ranks: Ranks) -> None:
        content, self._variants, self._evaluate, self._dtype = payload
        self._scene = load_scene(content, trust=True)
        # as many under way, and one in stock: who hands out may be at one of its own
        self.lanes = 1 + TOGETHER
        self._queue: list[tuple[int, int, int]] = []
        self._begun: Iterator[np.ndarray] = iter(())
        self._unfinished = 0

    @property
    def pending(self) -> int:
        """Responses submitted and not finished."""
        return len(self._queue) + self._unfinished

    def submit(self, index: Integers, points: Array) -> None:
        """Queue responses (m,), rows of variant and copy (m, 2)."""
        variants, copies = points.astype(int).T.tolist()
        self._queue += zip(index.tolist(), variants, copies, strict=True)

    def advance(self, seconds: float) -> np.ndarray:
        """The record of the next one, shape (1,), however long it takes; (0,) if there is none."""
        if not self._unfinished and self._queue:
            taken, self._queue = self._queue[:TOGETHER], self._queue[TOGETHER:]
            self._unfinished, self._begun = len(taken), self._records(taken)
        if not self._unfinished:
            return np.zeros(0, self._dtype)
        self._unfinished -= 1
        return next(self._begun)

    def _records(self, taken: Sequence[tuple[int, int, int]]) -> Iterator[np.ndarray]:
        """Yield records (1,) of responses, simulated in one batch."""
        made = {
            k: self._scene.with_(self._variants[k]) for k in {variant for _, variant, _ in taken}
        }
        scenes = [made[variant] for _, variant, _ in taken]
        for k, response in simulate_together(scenes, [copy for _, _, copy in taken]):
            record, values = np.zeros(1, self._dtype), self._evaluate(scenes[k], response)
            record["sample"], record["values"] = taken[k][0], values.ravel()
            yield record
