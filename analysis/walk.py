"""The files that a number really passes on its way through `hpcclear sample`, from the scene file to the result file.

    python analysis/walk.py                  # some seconds, or a minute where the kernel is not compiled yet

Watched are the calls that read the clearance, check it, draw it, write it into the kernel's parameters, step it, make a record
of what came of it and write the file: every file of the package that is on the stack of one of them is one that a reader opens.
docs/architecture.md has them in its walk, besides those of the kernel, whose calls Python does not see.
"""

import contextlib
import importlib
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import CodeType, FrameType

ROOT = Path(__file__).parent.parent / "hpcclear"
STATIONS = (
    "base/units.py:to_si",
    "scene/contacts/pin_in_bearing.py:PinInBearing._check",
    "scene/points.py:latin_hypercube",
    "scene/points.py:check_points",
    "dynamics/setup/parameters.py:fill",
    "dynamics/stepping/lanes.py:Lanes.step",
    "dynamics/evaluation/evaluator.py:outcome_records",
    "results/checkpoint.py:Checkpoint.add",
    "results/dataset.py:samples_dataset",
    "results/dataset.py:write",
)
"""Calls by their files: a clearance becomes a gap, a gap a record, a record a row of a file."""

ELSEWHERE = {
    "scene/random_inputs.py": "bounds of a distribution, not of the clearance",
    "dynamics/setup/problem.py": "the scene's own design, by which a method is chosen",
    "ensemble/simulate.py": "every rank makes the same scene once more, and compiles without samples",
    "cli/printing.py": "units of the summary that is printed",
    "report/spread.py": "reads the scene of the finished file for a line of the summary",
}
"""Files that make such calls about something else."""

KERNEL = (
    "dynamics/contacts/bearing.py",
    "dynamics/stepping/sample.py",
)
"""Files of the way whose functions are compiled."""


def files_on(frame: FrameType | None) -> list[str]:
    """Files of the package on a stack, the outermost first."""
    found = []
    while frame is not None:
        path = Path(frame.f_code.co_filename)
        if path.is_relative_to(ROOT):
            found.append(str(path.relative_to(ROOT)))
        frame = frame.f_back
    return found[::-1]


def code_of(station: str) -> CodeType:
    """What Python runs at a station."""
    file, _, name = station.partition(":")
    found = importlib.import_module("hpcclear." + file.removesuffix(".py").replace("/", "."))
    for part in name.split("."):
        found = getattr(found, part)
    code: CodeType = found.__code__  # type: ignore[attr-defined]
    return code


def passed(program: Callable[[], object]) -> dict[str, str]:
    """Files on the stack of the stations while a program runs, in their order, with the first station of each."""
    watched = {code_of(station): station for station in STATIONS}
    found: dict[str, str] = {}
    seen = set()

    def note(frame: FrameType, event: str, _: object) -> None:
        if event != "call" or frame.f_code not in watched:
            return
        files = files_on(frame)
        if not any(one in files for one in ELSEWHERE):
            seen.add(watched[frame.f_code])
            for one in files:
                found.setdefault(one, watched[frame.f_code])

    sys.setprofile(note)
    try:
        program()
    finally:
        sys.setprofile(None)
    missing = set(STATIONS) - seen
    assert not missing, missing
    return found


def main() -> None:
    from hpcclear.cli import main as command

    def program() -> None:
        with tempfile.TemporaryDirectory() as folder:
            scene = ROOT.parent / "jobs" / "quickstart.toml"
            words = ["sample", str(scene), "--set", "study.samples=8", "-o", f"{folder}/s.nc"]
            with contextlib.suppress(SystemExit):
                command(words)

    found = passed(program)
    for name in KERNEL:
        found[name] = "compiled, of the kernel"
    for k, (name, station) in enumerate(found.items(), 1):
        print(f"{k:3d} {name:40s} {station}")


if __name__ == "__main__":
    main()
