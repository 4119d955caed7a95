"""Samples of scenes without clearance whose drives prescribe everything: nothing is integrated."""

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.problem import Problem
from hpcclear.dynamics.views import Outcome, Start


class PrescribedSamples:
    """Stands in for `lanes.Lanes` where no coordinate is left to integrate: every sample is done when queued."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._labels: list[Integers] = []
        self._par: list[Array] = []
        self._starts: list[Array] = []

    @property
    def pending(self) -> int:
        """Samples queued and not collected."""
        return sum(map(len, self._labels))

    def queue(self, par: Array, start: Start, labels: Integers) -> None:
        """Add samples: parameters (m, PARAMETERS), m starts, of which only failures count, labels (m,)."""
        self._par.append(par)
        self._starts.append(start.rows)
        self._labels.append(labels)

    def advance(self, seconds: float) -> None:
        """Nothing takes time."""

    def collect(self) -> tuple[Integers, Outcome, Array]:
        """Labels (m,), outcomes and parameters (m, PARAMETERS) since the last call."""
        labels = np.concatenate([np.zeros(0, np.int64), *self._labels])
        par = np.concatenate([np.zeros((0, self._problem.parameter_rows)), *self._par])
        start = Start(np.concatenate([Start.at_rest(0).rows, *self._starts]))
        self._labels, self._par, self._starts = [], [], []
        return labels, self.run(par, start), par

    def run(self, par: Array, start: Start) -> Outcome:
        """Outcomes of samples, in their order: parameters (m, PARAMETERS) and m starts, of which only failures count."""
        return self._problem.marked(Outcome(_outcomes(self._problem, par)), par, start)


def _outcomes(problem: Problem, par: Array) -> Array:
    """Rows of outcomes (m, OUT) of parameters (m, PARAMETERS): no gap, contact or work, which only a response has."""
    rows = np.zeros((len(par), at.OUT))
    revolutions = problem.transient + problem.averaged
    rows[:, at.OUT_SPREAD] = 0.0 if problem.averaged > 1 else np.nan
    rows[:, at.OUT_REVOLUTIONS] = revolutions
    rows[:, at.OUT_TIME] = revolutions * par[:, at.PERIOD]
    works = at.OUT_TOTAL + at.WORKS
    rows[:, works : works + 4] = np.nan
    known = (
        (at.OUT_MOMENT, at.HELD_MOMENT),
        (at.OUT_ACCELERATION, at.HELD_DEVIATION),
        (at.OUT_FOLLOWED, at.HELD_PEAK),
    )
    for row, of_sample in known:
        rows[:, row] = par[:, of_sample]
    return rows
