"""How long the first result takes: from the command to the file, with nothing compiled and with what an earlier scene compiled.

    python analysis/first_result.py                          # about a minute
    python analysis/first_result.py --before FOLDER --pairs 3  # writes results/first_result.csv beside this file

Every row is one `hpcclear simulate` in a process of its own. The first of each group finds an empty cache (HPCCLEAR_CACHE is a
new folder), those below it find what the rows above have left. Wall time, and the processor's, which says more on a
machine that does other work as well.

With another checkout, the two simulate by turns: the paper's scene, a four-bar and a V-twin with nothing compiled, and the
paper's scene with everything compiled, and `--help`. Each run with nothing compiled has an empty cache of its own.
"""

import argparse
import csv
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
JOB = ROOT / "jobs" / "slider_crank.toml"
STIFF = [
    'effects.contact={law="hunt-crossley", damping=50.0}',
    'effects.friction={law="coulomb", coefficient=0.1, ramp_speed=0.0005}',
    "numerics.transient_revolutions=0",
    "numerics.averaged_revolutions=1",
]
FOUR_BAR, V_TWIN = "linkages/crank_rocker.toml", "linkages/v_twin.toml"
SHORT = ["numerics.transient_revolutions=0", "numerics.averaged_revolutions=1"]
GROUPS: dict[str, dict[str, list[str]]] = {
    "empty cache": {
        "the paper's scene": [],
        "the same again": [],
        "other effects": [
            'effects.contact={law="hunt-crossley", damping=0.5}',
            "effects.gravity=9.81",
            "effects.slider_load=-30.0",
        ],
        "one joint ideal": ['joints.rod_slider={kind="ideal"}'],
        "driven by a torque": [
            'drive={kind="torque", torque=5.0, initial_speed=520.0, flywheel_inertia=0.01}'
        ],
        "a four-bar": [FOUR_BAR, *SHORT],
        "a V-twin": [V_TWIN, *SHORT],
    },
    "empty cache, stiff": {
        "friction with a steep ramp": STIFF,
        "the same again": STIFF,
        "other effects": [*STIFF, "effects.gravity=9.81"],
    },
}
"""By group, then by row: what is set beside the job's scene, or beside another whose file is named first."""


RESULTS = ROOT / "analysis" / "results" / "first_result.csv"
COMPARED: dict[str, tuple[list[str] | None, bool]] = {
    "paper, cold": ([], True),
    "four-bar, cold": ([FOUR_BAR, *SHORT], True),
    "V-twin, cold": ([V_TWIN, *SHORT], True),
    "paper, warm": ([], False),
    "--help": (None, False),
}
"""By name: what is set, None for `--help`; and whether nothing is compiled before."""


def run(
    overrides: list[str] | None, cache: str, out: Path, root: Path = ROOT
) -> tuple[float, float]:
    """Wall and processor seconds of one command of a checkout."""
    job = JOB
    if overrides and overrides[0].endswith(".toml"):
        job, overrides = JOB.parent / overrides[0], overrides[1:]
    words = [word for override in overrides or [] for word in ("--set", override)]
    command = [sys.executable, "-P", "-m", "hpcclear"]
    command += ["--help"] if overrides is None else ["simulate", str(job), *words, "-o", str(out)]
    environment = {**os.environ, "PYTHONPATH": str(root), "HPCCLEAR_CACHE": cache}
    environment.pop("NUMBA_CACHE_DIR", None)
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - started, used


def compare(before: Path, pairs: int) -> None:
    """Run two checkouts by turns; print and write medians of seconds, and of the ratios of pairs."""
    measured = ["processor_before_s", "processor_now_s", "wall_before_s", "wall_now_s"]
    rows: list[list[object]] = [["what", "pairs", *measured, "ratio_of_processor"]]
    warm: dict[Path, str] = {}  # caches of the first runs, which the warm ones find
    with tempfile.TemporaryDirectory() as folder:
        print(f"{'':<18}{'processor s':>24}{'wall s':>24}{'ratio':>8}")
        for name, (overrides, cold) in COMPARED.items():
            found = []
            for _ in range(pairs):
                pair = []
                for root in (before, ROOT):
                    cache = tempfile.mkdtemp(dir=folder) if cold else warm[root]
                    warm.setdefault(root, cache)
                    out = (
                        Path(tempfile.mkdtemp(dir=folder)) / "out.nc"
                    )  # versions do not read each other's
                    pair.append(run(overrides, cache, out, root))
                found.append(pair)
            times = [
                round(statistics.median(pair[side][kind] for pair in found), 2)
                for kind in (1, 0)
                for side in (0, 1)
            ]
            ratio = round(statistics.median(now[1] / old[1] for old, now in found), 3)
            line = "".join(f"{one:>12.2f}" for one in times)
            print(f"{name:<18}{line}{ratio:>8.3f}", flush=True)
            rows.append([name, pairs, *times, ratio])
            with RESULTS.open("w", newline="") as file:
                csv.writer(file, lineterminator="\n").writerows(rows)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--before", type=Path, help="another checkout, to be compared")
    parser.add_argument("--pairs", type=int, default=3)
    given = parser.parse_args()
    if given.before:
        compare(given.before.resolve(), given.pairs)
        return
    with tempfile.TemporaryDirectory() as folder:
        for number, (group, rows) in enumerate(GROUPS.items()):
            print(f"{group:<34}{'wall s':>8}{'processor s':>14}", flush=True)
            cache = Path(folder) / f"cache{number}"
            cache.mkdir()
            for k, (name, overrides) in enumerate(rows.items()):
                wall, used = run(overrides, str(cache), Path(folder) / f"{number}_{k}.nc")
                print(f"  {name:<32}{wall:>8.1f}{used:>14.1f}", flush=True)


if __name__ == "__main__":
    main()
