"""Ranks that ask and a root that answers, event by event, under any policy of hand-out.

Assumed, not measured: ranks differ in speed by 3 % (standard deviation) and every hundredth is a quarter slower; a
message takes 5 us on the network. Samples of a block take the sum of independent draws from the measured costs; the
samples in a rank's lanes end one by one, so that half of the lanes stand idle during its last ones.
"""

import heapq
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.ranks.leading import FLUSH_INTERVAL
from hpcclear.ranks.schedule import QUANTUM, TAIL, Need, allot

LANES = 32
LATENCY = 5e-6  # s, network
WORK = 60.0  # s of work for a rank
MOST_REQUESTS = 2_000_000  # beyond, root's load alone decides

Policy = Callable[[int, int, Need], tuple[int, int]]


class Costs(NamedTuple):
    """What things take, in seconds."""

    samples: Array  # of one core, (m,): drawn from with replacement
    message: float  # root, to take in and answer one message
    record: float  # root, for each finished record
    handed: float  # root, for each sample handed out
    start: float  # from the launch of a process to its first simulation
    batch: float = 0.0  # root, besides, for a message with records, however many

    @property
    def mean(self) -> float:
        """Mean cost of a sample."""
        return float(self.samples.mean())


class Outcome(NamedTuple):
    """How a run went."""

    efficiency: float  # busy time over ranks times makespan
    root_load: float  # share of the makespan that root spends on messages
    makespan: float  # s, without start-up
    requests: float


# ---- policies ------------------------------------------------------------------------------------


def equal_shares(remaining: int, ranks: int, need: Need) -> tuple[int, int]:
    """Everything at once; `simulate` asks only once and gives each rank an equal share."""
    return remaining, 0


def half_a_second(remaining: int, ranks: int, need: Need) -> tuple[int, int]:
    """Blocks of half a second, whatever is left and however many ask."""
    size = min(remaining, max(2 * need.lanes, math.ceil(0.5 * need.rate)))
    return size, need.lanes + math.ceil(0.1 * need.rate)


def guided(remaining: int, ranks: int, need: Need) -> tuple[int, int]:
    """Half the fair share of what is left, however long that takes."""
    size = min(remaining, max(1, math.ceil(remaining / (TAIL * ranks))))
    return size, need.lanes + math.ceil(0.1 * need.rate)


POLICIES: dict[str, Policy] = {
    "package": allot,
    "equal shares": equal_shares,
    "half seconds": half_a_second,
    "guided": guided,
}


# ---- the simulation ---------------------------------------------------------------------------------


