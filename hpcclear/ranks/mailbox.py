"""Messages between ranks that never block; in one process there is nobody to write to.

Two threads use it: the main one for messages, and the `watch` for pulses. A lock keeps them out of MPI at the same time.
Knows MPI only as an object that is handed in, so that it loads without an MPI library.
"""

import os
import sys
import threading
import time
from collections import deque
from enum import IntEnum
from typing import Any, NamedTuple

from hpcclear.base import host
from hpcclear.ranks.life import Connections, Process, identity

_SHORTEST = 2e-4  # s


class Leave(BaseException):
    """Root said to leave with an exit code: unwinds a rank to its boundary."""

    def __init__(self, code: int) -> None:
        super().__init__(code)
        self.code = code


class Tag(IntEnum):
    """What a message says; the first five come from root."""

    STAGE = 1  # a stage begins: (task, function by which a rank takes part)
    CALL = 2  # do this once: (name, function, payload)
    BLOCK = 3  # samples: (index, points, ask_below)
    END = 4  # the stage is over, drop what is unfinished
    LEAVE = 5  # the program is over: exit code
    ASK = 6  # wants samples: (finished records or None, need)
    RECORDS = 7  # finished records
    DONE = 8  # stage or call are over here: (finished records or None, (busy, set-up seconds))
    STOP = 9  # has to stop: reason
    ERROR = 10  # failed: (report or InputError, finished records or None)
    LEFT = 11  # has heard LEAVE


class Message(NamedTuple):
    """A message that arrived."""

    source: int
    tag: int
    body: Any


class Backoff:
    """Sleeps longer and longer while nothing happens, so that waiting costs no processor time."""

    def __init__(self, longest: float = 0.01) -> None:
        self._longest = longest
        self._seconds = _SHORTEST

    def wait(self) -> None:
        """Sleep, half as long again as last time."""
        time.sleep(self._seconds)
        self._seconds = min(1.5 * self._seconds, self._longest)

    def reset(self) -> None:
        """Something happened: more may follow soon."""
        self._seconds = _SHORTEST


