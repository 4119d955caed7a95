"""Points to outcome records, in this process: what every rank runs, and what a script calls without MPI."""

import numpy as np
from numpy.typing import NDArray

from .kernel import layout as at
from .kernel.lanes import Lanes
from .lowering import parameters, problem_of, start_states
from .scene import Scene
from .scene.points import Points
from .status import OUTCOME, Flag, Status

DEFAULT_LANES = 32
"""Lanes of an ensemble; at least twice the vector length, or the compiler leaves them scalar."""


class Evaluator:
    """Simulates points of one scene as a stream: submit some, advance, submit more while others run.

    Parameters
    ----------
    scene : Scene
    columns : Points
        Points (perhaps none) whose names and paths all submitted values share.
    lanes : int, optional
        Samples in lockstep.

    Raises
    ------
    InputError
        If the scene asks for what the kernel cannot do.
    """

    def __init__(self, scene: Scene, columns: Points, lanes: int = DEFAULT_LANES) -> None:
        self.scene = scene
        self.lanes = lanes
        self._columns = columns
        self._lanes = Lanes(problem_of(scene), lanes)

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""
        return self._lanes.pending

    def submit(self, index: NDArray[np.int64], points: NDArray[np.float64]) -> None:
        """Queue samples: indices (m,), values (m, d) in the columns' order, SI."""
        par = parameters(self.scene, Points(self._columns.names, points, self._columns.paths))
        self._lanes.queue(par, start_states(self.scene, par), np.asarray(index, np.int64))

    def advance(self, seconds: float) -> NDArray[np.void]:
        """Work for about `seconds`; return the records (`status.OUTCOME`) of what finished meanwhile."""
        self._lanes.advance(seconds)
        labels, rows = self._lanes.collect()
        return outcome_records(labels, rows)


def outcome_records(labels: NDArray[np.int64], rows: NDArray[np.float64]) -> NDArray[np.void]:
    """Kernel outcome rows (m, OUT) as records: numbers of failed samples are NaN."""
    records = np.zeros(len(labels), OUTCOME)
    records["sample"] = labels
    records["status"] = rows[:, at.OUT_STATUS]
    records["rhs_evaluations"] = rows[:, at.OUT_EVALUATIONS]
    failed = records["status"] != Status.OK
    records["objective"] = rows[:, at.OUT_OBJECTIVE]
    records["objective_spread"] = rows[:, at.OUT_SPREAD]
    records["objective_uncertainty"] = np.nan
    records["mean_gap"] = rows[:, [at.OUT_GAP_12, at.OUT_GAP_23]]
    records["peak_contact_force"] = rows[:, [at.OUT_PEAK_12, at.OUT_PEAK_23]]
    for name in ("objective", "objective_spread", "mean_gap", "peak_contact_force"):
        records[name][failed] = np.nan
    latched = rows[:, [at.OUT_LATCHED_12, at.OUT_LATCHED_23]] == 1.0
    records["latched"] = latched & ~failed[:, None]
    records["flags"] = np.where(latched.any(axis=1) & ~failed, int(Flag.LATCHED), 0)
    return records


def evaluate_records(scene: Scene, points: Points, lanes: int = DEFAULT_LANES) -> NDArray[np.void]:
    """Simulate all points here and now; records in the points' order (n,)."""
    evaluator = Evaluator(scene, points, lanes)
    evaluator.submit(np.arange(len(points)), points.values)
    done = []
    while evaluator.pending:
        done.append(evaluator.advance(0.2))
    records = np.concatenate(done) if done else np.zeros(0, OUTCOME)
    return records[np.argsort(records["sample"], kind="stable")]
