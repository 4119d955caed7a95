"""A study on several ranks, started from a script or notebook: mpiexec in a process of its own."""

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from hpcclear.base import isolated
from hpcclear.base.errors import InputError
from hpcclear.base.extras import installing
from hpcclear.ranks.stopping import Exit, Stopped
from hpcclear.scene import Scene

DONE = "results in "
"""What the line begins with that names the directory of the results."""


def launch(scene: Scene, directory: Path, ranks: int, *, fresh: bool, progress_style: str) -> Path:
    """Run a study under ``mpiexec -n RANKS``; what it prints goes to standard error as it comes. Returns the directory of
    the results.

    Raises InputError without mpiexec, or for input that the study refuses; Stopped if it was stopped early (everything
    finished is on disk); RuntimeError, which ends with what it printed last, if it failed.
    """
    program = _mpiexec(ranks)
    style = "log" if progress_style == "auto" else progress_style
    content = {"text": scene.text, "directory": str(directory), "fresh": fresh, "style": style}
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "job.json"
        job.write_text(json.dumps(content), encoding="utf-8")
        rank = isolated.python("hpcclear.study.on_ranks:main", str(job))
        words = [program, "-n", str(ranks), *rank]
        process = subprocess.Popen(
            words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, errors="replace",
        )  # fmt: skip
        last, place = "", directory
        try:
            for line in process.stdout or ():
                if line.startswith(DONE):
                    place = Path(line.removeprefix(DONE).rstrip("\n"))
                    continue
                last = line.strip() or last
                sys.stderr.write(line)
            code = process.wait()
        except BaseException:  # an interrupted notebook leaves no ranks behind
            process.terminate()
            process.wait()
            raise
    if code == Exit.BAD_INPUT:
        raise InputError("run_study", str(directory), last.removeprefix("Error: "), "See above")
    if code == Exit.STOPPED:
        raise Stopped(last)
    if code != Exit.DONE:
        raise RuntimeError(f"the study on {ranks} ranks ended with exit code {code}: {last}")
    return place


def _mpiexec(ranks: int) -> str:
    """The launcher beside this Python, or the first in the path."""
    beside = Path(sys.executable).parent / "mpiexec"
    found = str(beside) if beside.exists() else shutil.which("mpiexec")
    if found is None:
        remedy = f"{installing('mpich')}, or leave ranks out"
        raise InputError("ranks", ranks, "there is no mpiexec to start them", remedy)
    return found
