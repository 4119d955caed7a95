"""False alarms of ranks on a busy machine: undisturbed runs beside so many endless loops a core.

    python analysis/busy_ranks.py                     # 3 runs of 4 ranks beside 30 loops a core, two minutes each at most
    python analysis/busy_ranks.py --runs 7 --loops 30 --ranks 2 --seconds 60

A run samples until its time limit and is then to end with exit code 3. Any other code, and any report that nothing was heard of
a rank, is a false alarm. The result goes to analysis/results/busy_ranks.json.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from hpcclear.base.host import cores, processor

ROOT = Path(__file__).parents[1]
LOOP = "while True: pass"


def run(ranks: int, seconds: float) -> dict[str, object]:
    """One run under mpiexec: exit code, whether a rank was given up, and the load at its end."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["sample", str(ROOT / "jobs" / "quickstart.toml"), "-o", f"{folder}/samples.nc"]
        words += [
            "--set",
            "study.samples=2000000",
            "--progress",
            "quiet",
            "--time-limit",
            str(seconds),
        ]
        mpiexec = Path(sys.executable).parent / "mpiexec"
        command = [str(mpiexec), "-n", str(ranks), sys.executable, "-m", "hpcclear", *words]
        began = time.monotonic()
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
        text = done.stdout + done.stderr
        return {
            "code": done.returncode,
            "given_up": "nothing was heard" in text,
            "seconds": round(time.monotonic() - began, 1),
            "load": round(os.getloadavg()[0], 1),
            "last": text.strip()[-200:],
        }


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--ranks", type=int, default=4)
    parser.add_argument("--loops", type=int, default=30, help="endless loops a core")
    parser.add_argument("--seconds", type=float, default=60.0, help="time limit of a run")
    parser.add_argument(
        "-o", "--output", type=Path, default=ROOT / "analysis" / "results" / "busy_ranks.json"
    )
    asked = parser.parse_args()
    loops = [
        subprocess.Popen([sys.executable, "-c", LOOP]) for _ in range(asked.loops * len(cores()))
    ]
    try:
        runs = [run(asked.ranks, asked.seconds) for _ in range(asked.runs)]
    finally:
        for loop in loops:
            loop.kill()
    alarms = sum(one["code"] != 3 or bool(one["given_up"]) for one in runs)
    found = {
        "processor": processor(), "cores": len(cores()), "loops": len(loops), "ranks": asked.ranks,
        "date": time.strftime("%Y-%m-%d"), "false_alarms": alarms, "runs": runs,
    }  # fmt: skip
    asked.output.write_text(json.dumps(found, indent=1) + "\n")
    print(
        f"{alarms} false alarms in {len(runs)} runs of {asked.ranks} ranks beside {len(loops)} loops"
    )


if __name__ == "__main__":
    main()
