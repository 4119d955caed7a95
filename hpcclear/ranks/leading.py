"""A design on its way through the ranks: root hands samples out and works along."""

import contextlib
import time
from collections.abc import Callable

import numpy as np

from hpcclear.ranks.mailbox import Backoff, Message, Tag
from hpcclear.ranks.progress import Progress
from hpcclear.ranks.schedule import COLUMNS, GLANCE, QUANTUM, HandOut, Kept, PointSource, Task
from hpcclear.ranks.stopping import RankFailed, Stopped
from hpcclear.ranks.team import Ranks

EARLY = 1.0
"""Seconds from the beginning of a stage in which the first samples are waited for."""

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
    lead = Lead(ranks, book, points)
    lead.on_records, lead.save, lead.progress = on_records, save, progress
    lead.kept = Kept(len(points), earlier) if keep else None
    progress.start(len(points), earlier)
    with contextlib.closing(progress), ranks.timed(task.name) as spent:
        if not book.done:
            lead.work(task, spent)
            ranks.queue = None
    return earlier[:0] if lead.kept is None else lead.kept.records()


class Lead:
    """Root's part in a stage: a design on its way through the ranks, seen from who hands it out."""

    def __init__(self, ranks: Ranks, book: HandOut, points: PointSource) -> None:
        self._ranks, self._mail = ranks, ranks.mail
        self._points = points
        self._present = set(range(1, ranks.size))  # ranks that will still say DONE
        self._early = time.monotonic() + EARLY
        self._closing = self._failed = False
        self.book = book
        self.progress = Progress("", style="quiet")
        self.on_records: Callable[[np.ndarray], object] | None = None
        self.save: Callable[[], object] | None = None
        self.kept: Kept | None = None

    def work(self, task: Task, spent: np.ndarray) -> None:
        """Run the stage; whatever ends it, everything finished is collected and delivered.

        `spent`: seconds of each rank, columns as `COLUMNS`, to be filled in.
        """
        self._spent = spent
        self._ranks.raise_if_stopped()
        self._mail.notify_others(Tag.STAGE, task)
        try:
            self._hand_out(task)
        except BaseException as error:
            self._failed = not isinstance(error, Stopped)
            self._gather(until=time.monotonic() + 1.2)
            raise
        self._gather(until=None)

    def _hand_out(self, task: Task) -> None:
        """Answer the others, and work along for a moment at a time, until every sample is finished."""
        queue, self._spent[0, _COMPILE] = self._ranks.make_queue(task)
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
