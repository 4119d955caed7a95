"""Who hands samples out: root to all ranks; where these are many, root to a leader on each node, and that to its others.

A rank serves whoever announced the stage to it. Shared out twice, samples cost root a message for each bundle of them,
and within a node all is as between root and a few ranks.
"""

import contextlib
import time
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from typing import Any, Protocol

import numpy as np

from hpcclear.ranks.mailbox import Backoff, Leave, Mail, Message, Tag
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import COLUMNS, GLANCE, QUANTUM, HandOut, Kept, Need, Points, WorkQueue
from hpcclear.ranks.stopping import RankFailed, Stopped, StopSwitch

EARLY = 1.0
"""Seconds from the beginning of a stage in which the first samples are waited for."""

_BUSY, _COMPILE = COLUMNS.index("busy"), COLUMNS.index("compile")
_NONE = np.empty(0, np.int64)


class Process(Protocol):
    """What a lead needs of its own process; see `hpcclear.ranks.team.Ranks`."""

    mail: Mail
    stop_switch: StopSwitch
    rank: int

    def make_queue(self, task: Any, /) -> tuple[WorkQueue, float]:
        """A worker for a task, and the seconds it took to make it."""

    def raise_if_stopped(self) -> None:
        """Raise `Stopped` if requested to end early."""

    def pass_on_stop(self) -> None:
        """Report to root a signal that only this rank may have received."""

    def heed(self, message: Message, /) -> None:
        """Act on what a rank may say at any time."""

    def writing(self) -> AbstractContextManager[None]:
        """Count the time inside as output."""


class Sharing(Protocol):
    """What a leader does with bundles of samples, besides handing these out."""

    @property
    def points(self) -> Points:
        """Points of the samples, by their numbers."""

    def open(self, index: np.ndarray, rows: np.ndarray) -> list[np.ndarray]:
        """Numbers of the samples in each of the bundles that came from root: their numbers (m,) and rows (m, d)."""

    def take(self, records: np.ndarray) -> None:
        """Take finished samples, records (m,)."""

    def finished(self) -> np.ndarray:
        """For root, once: a record for each bundle that is complete, shape (m,)."""

    def unfinished(self) -> list[np.ndarray]:
        """For root, at the end: records of whatever was taken of others, by type, shape (m,) each."""


class Lead:
    """A design on its way through ranks, seen from who hands it out.

    Parameters
    ----------
    ranks : Process
        This one.
    members : iterable of int
        The ranks that are served.
    """

    def __init__(
        self, ranks: Process, book: HandOut, points: Points, members: Iterable[int]
    ) -> None:
        self._ranks, self._mail = ranks, ranks.mail
        self._points = points
        self._present = set(members)  # ranks that will still say DONE
        self._early = time.monotonic() + EARLY
        self._closing = False
        self.book = book

    def _answer(self, message: Message) -> None:
        """Book what a rank sends, and give it what it requests."""
        source, tag, body = message
        if tag == Tag.ASK:
            records, need = body
            self._accept(records)
            if not self._closing:
                self._give(source, need)
        elif tag == Tag.RECORDS:
            self._accept(body)
        elif tag == Tag.DONE:
            records, times = body
            self._present.discard(source)
            self._book_times(times)
            self._accept(records)
        else:
            self._hear_more(message)

    def _give(self, source: int, need: Need) -> None:
        """Send a rank samples."""
        index, ask_below = self.book.grant(need)
        self._mail.send(source, Tag.BLOCK, (index, self._points[index], ask_below))

    def _work_along(self, queue: WorkQueue, backoff: Backoff) -> None:
        """Take samples oneself when it is time, and work on them for a moment; sleep if there is nothing to do."""
        if queue.hungry and self._can_answer:
            index, ask_below = self.book.grant(queue.need)
            queue.take(index, self._points[index], ask_below)
        if queue.idle:
            backoff.wait()
        else:
            self._accept(queue.work(GLANCE if self._awaited else QUANTUM))

    @property
    def _awaited(self) -> bool:
        """Whether others wait for their first samples or share the last."""
        return bool(self._present) and (time.monotonic() < self._early or self.book.ending)

    @property
    def _can_answer(self) -> bool:
        """Whether it is known now what a requesting rank may have; nothing, if no more will come."""
        return True

    def _accept(self, records: np.ndarray | None) -> None:
        """Book finished records, and do with them what is to be done."""
        raise NotImplementedError

    def _book_times(self, times: list[tuple[int, float, float]]) -> None:
        """Note rank, busy and set-up seconds of ranks that are through."""
        raise NotImplementedError

    def _hear_more(self, message: Message) -> None:
        """Act on a message that is not about samples."""
        raise NotImplementedError


