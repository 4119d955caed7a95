"""What travels to ranks that simulate, and the worker that each makes of it.

The kernel, scenes and files are imported where they are used: inside the rank boundary, where an import
that fails on one rank ends them all.
"""

from collections import deque
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from hpcclear.ranks.team import Ranks

if TYPE_CHECKING:
    from hpcclear.dynamics.evaluation.evaluator import Judge
    from hpcclear.ranks.schedule import Worker
    from hpcclear.scene import Scene
    from hpcclear.scene.points import Points


Compiled = TypeVar("Compiled", bound="Worker")


def content_of(scene: "Scene") -> dict[str, Any]:
    """A scene as it travels to ranks. Its study is left out: they simulate, whatever for.

    Requests of the study for each sample become part of the numerics.
    """
    content = scene.resolved()
    content.pop("study", None)
    content["numerics"] |= {"responses": scene.responses_asked(), "impacts": scene.impacts_asked()}
    content["numerics"] |= {"levels": scene.bands(), "objective": scene.objective.name}
    return content


class Payload(NamedTuple):
    """What a rank needs to know before it gets points: plain content, small, the same everywhere."""

    content: dict[str, Any]
    """Of a scene, as of `content_of`."""
    names: tuple[str, ...]
    paths: tuple[tuple[str, ...], ...]
    """names and paths: of the columns of points."""
    lanes: int

    @property
    def scene(self) -> "Scene":
        """The scene on a rank."""
        from hpcclear.scene import load_scene

        return load_scene(self.content, trust=True)

    @property
    def columns(self) -> "Points":
        """The columns of points, without rows."""
        from hpcclear.scene.points import Points

        return Points(self.names, np.empty((0, len(self.names))), self.paths)


def payload_of(scene: "Scene", points: "Points") -> Payload:
    """What travels to ranks that simulate such points of a scene."""
    from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES

    return Payload(content_of(scene), points.names, points.paths, DEFAULT_LANES)


_COMPILED = deque[Payload](maxlen=8)
"""Payloads whose evaluators were made in this process before: small stages need not wait for ranks to meet again."""


def make_evaluator(payload: Payload, ranks: Ranks) -> "Judge":
    """A rank's worker."""
    from hpcclear.dynamics.evaluation import evaluator_of
    from hpcclear.dynamics.evaluation.evaluator import Judge

    scene = payload.scene
    evaluator = evaluator_of(scene, payload.columns, payload.lanes)
    # All ranks have made the same ones before, so all wait for each other or none does.
    if payload not in _COMPILED:
        first_compiled(evaluator, ranks)
        _COMPILED.append(payload)
    return Judge(evaluator, scene.objective)


def first_compiled(worker: Compiled, ranks: Ranks) -> Compiled:
    """The worker, compiled by one rank of each node and loaded by the others."""
    ranks.first_on_node(lambda: worker.advance(0.0))  # without samples it only compiles
    return worker
