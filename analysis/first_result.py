"""How long the first result takes: from the command to the file, with nothing compiled and with what an earlier scene compiled.

    python analysis/first_result.py           # about two minutes

Every row is one `hpcclear simulate` in a process of its own. The first of each group finds an empty cache (HPCCLEAR_CACHE is a
new folder), those below it find what the rows above have left. Wall time, and the processor's, which says more on a
machine that does other work as well.
"""

import argparse
import os
import resource
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


def run(overrides: list[str], cache: str, out: Path) -> tuple[float, float]:
    """Wall and processor seconds of one command."""
    job = JOB
    if overrides and overrides[0].endswith(".toml"):
        job, overrides = JOB.parent / overrides[0], overrides[1:]
    words = [word for override in overrides for word in ("--set", override)]
    command = [sys.executable, "-m", "hpcclear", "simulate", str(job), *words, "-o", str(out)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "HPCCLEAR_CACHE": cache}
    environment.pop("NUMBA_CACHE_DIR", None)
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, env=environment, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - started, used


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0]).parse_args()
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