class RootLead(Lead):
    """Root's part in a stage; parameters as `Lead`."""

    def __init__(
        self, ranks: Process, book: HandOut, points: Points, members: Iterable[int]
    ) -> None:
        super().__init__(ranks, book, points, members)
        self._members = sorted(self._present)
        self._failed = False
        self.progress = Progress("", style="quiet")
        self.on_records: Callable[[np.ndarray], object] | None = None
        self.save: Callable[[], object] | None = None
        self.kept: Kept | None = None

    def work(self, task: object, spent: np.ndarray) -> None:
        """Run the stage; whatever ends it, everything finished is collected and delivered.

        `spent`: seconds of each rank, columns as `COLUMNS`, to be filled in.
        """
        self._spent = spent
        self._ranks.raise_if_stopped()
        self._mail.notify(self._members, Tag.STAGE, task)
        try:
            self._hand_out(task)
        except BaseException as error:
            self._failed = not isinstance(error, Stopped)
            self._gather(until=time.monotonic() + 1.2)
            raise
        self._gather(until=None)

    def _hand_out(self, task: object) -> None:
        """Answer the others and work along until every sample is finished."""
        queue, self._spent[0, _COMPILE] = self._ranks.make_queue(task)
        backoff = Backoff()
        while not self.book.done:
            while (message := self._mail.poll()) is not None:
                self._answer(message)
                backoff.reset()
            if self._ranks.stop_switch.is_set():
                raise Stopped(self._ranks.stop_switch.reason)
            self._work_along(queue, backoff)
            self._spent[0, _BUSY] = queue.busy
            self.progress.refresh()

    def _gather(self, until: float | None) -> None:
        """End the stage on every rank; after an error or a stop, do not wait for ever."""
        self._closing = True
        self._mail.notify(self._members, Tag.END)
        backoff = Backoff()
        while self._present and (until is None or time.monotonic() < until):
            message = self._mail.poll()
            if message is None:
                backoff.wait()
            elif until is None:
                self._answer(message)
            else:  # one failure is on its way up already: the records count, not another report
                with contextlib.suppress(RankFailed):
                    self._answer(message)

    def _book_times(self, times: list[tuple[int, float, float]]) -> None:
        for rank, busy, setup in times:
            self._spent[rank, [_BUSY, _COMPILE]] = busy, setup

    def _hear_more(self, message: Message) -> None:
        if message.tag == Tag.ERROR:
            self._present.discard(message.source)
            self._accept(message.body[2])
        self._ranks.heed(message)

    def _accept(self, records: np.ndarray | None) -> None:
        """Book finished records and hand them on; after a failure, do no more than keep them."""
        if records is None or records.size == 0:
            return
        self.book.accept(records)
        if self.kept is not None:
            self.kept.add(records)
        with self._ranks.writing():
            if self.on_records is not None:
                callback, self.on_records = self.on_records, None  # one that fails gets no more
                callback(records)
                self.on_records = callback
            if self.save is not None and not self._failed:
                self.save()
        if not self._failed:
            self.progress.add(records)


class NodeLead(Lead):
    """A leader's part in a stage: it takes bundles from root, and shares out what they hold with the others on its node."""

    def __init__(self, ranks: Process, sharing: Sharing, group: list[int]) -> None:
        super().__init__(ranks, HandOut(0, _NONE, 1 + len(group)), sharing.points, group)
        self._sharing, self._group = sharing, group
        self._sizes: list[int] = []  # samples of each bundle
        self._waiting: list[tuple[int, Need]] = []  # asked while nothing was there
        self._ask_below = 1  # bundles
        self._asked = self._exhausted = self._over = False
        self._times: list[tuple[int, float, float]] = []

    def work(self, task: object) -> None:
        """Serve the node until root ends the stage."""
        self._mail.notify(
            self._group, Tag.STAGE, task
        )  # before the worker is made: nodes meet there
        queue, setup = self._ranks.make_queue(task)
        try:
            self._share_out(queue)
            self._close()
        except Exception:
            self._report()  # what is finished; the error follows
            raise
        self._times.append((self._ranks.rank, queue.busy, setup))
        self._report()
        self._mail.send(0, Tag.DONE, (None, self._times))

    def _share_out(self, queue: WorkQueue) -> None:
        """Answer root and the others, and work along."""
        backoff = Backoff()
        while not self._over:
            while (message := self._mail.poll()) is not None:
                self._hear(message)
                backoff.reset()
            self._ranks.pass_on_stop()
            self._speak()
            self._work_along(queue, backoff)

    def _hear(self, message: Message) -> None:
        """Root's word, or an answer to one of the others."""
        if message.source != 0:
            self._answer(message)
        elif message.tag == Tag.LEAVE:
            raise Leave(message.body)
        elif message.tag == Tag.END:
            self._over = True
        else:
            index, rows, self._ask_below = message.body
            self._asked, self._exhausted = False, index.size == 0
            if index.size:
                bundles = self._sharing.open(index, rows)
                self.book.extend(np.concatenate(bundles))
                self._sizes += map(len, bundles)
            waiting, self._waiting = self._waiting, []
            for source, need in waiting:
                self._give(source, need)

    def _speak(self) -> None:
        """Hand root the bundles that are done, and request others in time."""
        done = self._sharing.finished()
        if not (self._asked or self._exhausted) and self._stock < self._ask_below:
            self._mail.send(0, Tag.ASK, (done, Need(1, self._stock, 0.0)))
            self._asked = True
        elif done.size:
            self._mail.send(0, Tag.RECORDS, done)

    @property
    def _stock(self) -> int:
        """Bundles with samples that nobody has."""
        left, found = self.book.remaining, 0
        while left > 0:
            found += 1
            left -= self._sizes[-found]
        return found

    @property
    def _can_answer(self) -> bool:
        return self.book.remaining > 0 or self._exhausted

    def _give(self, source: int, need: Need) -> None:
        if self._can_answer:
            super()._give(source, need)
        else:
            self._waiting.append((source, need))

    def _close(self) -> None:
        """Let the others end the stage, and take what they have."""
        self._closing = True
        self._mail.notify(self._group, Tag.END)
        backoff = Backoff()
        while self._present:
            message = self._mail.poll()
            if message is None:
                backoff.wait()
            else:
                self._hear(message)

    def _report(self) -> None:
        """Send root all that was taken, of bundles that are done and of others."""
        for records in (self._sharing.finished(), *self._sharing.unfinished()):
            if records.size:
                self._mail.send(0, Tag.RECORDS, records)

    def _accept(self, records: np.ndarray | None) -> None:
        if records is not None and records.size:
            self.book.accept(records)
            self._sharing.take(records)

    def _book_times(self, times: list[tuple[int, float, float]]) -> None:
        self._times += times
