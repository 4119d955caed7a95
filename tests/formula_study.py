"""Small studies whose f is the formula of `mpi_programs/formula.py`: one set-up for all tests of what a study decides.

A test states in which entries its study differs from `SMALL`. The fixture `carried_out` (conftest.py) runs it in this process.
"""

import subprocess
import tomllib
from pathlib import Path

import formula
from commands import MPIEXEC, warm
from patience import crowded

from hpcclear.scene import Scene, load_scene

PROGRAMS = Path(__file__).parent / "mpi_programs"


SMALL = """
seed = 3
samples = 20
test_samples = 8
[variables]
m2 = { range = [0.105, 0.42] }
C = { range = ["0.3 mm", "1 mm"] }
[random]
C = { distribution = "uniform", range = ["0.3 mm", "1 mm"] }
[sensitivity]
groups = []
[surrogate]
r2 = 0.5
restarts = 0
[swarm]
particles = 10
iterations = 5
runs = 1
archive = 8
[verification]
response_windows = 2
response_copies = 2
"""


def scene_of(study: str, *overrides: str) -> Scene:
    """The scene of a small study, from TOML of the entries that it has not as in `SMALL`."""
    small, own = tomllib.loads(SMALL), tomllib.loads(study)
    both = {key: small[key] | own[key] for key in own if isinstance(small.get(key), dict)}
    return load_scene(
        tomllib.loads(formula.PHYSICS) | {"study": small | own | both}, list(overrides)
    )


def whole(*overrides: str) -> Scene:
    """The scene of a study of two cases in all variables, with entries replaced."""
    return load_scene(tomllib.loads(formula.PHYSICS + formula.STUDY), list(overrides))


def on_ranks(scene: Scene, place: Path, *words: object, ranks: int = 2) -> Path:
    """Results of a study by so many ranks, in a place that is there."""
    (place / "scene.toml").write_text(scene.text)
    program = [str(PROGRAMS / "formula.py"), str(place / "scene.toml"), str(place / "out")]
    made = subprocess.run(
        [str(MPIEXEC), "-n", str(ranks), *warm().words([*program, *map(str, words)])],
        capture_output=True, text=True, timeout=crowded(300), check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    return place / "out"
