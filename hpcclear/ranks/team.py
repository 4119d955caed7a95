"""The processes of a job at work, stage after stage; `hpcclear.ranks.leading` has those that simulate.

The other ranks wait for root's stages and work on what it hands out. Root works too, and looks into
its mailbox between short quanta of its own work. No rank ever blocks inside MPI: every wait is a
poll with short sleeps, so that waiting costs nothing and errors and stops are heard everywhere.
"""

import contextlib
import importlib
import pickle
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn

import numpy as np

from hpcclear.ranks.mailbox import Backoff, Leave, Mail, Message, Tag
from hpcclear.ranks.schedule import COLUMNS, Task
from hpcclear.ranks.stopping import RankFailed, Stopped, StopSwitch

Call = Callable[[Any, "Ranks"], object]
"""What each rank does once, with a payload."""


class Ranks:
    """The processes of one job. Made by `run_on_ranks`, or by `alone` for one process; `is_root`: this one runs the program.

    `stage_seconds`: on root, seconds of every rank in each stage, float64 (size, 4), columns as in `COLUMNS`; every row of a
    stage adds up to its wall time. `suspects`: returns the samples that a worker's error may be of (`WorkQueue`); `unsent`:
    finished records that root has not got.
    """

    def __init__(self, mail: Mail, stop: StopSwitch) -> None:
        self.mail = mail
        self.stop_switch = stop
        self._stage = "start"
        self.suspects: Callable[[], list[int]] = list
        self.unsent: list[np.ndarray] = []
        self._writing = 0.0  # seconds of output not booked yet
        self._booked = 0.0  # wall seconds booked in `stage_seconds`
        self._passed_on = False
        self._known, self._recent = b"", np.zeros(2)  # a kind of worker, and its pace (`WorkQueue`)
        self.rank = mail.rank
        self.size = mail.size
        self.is_root = mail.rank == 0
        self.stage_seconds: dict[str, np.ndarray] = {}

    def first_on_node(self, action: Callable[[], object]) -> None:
        """Let one rank of each node do `action` before the others: it compiles, they load.

        For makers; every rank of the node must call it.
        """
        if self.mail.node_rank == 0:
            action()
        self.mail.meet_on_node()
        if self.mail.node_rank != 0:
            action()

    @property
    def where(self) -> str:
        """Rank, stage and, after an error of the worker, its samples: for reports."""
        samples = self.suspects()
        shown = ", ".join(map(str, samples[:8])) + (", ..." if len(samples) > 8 else "")
        place = f"rank {self.rank} of {self.size} in stage '{self._stage}'"
        if len(samples) > 1:
            return f"{place}, one of {len(samples)} samples in hand: {shown}"
        return f"{place}, sample {shown}" if samples else place

    def raise_if_stopped(self) -> None:
        """Raise `Stopped` if a signal on any rank or the time limit requests an early end, RankFailed if another rank failed;
        for loops of serial code on root."""
        while (message := self.mail.poll()) is not None:
            self.heed(message)
        if self.stop_switch.is_set():
            raise Stopped(self.stop_switch.reason)

    def stage(self, name: str) -> contextlib.AbstractContextManager[Any]:
        """Name what root does inside, for error reports and `stage_seconds`."""
        return self.timed(name, serial=True)

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Count root's time inside as output of the stage under way."""
        started = time.perf_counter()
        try:
            yield
        finally:
            self._writing += time.perf_counter() - started

    def everywhere(self, name: str, function: Call, payload: object) -> None:
        """Call `function(payload, ranks)` of a module once on every rank, and wait until all have returned; on root.

        `name`: for reports and timing; the time is booked as set-up. Raises Stopped if requested to end early, RankFailed if
        another rank failed.
        """
        with self.timed(name) as spent:
            self.raise_if_stopped()
            self.mail.notify_others(Tag.CALL, (name, function, payload))
            spent[0, COLUMNS.index("compile")] = self._call(function, payload)
            waited_for, backoff = set(range(1, self.size)), Backoff()
            while waited_for and not self.stop_switch.is_set():
                message = self.mail.poll()
                if message is None:
                    backoff.wait()
                elif message.tag == Tag.DONE:
                    waited_for.discard(message.source)
                    spent[message.source, COLUMNS.index("compile")] = message.body[1][1]
                else:
                    self.heed(message)
            self.raise_if_stopped()

    def _call(self, function: Call, payload: object) -> float:
        """Do this rank's share of a call; the seconds it took."""
        started = time.perf_counter()
        function(payload, self)
        return time.perf_counter() - started

    @contextlib.contextmanager
    def timed(self, name: str, serial: bool = False) -> Iterator[np.ndarray]:
        """Book the wall time inside, less what is booked inside; yields the table to fill."""
        spent = np.zeros((self.size, len(COLUMNS)))
        outer, self._stage = self._stage, name
        writing, self._writing = self._writing, 0.0
        started, booked = time.perf_counter(), self._booked
        try:
            yield spent
            self._stage = outer  # not after an error: its report names the stage
        finally:
            wall = time.perf_counter() - started - (self._booked - booked)
            spent[0, COLUMNS.index("write")] = self._writing
            if serial:
                spent[0, COLUMNS.index("busy")] = wall - self._writing
            spent[:, COLUMNS.index("idle")] = np.maximum(wall - spent.sum(axis=1), 0.0)
            self.stage_seconds[name] = self.stage_seconds.get(name, 0.0) + spent
            self._booked += wall
            self._writing = writing

    def heed(self, message: Message) -> None:
        """Act on what a rank may say at any time."""
        if message.tag == Tag.STOP:
            self.stop_switch.request(message.body)
        elif message.tag == Tag.ERROR:
            raise RankFailed(*message.body[:2])

    def pace_of(self, task: Task) -> np.ndarray:
        """Pace of this rank's worker (`WorkQueue.recent`): of a stage like the last one it is known how long samples take."""
        mark = pickle.dumps((task.make, task.payload)) if self.size > 1 else b""
        if mark != self._known:
            self._known, self._recent = mark, np.zeros(2)
        return self._recent

    def serve(self, ahead: Sequence[str] = ()) -> NoReturn:
        """Work for root, stage after stage, until it says to leave; load the modules `ahead` while it says nothing yet."""
        backoff, waiting = Backoff(0.02), list(ahead)
        while True:
            message = self.mail.poll()
            self.pass_on_stop()
            if message is None and waiting:
                importlib.import_module(waiting.pop(0))
            elif message is None:
                backoff.wait()
            elif message.tag == Tag.LEAVE:
                raise Leave(message.body)
            elif message.tag == Tag.STAGE:
                task, take_part = message.body
                self._stage = task.name
                take_part(self, task)
                self.suspects = list
                backoff.reset()
            elif message.tag == Tag.CALL:
                self._stage, function, payload = message.body
                self.mail.send(0, Tag.DONE, (None, (0.0, self._call(function, payload))))
                backoff.reset()

    def outbox(self) -> np.ndarray | None:
        """Finished records that root has not got yet; empties the box."""
        records = np.concatenate(self.unsent) if self.unsent else None
        self.unsent.clear()
        return records

    def pass_on_stop(self) -> None:
        """Report to root a signal that only this rank may have received."""
        if self.stop_switch.is_set() and not self._passed_on:
            self.mail.send(0, Tag.STOP, f"{self.stop_switch.reason} on rank {self.rank}")
            self._passed_on = True
