"""Single responses of variants of a scene, on all ranks: of each what it boils down to."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics.response import simulate
from hpcclear.ensemble.simulate import content_of
from hpcclear.ranks.team import Ranks, Task
from hpcclear.scene import Scene, load_scene


def responses_of(
    scene: Scene,
    variants: Sequence[Mapping[str, Any]],
    evaluate: Callable[[Scene, xr.Dataset], Array],
    shape: tuple[int, ...],
    ranks: Ranks,
    stage: str,
    copies: int = 1,
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
    }
    rows = np.indices((len(variants), copies)).reshape(2, -1).T.astype(float)
    records = ranks.run_points(Task(stage, Responses, payload, dtype), rows)
    return records["values"].reshape(len(variants), copies, *shape)


class Responses:
    """A rank's worker; see `hpcclear.ranks.schedule.Worker`."""

    lanes = 2  # one under way, one in stock: who hands out may be at one of its own

    def __init__(self, payload: Mapping[str, Any], ranks: Ranks) -> None:
        self._scene = load_scene(payload["scene"], trust=True)
        self._variants, self._evaluate = payload["variants"], payload["evaluate"]
        self._dtype = payload["dtype"]
        self._queue: list[tuple[int, int, int]] = []

    @property
    def pending(self) -> int:
        """Responses submitted and not finished."""
        return len(self._queue)

    def submit(self, index: Integers, points: Array) -> None:
        """Queue responses (m,), rows of variant and copy (m, 2)."""
        variants, copies = points.astype(int).T.tolist()
        self._queue += zip(index.tolist(), variants, copies, strict=True)

    def advance(self, seconds: float) -> np.ndarray:
        """The record of the next one, shape (1,), however long it takes; (0,) if there is none."""
        records = np.zeros(min(len(self._queue), 1), self._dtype)
        for record in records:
            record["sample"], variant, copy = self._queue.pop(0)
            scene = self._scene.with_(self._variants[variant])
            response = simulate(scene, copy=copy, checked=False)
            record["values"] = self._evaluate(scene, response).ravel()
        return records
