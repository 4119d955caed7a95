"""Whether the others live: ranks send each other pulses, and one that is lost or silent for long does not stay without notice.

Root exchanges pulses with the first rank of every other node and with the ranks of its own; the first rank of a node with
the others there. So root hears of nodes, not of a hundred thousand ranks. A thread sends and listens: the main thread may be
in a long fit. What it counts is its own looks, not the clock: a job that was suspended as a whole goes on.

On a busy machine a rank may be silent for a minute and yet get on. So who is silent is given up at once only if the system
says that the process has ended or that the connection is broken (`life`), and never while its process computes.
"""

import math
import os
import threading
import time
from collections.abc import Callable, Mapping
from typing import Self

from hpcclear.ranks.mailbox import Mail

SILENCE = 120.0
"""Seconds without a pulse after which a rank is given up by default, also if nothing else says that it is lost.

Twice as long as a rank may have to wait for its processor. A cut of the network has to be noticed earlier: MPICH itself ends a
process with a segmentation fault some 25 to 30 s after it.
"""

BEATS = 6
"""Pulses in this time at least."""

_LONGEST = 2.5  # s between two pulses
_LOOKS = 20  # at what came, from one beat to the next
_CERTAIN = 2  # beats without a pulse after which a rank that the system calls ended is given up: its goodbye may be on its way
_CONTRADICTED = 3  # pulses of a rank that the system called ended, after which the system is not believed any more
_ALIVE, _BYE = 1, 2


def silence(environment: Mapping[str, str] = os.environ) -> float:
    """Seconds without a pulse after which a rank is given up: ``HPCCLEAR_SILENCE``, 0 for never.

    What is no number counts as not set: a typing error must not cost a job.
    """
    try:
        seconds = float(environment.get("HPCCLEAR_SILENCE", SILENCE))
    except ValueError:
        return SILENCE
    return seconds if 0.0 <= seconds < 1e6 else SILENCE


class Neighbour:
    """Another rank that this one hears, by its beats."""

    def __init__(self) -> None:
        self._missed = self._contradicted = 0
        self._heard = False
        self._lost = False
        self.gone = False  # has said goodbye

    def heard(self, tag: int) -> None:
        """A pulse came."""
        self._heard = True
        self.gone = self.gone or tag == _BYE

    def beat(self, lives: bool | None, patience: float) -> bool:
        """Another beat of ours; whether the rank is given up now, after so many beats without a pulse (`patience`).

        `lives`: what the system says of it: it computes, it has ended, or nothing (None).
        """
        heard, self._heard = self._heard, False
        if self.gone or self._lost:
            return False
        if heard:
            self._missed = 0
            self._contradicted += lives is False
            return False
        if not lives:
            self._missed += 1
        ended = lives is False and self._contradicted < _CONTRADICTED
        self._lost = self._missed >= (_CERTAIN if ended else patience)
        return self._lost


class Watch:
    """The thread of one rank that knows who lives.

    `on_loss` gets the rank that was given up after so many seconds of silence (0: never); `on_orphan` is called once when
    `is_orphan` says that what started this process is gone (None: that is not watched). The thread calls both.
    """

    def __init__(
        self, mail: Mail, seconds: float, on_loss: Callable[[int], object], on_orphan: Callable[[], object],
        is_orphan: Callable[[], bool] | None = None,
    ) -> None:  # fmt: skip
        self._mail = mail
        self._neighbours = {rank: Neighbour() for rank in mail.neighbours}
        self._period = min(seconds / BEATS, _LONGEST) if seconds else _LONGEST
        self._patience = seconds / self._period if seconds else math.inf
        self._on_loss, self._on_orphan, self._is_orphan = on_loss, on_orphan, is_orphan
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)

    def __enter__(self) -> Self:
        if self._neighbours or self._is_orphan is not None:
            self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        """Say goodbye, and be silent from now on."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()
            self._send(_BYE)

    def _run(self) -> None:
        if self._neighbours:
            self._mail.connect()
        due = -math.inf
        while not self._over.is_set():
            # MPI gets on only while it is called, a step of its protocol at a time
            for _ in range(_LOOKS):
                now = time.monotonic()
                if now >= due:  # by the clock: looks take long on a busy machine
                    self._send(_ALIVE)
                    due = now + self._period
                if self._over.wait(self._period / _LOOKS):
                    return
                for rank, tag in self._mail.pulses() if self._neighbours else ():
                    self._neighbours[rank].heard(tag)
            self._beat()

    def _beat(self) -> None:
        for rank, neighbour in self._neighbours.items():
            if neighbour.beat(self._mail.lives(rank), self._patience) and not self._over.is_set():
                self._on_loss(rank)
        if self._is_orphan is not None and self._is_orphan():
            self._is_orphan = None
            self._on_orphan()

    def _send(self, tag: int) -> None:
        for rank, neighbour in self._neighbours.items():
            if not neighbour.gone:
                self._mail.pulse(rank, tag)
