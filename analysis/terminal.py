"""How long the answers of all commands are: lines and columns that each prints, beside those of another version.

    python analysis/terminal.py [--before COMMIT] [--keep DIRECTORY]

DIRECTORY gets what the commands print, of both versions. Runs short jobs, ten minutes a version, prints a row a command, and
writes ``analysis/results/terminal.csv``. What is left on a terminal counts, notes as well; a line of progress is replaced by
what follows. Help is left out.
"""

import argparse
import os
import pty
import re
import shlex
import subprocess
import sys
import tempfile
import termios
from pathlib import Path

from recorded import record
from same_bytes import ROOT, sources

LINES, COLUMNS = 24, 80
SHORT = (
    "--set numerics.transient_revolutions=2 --set numerics.averaged_revolutions=2 "
    "--set numerics.rtol=1e-4"
)
STUDY = (
    "--set study.samples=40 --set study.test_samples=10 --set study.accuracy.mean=0.1 --set study.accuracy.deviation=0.2 "
    "--set study.sensitivity.levels=2 --set study.sensitivity.sobol_samples=32"
)
COMMANDS = (
    "init starter.toml",
    "init compressor.toml --compressor",
    "check JOBS/quickstart.toml --no-cost",
    "check JOBS/compressor.toml --no-cost",
    "check JOBS/tolerances.toml --no-cost",
    "check JOBS/linkages/v_twin.toml --no-cost",
    "show laws",
    "show schema",
    "show citation",
    f"simulate JOBS/slider_crank.toml -o response/response.nc {SHORT}",
    f"simulate JOBS/linkages/v_twin.toml -o response/v_twin.nc {SHORT}",
    f"sample JOBS/quickstart.toml -o samples/samples.nc --set study.samples=32 {SHORT}",
    f"map JOBS/quickstart.toml --x C=0.3mm:1mm:3 --y m3=0.1:0.2:3 -o map.nc {SHORT}",
    f"wear JOBS/wear.toml -o wear.nc --set wear.lives=4 {SHORT}",
    f"effects JOBS/slider_crank.toml --tolerance 10% -o effects.nc {SHORT}",
    f"run JOBS/quickstart.toml -o study {STUDY} {SHORT}",
    "accuracy JOBS/quickstart.toml --plan",
    "report response",
    "plot response/response.nc -o figures",
    "export samples/samples.nc -o samples.csv",
    "export response/response.nc -o response.csv",
    "compare response/response.nc response.csv",
    "reproduce study --crate",
)
"""Commands in the order in which later ones need files of earlier ones."""


def left(words: list[str], place: str, root: Path = ROOT) -> tuple[int, str]:
    """Exit code of a command of the package below `root`, and what it leaves on a terminal."""
    screen, line = pty.openpty()
    termios.tcsetwinsize(line, (LINES, COLUMNS))
    job = subprocess.Popen(
        words, stdin=subprocess.DEVNULL, stdout=line, stderr=line, cwd=place,
        env=os.environ | {"PYTHONPATH": str(root)},
    )  # fmt: skip
    os.close(line)
    seen = b""
    try:
        while piece := os.read(screen, 4096):
            seen += piece
    except OSError:  # how Linux says that the other side was closed
        pass
    os.close(screen)
    return job.wait(), shown(seen.decode())


def shown(written: str) -> str:
    """What a terminal shows in the end, which draws lines again where it is told to."""
    rows, row, column = [""], 0, 0
    for piece in re.split(r"(\n|\r|\x1b\[[0-9;?]*[A-Za-z])", written):
        if piece == "\n":
            row += 1
            rows += [""] * (row == len(rows))
        elif piece == "\r":
            column = 0
        elif piece.startswith("\x1b"):
            row -= int(piece[2:-1] or 1) if piece.endswith("A") else 0
            rows[row] = "" if piece.endswith("2K") else rows[row]
        else:
            rows[row] = f"{rows[row][:column]:{column}}{piece}{rows[row][column + len(piece) :]}"
            column += len(piece)
    return "\n".join(rows).rstrip()


def answers(root: Path, keep: Path | None = None) -> dict[str, tuple[int, int]]:
    """Lines and columns that each command prints, by the command; nothing of one that failed."""
    found = {}
    with tempfile.TemporaryDirectory() as place:
        for command in COMMANDS:
            words = shlex.split(command.replace("JOBS", str(ROOT / "jobs")))
            code, text = left([sys.executable, "-m", "hpcclear", *words], place, root)
            if code not in (0, 4):
                print(f"{command}: exit code {code}\n{text}", file=sys.stderr)
                continue
            lines = text.splitlines()
            found[command] = len(lines), max(map(len, lines), default=0)
            if keep:
                keep.mkdir(parents=True, exist_ok=True)
                (keep / f"{len(found):02d}.txt").write_text(f"{command}\n{text}")
            print(*found[command], command, flush=True)
    return found


def main() -> None:
    """Measure, compare, record."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--before", metavar="COMMIT")
    parser.add_argument("--keep", type=Path, metavar="DIRECTORY")
    options = parser.parse_args()
    keep, then = options.keep, {}
    if options.before:
        with tempfile.TemporaryDirectory() as place:
            before = sources(options.before, Path(place) / "before")
            then = answers(before, keep and keep / "before")
    now = answers(ROOT, keep)
    rows = [
        (
            command.split(" --set")[0].replace("JOBS", "jobs"),
            *then.get(command, ("", ""))[:1],
            *now[command],
        )
        for command in now
    ]
    record("terminal", [("command", "lines before", "lines", "columns"), *rows])
    for command, (lines, columns) in now.items():
        if lines > LINES or columns > COLUMNS:
            print(f"too long: {command}: {lines} lines, {columns} columns")


if __name__ == "__main__":
    main()
