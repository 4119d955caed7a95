"""Progress on a terminal, in a log, and in silence."""

import io
import os
import pathlib
import pty
import re
import subprocess
import sys
import termios

import numpy as np
import pytest
from patience import crowded

from hpcclear.base.outcome import OUTCOME
from hpcclear.ranks.progress import Progress

ROOT = pathlib.Path(__file__).parents[1]
PROGRAM = pathlib.Path(__file__).parent / "mpi_programs" / "bar.py"
MPIEXEC = pathlib.Path(sys.executable).parent / "mpiexec"


class Clock:
    """Seconds that pass when told to."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def records(count: int, failed: int = 0) -> np.ndarray:
    made = np.zeros(count, OUTCOME)
    made["status"][:failed] = 1
    return made


def test_a_log_gets_a_line_every_interval_with_percentage_failures_and_eta():
    clock, log = Clock(), io.StringIO()
    progress = Progress("sampling", "log", 5.0, log, clock)
    progress.start(200, records(0))
    for _ in range(10):  # ten samples a second, one in ten fails
        clock.now += 1.0
        progress.add(records(10, failed=1))
        progress.refresh()
    progress.close()
    assert log.getvalue().splitlines() == [
        "sampling: 50/200 (25 %), 5 failed, 10 samples/s, 15 s left",
        "sampling: 100/200 (50 %), 10 failed, 10 samples/s, 10 s left",
        "sampling: 100/200 (50 %), 10 failed, 10 samples/s in 10 s",
    ]


def test_quiet_writes_nothing_and_an_empty_design_is_complete():
    log = io.StringIO()
    for style in ("quiet", "log"):
        progress = Progress("none", style, 0.0, log, Clock())
        progress.start(0, records(0))
        progress.close()
    assert log.getvalue() == "none: 0/0 (100 %), 0 samples/s in 0 s\n"


def run_on_a_terminal(command: list[str], errors: int | None = None, cwd=None) -> str:
    """What a program writes on a terminal of 24 lines of 80 columns; its standard error may go elsewhere."""
    screen, line = pty.openpty()
    termios.tcsetwinsize(line, (24, 80))
    environment = os.environ | {"PYTHONPATH": str(ROOT), "TERM": "xterm"}
    environment.pop("SLURM_JOB_ID", None)
    job = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=line,
        stderr=line if errors is None else errors,
        env=environment,
        cwd=cwd,
    )
    os.close(line)
    seen = b""
    try:
        while piece := os.read(screen, 4096):
            seen += piece
    except OSError:  # how Linux says that the other side was closed
        pass
    finally:
        os.close(screen)
    assert job.wait(timeout=crowded(30)) == 0, seen
    return seen.decode()


def left_of(seen: str) -> list[str]:
    """Lines that a terminal shows in the end: of one that is drawn again its last state, without colours."""
    lines = [line.rstrip("\r").rpartition("\r")[2] for line in seen.rstrip().split("\n")]
    return [re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", line) for line in lines]


@pytest.mark.mpi
@pytest.mark.parametrize("launch", [[], [str(MPIEXEC), "-n", "2"]])
def test_a_person_at_a_terminal_sees_a_bar_also_through_mpiexec(launch):
    seen = run_on_a_terminal([*launch, sys.executable, str(PROGRAM)])
    assert re.search(r"sampling: \d+/150 \(\d+ %\), \d+ failed.*━", seen)
    assert left_of(seen) == [""]


@pytest.mark.mpi
@pytest.mark.parametrize("launch", [[], [str(MPIEXEC), "-n", "2"]])
def test_errors_sent_to_a_file_get_a_log_even_at_a_terminal(launch, tmp_path):
    with open(tmp_path / "log", "w", encoding="utf-8") as log:
        seen = run_on_a_terminal([*launch, sys.executable, str(PROGRAM)], log.fileno())
    assert seen == ""
    assert "\x1b" not in (tmp_path / "log").read_text()
    assert (tmp_path / "log").read_text().count("sampling: ") >= 3
