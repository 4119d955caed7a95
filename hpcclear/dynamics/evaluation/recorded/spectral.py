"""Spectra of the forces of one recorded sample: taken while its steps come, on instants so dense that impacts are resolved."""

import itertools
from collections import deque

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics.evaluation.recorded.steps import Piece, Recorded, seen_between
from hpcclear.scene import Scene
from hpcclear.statistics import spectra

LEAST = 720
"""Instants a revolution by which forces are taken densely at least."""


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
        for name, ends in self._levels(forces, periods, centres).items():
            found |= {f"{name}_level{end}": one for end, one in zip(_ENDS, ends, strict=True)}
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


_ENDS = ("", "_lower", "_upper")
