"""Repeated stages in one job; writes what came back and the seconds spent: equal.py OUT.npz."""

import sys
import time
from pathlib import Path

import numpy as np
from synthetic import design, make_sleeping

from hpcclear.ranks.boundary import run_on_ranks
from hpcclear.ranks.leading import run_points
from hpcclear.ranks.schedule import COLUMNS, Task
from hpcclear.ranks.team import Ranks


def leave_a_mark(name: str, ranks: Ranks) -> None:
    """What every rank does once."""
    time.sleep(0.05)
    with open(f"{name}-{ranks.rank}", "x"):
        pass


def program(ranks: Ranks) -> None:
    points = design(200)
    seen: list[np.ndarray] = []

    def task(name: str) -> Task:
        return Task(name, make_sleeping, {"cost": 2e-3, "lanes": 4})

    full = run_points(ranks, task("full"), points, on_records=seen.append)
    half = run_points(ranks, task("half"), points, completed=full[::2])
    few = run_points(ranks, task("sleep"), points[:1])
    none = run_points(ranks, task("sleep"), points[:0])
    streamed = run_points(ranks, task("sleep"), points[:9], on_records=seen.append, keep=False)
    ranks.everywhere("everywhere", leave_a_mark, sys.argv[1])
    called = sorted(
        path.name for path in Path(sys.argv[1]).parent.glob(f"{Path(sys.argv[1]).name}-*")
    )
    with ranks.stage("serial"), ranks.writing():
        pass
    np.savez(
        sys.argv[1],
        full=full,
        half=half,
        few=few,
        none=none,
        streamed=streamed,
        called=called,
        seen=np.concatenate(seen),
        size=ranks.size,
        **{f"seconds_{name}": table for name, table in ranks.stage_seconds.items()},
        columns=COLUMNS,
    )


if __name__ == "__main__":
    sys.exit(run_on_ranks(program))
