"""Samples that record force levels: each is recorded as a single response is, so that both agree bit for bit."""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Integers, Records
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import LEVELS, Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.recorded.impacts import LEAST, Spectra, Turns, measured_of
from hpcclear.dynamics.evaluation.recorded.steps import Piece, Recorded, Recording, StepInstants
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.stepping import record as rec
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.scene.scene import record_of
from hpcclear.statistics import spectra

FEWEST_INSTANTS = 64  # instants a revolution from which on there are spectra
LARGEST_COUNT = 100_000  # instants a revolution that a band may take


class SoundingEvaluator:
    """Simulates points of one scene as a stream, with levels and half-widths; to be used like `Evaluator`.

    Arguments as of `hpcclear.dynamics.evaluation.evaluator.Evaluator`. Raises InputError if a band lies below the frequency
    of the drive, or too far above it.
    """

    def __init__(
        self, scene: Scene, columns: Points, lanes: int, perturbations: Sequence[int]
    ) -> None:
        self.scene, self.lanes = scene, lanes
        self._columns, self._perturbations = columns, perturbations
        self._count = _instants_of_bands(scene)
        self._waiting: deque[tuple[int, Array]] = deque()
        self._running: list[int] = []
        self._current: Iterator[Records | None] | None = None

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""
        return len(self._waiting) + len(self._running)

    def submit(self, index: Integers, points: Array) -> None:
        """Queue samples: indices (m,), values (m, d) in the columns' order, SI."""
        self._waiting.extend(zip(np.asarray(index).tolist(), points, strict=True))

    def advance(self, seconds: float) -> Records:
        """Work for about `seconds`; return the records of what finished meanwhile."""
        end = time.perf_counter() + seconds
        done: list[Records] = []
        if not self.pending:
            Recording(self.scene).compile()
        while self.pending:
            if self._current is None:
                self._current = self._batch()
            records = next(self._current)
            if records is not None:
                self._running, self._current = [], None
                done.append(records)
            if time.perf_counter() >= end:
                break
        return np.concatenate(done) if done else np.zeros(0, record_of(self.scene))

    def _batch(self) -> Iterator[Records | None]:
        """As many samples as there are lanes, piece by piece; their records at last."""
        size = 1 if self._perturbations else min(self.lanes, len(self._waiting))
        taken = [self._waiting.popleft() for _ in range(size)]
        self._running = [index for index, _ in taken]
        points = np.array([values for _, values in taken]).reshape(size, -1)
        design = Points(self._columns.names, points, self._columns.paths)
        perturbations, objective = self._perturbations, self.scene.objective
        recording = Recording(self.scene, (), perturbations, objective, design=design)
        heard = [Heard(self.scene, sample, 1, self._count) for sample in recording.samples]
        for rows in recording.chunks():
            for slot, one in enumerate(heard):
                one.take(rows[rows[:, rec.SLOT] == slot])
            yield None
        records = recording.record()
        records["sample"] = self._running
        for k, one in enumerate(heard):
            one.end()
            one.enter_levels(records[k : k + 1])
        yield records


class Heard:
    """One sample of a recording, as its steps come: pieces of so many `instants` of a revolution, spectra of `count` (0:
    none).
    """

    def __init__(self, scene: Scene, sample: Recorded, instants: int, count: int) -> None:
        self.scene, self.sample, self.turns = scene, sample, Turns(sample.problem.transient)
        self._pieces = StepInstants(instants)
        self.spectra = Spectra(scene, sample, count) if count else None

    def take(self, rows: Array) -> None:
        """Take rows (m, columns) of the record."""
        for piece in self._pieces.take(rows):
            self.add(piece)

    def add(self, piece: Piece) -> None:
        """Take a piece."""
        self.turns.take(piece.steps)
        if self.spectra is not None:
            self.spectra.take(piece)

    def end(self) -> None:
        """Take what is left once all rows have come."""
        last = self._pieces.finish()
        self.add(last)
        self.turns.finish(last.steps)

    def enter_levels(self, record: Records) -> None:
        """Enter levels in the scene's bands, and half-widths, into the sample's record (1,), if it ended well."""
        bands = np.array(self.scene.bands())
        if self.spectra is None or not len(bands) or not Status(int(record["status"][0])).valid:
            return
        periods, integrals = self.turns.averaged(self.sample.problem.transient)
        known = measured_of(self.scene, self.sample.problem, periods, integrals)
        known |= self.spectra.levels(bands) | {"band": bands}
        for name in LEVELS:
            if name in known:
                found = np.asarray(known[name])
                place: Any = (0, *map(slice, found.shape))
                record[name][place] = found


def _instants_of_bands(scene: Scene) -> int:
    """Instants a revolution by which spectra of a sample reach as far as the scene's bands, and as far as its response's do."""
    bands, period = np.array(scene.bands()), float(parameters(scene)[0, at.PERIOD])
    step = 10.0**0.05  # from the middle of a band to its ends
    for band in bands:
        if np.floor(band * step * period) < max(np.ceil(band / step * period), 1.0):
            reason = f"contains no multiple of the frequency of the drive, {1.0 / period:.4g} Hz"
            raise InputError("numerics.levels", f"{band:.4g} Hz", reason, "Name a higher band")
    needed = int(np.ceil(spectra.BANDWIDTH * (bands.max(initial=0.0) * step * period + 2.0)))
    if needed > LARGEST_COUNT:
        reason = f"takes {needed} instants a revolution, and there are {LARGEST_COUNT} at most"
        raise InputError("numerics.levels", f"{bands.max():.4g} Hz", reason, "Name a lower band")
    return max(needed, scene.output.instants_per_revolution, LEAST)


def instants_of(scene: Scene, sample: Recorded) -> int:
    """Those that spectra of a response are made of; 0 where it stores too few instants, or has no contacts."""
    count = _instants_of_bands(scene) if scene.bands() else scene.output.instants_per_revolution
    return count if count >= FEWEST_INSTANTS and sample.problem.effects.joints else 0
