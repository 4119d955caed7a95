"""Every command in a Python that lacks what native Windows lacks: modules, functions, signals, flags of files.

    python tests/native_windows.py            prints a table: command, exit code, its last line

Each command is a fork of one process in which these names are missing. What Windows has and Linux lacks is not imitated,
nor are its file system and compiler.
"""

import importlib
import importlib.abc
import os
import signal
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MODULES = ("fcntl", "grp", "pwd", "resource", "termios", "tty", "pty", "readline", "syslog")
FUNCTIONS = (
    "getuid", "geteuid", "getgid", "getegid", "sched_getaffinity", "sysconf", "pwrite", "getloadavg", "uname",
    "O_NOFOLLOW", "O_DIRECTORY", "O_NONBLOCK", "O_CLOEXEC", "O_NOCTTY",
)  # fmt: skip
LIBRARIES = (
    "h5py", "matplotlib.pyplot", "moocore", "numba", "pint", "pydantic", "rich.console", "scipy.stats", "sklearn", "xarray",
)  # fmt: skip
"""Loaded before: they choose their own code for Windows by the name of the system, which is not changed here."""
SIGNALS = (
    "SIGUSR1", "SIGUSR2", "SIGALRM", "SIGPROF", "SIGHUP", "SIGKILL", "setitimer", "ITIMER_PROF", "ITIMER_REAL", "alarm",
)  # fmt: skip

WORKS = (
    "init", "check", "simulate", "sample", "report", "reproduce", "reproduce --crate", "show", "export", "compare", "plot",
    "accuracy --plan", "init --import",
)  # fmt: skip
"""End with exit code 0."""

STOPS = ("map --bifurcation", "map", "wear", "effects", "identify", "run", "accuracy")
"""Work until the time limit that the test sets, and end with exit code 3."""

REFUSED = ("sample --merge",)
"""End with exit code 2 and a sentence: of the words here nothing else is there to merge, wherever they run."""


class Missing(importlib.abc.MetaPathFinder):
    """Finds none of the modules that only Unix has."""

    def find_spec(self, name, path=None, target=None):
        if name in MODULES:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


def become_windows() -> None:
    """Take away what native Windows lacks, as far as the standard library's own code for Unix runs without it."""
    sys.meta_path.insert(0, Missing())
    for name in MODULES:
        sys.modules.pop(name, None)
    for name in FUNCTIONS:
        delattr(os, name)
    for name in SIGNALS:
        delattr(signal, name)
    os.supports_dir_fd = set()


def commands(scene: str) -> dict[str, list[str]]:
    """Words of every command and its modes, by name, in the order they build on each other; later ones end by a time limit."""
    small = ["--set", "study.samples=50", "--set", "numerics.max_steps=20000"]
    short = ["--time-limit", "0.01"]
    return {
        "init": ["init", "mine.toml"],
        "check": ["check", scene, "--no-cost", "--sketch", "sketch.png"],
        "simulate": ["simulate", scene, "-o", "out/response.nc"],
        "sample": ["sample", scene, "-o", "out/samples.nc", *small],
        "report": ["report", "out"],
        "reproduce": ["reproduce", "out/samples.nc", "--samples", "1"],
        "reproduce --crate": ["reproduce", "--crate", "out"],
        "export": ["export", "out/response.nc", "-o", "response.csv"],
        "compare": ["compare", "out/response.nc", "response.csv"],
        "plot": ["plot", "out/response.nc", "--figure", "orbit", "-o", "orbit.png"],
        "show": ["show", "laws"],
        "sample --merge": ["sample", "--merge", scene, "-o", "out/merged.nc", *small],
        "map --bifurcation": [
            "map",
            "--bifurcation",
            scene,
            "--x",
            "C=0.1mm:1mm:4",
            "-o",
            "b.nc",
            *short,
        ],
        "map": ["map", scene, "--x", "C=0.1mm:1mm:4", "-o", "map.nc", *short],
        "wear": ["wear", str(ROOT / "jobs" / "wear.toml"), "-o", "wear.nc", *short],
        "effects": ["effects", scene, "-o", "effects.nc", *short],
        "identify": [
            "identify",
            str(ROOT / "jobs" / "identify.toml"),
            "--advise",
            "-o",
            "identify.nc",
            *short,
            "--unknown",
            "joints.crank_rod.clearance=10um:150um",
        ],
        "run": ["run", scene, "-o", "study", *short],
        "accuracy": ["accuracy", scene, "-o", "accuracy", "--quick", *short],
        "accuracy --plan": ["accuracy", "--plan", scene, "--ranks", "1"],
        "init --import": ["init", "--import", "points.csv", "imported.toml"],
    }


def outcomes(place: Path, scene: str) -> dict[str, tuple[int, str]]:
    """Exit code and output of every command of the package."""
    fork, wait = os.fork, os.waitpid
    for library in LIBRARIES:
        importlib.import_module(library)
    become_windows()
    os.chdir(place)
    from hpcclear import cli
    from hpcclear.accuracy import plan

    plan.FILE_SECONDS, plan.TARGETS = 0.1, ()  # only the settings of the file, in short

    Path("points.csv").write_text(
        "name,x [mm],y [mm],bodies\nA,0,0,ground crank\nB,50,0,crank rod\nC,60,120,rod rocker\nD,150,0,rocker ground\n"
    )
    known = commands(scene)
    assert {name.split()[0] for name in known} == set(cli.cli.every()), (
        "name the words of every command"
    )
    found = {}
    for name in known:
        said = place / f"{name}.txt"
        child = fork()
        if child == 0:
            descriptor = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(descriptor, 1)
            os.dup2(descriptor, 2)
            code = 70
            try:
                cli.main(known[name])
            except SystemExit as error:
                code = int(error.code or 0)
            except BaseException:  # noqa: BLE001 - shown, and judged by the test
                import traceback

                traceback.print_exc()
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
                os._exit(code)
        found[name] = (os.waitstatus_to_exitcode(wait(child, 0)[1]), said.read_text())
    return found


def main() -> None:
    scene = str(ROOT / "jobs" / "quickstart.toml")
    with tempfile.TemporaryDirectory() as place:
        for name, (code, said) in outcomes(Path(place), scene).items():
            last = said.strip().splitlines()[-1:] or [""]
            print(f"{name:10} {code:3}  {last[0][:110]}", flush=True)


if __name__ == "__main__":
    main()
