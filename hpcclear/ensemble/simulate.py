"""A design of any scene through the dynamics, on all ranks: what `sample` and `run` share.

The kernel, scenes and files are imported where they are used: inside the rank boundary, where an import
that fails on one rank ends them all.
"""

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.ranks.progress import Progress
from hpcclear.ranks.stopping import Stopped
from hpcclear.ranks.team import Maker, Ranks

if TYPE_CHECKING:
    from hpcclear.dynamics.evaluator import Evaluator
    from hpcclear.ensemble.compiling import Compiled
    from hpcclear.ensemble.parts import Summariser
    from hpcclear.results.checkpoint import Checkpoint
    from hpcclear.scene import Scene
    from hpcclear.scene.points import Points

KIND = "points"
"""The kind of stage that simulates designs; see `MAKERS`."""

PARTS = "parts"
"""The kind of stage whose ranks send sums of what they simulate."""

COMPILE = "compile"
"""The kind of stage that compiles ahead what a study needs."""


def payload_of(scene: "Scene", points: "Points", lanes: int | None = None) -> dict[str, Any]:
    """What a rank needs to know before it gets points: plain content, small, the same everywhere.

    The study is left out: ranks simulate, whatever for. What it asks of each sample goes into the numerics.
    """
    from hpcclear.dynamics.evaluator import DEFAULT_LANES

    lanes = DEFAULT_LANES if lanes is None else lanes
    content = scene.resolved()
    content.pop("study", None)
    content["numerics"]["responses"] = scene.responses_asked()
    return {"scene": content, "names": points.names, "paths": points.paths, "lanes": lanes}


def make_evaluator(payload: Mapping[str, Any], ranks: Ranks) -> "Evaluator":
    """A rank's worker; the kernel is compiled by one rank of each node and loaded by the others."""
    from hpcclear.dynamics.evaluator import Evaluator
    from hpcclear.scene import load_scene
    from hpcclear.scene.points import Points

    nothing = np.empty((0, len(payload["names"])))
    columns = Points(payload["names"], nothing, payload["paths"])
    evaluator = Evaluator(load_scene(payload["scene"]), columns, payload["lanes"])
    ranks.first_on_node(lambda: evaluator.advance(0.0))  # without samples it only compiles
    return evaluator


def _make_compiler(payload: Mapping[str, Any], ranks: Ranks) -> "Compiled":
    from hpcclear.ensemble.compiling import make_compiler

    return make_compiler(payload, ranks)


def _make_summariser(payload: Mapping[str, Any], ranks: Ranks) -> "Summariser":
    from hpcclear.ensemble.parts import make_summariser

    return make_summariser(payload, ranks)


MAKERS: Mapping[str, Maker] = {
    KIND: make_evaluator,
    COMPILE: _make_compiler,
    PARTS: _make_summariser,
}
"""For `hpcclear.ranks.boundary.run_on_ranks` and `hpcclear.ranks.boundary.alone`."""


def run_key(scene: "Scene", command: str, lanes: int | None = None) -> dict[str, str]:
    """What makes a run what it is, so that only the same run goes on from its results.

    The scene entry by entry, so that a message can name those that changed; besides, all that
    shapes the last bits of a result. The number of ranks is not among it.
    """
    from hpcclear.dynamics.evaluator import DEFAULT_LANES
    from hpcclear.results.dataset import provenance
    from hpcclear.scene.paths import flatten

    lanes = DEFAULT_LANES if lanes is None else lanes
    origin = provenance(scene.text, scene.hash)
    entries = {path: json.dumps(value) for path, value in flatten(scene.resolved())}
    made_by = {name: origin[name] for name in ("hpcclear_version", "versions", "processor")}
    return {"command": command, "lanes": str(lanes), **made_by, **entries}


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
) -> np.ndarray:
    """Simulate a design on all ranks; call it on root.

    Parameters
    ----------
    scene : Scene
    points : Points
        Designs, SI.
    ranks : Ranks
        Made with `MAKERS`.
    checkpoint : Checkpoint, optional
        Knows the samples finished earlier, and gets each new one; its names are those of `points`.
        When this raises, everything finished is on disk, unless the disk refused it twice.
    progress : Progress, optional
    stage : str
        Name for reports and timing.
    first : int
        Number of the first point in the checkpoint, for designs that come one after the other.

    Returns
    -------
    structured ndarray of `hpcclear.base.outcome.OUTCOME`, shape (n,)
        In the points' order; samples numbered from 0.

    Raises
    ------
    Stopped, RankFailed, InputError
        As `Ranks.run_points`.
    StorageError
        The disk refuses.
    """
    how: dict[str, Any] = {"stage": stage, "progress": progress}
    if checkpoint is None:
        return ranks.run_points(KIND, payload_of(scene, points), points.values, **how)
    completed = checkpoint.completed()
    inside = (completed["sample"] >= first) & (completed["sample"] < first + len(points))
    completed = completed[inside]
    completed["sample"] -= first

    def take(records: np.ndarray) -> None:
        numbered = records.copy()
        numbered["sample"] += first
        checkpoint.add(numbered, points.values[records["sample"]])

    def save() -> None:
        with ranks.stage(stage), ranks.writing():
            checkpoint.flush()

    how |= {"completed": completed, "on_records": take, "save": checkpoint.flush_when_due}
    with saving(save):
        return ranks.run_points(KIND, payload_of(scene, points), points.values, **how)
