"""Designs of a study simulated in this process, on scatter of one's own choice: what the judges of a study share."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from hpcclear.base.objectives import asked
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.ranks.boundary import alone
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.streams import generator
from hpcclear.study.simulations import Simulations


class Here(Simulations):
    """Simulations without ranks or files."""

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene, alone(), None)  # type: ignore[arg-type]

    def _records(self, points: Points, stage: str) -> np.ndarray:
        """Outcome records of designs, in their order."""
        return asked(evaluate_records(self.scene, points), self.scene.objective)


def run_of(scene: Scene) -> Any:
    """As much of a run as `hpcclear.study.truth` needs."""
    study = scene.required_study
    rng = partial(generator, study.seed)
    return SimpleNamespace(scene=scene, study=study, simulations=Here(scene), rng=rng)
