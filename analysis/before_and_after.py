"""Is this checkout slower than an earlier commit? Ensembles of several scenes, or the starts of commands; both sources in turn,
ratios pair by pair.

    python analysis/before_and_after.py 1386e2f                 # that commit against this checkout, eleven minutes
    python analysis/before_and_after.py 1386e2f --pairs 15 --designs 2048
    python analysis/before_and_after.py 1386e2f --record        # writes results/before_and_after.csv beside this file
    python analysis/before_and_after.py 063ea1e --starts        # commands that compute little, two minutes; results/starts.csv

A pair is two new processes, one of each source, of `TURNS` calls of `evaluate` each, by turns; the least processor time counts.
Where its memory lies makes one process as much as a tenth slower than another of the same code. Of a command its own process
counts, after one that fills the caches of bytecode and of compiled code. A line says the median of the ratios, new over old,
and their lower and upper quarter.
"""

import argparse
import csv
import datetime
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Self

import numpy as np
from same_bytes import ROOT, sources

from hpcclear.base.host import processor

RESULTS = ROOT / "analysis" / "results" / "before_and_after.csv"
HEAD = ["scene", "pairs", "before_s", "ratio", "lower_quarter", "upper_quarter", "before", "processor", "date"]  # fmt: skip
LINKAGES = "linkages/"
CASES = {
    "Lankarani-Nikravesh": ("slider_crank", {"C": (3e-4, 1e-3)}),
    "Hunt-Crossley": ("hunt_crossley", {"C": (3e-4, 1e-3)}),
    "V-twin": (f"{LINKAGES}v_twin", {"C": (2e-5, 8e-5)}),
    "crank-rocker, masses": (f"{LINKAGES}crank_rocker", {"mass": (0.2, 0.4), "C": (5e-5, 3e-4)}),
    "crank-rocker, length": (f"{LINKAGES}crank_rocker", {"coupler": (0.115, 0.125), "C": (5e-5, 3e-4)}),
    "Hunt-Crossley, load table": ("hunt_crossley", {"C": (3e-4, 1e-3)}),
    "four-stroke, gas table": (f"{LINKAGES}four_stroke", {"rod": (0.35, 0.65), "piston": (0.3, 0.5), "C": (1e-5, 5e-5)}),
}  # fmt: skip
"""Scenes of `jobs/`, and the ranges that their designs are drawn from, SI."""

STARTS = {
    "check slider_crank": ("check", "--no-cost", f"{ROOT}/jobs/slider_crank.toml"),
    "check quickstart": ("check", "--no-cost", f"{ROOT}/jobs/quickstart.toml"),
    "report of a response": ("report", "response.nc"),
    "simulate, compiled": ("simulate", f"{ROOT}/jobs/slider_crank.toml", "-o", "response.nc"),
    "--help": ("--help",),
}
"""Commands, in a folder with a response."""
SHORT = ("--help",)

TURNS = 5

LOAD = ["effects.slider_load=[[0, -2000], [1.5, -300], [3.1, 0], [5.5, -300]]"]


def work(designs: int) -> None:
    """Answer each line, a case, with the processor time of its ensemble, s."""
    import hpcclear

    for line in sys.stdin:
        name, ranges = CASES[line.rstrip("\n")]
        changes = LOAD if line.rstrip("\n").endswith("load table") else []
        scene = hpcclear.load_scene(ROOT / "jobs" / f"{name}.toml", changes)
        dice = np.random.default_rng(1)
        points = {key: dice.uniform(*ends, designs) for key, ends in ranges.items()}
        start = time.process_time()
        hpcclear.evaluate(scene, points)
        print(time.process_time() - start, flush=True)


class Worker:
    """A process with the package below `root`."""

    def __init__(self, root: Path, designs: int) -> None:
        self._process = subprocess.Popen(
            [sys.executable, __file__, "--worker", "--designs", str(designs)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"PYTHONPATH": str(root)},
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def seconds(self, case: str) -> float:
        """Processor time of one ensemble."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(case, file=self._process.stdin, flush=True)
        return float(self._process.stdout.readline())


def pair(before: Path, case: str, designs: int) -> tuple[float, ...]:
    """The least processor times of an ensemble in two new processes, old and new; the first call compiles."""
    with Worker(before, designs) as old, Worker(ROOT, designs) as new:
        turns = [(old.seconds(case), new.seconds(case)) for _ in range(TURNS + 1)]
    return tuple(np.min(turns[1:], axis=0))


class Starts:
    """Commands of `STARTS` by the package below `root`, in a folder of their own."""

    def __init__(self, root: Path, folder: Path) -> None:
        kept = {
            name: word for name, word in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
        }
        self._of = {"cwd": folder, "env": kept | {"PYTHONPATH": str(root)}}
        folder.mkdir()
        self.seconds("simulate, compiled")

    def seconds(self, case: str) -> float:
        """Processor time of one command, s: of user and system."""
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        words = [sys.executable, "-m", "hpcclear", *STARTS[case]]
        subprocess.run(words, check=True, capture_output=True, **self._of)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("commit", nargs="?")
    parser.add_argument("--pairs", type=int, default=7)
    parser.add_argument("--designs", type=int, default=256)
    parser.add_argument("--only", help="cases whose names contain this")
    parser.add_argument("--record", action="store_true", help=f"write {RESULTS.name}")
    parser.add_argument("--starts", action="store_true", help="processor time of commands instead")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    words = parser.parse_args()
    if words.worker:
        return work(words.designs)
    with tempfile.TemporaryDirectory() as place:
        before = sources(words.commit, Path(place) / "before")
        if words.starts:
            old, new = Starts(before, Path(place) / "old"), Starts(ROOT, Path(place) / "new")
        rows, run = [HEAD], [words.commit or "HEAD", processor(), f"{datetime.date.today()}"]
        print(f"{'scene':24s} {'before, s':>10s} {'ratio':>7s} {'quarters':>14s}")

        def measured(case: str) -> tuple[float, ...]:
            if words.starts:  # what is short is lost in the noise of others: the least of several
                turns = [
                    (old.seconds(case), new.seconds(case))
                    for _ in range(TURNS if case in SHORT else 1)
                ]
                return tuple(np.min(turns, axis=0))
            return pair(before, case, words.designs)

        for case in (
            one for one in (STARTS if words.starts else CASES) if (words.only or "") in one
        ):
            measured(case)  # fills the caches
            pairs = [measured(case) for _ in range(words.pairs)]
            old_s, new_s = np.array(pairs).T
            low, middle, high = np.quantile(new_s / old_s, (0.25, 0.5, 0.75))
            print(
                f"{case:24s} {np.median(old_s):10.3f} {middle:7.3f} {low:7.3f}-{high:.3f}",
                flush=True,
            )
            found = [f"{np.median(old_s):.3f}", *(f"{x:.3f}" for x in (middle, low, high))]
            rows.append([case, f"{words.pairs}", *found, *run])
    if words.record:
        with (RESULTS.with_name("starts.csv") if words.starts else RESULTS).open(
            "w", newline=""
        ) as file:
            csv.writer(file, lineterminator="\n").writerows(rows)


if __name__ == "__main__":
    main()
