"""Whether the others live: ranks send each other pulses, and one that hears none any more does not stay behind.

Root exchanges pulses with the first rank of every other node and with the ranks of its own; the first rank of a node with
the others there. So root hears of nodes, not of a hundred thousand ranks. A thread sends and listens: the main thread may be
in a long fit. What it counts is its own beats, not the clock: a job that was suspended as a whole goes on.
"""

import os
import threading
from collections.abc import Callable, Mapping
from typing import Protocol, Self

BEATS = 6
"""Pulses in the time after which who sends none is given up."""

SILENCE = 15.0
"""That time by default, s.

Where the network is cut MPICH itself ends a process with a segmentation fault, some 25 to 30 s later. Until then a rank has
to notice (one beat more at most), to report it and, on root, to save what is finished.
"""

_LOOKS = 20  # at what came, between two beats
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
        self.missed = 0
        self.lost = False
        self.gone = False  # has said goodbye

    def heard(self, tag: int) -> None:
        """A pulse came."""
        self.missed = 0
        self.gone = self.gone or tag == _BYE

    def beat(self) -> bool:
        """Another beat of ours without a pulse of theirs; whether it is given up now."""
        self.missed += 1
        if self.gone or self.lost or self.missed <= BEATS:
            return False
        self.lost = True
        return True


class Pulses(Protocol):
    """Transport of pulses; it never blocks, and any thread may call it."""

    @property
    def neighbours(self) -> list[int]:
        """Ranks to exchange pulses with."""

    def pulse(self, to: int, tag: int) -> None:
        """Send one."""

    def pulses(self) -> list[tuple[int, int]]:
        """Rank and tag of each that came since the last call."""


class Watch:
    """The thread of one rank that knows who lives.

    Parameters
    ----------
    seconds : float
        Silence after which a rank is given up; 0 for never.
    on_loss : callable
        Gets the rank that was given up; called by the thread.
    on_orphan : callable
        Called once by the thread, when the process that started this one is gone.
    """

    def __init__(
        self,
        mail: Pulses,
        seconds: float,
        on_loss: Callable[[int], object],
        on_orphan: Callable[[], object],
    ) -> None:
        self._mail = mail
        self._neighbours = {rank: Neighbour() for rank in mail.neighbours}
        self._period = seconds / BEATS
        self._on_loss, self._on_orphan = on_loss, on_orphan
        self._parent = os.getppid()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="watch", daemon=True)

    def __enter__(self) -> Self:
        if self._period > 0.0 and self._neighbours:
            self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        """Say goodbye, and be silent from now on."""
        self._over.set()
        if self._thread.ident is not None:
            self._thread.join()
            self._send(_BYE)

    def _run(self) -> None:
        while not self._over.is_set():
            self._send(_ALIVE)
            for _ in range(
                _LOOKS
            ):  # MPI gets on only while it is called, a step of its protocol at a time
                self._over.wait(self._period / _LOOKS)
                for rank, tag in self._mail.pulses():
                    self._neighbours[rank].heard(tag)
            for rank, neighbour in self._neighbours.items():
                if neighbour.beat() and not self._over.is_set():
                    self._on_loss(rank)
            if self._parent != os.getppid():
                self._parent = os.getppid()
                self._on_orphan()

    def _send(self, tag: int) -> None:
        for rank, neighbour in self._neighbours.items():
            if not neighbour.gone:
                self._mail.pulse(rank, tag)
