"""Who simulates what: how many samples a rank gets at a time, and the record that is kept of them.

Free of MPI, so that a scaling model can run the same policy on ranks that do not exist.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from hpcclear.base.outcome import OUTCOME

QUANTUM = 0.03
"""Seconds of work between two looks into the mailbox; the longest a request waits at root."""

GLANCE = 0.005
"""The same while ranks wait for their first samples, or share the last: nobody should wait for long then."""

ENDING = 0.3
"""Seconds of work that are left to hand out when these are the last."""

TAIL = 2.0
"""A block is at most 1/TAIL of a rank's fair share of what is left (guided self-scheduling)."""


COLUMNS = ("busy", "idle", "compile", "write")
"""What a rank's seconds are spent on: samples or serial code, waiting, set-up, output."""


class Worker(Protocol):
    """A stream of simulations in one process: samples go in, finished records come out."""

    @property
    def lanes(self) -> int:
        """Samples worked on at once."""

    @property
    def pending(self) -> int:
        """Samples submitted and not finished."""

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        """Queue samples: `index` int64 (m,), their `points` float64 (m, d)."""

    def advance(self, seconds: float) -> np.ndarray:
        """Work for about `seconds`, or until idle; return the finished records (may be empty)."""


class PointSource(Protocol):
    """A design: an array (n, d), or anything that makes the rows requested."""

    def __len__(self) -> int:
        """Number of samples."""

    def __getitem__(self, index: np.ndarray, /) -> np.ndarray:
        """Rows of the samples `index`, float64 (m, d)."""


Maker = Callable[[Any, Any], Worker]
"""Makes a rank's worker from the payload of a stage and its `hpcclear.ranks.team.Ranks`; called on every rank."""


@dataclass(frozen=True)
class Task:
    """What the ranks do in a stage that simulates; it travels to every rank."""

    name: str
    """Of the stage, for reports and timing."""
    make: Maker
    """A function of a module: pickle sends its name."""
    payload: object
    """What it makes a worker from, such as a scene's content."""
    dtype: np.dtype = OUTCOME
    """Of the records; has a field ``sample``."""
    workers: int | None = None
    """How many ranks get samples, root first; by default all. The others only make their worker."""


class Need(NamedTuple):
    """What a rank says of itself when it requests samples."""

    lanes: int  # samples it works on at once
    pending: int  # samples it still has
    rate: float  # samples it finishes a second; 0 = not known yet


def allot(remaining: int, ranks: int, need: Need) -> tuple[int, int]:
    """Size of the next block for one rank, of `remaining` samples: enough to stay busy, less and less towards the end; and the
    stock below which the rank requests more.

    Costs of samples are unknown beforehand and may differ tenfold, so a block holds what the rank does in about half a second
    (longer on many ranks, so that root is not swamped by requests), never more than half its fair share of what is left, never
    less than fills its lanes: samples in lanes of a batch take the time of the longest one, so an empty lane saves nothing.
    Stock for the time a request takes is kept while there is enough to do; at the end it would only sit behind one rank while
    another is idle, and a lane waits for its next sample instead.

    Source of guided self-scheduling: Polychronopoulos and Kuck, IEEE Trans. Computers C-36 (1987), doi:10.1109/TC.1987.5009495.
    """
    horizon = max(0.5, 2e-4 * ranks)  # s; 10 000 ranks send root some 5000 requests a second
    lead = need.rate * 0.2 * horizon  # samples finished while a request is under way
    stock = max(2.0 * need.lanes, need.lanes + need.rate * horizon)
    guided = math.ceil(remaining / (TAIL * ranks))
    wanted = max(math.ceil(stock) - need.pending, 1)
    to_fill = min(need.lanes - need.pending, math.ceil(remaining / ranks))
    size = min(remaining, max(min(wanted, guided), to_fill))
    ends_soon = remaining - size < ranks * stock
    ask_below = max(need.lanes, int(lead)) if ends_soon else need.lanes + math.ceil(max(lead, 1.0))
    return size, ask_below


class HandOut:
    """Root's record of one design of `total` samples: what is left, what is out, what is finished.

    `completed`: samples finished in an earlier run, each once; they are not handed out.
    """

    def __init__(self, total: int, completed: np.ndarray, ranks: int) -> None:
        self._ranks = ranks
        self._total = total
        self._queue: np.ndarray | None = None  # of all in order there is no list
        if completed.size:
            waiting = np.ones(total, bool)
            waiting[completed] = False
            self._queue = np.flatnonzero(waiting)
        self._next = 0
        self._rate = 0.0  # of who asked last
        self.outstanding = 0

    @property
    def remaining(self) -> int:
        """Samples not handed out yet."""
        return (self._total if self._queue is None else self._queue.size) - self._next

    @property
    def done(self) -> bool:
        """Whether every sample is finished."""
        return self.remaining == 0 and self.outstanding == 0

    @property
    def ending(self) -> bool:
        """Whether something is left to hand out, which keeps the ranks busy for a moment only."""
        return 0 < self.remaining <= ENDING * self._rate * self._ranks

    def grant(self, need: Need) -> tuple[np.ndarray, int]:
        """Indices of samples for the requesting rank (none when nothing is left), and when it requests more."""
        self._rate = need.rate
        size, ask_below = allot(self.remaining, self._ranks, need)
        index = np.arange(self._next, self._next + size)
        self._next += size
        index = index if self._queue is None else self._queue[index]
        self.outstanding += size
        return index, ask_below

    def accept(self, records: np.ndarray) -> None:
        """Book finished records."""
        self.outstanding -= records.size
