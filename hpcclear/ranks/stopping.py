"""Why a run ends early: signals and a time limit become one flag, with a last resort behind it."""

import contextlib
import os
import select
import signal
import socket
import threading
import time
from collections.abc import Callable
from enum import IntEnum

from hpcclear.base.host import STOP_SIGNALS
from hpcclear.ranks.launcher import launched_rank

GRACE = 3.8
"""Seconds a rank has to flush and leave after a stop; documented as 5."""


LONGEST_WAIT = 3600.0
"""Seconds after which the thread that listens looks at the clock again, at the latest."""


class Exit(IntEnum):
    """Exit codes of every command."""

    DONE = 0
    FAILED = 1
    BAD_INPUT = 2
    STOPPED = 3
    TARGET_MISSED = 4


class Stopped(Exception):
    """The run was stopped early; everything finished is saved, the same command resumes."""


class RankFailed(Exception):
    """Another rank cannot go on: bad input or a fault; the text is its report, `code` the exit code that follows of it."""

    def __init__(self, report: str, code: int = Exit.FAILED) -> None:
        super().__init__(report)
        self.code = code


RESUMES = "The same command goes on from here"
ANEW = "Nothing is kept: the same command starts anew"
"""RESUMES and ANEW: what the same command does after an early stop, by whether the stopped one saves what it finishes."""


class StopSwitch:
    """Collects the signals and the time limit of one process; loops poll `is_set`.

    A thread of its own listens, since Python runs signal handlers only between two bytecodes of the main thread, which a long
    fit in compiled code may not reach in time. Once it has to stop, the process has `GRACE` seconds before `last_resort` ends
    it: files are written whole and renamed, so that nothing breaks. A second SIGINT ends it at once.

    Use as a context manager in the main thread, as early as possible: until then a signal kills. Afterwards the old handlers
    come back, or, if nothing but the end of the process follows (`ends_process`), signals are ignored. `outlook`: what the same
    command does after an early stop, `RESUMES`, or `ANEW` where nothing is saved.
    """

    def __init__(self, ends_process: bool = False) -> None:
        self._began = time.monotonic()
        self._ends_process = ends_process
        self._limit: float | None = None
        self._reason: str | None = None
        self._leave_at: float | None = None
        self._code: int = Exit.STOPPED
        self._interrupted_at: float | None = None
        self._closing = False
        self._previous: dict[int, object] = {}
        self._mouth: socket.socket | None = None
        self.last_resort: Callable[[int], object] = os._exit
        self.outlook = ANEW
        self._is_first = launched_rank() in (0, None)  # one of all copies tells how it ended
        self.reported = not self._is_first

    @property
    def reason(self) -> str:
        """Source of the stop; empty without one."""
        if self._reason is None and self._limit is not None and time.monotonic() >= self._limit:
            self.request("the time limit was reached")
        return self._reason or ""

    def is_set(self) -> bool:
        """Whether to stop."""
        return self.reason != ""

    def limit_time(self, seconds: float) -> None:
        """Stop that many seconds after this switch was made."""
        self._limit = self._began + seconds
        self._rouse()

    def request(self, reason: str) -> None:
        """Request a stop; the first reason counts."""
        if self._reason is None:
            self._reason = reason
            self.leave_within(GRACE, Exit.STOPPED)

    def leave_within(self, seconds: float, code: int) -> None:
        """Make sure that the process ends in time with `code`, come what may."""
        # an abort by another rank must not overtake the first one's last word, who may have begun later by a busy machine
        due = time.monotonic() + seconds + (0.0 if self._is_first else 0.9)
        self._leave_at = due if self._leave_at is None else min(due, self._leave_at)
        self._code = code
        self._rouse()

    def __enter__(self) -> "StopSwitch":
        self._ear, mouth = socket.socketpair()
        self._ear.setblocking(False)
        mouth.setblocking(False)
        self._mouth = mouth
        self._previous_fd = signal.set_wakeup_fd(mouth.fileno(), warn_on_full_buffer=False)
        for number in STOP_SIGNALS:  # Python writes the number to the socket before it calls this
            self._previous[number] = signal.signal(number, lambda number, frame: None)
        self._thread = threading.Thread(target=self._listen, name="stop-switch", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self._ends_process:
            for number in STOP_SIGNALS:
                signal.signal(number, signal.SIG_IGN)
            return  # the thread stays: a rank that has to leave leaves in time
        for former, handler in self._previous.items():
            signal.signal(former, handler)  # type: ignore[arg-type]
        signal.set_wakeup_fd(self._previous_fd)
        self._closing = True
        self._rouse()
        self._thread.join()
        self._ear.close()
        if self._mouth is not None:
            self._mouth.close()

    def _rouse(self) -> None:
        """Let the thread look at the clock again (before `__enter__` there is none to rouse)."""
        if self._mouth is not None:
            self._mouth.send(b"\0")

    def _listen(self) -> None:
        while not self._closing:
            limit = self._limit if self._reason is None else None
            dues = [due for due in (self._leave_at, limit) if due is not None]
            # the system's calls take no time limit of centuries, nor one of inf
            wait = min(max(0.0, min(dues) - time.monotonic()), LONGEST_WAIT) if dues else None
            ready, _, _ = select.select([self._ear], [], [], wait)
            for number in self._ear.recv(4096) if ready else b"":
                self._heard(number)
            if self._leave_at is not None and time.monotonic() >= self._leave_at:
                self._end(self._code)
            self.is_set()  # looks at the time limit

    def _heard(self, number: int) -> None:
        if number not in STOP_SIGNALS:
            return
        now = time.monotonic()
        if number == signal.SIGINT:
            if self._interrupted_at is None:
                self._interrupted_at = now
            elif now - self._interrupted_at > 0.5:  # one Ctrl-C may come twice: terminal, mpiexec
                self._end(Exit.STOPPED)
        self.request(f"{signal.Signals(number).name} was received")

    def _end(self, code: int) -> None:
        if code == Exit.STOPPED and not self.reported:
            self.reported = True
            text = f"Stopped early: {self.reason}, in the midst of something. {self.outlook}.\n"
            with contextlib.suppress(OSError):  # a launcher that is gone reads no more
                os.write(2, text.encode())  # the main thread may hold what sys.stderr needs
            time.sleep(0.2)  # the launcher passes it on
        threading.Thread(target=self.last_resort, args=(code,), daemon=True).start()
        time.sleep(0.5)  # the last resort may be an MPI call, and hang
        os._exit(code)
