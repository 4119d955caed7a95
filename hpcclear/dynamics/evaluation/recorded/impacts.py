"""Measures of impact and noise of one response: by revolution, means with confidence intervals, and spectra of forces.

Spectra are taken while steps come, on instants so dense that impacts are resolved.
"""

import itertools
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import FIELDS, IMPACTS
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.recorded.steps import Piece, Recorded, Steps, seen_between
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
            middle = 0.5 * (steps.time[1:] + steps.time[:-1])
            self.when = np.where(most > self.largest, middle[step], self.when)
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


LEAST = 720  # instants a revolution by which forces are taken densely at least


class Spectra:
    """Mean squares of the orders of contact forces, and of the force on the frame, in the averaged revolutions.

    `count`: instants a revolution by which the highest order is chosen (`hpcclear.statistics.spectra.highest`).
    """

    def __init__(self, scene: Scene, sample: Recorded, count: int) -> None:
        self._sample, self._count = sample, count
        self._joints, self._rigid = len(scene.joint_labels), not scene.modes
        self._dense = spectra.OVERSAMPLING * max(count, LEAST)
        self._last: deque[Array] = deque(maxlen=spectra.WINDOW)
        self._periods: list[float] = []
        self._squares: list[Array] = []

    def take(self, piece: Piece) -> None:
        """Take in the revolutions of a piece, which end with its rows."""
        steps = piece.steps
        closing = np.flatnonzero(np.diff(steps.revolution) > 0)
        ends = np.unique([0, *closing, len(steps.time) - 1])
        for first, last in itertools.pairwise(ends):
            if steps.revolution[last] >= self._sample.problem.transient:
                self._add(piece, steps.time[first], steps.time[last])

    def _add(self, piece: Piece, start: float, end: float) -> None:
        """Take in one revolution."""
        steps = piece.steps
        times = np.linspace(start, end, self._dense, endpoint=False)
        k = np.clip(np.searchsorted(steps.time, times, side="right") - 1, 0, len(steps.time) - 2)
        rates = seen_between(self._sample, Piece(times, steps, k)).rates
        frame = [rates.frame_x[:, None], rates.frame_y[:, None]] if self._rigid else []
        self._last.append(np.hstack([rates.force[:, : self._joints], *frame]))
        self._periods.append(end - start)
        if len(self._last) == spectra.WINDOW:
            self._squares.append(self._window())

    def _window(self) -> Array:
        """Orders of the last revolutions, (orders, joints), and a column more for the force on the frame."""
        found = spectra.orders(np.stack(self._last))[: spectra.highest(self._count)]
        frame = found[:, self._joints :].sum(axis=1, keepdims=True)
        columns = found[:, : self._joints], *([frame] if self._rigid else [])
        return np.hstack(columns)

    def _found(self) -> tuple[dict[str, Array], Array]:
        """Mean squares (windows, orders) of the frame, (windows, orders, joints) of contacts; periods (windows,)."""
        if not self._squares:
            self._squares.append(self._window())
        squares = np.stack(self._squares)
        size = min(len(self._periods), spectra.WINDOW)
        periods = np.convolve(self._periods, np.full(size, 1.0 / size), "valid")
        found = {"contact_force": squares[:, :, : self._joints]}
        if self._rigid:
            found["frame_force"] = squares[:, :, self._joints]
        return found, periods

    def measured(self) -> dict[str, Array]:
        """Order spectra (orders,) and third-octave levels (bands,), of contacts with a column a joint, and middles of bands."""
        forces, periods = self._found()
        most = len(next(iter(forces.values()))[0])
        centres = spectra.band_centres(1.0 / periods.max(), most / periods.max())
        found: dict[str, Array] = {"order": np.arange(1.0, most + 1), "band": centres}
        for name, squares in forces.items():
            found[f"{name}_orders"] = np.sqrt(squares.mean(axis=0))
        for name, levels in self._levels(forces, periods, centres).items():
            ends = zip(("", "_lower", "_upper"), levels, strict=True)
            found |= {f"{name}_level{end}": one for end, one in ends}
        return found

    def levels(self, centres: Array) -> dict[str, Array]:
        """Levels in bands with these middles and their half-widths, dB, by their names in a record: of the frame (bands,), of
        contacts (joints, bands)."""
        found = {}
        for name, ends in self._levels(*self._found(), centres).items():
            level, _, upper = ends
            found[f"{name}_level"], found[f"{name}_level_limit"] = level.T, (upper - level).T
        return found

    @staticmethod
    def _levels(
        forces: dict[str, Array], periods: Array, centres: Array
    ) -> dict[str, tuple[Array, Array, Array]]:
        """Levels and the ends of their intervals, (bands,) or (bands, joints)."""
        found = {}
        for name, squares in forces.items():
            flat = squares.reshape(*squares.shape[:2], -1)
            bands = [spectra.in_bands(flat[..., j], periods, centres) for j in range(flat.shape[2])]
            stacked = np.stack(bands, axis=-1)
            found[name] = spectra.levels(stacked.reshape(*stacked.shape[:2], *squares.shape[2:]))
        return found
