"""How far a stage is: a bar on a terminal, a line now and then in a log, or nothing."""

import os
import sys
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, Self, TextIO

import numpy as np

from hpcclear.ranks.launcher import is_launched

Style = Literal["auto", "bar", "log", "quiet"]

_LAUNCHERS = ("mpiexec", "mpirun", "prterun", "orterun")
_BAR_INTERVAL = 0.2  # s
SIGN_OF_LIFE = 300.0  # s, after which a line of a log is repeated though nothing was finished
_WINDOW = 30.0  # s, over which the rate is taken: costs change over a design


class Progress:
    """Counts finished and failed samples of `label`, and shows them on standard error or another stream.

    `style`: ``auto`` is a bar on a terminal, also through a local mpiexec, else a log. `interval`: seconds between two lines
    of a log; 5 by default, 30 in a Slurm job.
    """

    def __init__(
        self,
        label: str,
        style: Style = "auto",
        interval: float | None = None,
        stream: TextIO | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._label = label
        self._style = style
        self._interval = log_interval() if interval is None else interval
        self._stream = stream
        self._clock = clock
        self._bar: Any = None

    def start(self, total: int, completed: np.ndarray) -> None:
        """Begin with `total` samples, of which the records `completed` are there already."""
        self._total, self._done, self._failed = total, completed.size, _failures(completed)
        self._began = self._shown = self._written = self._clock()
        self._counted = (-1, -1)  # samples and failures of the last line of a log
        self._origin = (self._began, self._done)
        self._history = deque([self._origin])
        if self._style == "auto":
            terminal = None if self._stream else launching_terminal()
            self._stream = terminal or self._stream or sys.stderr
            self._style = "bar" if self._stream.isatty() else "log"
        self._stream = self._stream or sys.stderr
        if self._style == "bar":
            self._bar = _make_bar(self._label, total, self._stream)
            self._bar.start()

    def add(self, records: np.ndarray) -> None:
        """Count finished records; a field ``status`` other than 0 is a failure."""
        self._done += records.size
        self._failed += _failures(records)

    def refresh(self) -> None:
        """Show the state, if it is time to."""
        now = self._clock()
        if self._style == "quiet" or now - self._shown < (
            self._interval if self._bar is None else _BAR_INTERVAL
        ):
            return
        self._shown = now
        self._history.append((now, self._done))
        while len(self._history) > 2 and now - self._history[1][0] >= _WINDOW:
            self._history.popleft()
        counted = (self._done, self._failed)
        if self._bar is not None:
            self._draw()
        elif counted != self._counted or now - self._written >= SIGN_OF_LIFE:
            self._counted, self._written = counted, now
            self._write(f"{self.text()}, {self._eta()}")

    def close(self) -> None:
        """Show the final state, with the rate over all."""
        self._history = deque([self._origin])
        if self._bar is not None:
            self._draw()
            self._bar.stop()
            self._bar = None
        if self._style != "quiet":
            self._write(f"{self.text()} in {duration(self._clock() - self._began)}")

    def text(self) -> str:
        """Done, total, percentage, failures and rate."""
        share = 100.0 * self._done / self._total if self._total else 100.0
        failed = f", {self._failed} failed" if self._failed else ""
        return (
            f"{self._done}/{self._total} ({share:.0f} %){failed}, {grouped(self._rate())} samples/s"
        )

    def _rate(self) -> float:
        """Samples a second over the last `_WINDOW` seconds."""
        (since, before), now = self._history[0], self._clock()
        return (self._done - before) / (now - since) if now > since else 0.0

    def _eta(self) -> str:
        rate = self._rate()
        return (
            f"{duration((self._total - self._done) / rate)} left"
            if rate > 0.0
            else "time left not known"
        )

    def _write(self, text: str) -> None:
        assert self._stream is not None
        self._stream.write(f"{self._label}: {text}\n" if self._label else f"{text}\n")
        self._stream.flush()

    def _draw(self) -> None:
        self._bar.update(0, completed=self._done, state=f"{self.text()}, {self._eta()}")
        self._bar.refresh()


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

    def _draw(self) -> None:
        self._bar.update(
            0, completed=self._behind * self._whole, state=f"{self.text()}, {self._eta()}"
        )
        self._bar.refresh()


def log_interval(environment: Mapping[str, str] = os.environ) -> float:
    """Seconds between two lines of a log: batch logs are read later and should stay short."""
    return 30.0 if "SLURM_JOB_ID" in environment else 5.0


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


def launching_terminal() -> TextIO | None:
    """The terminal on which a local mpiexec shows what its ranks write; None if there is none.

    Ranks write to a pipe even when a person watches, so look up the standard error of mpiexec
    (Linux only).
    """
    if sys.platform != "linux" or not is_launched():
        return None
    pid = os.getppid()
    try:
        for _ in range(3):  # proxy, mpiexec
            with open(f"/proc/{pid}/stat", encoding="utf-8") as status:
                name, _, rest = status.read().partition("(")[2].rpartition(")")
            if name.startswith(_LAUNCHERS):
                return _open_terminal(os.readlink(f"/proc/{pid}/fd/2"))
            pid = int(rest.split()[1])
    except OSError:  # another user's process, or another namespace
        return None
    return None


def _open_terminal(path: str) -> TextIO | None:
    if not path.startswith("/dev/"):
        return None
    descriptor = os.open(path, os.O_WRONLY | os.O_NOCTTY)
    if os.isatty(descriptor):
        return os.fdopen(descriptor, "w")
    os.close(descriptor)
    return None


def _failures(records: np.ndarray) -> int:
    names = records.dtype.names or ()
    return int(np.count_nonzero(records["status"])) if "status" in names else 0


def _make_bar(label: str, total: int, stream: TextIO) -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[state]}"),
        console=Console(file=stream),
        auto_refresh=False,  # no thread: drawn between two quanta of work
        transient=True,  # the last line is written as text
    )
    bar.add_task(label, total=total, state="")
    return bar
