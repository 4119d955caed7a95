"""A leader on each node, where ranks are many: root hands it bundles of samples, and it shares these out on its node.

Shared out twice, samples cost root a message for each bundle of them, and within a node all is as between root and a few ranks.
"""

import numpy as np

from hpcclear.ranks.leading import Lead, Process, WorkQueue
from hpcclear.ranks.mailbox import Backoff, Leave, Message, Tag
from hpcclear.ranks.schedule import HandOut, Need, Sharing

_NONE = np.empty(0, np.int64)


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