class _Team:
    """The ranks: how fast each is, until when it has work, and how much it was given."""

    def __init__(self, costs: Costs, size: int, lanes: int, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        slow = 1.0 + 0.25 * (self._rng.random(size) < 0.01)
        pace = np.clip(self._rng.normal(1.0, 0.03, size), 0.8, 1.2)
        # plain lists: they are read one entry at a time
        self.each = (costs.mean * slow * pace).tolist()  # s a sample
        self._spread = float(costs.samples.std()) / costs.mean
        self._shape = costs.samples / costs.mean
        self.lanes = lanes
        self.end = [0.0] * size
        self.busy = [0.0] * size
        self.given = [0] * size
        self.reported = [0.0] * size

    def seconds(self, rank: int, samples: int) -> float:
        """What a block of samples takes this rank."""
        if samples <= LANES:
            relative = float(self._rng.choice(self._shape, samples).sum())
        else:
            relative = samples + self._spread * math.sqrt(samples) * self._rng.standard_normal()
        return relative * self.each[rank]

    def pending(self, rank: int, now: float) -> float:
        """Samples it has not finished."""
        return max(self.end[rank] - now, 0.0) / self.each[rank]

    def take(self, rank: int, now: float, samples: int, ask_below: int) -> float:
        """Give it a block; returns when it will ask again."""
        taken = self.seconds(rank, samples)
        self.end[rank] = max(self.end[rank], now) + taken
        self.busy[rank] += taken
        self.given[rank] += samples
        return max(now, self.end[rank] - ask_below * self.each[rank])

    def need(self, rank: int, now: float) -> Need:
        """What it tells root; nothing of its speed the first time."""
        rate = 1.0 / self.each[rank] if self.given[rank] else 0.0
        return Need(self.lanes, int(self.pending(rank, now)), rate)

    def finished_since(self, rank: int, now: float) -> float:
        """Records that it has not reported yet; reports them."""
        done = self.given[rank] - self.pending(rank, now)
        fresh = done - self.reported[rank]
        self.reported[rank] = done
        return fresh


class _Root:
    """Root's clock and books."""

    def __init__(self, costs: Costs, team: _Team, total: int, policy: Policy) -> None:
        self.costs, self.team, self.policy = costs, team, policy
        self.size = len(team.each)
        self.left = total
        self.now = 0.0
        self.on_messages = 0.0
        self.requests = 0
        self.asking: list[tuple[float, int]] = [(LATENCY, rank) for rank in range(1, self.size)]
        self._ask_below = 1
        self._own = 0.0  # s of work in its own stock

    def answer(self) -> None:
        """Take in the first message, records and all, and reply to it."""
        asked, rank = heapq.heappop(self.asking)
        finished = self.team.finished_since(rank, asked)
        # records are sent on their own while a rank need not ask
        flushed = finished * self.team.each[rank] // FLUSH_INTERVAL
        size, ask_below = self.policy(self.left, self.size, self.team.need(rank, asked))
        service = (self.costs.message + self.costs.batch) * (1.0 + flushed)
        service += self.costs.record * finished
        service += self.costs.handed * size
        self.now += service
        self.on_messages += service
        self.requests += 1 + int(flushed)
        if size > 0:
            self.left -= size
            again = self.team.take(rank, self.now + LATENCY, size, ask_below)
            heapq.heappush(self.asking, (again + LATENCY, rank))

    def work(self) -> None:
        """A quantum of root's own samples, if it has any; else wait for a message."""
        stock = self._own / self.team.each[0]
        if self.left > 0 and stock < self._ask_below:
            rate = 1.0 / self.team.each[0] if self.team.given[0] else 0.0
            size, self._ask_below = self.policy(
                self.left, self.size, Need(self.team.lanes, int(stock), rate)
            )
            self.left -= size
            taken = self.team.seconds(0, size)
            self._own += taken
            self.team.busy[0] += taken
            self.team.given[0] += size
        if self._own > 0.0:
            spent = min(QUANTUM, self._own)
            self._own -= spent
            self.now += spent
            self.team.end[0] = self.now
        elif self.asking:
            self.now = max(self.now, self.asking[0][0])

    @property
    def over(self) -> bool:
        """Whether nothing is left to hand out, to answer or to do."""
        return self.left == 0 and not self.asking and self._own <= 0.0


def _run(root: _Root) -> Outcome:
    """Until nothing is left; at its end a rank loses half of its lanes."""
    team, costs = root.team, root.costs
    idle = 0.5 * team.lanes
    while not root.over:
        if root.asking and root.asking[0][0] <= root.now:
            root.answer()
        else:
            root.work()
    # the last samples leave lanes empty
    last = max(end + idle * each for end, each in zip(team.end, team.each, strict=True))
    unreported = sum(team.given[1:]) - sum(team.reported[1:])
    closing = (costs.message + costs.batch) * root.size + costs.record * unreported
    makespan = max(last, root.now) + closing
    busy = sum(team.busy)
    return Outcome(
        busy / (root.size * makespan),
        (root.on_messages + closing) / makespan,
        makespan,
        root.requests,
    )


def simulate(
    costs: Costs, ranks: int, policy: Policy, *, work: float = WORK, seed: int = 1
) -> Outcome:
    """A run of `ranks` processes with `work` seconds each, root among them.

    Parameters
    ----------
    costs : Costs
    ranks : int
    policy : callable
        As `hpcclear.ranks.schedule.allot`.
    work : float
        Seconds of work for each rank, on average.
    seed : int
        Of speeds and draws of costs.
    """
    total = max(round(ranks * work / costs.mean), ranks)
    team = _Team(costs, ranks, LANES, seed)
    if policy is equal_shares:
        return _equal_shares(costs, team, total)
    if policy is half_a_second and ranks * work / 0.5 > MOST_REQUESTS:
        return _saturated(costs, ranks, total, work, 2.0 * work)
    return _run(_Root(costs, team, total, policy))


def _equal_shares(costs: Costs, team: _Team, total: int) -> Outcome:
    """No requests: root sends each its share, and takes in all records."""
    ranks = len(team.each)
    share = total / ranks
    sending = (costs.message + costs.handed * share) * np.arange(ranks)
    taking = costs.record * total
    taking += (costs.message + costs.batch) * ranks * (1.0 + WORK / FLUSH_INTERVAL)
    took = np.array([team.seconds(rank, round(share)) for rank in range(ranks)])
    last = float((sending + took + 0.5 * team.lanes * np.array(team.each)).max())
    makespan = max(last, float(took[0] + sending[-1] + taking))
    return Outcome(
        float(took.sum()) / (ranks * makespan), (sending[-1] + taking) / makespan, makespan, ranks
    )


def _saturated(costs: Costs, ranks: int, total: int, work: float, requests: float) -> Outcome:
    """A root that does nothing but answer: it decides how long the run takes."""
    serving = ranks * requests * (costs.message + costs.batch) + total * (
        costs.record + costs.handed
    )
    makespan = max(serving, work)
    return Outcome(work / makespan, serving / makespan, makespan, ranks * requests)
