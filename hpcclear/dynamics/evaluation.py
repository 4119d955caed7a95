"""Points to records, here and now or as a stream: by the evaluator that the scene calls for."""

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.base.outcome import OUTCOME
from hpcclear.dynamics.evaluator import DEFAULT_LANES, Evaluator
from hpcclear.dynamics.steady.evaluator import SteadyEvaluator
from hpcclear.scene import Scene
from hpcclear.scene.points import Points


def evaluator_of(
    scene: Scene, columns: Points, lanes: int = DEFAULT_LANES
) -> Evaluator | SteadyEvaluator:
    """The steady mean to a named error, or the stretch of revolutions that the scene names; arguments and errors are those of
    either.
    """
    steady = scene.numerics.target_error is not None and scene.clearance_joints()
    return (SteadyEvaluator if steady else Evaluator)(scene, columns, lanes)


def evaluate_records(scene: Scene, points: Points, lanes: int = DEFAULT_LANES) -> Records:
    """Simulate all points here and now; records in the points' order (n,)."""
    evaluator = evaluator_of(scene, points, lanes)
    evaluator.submit(np.arange(len(points)), points.values)
    done = []
    while evaluator.pending:
        done.append(evaluator.advance(0.2))
    records = np.concatenate(done) if done else np.zeros(0, OUTCOME)
    return records[np.argsort(records["sample"], kind="stable")]
