"""How much a command loads before it works: counted in modules, as seconds depend on the machine."""

import subprocess
import sys
from pathlib import Path

import pytest
from light import loaded_by
from patience import crowded

from hpcclear.cli import Program

SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
HEAVY = {
    "h5py", "matplotlib", "mpi4py", "numba", "numpy", "pandas", "pint", "pydantic", "rich", "scipy", "sklearn", "xarray",
}  # fmt: skip


def command(*words: str) -> str:
    """A statement that carries out a command and leaves its modules loaded."""
    return (
        "import contextlib, io\nfrom hpcclear.cli import main\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        f"    main({list(words)!r})"
    )


@pytest.mark.parametrize(
    "words", [["--help"], ["--version"], ["run", "--help"], ["show", "citation"]]
)
def test_help_loads_no_library_of_numbers(words):
    light = HEAVY if words != ["show", "citation"] else {"numba", "xarray", "scipy"}
    assert not loaded_by(command(*words), light)


TAKES_SCENES = sorted(
    name
    for name, one in Program().every().items()
    if {"file", "overrides"} <= {option.name for option in one.params}
)


@pytest.mark.parametrize("name", TAKES_SCENES)
def test_a_scene_is_refused_before_what_simulates_is_loaded(name):
    needed = {"map": ["--x", "C=0.1mm:1mm:3"], "identify": ["--unknown", "C=0.1mm:1mm"]}
    place = [] if name == "check" else ["-o", "refused.nc"]
    words = [name, str(SCENE), "--set", "effects.gravity=heavy", *place, *needed.get(name, [])]
    heavy = HEAVY - {"numpy", "pydantic"}
    ours = ("accuracy", "dynamics.evaluation", "ensemble.session", "identify", "report", "study")
    assert not loaded_by(command(*words), heavy | {f"hpcclear.{one}" for one in ours})


def test_a_response_that_is_compiled_loads_nothing_that_only_compiling_needs(tmp_path):
    words = [
        "simulate",
        str(SCENE),
        "-o",
        str(tmp_path / "a.nc"),
        "--set",
        "numerics.averaged_revolutions=4",
    ]
    program = [sys.executable, "-m", "hpcclear", *words]
    subprocess.run(program, check=True, capture_output=True, timeout=crowded(600.0))  # compiles
    unwanted = {
        "numba.np.linalg", "numba.np.arraymath", "numba.np.npdatetime", "numba.core.inline_closurecall", "scipy.linalg",
        "cffi", "matplotlib.pyplot", "mpi4py.MPI", "pint", "pyarrow", "scipy.special", "scipy.stats", "sklearn", "xarray",
    }  # fmt: skip
    assert loaded_by(command(*words), unwanted | {"numba"}) == {"numba"}


@pytest.mark.parametrize(("ends", "code"), [("3", 3), ("None", 0), ("'why'", 1)])
def test_a_process_ends_at_once_but_says_all_and_leaves_nothing(ends, code):
    """What Python does at its end, but for freeing one by one what the system frees."""
    program = f"""
import atexit, gc, sys
import hpcclear.__main__ as program, hpcclear.cli
def command():
    assert gc.get_threshold() > usual
    gc.collect()
    assert gc.get_threshold() == usual
    atexit.register(print, "last")
    print("x" * 100_000)
    sys.exit({ends})
usual = gc.get_threshold()
hpcclear.cli.main = command
class Left:
    def __del__(self): print("freed")
left = Left()
program.main()
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=crowded(60.0)
    )
    assert (done.returncode, done.stderr) == (code, "")
    assert done.stdout == "x" * 100_000 + "\nlast\n"
