"""Points to records, here and now or as a stream: by the evaluator that the scene calls for."""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES, Evaluator
from hpcclear.dynamics.evaluation.recorded.sounding import SoundingEvaluator
from hpcclear.dynamics.evaluation.steady import mapping
from hpcclear.dynamics.evaluation.steady.evaluator import SteadyEvaluator
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.scene import record_of


def evaluator_of(
    scene: Scene, columns: Points, lanes: int = DEFAULT_LANES, perturbations: Sequence[int] = (), mapped: bool = False
) -> Evaluator | SteadyEvaluator | SoundingEvaluator:  # fmt: skip
    """The steady mean to a named error, or the segment of revolutions that the scene names, with force levels where it requires
    them; `mapped`: the motion, as a map judges it. Further arguments and errors are those of these.
    """
    if mapped:
        return SteadyEvaluator(scene, columns, lanes, mapping.mapped)
    if scene.numerics.target_error is not None and scene.clearance_joints():
        return SteadyEvaluator(scene, columns, lanes)
    if scene.bands():
        return SoundingEvaluator(scene, columns, lanes, perturbations)
    return Evaluator(scene, columns, lanes, perturbations)


def evaluate_records(
    scene: Scene, points: Points, lanes: int = DEFAULT_LANES, perturbations: Sequence[int] = (), mapped: bool = False
) -> Records:  # fmt: skip
    """Simulate all points at once, with replicas (`Evaluator`) or as a map if requested; records in the points' order (n,)."""
    evaluator = evaluator_of(scene, points, lanes, perturbations, mapped)
    evaluator.submit(np.arange(len(points)), points.values)
    done = []
    while evaluator.pending:
        done.append(evaluator.advance(0.2))
    records = np.concatenate(done) if done else np.zeros(0, record_of(scene, mapped))
    return records[np.argsort(records["sample"], kind="stable")]
