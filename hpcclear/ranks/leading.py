"""A design on its way through the ranks: root hands samples out and works along; the others request them."""

import contextlib
import math
import time
from collections.abc import Callable

import numpy as np

from hpcclear.ranks.mailbox import Backoff, Leave, Message, Tag
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import (
    COLUMNS,
    GLANCE,
    QUANTUM,
    HandOut,
    Need,
    PointSource,
    Task,
    Worker,
)  # fmt: skip
from hpcclear.ranks.stopping import RankFailed, Stopped
from hpcclear.ranks.team import Ranks

EARLY = 1.0
"""Seconds from the beginning of a stage in which the first samples are waited for."""

FLUSH_INTERVAL = 1.0
"""Seconds that a finished record waits on a rank at most."""

_BUSY, _COMPILE = COLUMNS.index("busy"), COLUMNS.index("compile")


def run_points(
    ranks: Ranks, task: Task, points: PointSource, *, completed: np.ndarray | None = None,
    on_records: Callable[[np.ndarray], object] | None = None, save: Callable[[], object] | None = None,
    progress: Progress | None = None, keep: bool = True,
) -> np.ndarray:  # fmt: skip
    """Simulate a design on all ranks; call it on root, as often as needed. Returns a record a sample in ascending order if
    `keep`.

    `points` are an array (n, d) or an object that makes the rows requested; samples whose records are `completed` are not
    simulated again. `on_records` gets every batch of newly finished records, on root, as they arrive; `save` is called after
    each batch, to write what has gathered; not again once anything has failed, while `on_records` still gets what the ranks
    had finished by then. Without `keep` memory does not grow with the records.

    Raises Stopped if requested to end early; `on_records` got everything that was finished, `save` may be due. Raises
    RankFailed if another rank failed; likewise.
    """
    earlier = np.empty(0, task.dtype) if completed is None else completed.astype(task.dtype)
    progress = Progress("", style="quiet") if progress is None else progress
    book = HandOut(len(points), earlier["sample"], task.workers or ranks.size)
    kept = Kept(len(points), earlier) if keep else None
    lead = Lead(ranks, book, points, on_records, save, progress, kept)
    progress.start(len(points), earlier)
    with contextlib.closing(progress), ranks.timed(task.name) as spent:
        if not book.done:
            lead.work(task, spent)
            ranks.suspects = list
    return earlier[:0] if kept is None else kept.records()


class Kept:
    """Records of a design of `total` samples in their order, put where they belong as they come: held once, never sorted."""

    def __init__(self, total: int, earlier: np.ndarray) -> None:
        self._records = np.empty(total, earlier.dtype)
        self._there = np.zeros(total, bool)
        self.add(earlier)

    def add(self, records: np.ndarray) -> None:
        """Take finished records; raises TypeError for those of another type, whose fields NumPy would assign by their order."""
        if records.dtype != self._records.dtype:
            raise TypeError(f"records are of type {records.dtype}, not {self._records.dtype}")
        self._records[records["sample"]] = records
        self._there[records["sample"]] = True

    def records(self) -> np.ndarray:
        """What has been taken, by growing number, shape (taken,)."""
        return self._records if self._there.all() else self._records[self._there]


