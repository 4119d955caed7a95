"""Speed-up and efficiency on the available ranks, and lost time by cause."""

import os
import time

import numpy as np

from hpcclear.accuracy.profile import Profile, Variables
from hpcclear.accuracy.surrogate import region_of
from hpcclear.base.host import process_fields
from hpcclear.ensemble import simulate
from hpcclear.ranks import leading
from hpcclear.ranks.schedule import COLUMNS, Task
from hpcclear.ranks.team import Ranks
from hpcclear.scene import Scene
from hpcclear.scene.points import points_at
from hpcclear.scene.scene import record_of
from hpcclear.scene.streams import generator

LOSSES = ("start-up", "compilation", "imbalance", "writing")
"""Causes of lost time, core-seconds over all ranks."""


def measure(
    scene: Scene, case: str, sample_seconds: float, profile: Profile, ranks: Ranks
) -> Variables:
    """Time a fixed batch, and one that grows with the ranks, on 1, 2, 4, ... ranks."""
    numbers = np.unique([*2 ** np.arange(1 + int(np.log2(ranks.size))), ranks.size])
    samples = samples_of(sample_seconds, profile)
    each = max(samples // ranks.size, 32)
    strong = np.array([_timed(scene, case, samples, int(n), ranks) for n in numbers])
    last = ranks.stage_seconds[_stage(int(numbers[-1]), samples)]
    weak = np.array([_timed(scene, case, each * int(n), int(n), ranks) for n in numbers])
    total = sum(ranks.stage_seconds.values(), np.zeros_like(last))
    compiling, writing = (float(total[:, COLUMNS.index(k)].sum()) for k in ("compile", "write"))
    waiting = float(last[:, COLUMNS.index("idle")].sum())
    lost = [process_age_at_start() * ranks.size, compiling, waiting, writing]
    return {
        "ranks": numbers.astype(np.int64),
        "loss": np.array(LOSSES),
        "strong_seconds": strong,
        "weak_seconds": weak,
        "lost_seconds": np.array(lost),
    }


def samples_of(sample_seconds: float, profile: Profile) -> int:
    """Of the fixed batch."""
    return int(np.clip(profile.strong_seconds / sample_seconds, 64, 10**6))


def _stage(number: int, samples: int) -> str:
    return f"parallel: {samples} samples on {number} ranks"


def _timed(scene: Scene, case: str, samples: int, number: int, ranks: Ranks) -> float:
    """Wall seconds of a batch on the first `number` ranks, making of the workers left out."""
    region = region_of(scene, case)
    rng = generator(scene.required_study.seed, "accuracy", "parallel")
    coordinates = region.at(rng.random((samples, len(region.names))))
    points = points_at(scene, region.names, coordinates)
    stage = _stage(number, samples)
    payload = simulate.payload_of(scene, points)
    task = Task(stage, simulate.make_evaluator, payload, record_of(scene), workers=number)
    started = time.perf_counter()
    leading.run_points(ranks, task, points.values, keep=False)
    wall = time.perf_counter() - started
    return float(wall - ranks.stage_seconds[stage][0, COLUMNS.index("compile")])


_IMPORTED = time.clock_gettime(time.CLOCK_BOOTTIME) if hasattr(time, "CLOCK_BOOTTIME") else np.nan


def process_age_at_start() -> float:
    """Seconds from the start of this process to the import of this module, on Linux; NaN elsewhere.

    That is the interpreter, the package's imports and MPI's start.
    """
    fields = process_fields(os.getpid())
    if len(fields) <= 19 or not hasattr(os, "sysconf"):
        return float("nan")
    ticks = int(fields[19])
    return float(_IMPORTED - ticks / os.sysconf("SC_CLK_TCK"))
