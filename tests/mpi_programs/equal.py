"""Repeated stages in one job; writes what came back and the seconds spent: equal.py OUT.npz."""

import sys

import numpy as np
from synthetic import design, make_sleeping

from hpcclear.ranks.boundary import run_on_ranks
from hpcclear.ranks.team import COLUMNS, Ranks


def program(ranks: Ranks) -> None:
    points = design(200)
    seen: list[np.ndarray] = []
    payload = {"cost": 2e-3, "lanes": 4}
    full = ranks.run_points("sleep", payload, points, on_records=seen.append, stage="full")
    half = ranks.run_points("sleep", payload, points, completed=full[::2], stage="half")
    few = ranks.run_points("sleep", payload, points[:1])
    none = ranks.run_points("sleep", payload, points[:0])
    streamed = ranks.run_points("sleep", payload, points[:9], on_records=seen.append, keep=False)
    with ranks.stage("serial"), ranks.writing():
        pass
    np.savez(
        sys.argv[1],
        full=full,
        half=half,
        few=few,
        none=none,
        streamed=streamed,
        seen=np.concatenate(seen),
        size=ranks.size,
        **{f"seconds_{name}": table for name, table in ranks.stage_seconds.items()},
        columns=COLUMNS,
    )


if __name__ == "__main__":
    sys.exit(run_on_ranks(program, {"sleep": make_sleeping}))