class Lead:
    """Root's part in a stage: a design on its way through the ranks, seen from who hands it out."""

    def __init__(
        self, ranks: Ranks, book: HandOut, points: PointSource, on_records: Callable[[np.ndarray], object] | None,
        save: Callable[[], object] | None, progress: Progress, kept: Kept | None,
    ) -> None:  # fmt: skip
        self._ranks, self._mail = ranks, ranks.mail
        self._points = points
        self._present = set(range(1, ranks.size))  # ranks that will still say DONE
        self._early = time.monotonic() + EARLY
        self._closing = self._failed = False
        self.book, self.progress, self.kept = book, progress, kept
        self.on_records, self.save = on_records, save

    def work(self, task: Task, spent: np.ndarray) -> None:
        """Run the stage; whatever ends it, everything finished is collected and delivered.

        `spent`: seconds of each rank, columns as `COLUMNS`, to be filled in.
        """
        self._spent = spent
        self._ranks.raise_if_stopped()
        self._mail.notify_others(Tag.STAGE, (task, take_part))
        try:
            self._hand_out(task)
        except BaseException as error:
            self._failed = not isinstance(error, Stopped)
            self._gather(until=time.monotonic() + 1.2)
            raise
        self._gather(until=None)

    def _hand_out(self, task: Task) -> None:
        """Answer the others, and work along for a moment at a time, until every sample is finished."""
        queue, self._spent[0, _COMPILE] = queue_of(self._ranks, task)
        backoff = Backoff()
        while not self.book.done:
            while (message := self._mail.poll()) is not None:
                self._answer(message)
                backoff.reset()
            if self._ranks.stop_switch.is_set():
                raise Stopped(self._ranks.stop_switch.reason)
            if queue.hungry:
                index, ask_below = self.book.grant(queue.need)
                queue.take(index, self._points[index], ask_below)
            if queue.idle:
                backoff.wait()
            else:
                # others wait for their first samples, or share the last
                awaited = self._present and (time.monotonic() < self._early or self.book.ending)
                self._accept(queue.work(GLANCE if awaited else QUANTUM))
            self._spent[0, _BUSY] = queue.busy
            self.progress.refresh()

    def _gather(self, until: float | None) -> None:
        """End the stage on every rank; after an error or a stop, do not wait for ever."""
        self._closing = True
        self._mail.notify_others(Tag.END)
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

    def _answer(self, message: Message) -> None:
        """Book what a rank sends, and give it what it requests."""
        source, tag, body = message
        if tag == Tag.ASK:
            records, need = body
            self._accept(records)
            if not self._closing:
                index, ask_below = self.book.grant(need)
                self._mail.send(source, Tag.BLOCK, (index, self._points[index], ask_below))
        elif tag == Tag.RECORDS:
            self._accept(body)
        elif tag == Tag.DONE:
            records, times = body
            self._present.discard(source)
            self._spent[source, [_BUSY, _COMPILE]] = times
            self._accept(records)
        else:
            if tag == Tag.ERROR:
                self._present.discard(source)
                self._accept(body[2])
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


def take_part(ranks: Ranks, task: Task) -> None:
    """Another rank's part in a stage: request samples before the last ones are done, send records along, until root ends it."""
    queue, setup = queue_of(ranks, task)
    asked, sent_at, backoff = False, time.monotonic(), Backoff()
    while (message := ranks.mail.poll()) is None or message.tag != Tag.END:
        ranks.pass_on_stop()
        if message is not None:
            if message.tag == Tag.LEAVE:
                raise Leave(message.body)
            queue.take(*message.body)
            asked = False
            backoff.reset()
        overdue = queue.idle or time.monotonic() - sent_at > FLUSH_INTERVAL
        if queue.hungry and not asked:
            ranks.mail.send(0, Tag.ASK, (ranks.outbox(), queue.need))
            asked, sent_at = True, time.monotonic()
        elif ranks.unsent and overdue:
            ranks.mail.send(0, Tag.RECORDS, ranks.outbox())
            sent_at = time.monotonic()
        if queue.idle:
            backoff.wait()
        else:
            ranks.unsent.append(queue.work(GLANCE if queue.soon_hungry else QUANTUM))
    ranks.mail.send(0, Tag.DONE, (ranks.outbox(), (queue.busy, setup)))


def queue_of(ranks: Ranks, task: Task) -> tuple["WorkQueue", float]:
    """The queue of this rank's worker, and the seconds it took to make that."""
    started = time.perf_counter()
    recent = ranks.pace_of(task)
    queue = WorkQueue(task.make(task.payload, ranks), recent=recent)
    queue.exhausted = ranks.rank >= (ranks.size if task.workers is None else task.workers)
    ranks.suspects = queue.suspects
    return queue, time.perf_counter() - started


class WorkQueue:
    """One rank's samples in hand: feeds the worker, knows its stock, its speed and its busy time.

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
