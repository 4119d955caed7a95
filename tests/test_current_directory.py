"""No process of this package runs code of the current directory, whatever lies there."""

import functools
import importlib.metadata
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from commands import MPIEXEC, overrides
from patience import crowded

import hpcclear
from hpcclear.base import isolated

ROOT = Path(hpcclear.__file__).parent.parent
PROGRAM = Path(sys.executable).with_name("hpcclear")
BEFORE = {"hpcclear", "importlib", "warnings"}
"""Modules that Python itself loads for `python -m hpcclear`, before this package."""


@functools.cache
def names() -> tuple[str, ...]:
    """Every module of the standard library, of every installed distribution, and of this package."""
    installed = importlib.metadata.packages_distributions()
    found = {*sys.stdlib_module_names, *installed, "hpcclear", "sitecustomize", "usercustomize"}
    return tuple(sorted(name for name in found if name.isidentifier()))


@pytest.fixture
def theirs(tmp_path) -> Path:
    """A directory with a file for each of these names, which says that it ran, and three scenes."""
    place = tmp_path / "theirs"
    place.mkdir()
    for name in names():
        text = f"open({str(tmp_path / 'ran')!r}, 'a').write('{name} ')\n"
        (place / f"{name}.py").write_text(text)
    for name in ("slider_crank", "quickstart", "wear", "identify"):
        shutil.copy(ROOT / "jobs" / f"{name}.toml", place)
    return place


def start(place: Path, *words: str, **settings: str) -> subprocess.CompletedProcess:
    """Run a program in a directory; fails if code of the directory ran."""
    known = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        words, cwd=place, env=known | settings, capture_output=True, text=True,
        stdin=subprocess.DEVNULL, timeout=crowded(400.0),
    )  # fmt: skip
    ran = place.parent / "ran"
    assert not ran.exists(), f"{' '.join(words)} ran {ran.read_text()}"
    return done


@pytest.mark.parametrize("launcher", [[], [str(MPIEXEC), "-n", "2"]], ids=["alone", "mpiexec"])
def test_a_process_takes_nothing_from_the_directory_it_starts_in(theirs, launcher):
    # what it returns is the exit code
    words = isolated.python("hpcclear.base.width:doubles_in_a_vector")
    done = start(theirs, *launcher, *words, HPCCLEAR_CACHE=str(theirs.parent / "cache"))
    assert done.returncode in (2, 4, 8), done.stderr


def test_a_process_keeps_pythonpath_and_the_package_of_who_started_it(tmp_path):
    """Another hpcclear stands first on the path; a module of the path is found all the same."""
    (tmp_path / "hpcclear.py").write_text("raise SystemExit('the other package')")
    (tmp_path / "beside_it.py").write_text("def named(*words): print(*words)\n")
    words = isolated.python("beside_it:named", "a b", "'; x")
    done = start(tmp_path, *words, PYTHONPATH=str(tmp_path))
    assert (done.returncode, done.stdout) == (0, "a b '; x\n"), done.stderr
    words = isolated.python("hpcclear.base.host:is_running", "x")
    done = start(tmp_path, *words, PYTHONPATH=str(tmp_path))
    assert str(ROOT / "hpcclear" / "base" / "host.py") in done.stderr


def test_python_m_drops_the_directory_that_python_put_first(theirs):
    for name in BEFORE:
        (theirs / f"{name}.py").unlink(missing_ok=True)
    words = ["check", "slider_crank.toml", "--no-cost", "--details"]
    done = start(theirs, sys.executable, "-m", "hpcclear", *words)
    assert done.returncode == 0, done.stderr
    assert "scene hash" in done.stdout


def test_python_m_of_another_program_keeps_its_path(tmp_path):
    (tmp_path / "theirs.py").write_text("import hpcclear, sys; print(sys.path[0])")
    done = start(tmp_path, sys.executable, "-m", "theirs")
    assert done.stdout == f"{tmp_path}\n", done.stderr


SHORT = ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1")
FEW = ("study.samples=8", *SHORT)


