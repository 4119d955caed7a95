"""Samples without a coordinate to integrate: their outcomes follow from their parameters."""

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Outcome, Start
from hpcclear.dynamics.stepping.problem import Problem


class PrescribedSamples:
    """Stands in for `lanes.Lanes` where no coordinate is left to integrate: every sample is done when queued."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        nothing = np.zeros((0, problem.parameter_rows)), Start.at_rest(0).rows
        self._none = np.zeros(0, np.int64), *nothing
        self._queued = [self._none]  # labels, parameters, starts

    @property
    def pending(self) -> int:
        """Samples queued and not collected."""
        return sum(len(labels) for labels, _, _ in self._queued)

    def queue(self, par: Array, start: Start, labels: Integers) -> None:
        """Add samples: parameters (m, PARAMETERS), m starts, of which only failures count, labels (m,)."""
        self._queued.append((labels, par, start.rows))

    def advance(self, seconds: float) -> None:
        """Nothing takes time."""

    def collect(self) -> tuple[Integers, Outcome, Array]:
        """Labels (m,), outcomes and parameters (m, PARAMETERS) since the last call."""
        labels, par, starts = map(np.concatenate, zip(*self._queued, strict=True))
        self._queued = [self._none]
        rows, problem = np.zeros((len(par), Outcome.size)), self._problem
        revolutions = problem.transient + problem.averaged
        rows[:, Outcome.spread] = 0.0 if problem.averaged > 1 else np.nan
        rows[:, Outcome.revolutions] = revolutions
        rows[:, Outcome.time] = revolutions * par[:, at.PERIOD]
        works = Outcome.total + at.WORKS
        rows[:, works : works + 4] = np.nan  # no gap, contact or work, which only a response has
        held = slice(Outcome.peak_moment, Outcome.peak_acceleration + 1)
        rows[:, held] = par[:, at.HELD_MOMENT : at.HELD_PEAK + 1]
        return labels, problem.marked(Outcome(rows), par, Start(starts)), par
