"""The files that a number really passes on its way through `hpcclear sample`, from the scene file to the result file.

    python analysis/walk.py                  # half a minute, most of it compilation

Watched are the calls that read the clearance, check it, write it into the kernel's parameters, step it, make a record of what
came of it and write the file: every file of the package that is on the stack of one of them is one that a reader opens.
docs/architecture.md names them in its walk.
"""

import sys
import tempfile
from pathlib import Path
from types import FrameType

ROOT = Path(__file__).parent.parent / "hpcclear"
STATIONS = {
    "scene/units.py": "to_si",
    "scene/mechanism.py": "check_journal",
    "scene/points.py": "check_points",
    "dynamics/joint_laws.py": "fill",
    "dynamics/stepping/lanes.py": "step",
    "dynamics/evaluation/evaluator.py": "outcome_records",
    "results/netcdf.py": "save",
}
"""Calls by their files: a clearance becomes a gap, a gap a record, a record a row of a file."""

ELSEWHERE = {
    "scene/units.py": "scene/random_inputs.py",  # bounds of the distribution, not the clearance
    "dynamics/joint_laws.py": "dynamics/setup/problem.py",  # the scene's own design, by which a method is chosen
}
"""Calls that are about other numbers where this file is on the stack."""


def files_on(frame: FrameType | None) -> list[str]:
    """Files of the package on a stack, the outermost first."""
    found = []
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if path.is_relative_to(ROOT):
            found.append(str(path.relative_to(ROOT)))
        frame = frame.f_back
    return found[::-1]


def main() -> None:
    passed: dict[str, str] = {}

    def watch(frame: FrameType, event: str, argument: object) -> None:
        if event != "call":
            return
        path = Path(frame.f_code.co_filename)
        if not path.is_relative_to(ROOT):
            return
        name = str(path.relative_to(ROOT))
        if STATIONS.get(name) == frame.f_code.co_name:
            files = files_on(frame)
            for one in files if ELSEWHERE.get(name) not in files else ():
                passed.setdefault(one, name)

    from hpcclear.cli import main as command

    with tempfile.TemporaryDirectory() as folder:
        scene = ROOT.parent / "jobs" / "quickstart.toml"
        words = ["sample", str(scene), "--set", "study.samples=8", "-o", f"{folder}/samples.nc"]
        sys.setprofile(watch)
        try:
            command(words)
        except SystemExit:
            pass
        finally:
            sys.setprofile(None)
    for k, (name, station) in enumerate(passed.items(), 1):
        print(f"{k:3d} {name:40s} on the way to {station}")
    missing = set(STATIONS) - set(passed)
    assert not missing, missing


if __name__ == "__main__":
    main()
