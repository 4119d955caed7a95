"""Statistics of made-up outcomes of a scene's Monte Carlo points, streamed: streaming_run.py OUT.nc SAMPLES [LIMIT].

RAW=directory: samples are kept. FAILS=rank: its worker raises once it has finished some thousand samples.
"""

import os
import resource
import sys
import time
from pathlib import Path

import numpy as np

from hpcclear.base.outcome import OUTCOME, Flag, Status
from hpcclear.ensemble import statistics
from hpcclear.ensemble.session import Options
from hpcclear.ensemble.statistics import run_statistics
from hpcclear.ranks import launcher
from hpcclear.ranks.boundary import run_on_ranks
from hpcclear.ranks.stopping import StopSwitch
from hpcclear.ranks.team import Ranks
from hpcclear.scene import load_scene

SCENE = Path(__file__).parents[2] / "jobs" / "quickstart.toml"


class MadeUp:
    """Outcomes that follow from index and point alone, 100 000 a second: far more than a kernel makes."""

    lanes = 32

    def __init__(self) -> None:
        self._queue: list[np.ndarray] = []
        self._left = np.inf
        if os.environ.get("FAILS") == str(launcher.launched_rank()):
            self._left = 3000

    @property
    def pending(self) -> int:
        return sum(records.size for records in self._queue)

    def submit(self, index: np.ndarray, points: np.ndarray) -> None:
        records = np.zeros(index.size, OUTCOME)
        records["sample"] = index
        records["objective"] = points[:, 0] + 10.0 * points[:, -1]
        records["objective_spread"] = np.nan
        records["mean_gap"][:, :2] = points[:, :2]
        records["peak_contact_force"][:, :2] = 1e3 * points[:, 1:3]
        records["rhs_evaluations"] = 1000.0 + 1e3 * points[:, 0]
        broken = points[:, 0] > 0.4
        records["status"][broken] = Status.NOT_FINITE
        records["objective_uncertainty"] = np.nan
        for name in ("objective", "mean_gap", "peak_contact_force"):
            records[name][broken] = np.nan
        records["flags"][points[:, 1] > 0.2] = Flag.LATCHED
        self._queue.append(records)

    def advance(self, seconds: float) -> np.ndarray:
        if not self._queue:
            return np.zeros(0, OUTCOME)
        records = self._queue.pop(0)
        if records.size > 1000:
            records, rest = np.split(records, [1000])
            self._queue.insert(0, rest.copy())
        self._left -= records.size
        if self._left < 0:
            raise ArithmeticError("raised on purpose")
        time.sleep(1e-5 * records.size)
        return records.copy()


def make_made_up(payload: object, ranks: Ranks) -> MadeUp:
    """What takes the place of the kernel."""
    return MadeUp()


def scene_of(samples: int):
    """The first job, sampled at random."""
    return load_scene(SCENE, ['study.method="monte-carlo"', f"study.samples={samples}"])


def main(output: str, samples: str, limit: str = "") -> int:
    def program(ranks: Ranks) -> None:
        options = Options(style="quiet")
        raw = Path(os.environ["RAW"]) if "RAW" in os.environ else None
        run_statistics(scene_of(int(samples)), Path(output), ranks, raw=raw, options=options)
        print("peak MB", resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)

    statistics.make_evaluator = make_made_up  # type: ignore[assignment]
    with StopSwitch(ends_process=True) as stop:
        if limit:
            stop.limit_time(float(limit))
        return run_on_ranks(program, stop)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
