"""The block policy, on ranks whose time is simulated, and the books of hand-out."""

import heapq
from collections import deque

import numpy as np
import pytest

from hpcclear.ranks.leading import WorkQueue
from hpcclear.ranks.schedule import QUANTUM, HandOut


class SimulatedWorker:
    """Lanes in lockstep on a clock of its own; a sample takes its cost in seconds of one lane."""

    def __init__(self, lanes: int) -> None:
        self.lanes = lanes
        self.now = 0.0
        self._queue: deque[tuple[int, float]] = deque()
        self._lanes: list[list[float]] = []

    @property
    def pending(self) -> int:
        return len(self._queue) + len(self._lanes)

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        self._queue += zip(index.tolist(), points.tolist(), strict=True)

    def advance(self, seconds: float) -> np.ndarray:
        finished = []
        while seconds > 1e-12 and self.pending:
            while self._queue and len(self._lanes) < self.lanes:
                self._lanes.append(list(self._queue.popleft()))
            step = min(seconds, min(left for _, left in self._lanes))
            seconds -= step
            self.now += step
            for lane in self._lanes:
                lane[1] -= step
            finished += [int(sample) for sample, left in self._lanes if left <= 1e-12]
            self._lanes = [lane for lane in self._lanes if lane[1] > 1e-12]
        return np.array([(sample,) for sample in finished], [("sample", np.int64)])


def simulate(costs: np.ndarray, ranks: int, lanes: int) -> float:
    """Summed busy time over ranks x makespan; root answers between its quanta, as in a job."""
    book = HandOut(costs.size, np.empty(0, np.int64), ranks)
    workers = [SimulatedWorker(lanes) for _ in range(ranks)]
    queues = [WorkQueue(worker, lambda worker=worker: worker.now) for worker in workers]
    requests: deque[tuple[float, int]] = deque()
    replies: list[tuple[float, tuple] | None] = [None] * ranks
    asked = [False] * ranks
    turns = [(0.0, rank) for rank in range(ranks)]
    finished = np.zeros(ranks)
    while not book.done:
        now, rank = heapq.heappop(turns)
        queue, worker = queues[rank], workers[rank]
        worker.now = now
        if rank == 0:
            while requests and requests[0][0] <= now:
                other = requests.popleft()[1]
                index, ask_below = book.grant(queues[other].need)
                replies[other] = (now, (index, costs[index], ask_below))
            if queue.hungry:
                index, ask_below = book.grant(queue.need)
                queue.take(index, costs[index], ask_below)
        else:
            reply = replies[rank]
            if reply is not None and reply[0] <= now:
                queue.take(*reply[1])
                asked[rank], replies[rank] = False, None
            if queue.hungry and not asked[rank]:
                requests.append((now, rank))
                asked[rank] = True
        if queue.idle:
            worker.now = now + 0.005
        else:
            book.accept(queue.work(QUANTUM))
            finished[rank] = worker.now
        heapq.heappush(turns, (worker.now, rank))
    return sum(queue.busy for queue in queues) / (ranks * finished.max())


def tenfold(total: int, mean: float) -> np.ndarray:
    """Costs spread tenfold, in random order."""
    costs = np.random.default_rng(3).permutation(np.geomspace(1.0, 10.0, total))
    return costs * mean / costs.mean()


@pytest.mark.parametrize(
    ("lanes", "seconds"), [(1, 0.002), (1, 0.05), (1, 0.5), (16, 0.02), (16, 0.2), (32, 0.5)]
)
def test_two_ranks_are_busy_to_the_end_at_a_tenfold_spread(lanes, seconds):
    samples = round(2 * 30.0 * lanes / seconds)  # a run of 30 s
    assert simulate(tenfold(samples, seconds), 2, lanes) > 0.97


def test_expensive_samples_at_the_end_of_a_table_are_shared():
    assert simulate(np.sort(tenfold(12000, 0.005)), 2, 1) > 0.97


def test_many_ranks_stay_busy():
    assert simulate(tenfold(64 * 400, 0.05), 64, 1) > 0.95


def test_a_desk_knows_its_samples_when_the_worker_raises():
    class Failing(SimulatedWorker):
        def advance(self, seconds: float) -> np.ndarray:
            raise ArithmeticError

    queue = WorkQueue(Failing(1))
    queue.take(np.array([7, 3]), np.array([1.0, 1.0]), 1)
    assert queue.suspects() == []
    with pytest.raises(ArithmeticError):
        queue.work()
    assert queue.suspects() == [3, 7]


@pytest.mark.parametrize("strange", [[5], [7, 7], [-1]])
def test_a_worker_may_only_return_what_it_was_given_and_once(strange):
    class Confused(SimulatedWorker):
        def advance(self, seconds: float) -> np.ndarray:
            return np.array([(sample,) for sample in strange], [("sample", np.int64)])

    queue = WorkQueue(Confused(1))
    queue.take(np.array([7, 3]), np.array([1.0, 1.0]), 1)
    with pytest.raises(RuntimeError, match=f"sample {strange[-1]}, which it does not have"):
        queue.work()
