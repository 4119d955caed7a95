"""What stopping.py runs: WHERE FOLDER [TIME_LIMIT].

FOLDER/ready is touched when WHERE is reached; FOLDER/records holds what was finished, and a second
run goes on from there; FOLDER/result.npy is written at the end.
"""

import pathlib
import sys
import time

import numpy as np
from synthetic import SleepingWorker, design, make_sleeping

from hpcclear.base.outcome import OUTCOME
from hpcclear.ranks.leading import run_points
from hpcclear.ranks.schedule import Task
from hpcclear.ranks.team import Ranks

WHERE, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])


def reached(where: str) -> None:
    if where == WHERE:
        (FOLDER / "ready").touch()


def save(records: np.ndarray) -> None:
    with open(FOLDER / "records", "ab") as file:
        file.write(records.tobytes())
    reached("sampling")


def make_slowly(payload: dict, ranks: Ranks) -> SleepingWorker:
    if not ranks.is_root:
        reached("set-up of a rank")
        time.sleep(60.0)
    return make_sleeping(payload, ranks)


def wait_on_ranks(payload: object, ranks: Ranks) -> None:
    if not ranks.is_root:
        reached("call of a rank")
        time.sleep(60.0)


def program(ranks: Ranks) -> None:
    reached("begin")
    if WHERE == "begin":
        time.sleep(0.3)
    if WHERE == "set-up of a rank":
        run_points(ranks, Task("slow", make_slowly, {"cost": 1e-3}), design(10**6))
    if WHERE == "call of a rank":
        ranks.everywhere("call", wait_on_ranks, None)
    if WHERE == "polling":
        with ranks.stage("fit"):
            while True:
                reached("polling")
                time.sleep(0.05)
                ranks.raise_if_stopped()
    if WHERE == "deaf":
        reached("deaf")
        time.sleep(60.0)
    path = FOLDER / "records"
    completed = np.frombuffer(path.read_bytes() if path.exists() else b"", OUTCOME)
    task = Task("sampling", make_sleeping, {"cost": 4e-3, "lanes": 2})
    points = design(100_000 if WHERE == "limited" else 800)
    result = run_points(ranks, task, points, completed=completed, on_records=save)
    np.save(FOLDER / "result.npy", result)