class Mail:
    """One rank's mailbox. `mpi` is initialised, if given: every rank makes its mailbox at the same time.

    `finalizes`: whether this job ends MPI, which it does if it began it. `rank`, `size`: this process, and how many there
    are; `node_rank`, `node_size`: the same within this node, whose ranks may use `node_cores` together; `neighbours`: ranks
    that this one exchanges pulses with (`hpcclear.ranks.watch`).
    """

    def __init__(self, mpi: Any = None, finalizes: bool = True) -> None:
        self._mpi = mpi
        self._finalizes = finalizes
        self._sent: list[tuple[Any, bytes]] = []
        self._pulsed: list[Any] = []
        self._lock = threading.Lock()
        self._news: deque[Message] = deque()  # messages of this rank to itself
        self._processes: dict[int, Process] = {}
        self._connections, self._address = Connections(), None
        self.neighbours: list[int] = []
        cores = host.cores()
        if mpi is None:
            self.rank, self.size = 0, 1
            self.node_rank, self.node_size, self.node_cores = 0, 1, len(cores)
            return
        self._comm = mpi.COMM_WORLD.Dup()  # messages of our own, whatever else the process does
        self.rank, self.size = self._comm.rank, self._comm.size
        self._pulses = mpi.COMM_WORLD.Dup()
        self._node = self._comm.Split_type(mpi.COMM_TYPE_SHARED)
        self.node_rank, self.node_size = self._node.rank, self._node.size
        self.node_cores = len(set().union(*self._node.allgather(cores)))
        self._look_around(mpi.Query_thread() >= mpi.THREAD_SERIALIZED)

    def _look_around(self, threads: bool) -> None:
        """Find whom this rank exchanges pulses with, if it may from a thread.

        Root: the first rank of every other node, and all of its own; the first of a node: root and its others.
        """
        beside = self._node.allgather((self.rank, identity()))
        here = [rank for rank, _ in beside]
        first = here[0]
        every = self._comm.allgather(first)
        if threads and self.rank != first:
            self.neighbours = [first]
        elif threads:
            firsts = sorted(set(every) - {0})
            self.neighbours = [*(firsts if first == 0 else [0]), *here[1:]]
        known = {rank: Process(it) for rank, it in beside if it and rank in self.neighbours}
        self._processes = {rank: process for rank, process in known.items() if process.visible}
        away = {rank for rank in self.neighbours if rank not in here}
        self._address = self._comm.bcast(self._connections.offer(away) if self.rank == 0 else None)

    def everyone(self, word: object) -> list[Any]:
        """What every rank has to say, by rank; all must call it at the same time, before any work."""
        return [word] if self._mpi is None else self._comm.allgather(word)

    def send(self, to: int, tag: Tag, body: object = None) -> None:
        """Post a message."""
        if self._mpi is not None:
            self._post(to, tag, self._mpi.pickle.dumps(body))

    def notify_others(self, tag: Tag, body: object = None) -> None:
        """Post one message to every other rank."""
        if self._mpi is not None:
            data = self._mpi.pickle.dumps(body)
            for other in range(self.size):
                if other != self.rank:
                    self._post(other, tag, data)

    def _post(self, to: int, tag: Tag, data: bytes) -> None:
        with self._lock:
            # MPI reads the bytes until the request is complete: hold on to them
            self._sent = [(request, held) for request, held in self._sent if not request.Test()]
            self._sent.append((self._comm.Isend([data, self._mpi.BYTE], to, tag), data))

    def poll(self) -> Message | None:
        """Next message, if one is there."""
        if self._news:
            return self._news.popleft()
        if self._mpi is None:
            return None
        with self._lock:
            status = self._mpi.Status()
            message = self._comm.improbe(status=status)
            if message is None:
                return None
            return Message(status.source, status.tag, message.recv())

    def notify_itself(self, message: Message) -> None:
        """Let `poll` return a message that nobody sent; for the other thread."""
        self._news.append(message)

    def pulse(self, to: int, tag: int) -> None:
        """Send a sign of life."""
        with self._lock:
            self._pulsed = [request for request in self._pulsed if not request.Test()]
            self._pulsed.append(self._pulses.Isend([b"", self._mpi.BYTE], to, tag))

    def pulses(self) -> list[tuple[int, int]]:
        """Rank and tag of each sign of life that came since the last call."""
        found = []
        with self._lock:
            status = self._mpi.Status()
            while (message := self._pulses.Improbe(status=status)) is not None:
                message.Recv([bytearray(), self._mpi.BYTE])
                found.append((status.source, status.tag))
        return found

    def connect(self) -> None:
        """Connect the first rank of a node with root; root takes such connections as they come (`lives`)."""
        if self._address is not None and self.rank and 0 in self.neighbours:
            self._connections.join(self.rank, 0, self._address)

    def lives(self, rank: int) -> bool | None:
        """What the system says of a neighbour: it computes (True), it has ended or its connection broke (False), or nothing."""
        if rank in self._processes:
            return self._processes[rank].lives()
        self._connections.accept()
        return self._connections.lives(rank)

    def meet_on_node(self) -> None:
        """Wait until every rank of this node is here."""
        if self._mpi is not None:
            request, backoff, complete = self._node.Ibarrier(), Backoff(), False
            while not complete:
                backoff.wait()
                with self._lock:
                    complete = request.Test()

    def finalize(self) -> None:
        """Leave MPI; every rank must come."""
        if self._mpi is not None and self._finalizes:
            self._mpi.Finalize()
        self._connections.close()

    def abort(self, code: int) -> None:
        """End all ranks now; does not return."""
        sys.stderr.flush()
        if self._mpi is not None:
            # not while another thread is inside MPI, unless it is stuck there
            self._lock.acquire(timeout=0.2)
            # from a duplicate, or a plain exit, mpiexec at times returns 9, the code of the killed
            self._mpi.COMM_WORLD.Abort(code)
        os._exit(code)
