"""A worker with known results and uneven costs, for programs under mpiexec."""

import time

import numpy as np

from hpcclear.base.outcome import OUTCOME
from hpcclear.ranks.team import Ranks


def design(samples: int) -> np.ndarray:
    """Points (n, 2); the second column is the cost of a sample relative to the mean."""
    points = np.random.default_rng(5).random((samples, 2))
    points[:, 1] = np.geomspace(0.3, 3.0, samples)[np.random.default_rng(6).permutation(samples)]
    return points


def records_of(index: np.ndarray, points: np.ndarray) -> np.ndarray:
    """What every simulation must return."""
    records = np.zeros(index.size, OUTCOME)
    records["sample"] = index
    records["objective"] = np.sin(12.9898 * points[:, 0] + index) * 43758.5453
    records["status"] = index % 7 == 3
    records["objective"][records["status"] != 0] = np.nan
    return records


class SleepingWorker:
    """Takes `cost` seconds for a mean sample in each of its lanes, without using the processor.

    `fails_at` is a sample that raises; `fixed` seconds are slept on every call of `advance`.
    """

    def __init__(self, cost: float, lanes: int = 1, fails_at: int = -1) -> None:
        self.lanes = lanes
        self._cost = cost
        self._fails_at = fails_at
        self._queue: list[tuple[int, np.ndarray]] = []
        self._running: list[list[float]] = []  # seconds left, index, position in _points
        self._points: dict[int, np.ndarray] = {}

    @property
    def pending(self) -> int:
        return len(self._queue) + len(self._running)

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        self._queue += zip(index.tolist(), points, strict=True)

    def advance(self, seconds: float) -> np.ndarray:
        finished = []
        while seconds > 0.0 and self.pending:
            while self._queue and len(self._running) < self.lanes:
                sample, point = self._queue.pop(0)
                if sample == self._fails_at:
                    raise ArithmeticError("raised on purpose")
                self._points[sample] = point
                self._running.append([self._cost * point[1], sample])
            step = min(seconds, min(left for left, _ in self._running))
            started = time.perf_counter()
            time.sleep(step)
            slept = time.perf_counter() - started
            seconds -= slept
            for lane in self._running:
                lane[0] -= slept
            finished += [int(sample) for left, sample in self._running if left <= 0.0]
            self._running = [lane for lane in self._running if lane[0] > 0.0]
        index = np.array(finished, np.int64)
        points = np.array([self._points.pop(sample) for sample in finished]).reshape(-1, 2)
        return records_of(index, points)


def make_sleeping(payload: dict, ranks: Ranks) -> SleepingWorker:
    """Maker: the payload holds the arguments of `SleepingWorker`."""
    return SleepingWorker(**payload)
