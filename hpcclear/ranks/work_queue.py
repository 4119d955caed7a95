"""The samples in hand of one rank."""

import math
import time
from collections.abc import Callable

import numpy as np

from hpcclear.ranks.schedule import QUANTUM, Need, Worker


class WorkQueue:
    """One rank's side of it: feeds the worker, knows its stock, its speed and its busy time.

    `recent`: finished samples and busy seconds (2,), the older the less weight, of such a worker before; kept up.
    """

    def __init__(
        self, worker: Worker, clock: Callable[[], float] = time.perf_counter, recent: np.ndarray | None = None
    ) -> None:  # fmt: skip
        self._worker = worker
        self._clock = clock
        self._in_hand: set[int] = set()
        self._recent = np.zeros(2) if recent is None else recent
        self._ask_below = 1
        self._inside = False
        self.busy = 0.0
        self.exhausted = False

    @property
    def need(self) -> Need:
        """What to report to root."""
        finished, seconds = self._recent
        rate = float(finished / seconds) if seconds > 0.0 else 0.0
        return Need(self._worker.lanes, self._worker.pending, rate)

    @property
    def hungry(self) -> bool:
        """Whether it is time to request more."""
        return not self.exhausted and self._worker.pending < self._ask_below

    @property
    def soon_hungry(self) -> bool:
        """Whether it may be, within the next `QUANTUM`."""
        need = self.need
        return not self.exhausted and need.pending < self._ask_below + 2.0 * QUANTUM * need.rate

    @property
    def idle(self) -> bool:
        """Whether there is nothing to work on."""
        return self._worker.pending == 0

    @property
    def suspects(self) -> list[int]:
        """Samples in hand, ascending, if the worker raised an exception; else none."""
        return sorted(self._in_hand) if self._inside else []

    def take(self, index: np.ndarray, points: np.ndarray, ask_below: int) -> None:
        """Queue a block: indices of shape (n,), points of shape (n, d); an empty one says that there is no more."""
        self._ask_below = ask_below
        if index.size == 0:
            self.exhausted = True
            return
        self._in_hand.update(index.tolist())
        self._inside = True
        self._worker.submit(index, points)
        self._inside = False

    def work(self, seconds: float = QUANTUM) -> np.ndarray:
        """Let the worker advance; return the records it finished.

        Raises RuntimeError if the worker returns a sample that it was not given, or had returned before.
        """
        started = self._clock()
        self._inside = True
        records = self._worker.advance(seconds)
        self._inside = False
        spent = self._clock() - started
        self.busy += spent
        self._recent *= math.exp(-spent / 2.0)  # costs change over a design: two seconds of memory
        self._recent += records.size, spent
        for sample in records["sample"].tolist():
            if sample not in self._in_hand:
                raise RuntimeError(f"the worker returned sample {sample}, which it does not have")
            self._in_hand.remove(sample)
        return records
