"""What a run that was ended early lost, from the log of mpi_programs/command.py, and whether it had to.

No rate and no speed of a machine enters: what was saved is told from what was received, and what was
received from what a rank still had.
"""

from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from hpcclear.ranks.leading import FLUSH_INTERVAL

UNSAVED = ("readings: simulations", "surrogate: ", "random inputs: ", "parallel: ")
"""Beginnings of the names of stages that are kept a reading or a panel of `accuracy` at a time, not by samples: a
batch that is timed is whole."""

COMPILING = "compilation#"
"""Beginning of the name of a design that is simulated at each start, so that every rank has its kernel."""

RESPONSES = ("bifurcation#", "ensemble#")
"""Beginnings of the names of single responses, which are kept as a stage that is written again each time."""

DELIVERY = 10
"""Turns of root within which a message that was sent is received: MPI needs some polls for a long one."""


@dataclass(frozen=True)
class Event:
    """A line of the log."""

    time: float
    rank: int
    what: str
    samples: frozenset[str]


def read(log: Path) -> list[Event]:
    """Events of one run; those of a rank in their order."""
    lines = [line.split("\t") for line in log.read_text().splitlines()] if log.exists() else []
    return [
        Event(float(t), int(rank), what, frozenset(n for n in rest if not n.startswith(COMPILING)))
        for t, rank, what, *rest in lines
    ]


def samples(events: list[Event], what: str) -> set[str]:
    """All samples that something happened to."""
    return set().union(*(event.samples for event in events if event.what == what))


def saved_and_since(events: list[Event]) -> tuple[set[str], float]:
    """Samples in completed saves, and when the last of these began."""
    saved, received, writing = set[str](), set[str](), set[str]()
    since = began = events[0].time if events else 0.0
    for event in events:
        if event.what == "received":
            received |= event.samples
        elif event.what in ("saving", "saving a stage"):
            writing, began = set(received), event.time
            if (
                event.what == "saving"
            ):  # only the result of a reading or panel is kept, not its samples
                writing = {sample for sample in writing if not sample.startswith(UNSAVED)}
        elif event.what in ("saved", "saved a stage"):
            saved, since = saved | writing, began
    return saved, since


def check_interval_kept(events: list[Event], interval: float) -> None:
    """Assert that root saved at the first batch of samples after the interval, each time."""
    root = [event for event in events if event.rank == 0 and event.what != "finished"]
    since, stage_since = 0.0, 0.0
    for event, following in pairwise(root):
        if event.what in ("opened", "saved"):
            since = event.time
        if event.what in ("stage", "saved a stage"):
            stage_since = event.time
        if event.what != "received" or all(name.startswith(UNSAVED) for name in event.samples):
            continue
        single = all(name.startswith(RESPONSES) for name in event.samples)
        if event.time - (stage_since if single else since) >= interval:
            saving = "saving a stage" if single else "saving"
            assert following.what == saving, (event, following)


def check_sent_in_time(events: list[Event], lost: set[str]) -> None:
    """Assert that lost samples which root never received had not been on their way for long."""
    turns = {
        rank: [e.time for e in events if (e.rank, e.what) == (rank, "finished")]
        for rank in {0} | {e.rank for e in events}
    }
    missing = lost - samples(events, "received")
    for event in events:
        if event.what != "finished" or not event.samples & missing:
            continue
        own = turns[event.rank]
        if event.rank == 0:
            assert event.time == own[-1]
            continue
        later = bisect_right(own, event.time + FLUSH_INTERVAL)
        if later + 1 < len(own):  # the turn after which it was sent was followed by another
            assert len(turns[0]) - bisect_right(turns[0], own[later + 1]) <= DELIVERY


@dataclass(frozen=True)
class Loss:
    """What one run lost: samples done again, seconds since the last good save began; and in which stage."""

    samples: int
    seconds: float
    stage: str


def loss_of(log: Path, later: list[Path], interval: float | None) -> Loss:
    """Assert that a run which was killed lost no more than it may; how much it lost.

    Parameters
    ----------
    log : Path
        Of that run.
    later : list of Path
        Of those that went on from it.
    interval : float, optional
        Seconds between two saves; None if saves were made to fail.
    """
    events, again = read(log), set[str]()
    for other in later:
        again |= samples(read(other), "finished")
    lost = samples(events, "finished") & again
    saved, since = saved_and_since(events)
    assert not lost & saved, "what was saved was done again"
    check_sent_in_time(events, lost)
    if interval is not None:
        check_interval_kept(events, interval)
    stages = [event for event in events if event.what == "stage"]
    stage = min(stages[-1].samples) if stages else "start"
    return Loss(len(lost), max(e.time for e in events) - since if lost else 0.0, stage)
