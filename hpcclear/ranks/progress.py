"""How far a stage is: a line on a terminal that the next replaces, a line now and then in a log, or nothing."""

import os
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from typing import Self, TextIO

import numpy as np

from hpcclear.ranks.terminal import Style, clear, draw, terminal

_BAR_INTERVAL = 0.2  # s
SIGN_OF_LIFE = 300.0  # s, after which a line of a log is repeated though nothing was finished
_WINDOW = 30.0  # s, over which the rate is taken: costs change over a design


class Progress:
    """Counts finished and failed samples of `label`, and shows them on standard error or another stream.

    `style`: ``auto`` is a bar on a terminal, also through a local mpiexec, else a log. `interval`: seconds between two lines
    of a log; 5 by default, 30 in a Slurm job.
    """

    def __init__(
        self, label: str, style: Style = "auto", interval: float | None = None, stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:  # fmt: skip
        self._label = label
        self._style = style
        usual = 30.0 if "SLURM_JOB_ID" in os.environ else 5.0  # batch logs are read later
        self._interval = usual if interval is None else interval
        self._stream = stream
        self._clock = clock

    def start(self, total: int, completed: np.ndarray) -> None:
        """Begin with `total` samples, of which the records `completed` are there already."""
        self._total, self._done, self._failed = total, completed.size, _failures(completed)
        self._began = self._shown = self._written = self._clock()
        self._counted = (-1, -1)  # samples and failures of the last line of a log
        self._origin = (self._began, self._done)
        self._history = deque([self._origin])
        found = terminal() if self._stream is None and self._style in ("auto", "bar") else None
        if self._style == "auto":
            self._style = "bar" if found else "log"
        self._stream = found or self._stream or sys.stderr

    def add(self, records: np.ndarray) -> None:
        """Count finished records; a field ``status`` other than 0 is a failure."""
        self._done += records.size
        self._failed += _failures(records)

    def refresh(self) -> None:
        """Show the state, if it is time to."""
        now = self._clock()
        interval = _BAR_INTERVAL if self._style == "bar" else self._interval
        if self._style == "quiet" or now - self._shown < interval:
            return
        self._shown = now
        self._history.append((now, self._done))
        while len(self._history) > 2 and now - self._history[1][0] >= _WINDOW:
            self._history.popleft()
        counted = (self._done, self._failed)
        if self._style == "bar":
            assert self._stream is not None
            draw(self._stream, f"{self._label}: {self.text()}, {self._eta()}", self._share())
        elif counted != self._counted or now - self._written >= SIGN_OF_LIFE:
            self._counted, self._written = counted, now
            self._write(f"{self.text()}, {self._eta()}")

    def close(self) -> None:
        """Write the final state into a log, with the rate over all; what a terminal shows of it goes."""
        self._history = deque([self._origin])
        if self._style == "bar":
            clear()
        elif self._style != "quiet":
            self._write(f"{self.text()} in {duration(self._clock() - self._began)}")

    def text(self) -> str:
        """Done, total, percentage, failures and rate."""
        failed = f", {self._failed} failed" if self._failed else ""
        counted = f"{self._done}/{self._total} ({100.0 * self._share():.0f} %){failed}"
        return f"{counted}, {grouped(self._rate())} samples/s"

    def _share(self) -> float:
        return self._done / self._total if self._total else 1.0

    def _rate(self) -> float:
        """Samples a second over the last `_WINDOW` seconds."""
        (since, before), now = self._history[0], self._clock()
        return (self._done - before) / (now - since) if now > since else 0.0

    def _eta(self) -> str:
        rate, left = self._rate(), self._total - self._done
        return f"{duration(left / rate)} left" if rate > 0.0 else "time left not known"

    def _write(self, text: str) -> None:
        assert self._stream is not None
        self._stream.write(f"{self._label}: {text}\n" if self._label else f"{text}\n")
        self._stream.flush()


class LongProgress(Progress):
    """Progress over designs that come one after the other: each calls `start` and `close`; shown is the state of all.

    A context, at whose end the final state is shown. `total`: samples of all of them, of which `done` are there already.
    """

    def __init__(self, label: str, style: Style, total: int, done: int = 0) -> None:
        super().__init__(label, style)
        self._whole, self._before, self._going = total, done, False

    def start(self, total: int, completed: np.ndarray) -> None:
        """Begin with a further design of `total` samples, of which the records `completed` are there already."""
        if not self._going:
            super().start(self._whole, np.broadcast_to(0, self._before))
            self._going = True
        self._done += completed.size
        self._failed += _failures(completed)

    def close(self) -> None:
        """Show nothing: a design is done, others follow."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._going:
            super().close()


class LivesProgress(LongProgress):
    """How far service lives are, which need one design after the other, with a forecast of the time left; `total`: lives."""

    def lives(self, over: int, parts: Sequence[float]) -> None:
        """`over` lives are over; of each other one this part of the simulations is done, from 0 to 1."""
        self._over, self._behind = over, (over + sum(parts)) / self._whole

    def text(self) -> str:
        """Lives that are over, part of the simulations done, their number and failures."""
        failed = f", {self._failed} failed" if self._failed else ""
        share = f"{self._over}/{self._whole} service lives finished ({100.0 * self._behind:.0f} %)"
        return f"{share}, {self._done} simulations{failed}"

    def _eta(self) -> str:
        gone = self._clock() - self._began
        left = gone * (1.0 - self._behind) / self._behind if self._behind > 0.0 else 0.0
        return f"about {duration(left)} left" if left > 0.0 else "time left not known"

    def _share(self) -> float:
        return self._behind


def duration(seconds: float) -> str:
    """Seconds as people read them: ``42 s``, ``3:05 min``, ``1:02:03 h``."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours}:{minutes:02d}:{rest:02d} h"
    return f"{minutes}:{rest:02d} min" if minutes else f"{rest} s"


def grouped(number: float) -> str:
    """A positive number as people read it: ``1 250``, ``3.2``."""
    return f"{number:,.0f}".replace(",", " ") if number >= 100.0 else f"{number:.3g}"


def _failures(records: np.ndarray) -> int:
    names = records.dtype.names or ()
    return int(np.count_nonzero(records["status"])) if "status" in names else 0
