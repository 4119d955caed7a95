"""Repeat every statistical test with other seeds: how often each was red, and what it had to spare.

    python tests/repeat_statistical.py                              all, 50 other seeds each
    python tests/repeat_statistical.py --seeds 10 tests/test_mopso.py
    python tests/repeat_statistical.py -m "not full"                other words go to pytest
    python tests/repeat_statistical.py --last-bits 5                five seeds for the last bits of f, see last_bits.py

A test is statistical if it asks for the fixture `shift`. The table, tests/statistical.md, keeps the rows of tests that
are not run this time, and names the tests that have never been run.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from mpi_programs import last_bits

TABLE = Path(__file__).with_name("statistical.md")
ROW = re.compile(r"^\| `(\S.*)` \| (.+) \|$", re.MULTILINE)
HEAD = """# Statistical tests with other seeds

Made by `python tests/repeat_statistical.py`. To spare: the least distance from a limit, over all seeds, and the mean
distance in standard deviations over the seeds, of the tightest limit of the test (none where a test has no number).

| test | seeds | red | least to spare | mean to spare, deviations |
|---|---|---|---|---|
"""


class Collector:
    """Outcomes and distances by test, whatever the seed; a plugin of pytest."""

    def __init__(self) -> None:
        self.red: dict[str, int] = defaultdict(int)
        self.spare: dict[str, list[list[float]]] = defaultdict(list)
        self.found: set[str] = set()

    @staticmethod
    def name(nodeid: str) -> str:
        return re.sub(r"\[\]$", "", re.sub(r"-?shift\d+-?", "", nodeid))

    def pytest_collection_finish(self, session: pytest.Session) -> None:
        self.found |= {self.name(item.nodeid) for item in session.items}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        name = self.name(report.nodeid)
        if report.when == "call":
            self.spare[name].append(dict(report.user_properties).get("to spare", []))
        if report.failed:
            self.red[name] += 1

    def row(self, name: str) -> str:
        """Cells of a test that was run."""
        runs = self.spare[name]
        whole = np.array([spare for spare in runs if spare and len(spare) == max(map(len, runs))])
        cells = ["–", "–"]
        if whole.size:
            scatter = (
                whole.std(axis=0, ddof=1) if len(whole) > 1 else np.full(whole.shape[1], np.nan)
            )
            mean = np.divide(
                whole.mean(axis=0), scatter, where=scatter > 0, out=scatter * 0 + np.inf
            )
            tightest = int(np.argmin(mean))
            cells = [f"{whole[:, tightest].min():.3g}", f"{mean[tightest]:.1f}"]
        return " | ".join([str(len(runs)), str(self.red[name]), *cells])


def asking(*fixtures: str) -> list[str]:
    """Test files that ask for one of some fixtures."""
    pattern = re.compile(rf"\b({'|'.join(fixtures)})\b")
    places = sorted(TABLE.parent.glob("test_*.py"))
    return [str(path) for path in places if pattern.search(path.read_text(encoding="utf-8"))]


def with_last_bits(seeds: int, words: list[str]) -> int:
    """Run tests of studies and of statistics with disturbed last bits of f; print how often each was red."""
    red: dict[str, int] = defaultdict(int)
    for seed in range(1, seeds + 1):
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-rfE",
            "--tb=no",
            "--timeout",
            "0",
            *words,
        ]
        done = subprocess.run(
            command,
            env=os.environ | {last_bits.NAME: str(seed)},
            capture_output=True,
            text=True,
            check=False,
        )
        print(f"seed {seed}: {done.stdout.strip().splitlines()[-1]}", flush=True)
        for name in re.findall(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE):
            red[name] += 1
    for name, count in sorted(red.items()):
        print(f"{name}: red with {count} of {seeds} seeds")
    return int(bool(red))


def main() -> int:
    """Run, renew the table, and say whether more than one in a thousand was red."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=50)
    parser.add_argument("--last-bits", type=int, default=0)
    known, words = parser.parse_known_args()
    if not any(word.startswith("tests/") for word in words):
        words += asking("shift", *(["carried_out"] if known.last_bits else []))
    if known.last_bits:
        return with_last_bits(known.last_bits, words)
    collector = Collector()
    pytest.main(
        ["-q", "--timeout", "0", "--other-seeds", str(known.seeds), *words], plugins=[collector]
    )
    rows = dict(ROW.findall(TABLE.read_text())) if TABLE.exists() else {}
    rows |= dict.fromkeys(collector.found - rows.keys(), "never run | | |")
    rows |= {name: collector.row(name) for name in collector.spare}
    lines = [f"| `{name}` | {cells} |" for name, cells in sorted(rows.items())]
    TABLE.write_text(HEAD + "\n".join(lines) + "\n")
    runs, red = sum(map(len, collector.spare.values())), sum(collector.red.values())
    print(json.dumps({"runs": runs, "red": red}))
    return int(red > max(1, runs // 1000))


if __name__ == "__main__":
    sys.exit(main())
