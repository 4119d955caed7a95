"""Samples that record force levels: each is recorded as a single response is, so that both agree bit for bit."""

import time
from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Integers, Records
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import LEVELS, OUTCOME, Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.evaluation.evaluator import DEFAULT_LANES
from hpcclear.dynamics.evaluation.recorded.impacts import Turns, measured_of
from hpcclear.dynamics.evaluation.recorded.spectral import LEAST, Spectra
from hpcclear.dynamics.evaluation.recorded.steps import Recorded, Recording, pieces
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.scene import Scene
from hpcclear.scene.points import Points
from hpcclear.statistics import spectra

FEWEST_INSTANTS = 64
"""Instants a revolution from which on there are spectra."""

LARGEST_COUNT = 100_000
"""Instants a revolution that a band may take."""


class SoundingEvaluator:
    """Simulates points of one scene as a stream, with levels and half-widths; to be used like `Evaluator`.

    Arguments as of `hpcclear.dynamics.evaluation.evaluator.Evaluator`.

    Raises
    ------
    InputError
        If a band lies below the frequency of the drive, or too far above it.
    """

    def __init__(
        self,
        scene: Scene,
        columns: Points,
        lanes: int = DEFAULT_LANES,
        perturbations: Sequence[int] = (),
    ) -> None:
        self.scene, self.lanes = scene, lanes
        self._columns, self._perturbations = columns, perturbations
        self._count = instants_of(scene)
        self._waiting: deque[tuple[int, Array]] = deque()
        self._current: Iterator[Records | None] | None = None

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""
        return len(self._waiting) + (self._current is not None)

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
                self._current = self._sample(*self._waiting.popleft())
            record = next(self._current)
            if record is not None:
                self._current = None
                done.append(record)
            if time.perf_counter() >= end:
                break
        return np.concatenate(done) if done else np.zeros(0, OUTCOME)

    def _sample(self, index: int, values: Array) -> Iterator[Records | None]:
        """One sample, piece by piece; its record (1,) at last."""
        design = Points(self._columns.names, values[None], self._columns.paths)
        recording = Recording(
            self.scene, 0, self._perturbations, self.scene.objective, design=design
        )
        sample = recording.samples[0]
        turns, heard = Turns(), Spectra(self.scene, sample, self._count)
        for piece in pieces(recording.chunks(), 1):
            turns.take(piece.steps)
            heard.take(piece)
            yield None
        turns.finish(piece.steps)
        record = recording.record()
        record["sample"] = index
        if Status(int(record["status"][0])).valid:
            enter_levels(self.scene, sample, turns, heard, record)
        yield record


def enter_levels(
    scene: Scene, sample: Recorded, turns: Turns, heard: Spectra, record: Records
) -> None:
    """Enter levels in the scene's bands, and half-widths, into a record (1,) of a recorded sample that ended well."""
    bands = np.array(scene.bands())
    periods, integrals = turns.averaged(sample.problem.transient)
    known = measured_of(scene, sample.problem, periods, integrals)
    known |= heard.levels(bands) | {"band": bands}
    for name in LEVELS:
        if name in known:
            found = np.asarray(known[name])
            place: Any = (0, *map(slice, found.shape))
            record[name][place] = found


def instants_of(scene: Scene) -> int:
    """Instants a revolution by which spectra of a sample reach as far as the scene's bands, and as far as its response's do.

    Raises
    ------
    InputError
        If a band lies below the frequency of the drive, or too far above it.
    """
    bands, period = np.array(scene.bands()), float(parameters(scene)[0, at.PERIOD])
    step = 10.0**0.05  # from the middle of a band to its ends
    for band in bands:
        if np.floor(band * step * period) < max(np.ceil(band / step * period), 1.0):
            raise InputError(
                "numerics.levels", band, f"contains no multiple of the frequency of the drive, {1.0 / period:.4g} Hz",
                "Name a higher band",
            )  # fmt: skip
    needed = int(np.ceil(spectra.BANDWIDTH * (bands.max(initial=0.0) * step * period + 2.0)))
    if needed > LARGEST_COUNT:
        raise InputError(
            "numerics.levels", bands.max(), f"takes {needed} instants a revolution, and there are {LARGEST_COUNT} at most",
            "Name a lower band",
        )  # fmt: skip
    return max(needed, scene.output.instants_per_revolution, LEAST)


def spectra_of(scene: Scene, sample: Recorded) -> Spectra | None:
    """Those of a response, None where it stores too few instants, or has no contacts."""
    count = scene.output.instants_per_revolution
    if scene.bands():
        count = instants_of(scene)
    there = count >= FEWEST_INSTANTS and sample.problem.effects.joints
    return Spectra(scene, sample, count) if there else None
