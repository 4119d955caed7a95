"""Which stage of how many a study is at, for those who wait."""

import sys
import time

from hpcclear.base.plain import plain
from hpcclear.ranks.progress import duration
from hpcclear.scene import Scene
from hpcclear.study import paper

_WORDS = {
    "wear": "wear over the service life",
    "effects": "effect screening",
    "sensitivity": "sensitivity analysis",
    "kriging": "surrogate models",
    "optimisation": "search on the surrogate",
    "check": "simulation of its designs",
    "infill": "adaptive refinement of the Pareto front",
    "verification": "verification of the best designs",
    "lives": "wear of the baseline and the best designs",
    "responses": "responses of the baseline and the best designs",
    "readings": "published designs under alternative interpretations",
}
"""What each stage does, by its name without the number of a round."""

_SEARCH = ("optimisation", "check", "infill")
"""Stages that look for the front, the last one as often as it takes: one of those that are counted."""


class Stages:
    """Tells each stage of a study of this scene as it begins, on standard error."""

    def __init__(self, scene: Scene) -> None:
        steps = ["kriging", "optimisation", "verification", "responses"]
        steps = (["sensitivity"] if scene.required_study.groups else []) + steps
        steps = (["effects"] if scene.required_study.certificate is not None else []) + steps
        if scene.required_study.worn:
            steps = ["wear", *steps[:-1], "lives", steps[-1]]
        self._steps = steps + (["readings"] if "readings.nc" in paper.files(scene) else [])
        self._began = time.monotonic()

    def announced(self, name: str) -> None:
        """Write which stage begins, and how long the study has taken so far."""
        kind, _, round_ = name.partition("-")
        step = "optimisation" if kind in _SEARCH else kind
        if step not in self._steps:
            return
        number = self._steps.index(step) + 1
        again = f", round {int(round_) + 1}" if kind == "infill" else ""
        spent = duration(time.monotonic() - self._began)
        text = f"stage {number} of {len(self._steps)}: {_WORDS[kind]}{again} ({spent} so far)"
        print(plain(text), file=sys.stderr, flush=True)

    @staticmethod
    def silent(name: str) -> None:
        """Say nothing."""
