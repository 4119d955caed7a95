"""Program errors at every stage: failing.py HOW MARK; MARK is touched when it happens."""

import pathlib
import sys
import time

import numpy as np
from synthetic import SleepingWorker, design

from hpcclear.base.errors import InputError
from hpcclear.ranks.boundary import run_on_ranks
from hpcclear.ranks.leading import run_points
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks

HOW, MARK = sys.argv[1], pathlib.Path(sys.argv[2])
OTHER = 1
BUSY = {"call on a rank, root busy": 60.0, "call on a rank, root late": 2.15}
"""Seconds for which root does not listen: in the second case, until the other one has begun to speak for itself."""


def fail() -> None:
    MARK.touch()
    raise ArithmeticError("raised on purpose")


def refuse() -> None:
    MARK.touch()
    raise InputError("crank.length", -1.0, "must be positive", "Give a length in metres.")


class Failing(SleepingWorker):
    """Raises in `advance` once it has finished some samples."""

    finished = 0

    def advance(self, seconds: float) -> np.ndarray:
        if self.finished >= 5:
            fail()
        records = super().advance(min(seconds, 0.012))
        self.finished += records.size
        return records


class Stray(SleepingWorker):
    """Returns records of samples it was never given."""

    def advance(self, seconds: float) -> np.ndarray:
        records = super().advance(seconds)
        records["sample"] += 10**6
        MARK.touch()
        return records


class Unwelcome:
    """Travels, but does not arrive."""

    def __reduce__(self) -> tuple:
        return fail, ()


def make(payload: object, ranks: Ranks) -> SleepingWorker:
    root = ranks.is_root
    if HOW == "maker on root" and root:
        fail()
    if HOW == "import on a rank" and not root:
        MARK.touch()
        import hpcclear.no_such_module  # noqa: F401
    if HOW in ("bad input on a rank", "deaf root, bad input") and ranks.rank == OTHER:
        refuse()
    if HOW == "bad input on every rank":
        refuse()
    if HOW == "deaf root" and ranks.rank == OTHER:
        time.sleep(0.5)  # root is in its callback by now
        fail()
    if HOW == "first on node" and root:
        ranks.first_on_node(fail)
    if HOW == "first on node":
        ranks.first_on_node(lambda: None)
    failing = {"worker on root": root, "worker on a rank": ranks.rank == OTHER}
    failing |= {"workers everywhere": True}
    if failing.get(HOW, False):
        return Failing(2e-3)
    if HOW == "stray record" and not root:
        return Stray(2e-3)
    return SleepingWorker(2e-3)


def call(payload: object, ranks: Ranks) -> None:
    if HOW == "call on root" and ranks.is_root:
        fail()
    if HOW == "call on a rank" and ranks.rank == OTHER:
        fail()
    if HOW in BUSY:
        if ranks.is_root:
            time.sleep(BUSY[HOW])
        if ranks.rank == OTHER:
            fail()
    if HOW == "bad input in a call on a rank" and ranks.rank == OTHER:
        refuse()


def receive(records: np.ndarray) -> None:
    if HOW == "callback":
        fail()
    if HOW.startswith("deaf root"):
        time.sleep(60.0)


def program(ranks: Ranks) -> int | None:
    if HOW == "bad input":
        refuse()
    if HOW == "exit code":
        MARK.touch()
        return 1
    payload = Unwelcome() if HOW == "payload" else None
    if "call" in HOW.split():
        ranks.everywhere("call", call, None)
    run_points(ranks, Task("sampling", make, payload), design(20_000), on_records=receive)
    return None


def program_with_fit(ranks: Ranks) -> int | None:
    if HOW == "serial":
        with ranks.stage("fit"):
            fail()
    if HOW == "system exit":
        MARK.touch()
        sys.exit(1)
    return program(ranks)


if __name__ == "__main__":
    sys.exit(run_on_ranks(program_with_fit))
