"""What travels to ranks that simulate, and the worker that each makes of it.

The kernel, scenes and files are imported where they are used: inside the rank boundary, where an import
that fails on one rank ends them all.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeVar

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


def make_evaluator(payload: Mapping[str, Any], ranks: Ranks) -> "Judge":
    """A rank's worker."""
    from hpcclear.dynamics.evaluation import evaluator_of
    from hpcclear.dynamics.evaluation.evaluator import Judge
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
