"""Single responses of variants of a scene, on all ranks: of each what it boils down to."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics.response import simulate_together
from hpcclear.ensemble.simulate import content_of
from hpcclear.ranks import leading
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks
from hpcclear.scene import Scene, load_scene

TOGETHER = 8
"""Responses in a batch where many are wanted and their memory is small."""


def responses_of(
    scene: Scene,
    variants: Sequence[Mapping[str, Any]],
    evaluate: Callable[[Scene, xr.Dataset], Array],
    shape: tuple[int, ...],
    ranks: Ranks,
    stage: str,
    copies: int = 1,
    together: int = 1,
) -> Array:
    """What each response comes to, NaN where `evaluate` returns it; call it on root.

    Parameters
    ----------
    scene : Scene
        Its study is left out; the objective is its own.
    variants : sequence of mapping
        Entries that are other ones, by their paths.
    evaluate : callable
        A function of a module, of a variant and its response: values of `shape`.
    shape : tuple of int
    stage : str
        Name for reports and timing.
    copies : int
        Starts of each variant; all but the first are perturbed.
    together : int
        Responses in a batch, which share the memory of a rank; results do not depend on it.

    Returns
    -------
    ndarray, shape (variants, copies, *shape)

    Raises
    ------
    Stopped, RankFailed, InputError
    """
    dtype = np.dtype([("sample", "i8"), ("values", "f8", (int(np.prod(shape)),))])
    payload = {
        "scene": content_of(scene),
        "variants": list(variants),
        "evaluate": evaluate,
        "dtype": dtype,
        "together": together,
    }
    rows = np.indices((len(variants), copies)).reshape(2, -1).T.astype(float)
    records = leading.run_points(ranks, Task(stage, Responses, payload, dtype), rows)
    return records["values"].reshape(len(variants), copies, *shape)


class Responses:
    """A rank's worker; see `hpcclear.ranks.schedule.Worker`."""

    def __init__(self, payload: Mapping[str, Any], ranks: Ranks) -> None:
        self._scene = load_scene(payload["scene"], trust=True)
        self._variants, self._evaluate = payload["variants"], payload["evaluate"]
        self._dtype, self._together = payload["dtype"], payload["together"]
        # as many under way, and one in stock: who hands out may be at one of its own
        self.lanes = 1 + self._together
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
            taken, self._queue = self._queue[: self._together], self._queue[self._together :]
            self._unfinished, self._begun = len(taken), self._records(taken)
        if not self._unfinished:
            return np.zeros(0, self._dtype)
        self._unfinished -= 1
        return next(self._begun)

    def _records(self, taken: Sequence[tuple[int, int, int]]) -> Iterator[np.ndarray]:
        """Yield records (1,) of responses, simulated in one batch."""
        scenes = [self._scene.with_(self._variants[variant]) for _, variant, _ in taken]
        for k, response in simulate_together(scenes, [copy for _, _, copy in taken]):
            yield self._record(taken[k][0], scenes[k], response)

    def _record(self, sample: int, scene: Scene, response: xr.Dataset) -> np.ndarray:
        """The record (1,) of a response."""
        records = np.zeros(1, self._dtype)
        records["sample"], records["values"] = sample, self._evaluate(scene, response).ravel()
        return records