RANKS = [str(MPIEXEC), "-n", "2"]
COMMANDS: dict[str, tuple[list[str], list[str]]] = {
    "show laws": ([], ["show", "laws"]),
    "show citation": ([], ["show", "citation"]),
    "show schema": ([], ["show", "schema"]),
    "init": ([], ["init", "made.toml"]),
    "init --import": ([], ["init", "--import", "points.csv", "imported.toml"]),
    "check": ([], ["check", "slider_crank.toml", *overrides(*SHORT)]),
    "simulate": ([], ["simulate", "slider_crank.toml", "-o", "r.nc", *overrides(*SHORT)]),
    "sample": (RANKS, ["sample", "quickstart.toml", "-o", "s.nc", *overrides(*FEW)]),
    "sample --merge": ([], ["sample", "--merge", "quickstart.toml", "-o", "s.nc", *overrides(*FEW)]),
    "map": (
        RANKS,
        ["map", "quickstart.toml", "--x", "C=0.3mm:1mm:3", "-o", "m.nc", *overrides(*FEW)],
    ),
    "map --bifurcation": (
        RANKS,
        ["map", "--bifurcation", "quickstart.toml", "--x", "C=0.3mm:1mm:3", "-o", "b.nc", *overrides(*FEW)],
    ),
    "wear": (RANKS, ["wear", "wear.toml", "-o", "w.nc", *overrides("wear.lives=1")]),
    "effects": (
        RANKS,
        ["effects", "quickstart.toml", "--tolerance", "20%", "--samples", "64", "-o", "e.nc", *overrides(*FEW)],
    ),
    "identify": (
        RANKS,
        ["identify", "identify.toml", "--signal", "measured.csv", "--members", "32", "-o", "i.nc",
         "--unknown", "joints.crank_rod.clearance=10um:150um"],
    ),
    "run": (RANKS, ["run", "quickstart.toml", "-o", "study"]),
    "accuracy": (RANKS, ["accuracy", "slider_crank.toml", "-o", "a", "--quick"]),
    "accuracy --plan": ([], ["accuracy", "--plan", "quickstart.toml", *overrides(*FEW)]),
    "export": ([], ["export", "s.nc", "-o", "s.csv"]),
    "compare": ([], ["compare", "r.nc", "measured.csv"]),
    "plot": ([], ["plot", "r.nc", "--figure", "orbit", "-o", "o.png"]),
    "report": ([], ["report", "s.nc", "-o", "p.html"]),
    "reproduce": ([], ["reproduce", "s.nc", "--samples", "1"]),
    "reproduce --crate": ([], ["reproduce", "--crate", "."]),
}  # fmt: skip
"""Launcher and words of each command."""
READING = "sample --merge", "export", "report", "reproduce", "reproduce --crate", "compare", "plot"
"""Commands that read results."""
LONG = ("run", "accuracy", "identify", "effects", "wear")
"""Commands that work for minutes: they are stopped before, when everything has been started."""


@pytest.fixture(scope="module")
def results(tmp_path_factory) -> Path:
    """A directory with results that commands read, made with the usual cache."""
    place = tmp_path_factory.mktemp("results")
    for name in ("slider_crank", "quickstart"):
        shutil.copy(ROOT / "jobs" / f"{name}.toml", place)
    for command in ("simulate", "sample"):
        done = start(place, str(PROGRAM), *COMMANDS[command][1])
        assert done.returncode == 0, done.stderr
    return place


@pytest.mark.nightly
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_runs_code_of_the_directory_with_a_cold_cache(theirs, results, command):
    (theirs / "points.csv").write_text("name,x [mm],y [mm]\nO,0,0\nA,50,0\nB,150,80\nC,200,0\n")
    rows = "".join(f"{k / 1000:.3f},{k % 7 - 3}\n" for k in range(400))
    (theirs / "measured.csv").write_text(f"time [s],crank_moment [N m]\n{rows}")
    if command in READING:
        for path in results.glob("*.nc"):
            shutil.copy(path, theirs)
    launcher, words = COMMANDS[command]
    limit = ["--time-limit", "60"] if command in LONG else []
    cache = theirs.parent / "cache"
    cache.mkdir(mode=0o700)
    done = start(theirs, *launcher, str(PROGRAM), *words, *limit, HPCCLEAR_CACHE=str(cache))
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode in (0, 3, 4), done.stderr
    assert not list(theirs.rglob("__pycache__"))
