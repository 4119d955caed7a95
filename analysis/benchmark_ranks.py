"""Ranks on this machine: start-up, memory, busy time of two of them, four on two cores, and what statistics take.

    python analysis/benchmark_ranks.py            # about 5 minutes on a quiet machine
    python analysis/benchmark_ranks.py --quick    # runs of a few seconds

Samples whose costs spread tenfold (crank speeds from slow to fast, at random) are simulated on 1, 2 and 4 ranks, root
working, in rounds one after the other; ratios are medians of those within a round. Start-up is what passes between the
launch of mpiexec and the end of a first simulation on the slower rank, compiled code on disk. Writes benchmark_ranks.nc.
"""

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr  # ranks run this script, too: what only the outside needs is imported there

# rad/s: a slow revolution holds ten times as many vibrations of the contacts as a fast one
SLOWEST, FASTEST = 4.0, 1000.0
SAMPLES_A_SECOND = 700  # of one core, about


def launch(ranks: int, *arguments: object) -> list[dict[str, Any]]:
    """This script's inside on so many ranks: what each of them printed."""
    mpiexec = Path(sys.executable).parent / "mpiexec"
    environment = os.environ | {
        "PYTHONPATH": str(Path(__file__).parents[1]),
        "LAUNCHED_AT": repr(time.time()),
    }
    command = [str(mpiexec), "-n", str(ranks), sys.executable, __file__, "--inside"]
    done = subprocess.run(
        [*command, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=True,
        env=environment,
        timeout=900,
    )
    # lines of two ranks may come as one
    return [json.loads(found) for found in re.findall(r"{.*?}", done.stdout)]


# ---- on the ranks ----------------------------------------------------------------------------------


LINE: dict[str, Any] = {}
"""What this rank says of itself."""


class Watched:
    """The evaluator, with the time of its first finished sample."""

    def __init__(self, worker: Any) -> None:
        self._worker = worker

    def __getattr__(self, name: str) -> Any:
        return getattr(self._worker, name)

    def advance(self, seconds: float) -> np.ndarray:
        records: np.ndarray = self._worker.advance(seconds)
        if records.size:
            LINE.setdefault("first", time.time() - float(os.environ["LAUNCHED_AT"]))
        return records


def make_watched(payload: Any, ranks: Any) -> Watched:
    """The maker of every rank's worker, by a name that pickle finds."""
    from hpcclear.ensemble.simulate import make_evaluator

    return Watched(make_evaluator(payload, ranks))


def inside(task: str, count: int) -> int:
    """One rank: samples or statistics on all of them, then a line about itself."""
    from hpcclear.ensemble.simulate import payload_of
    from hpcclear.ranks.boundary import run_on_ranks
    from hpcclear.ranks.leading import run_points
    from hpcclear.ranks.schedule import COLUMNS, Task
    from hpcclear.ranks.team import Ranks
    from hpcclear.scene.scene import record_of

    line = LINE

    def program(ranks: Ranks) -> None:
        scene, points = design(count)
        if task == "statistics":
            from hpcclear.ensemble import statistics
            from hpcclear.ensemble.session import Options

            statistics.make_evaluator = make_watched
            with tempfile.TemporaryDirectory() as folder:
                output, options = Path(folder) / "out.nc", Options(style="quiet")
                statistics.run_statistics(scene, output, ranks, samples=count, options=options)
                spent = ranks.stage_seconds["statistics"]
        else:
            work = Task("samples", make_watched, payload_of(scene, points), record_of(scene))
            records = run_points(ranks, work, points.values)
            spent = ranks.stage_seconds["samples"]
            cost = records["rhs_evaluations"]
            line["spread"] = float(np.quantile(cost, 0.99) / np.quantile(cost, 0.01))
        line["makespan"] = float(spent[0].sum())
        line["busy"] = float(spent[:, COLUMNS.index("busy")].sum())
        line["made"] = float(spent[:, COLUMNS.index("compile")].max())

    code = run_on_ranks(program)
    line["memory"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(json.dumps(line), flush=True)
    return code


def design(count: int) -> tuple[Any, Any]:
    """Scene and points: crank speeds spread evenly over a decade and more, in random order."""
    from hpcclear.scene import load_scene
    from hpcclear.scene.points import Points

    job = Path(__file__).parents[1] / "jobs" / "quickstart.toml"
    scene = load_scene(job, ['study.method="monte-carlo"', f"study.samples={max(count, 1)}"])
    speeds = np.geomspace(SLOWEST, FASTEST, count)
    np.random.default_rng(1).shuffle(speeds)
    return scene, Points(("speed",), speeds[:, None], (("drive.speed",),))


# ---- outside ----------------------------------------------------------------------------------------


def row(lines: list[dict[str, Any]]) -> dict[str, float]:
    """What root said, and the ranks' first results and memory."""
    root = next(line for line in lines if "makespan" in line)
    others = [line["memory"] for line in lines if line is not root]
    return {
        "makespan": root["makespan"],
        "busy": root["busy"],
        "made": root["made"],
        "spread": root.get("spread", np.nan),
        "first": max(line.get("first", 0.0) for line in lines),
        "memory_root": root["memory"],
        "memory_other": max(others) if others else np.nan,
    }


def measure(seconds: float, rounds: int) -> "xr.Dataset":
    """All rounds: start-up on 2 ranks, the design on 1, 2 and 4, statistics on 2."""
    import xarray as xr

    from hpcclear.results.provenance import program

    launch(2, "samples", 64)  # compiles
    count = int(seconds * 2 * SAMPLES_A_SECOND)
    tasks = {
        "start": (2, "samples", 64),
        "1 rank": (1, "samples", count),
        "2 ranks": (2, "samples", count),
        "4 ranks": (4, "samples", count),
        "statistics": (2, "statistics", 2 * count),
    }
    rows: dict[str, list[dict[str, float]]] = {name: [] for name in tasks}
    for k in range(rounds):
        for name in np.roll(list(tasks), k).tolist():
            rows[name].append(row(launch(*tasks[name])))
    found = {
        key: (("task", "round"), [[r[key] for r in rows[name]] for name in tasks])
        for key in rows["start"][0]
    }
    return xr.Dataset(
        found,
        coords={"task": list(tasks)},
        attrs={**program(), "samples": count, "cores": os.cpu_count()},
    )


def report(data: "xr.Dataset") -> str:
    """80-column table."""
    median = lambda name, task: float(data[name].sel(task=task).median())  # noqa: E731
    share = lambda task, ranks: float(  # noqa: E731
        (data["busy"] / (ranks * data["makespan"])).sel(task=task).median()
    )
    wall = data["makespan"]
    ratio = lambda a, b: float((wall.sel(task=a) / wall.sel(task=b)).median())  # noqa: E731
    return "\n".join(
        [
            f"from mpiexec to the first result of 2 ranks: {median('first', 'start'):.2f} s",
            f"memory: root {float(data['memory_root'].max()):.0f} MB, "
            f"others {float(data['memory_other'].max()):.0f} MB at most",
            f"costs of samples, 99 % over 1 %: {median('spread', '2 ranks'):.1f}",
            f"2 ranks: {median('makespan', '2 ranks'):.1f} s, busy {share('2 ranks', 2):.3f} of it; "
            f"1 rank takes {ratio('1 rank', '2 ranks'):.2f} times as long",
            f"4 ranks on {data.attrs['cores']} cores: {ratio('4 ranks', '2 ranks'):.3f} times the wall time of 2",
            f"statistics on 2 ranks: {median('makespan', 'statistics'):.1f} s, "
            f"busy {share('statistics', 2):.3f} of it",
        ]
    )


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("-o", "--output", type=Path, default=Path("benchmark_ranks.nc"))
    parser.add_argument("--inside", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.inside is not None:
        sys.exit(inside(options.inside[0], int(options.inside[1])))
    data = measure(*((4.0, 1) if options.quick else (40.0, 3)))
    print(report(data))
    data.to_netcdf(options.output, engine="h5netcdf")


if __name__ == "__main__":
    main()
