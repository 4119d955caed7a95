"""Measures of impact and noise of one response: by revolution, and means with confidence intervals."""

from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import FIELDS, IMPACTS
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.recorded.steps import Steps
from hpcclear.dynamics.layout.views import Outcome
from hpcclear.dynamics.stepping import record as rec
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import Scene
from hpcclear.statistics import spectra


def _columns(first: int, size: int = at.MAX_JOINTS) -> slice:
    start = int(np.flatnonzero(first == rec.MEASURES)[0])
    return slice(start, start + size)


@dataclass
class Turns:
    """Integrals of the measures at the ends of revolutions, from steps as they come, and when forces are largest.

    The largest forces count after so many `transient` revolutions.
    """

    transient: int = 0
    largest: Array = field(default_factory=lambda: np.zeros(at.MAX_JOINTS))
    """Largest mean square of each contact force over a step, N^2."""
    when: Array = field(default_factory=lambda: np.full(at.MAX_JOINTS, np.nan))
    """Middle of that step, s."""
    ends: dict[int, tuple[float, Array]] = field(default_factory=dict)
    """Time and integrals since the start, by the revolutions finished."""

    def take(self, steps: Steps) -> None:
        """Note the revolutions that end between rows of these steps, and the steps of largest force."""
        length = np.diff(steps.time)
        squares = np.diff(steps.measures[:, _columns(at.FORCE_SQUARES)], axis=0)
        counts = (steps.revolution[1:] >= self.transient) & (length > 0.0)
        mean = np.where(counts, 1.0 / np.where(counts, length, 1.0), 0.0)[:, None] * squares
        if len(mean):
            step = mean.argmax(axis=0)
            most = mean[step, np.arange(mean.shape[1])]
            self.when = np.where(
                most > self.largest, 0.5 * (steps.time[1:] + steps.time[:-1])[step], self.when
            )
            self.largest = np.maximum(most, self.largest)
        closing = np.flatnonzero(np.diff(steps.revolution) > 0)
        for k in closing:
            self.ends[int(steps.revolution[k]) + 1] = (steps.time[k], steps.measures[k].copy())

    def finish(self, steps: Steps) -> None:
        """Note that the last revolution ends with the last of these steps."""
        last = int(steps.revolution[-1]) + 1
        self.ends[last] = (steps.time[-1], steps.measures[-1].copy())

    def averaged(self, transient: int) -> tuple[Array, Array]:
        """Lengths (r,) of the revolutions after the transient, and integrals over them (r, measures)."""
        numbers = [n for n in sorted(self.ends) if n >= transient]
        start = (0.0, np.zeros(len(rec.MEASURES)))
        ends = [self.ends.get(transient, start), *(self.ends[n] for n in numbers if n > transient)]
        times = np.array([time for time, _ in ends])
        return np.diff(times), np.diff(np.array([one for _, one in ends]), axis=0)


class Revolutions:
    """Means over each revolution by the names of `Outcome`, (r, joints) or (r,), as formulas of `FIELDS` read them.

    Lengths (r,) and integrals (r, measures) of revolutions, the angle in rad of one, and how many joints there are.
    """

    def __init__(self, periods: Array, integrals: Array, cycle: float, joints: int) -> None:
        self.period, self.cycle = periods, np.full(len(periods), cycle)
        self._integrals, self._joints = integrals, joints

    def in_revolution(self, name: str) -> Array:
        """Integral of a rate over each revolution."""
        column = vars(Outcome)[name]
        rate = at.INTEGRATED[column.first - Outcome.mean].rate
        size = self._joints if column.size == at.MAX_JOINTS else column.size
        found: Array = self._integrals[:, _columns(rate, size)]
        return found[:, 0] if column.size == 1 else found

    def __getattr__(self, name: str) -> Array:
        found = self.in_revolution(name)
        return found / (self.period if found.ndim == 1 else self.period[:, None])


def measured_of(
    scene: Scene, problem: Problem, periods: Array, integrals: Array
) -> dict[str, Array]:
    """Measures of impact and noise as the file has them: of each revolution (r, joints), of all of them (joints,), and
    half-widths.

    Lengths (r,) and integrals (r, measures) of revolutions. The force on the frame is left out where bodies bend.
    """
    cycle, joints = abs(problem.cycle) or at.TURN, len(scene.joint_labels)
    each = Revolutions(periods, integrals, cycle, joints)
    means = periods.mean(keepdims=True), integrals.mean(axis=0, keepdims=True)
    together = Revolutions(*means, cycle, joints)
    result = {}
    for name in IMPACTS:
        if scene.modes and name == "rms_frame_force":
            continue
        values = FIELDS[name].values(each)
        result[f"{name}_by_revolution"] = values
        result[name] = FIELDS[name].values(together)[0]
        result[f"{name}_limit"] = spectra.half_width(values)
    return result
