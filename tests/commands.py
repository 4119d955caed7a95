"""The real commands under mpiexec, for tests of what ends them: started, killed, resumed, read meanwhile."""

import atexit
import contextlib
import functools
import os
import shlex
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import pytest
from mpi_programs import client
from patience import crowded

from hpcclear.base.errors import InputError
from hpcclear.results import netcdf

ROOT = Path(__file__).parent.parent
MPIEXEC = Path(sys.executable).parent / "mpiexec"
PROGRAM = Path(__file__).parent / "mpi_programs" / "command.py"
SCENE = ROOT / "jobs" / "quickstart.toml"
# A sample that goes wild ends soon; the kernel is the shipped scene's, compiled once for all tests.
CHEAP = ("numerics.max_steps=20000", "numerics.transient_revolutions=2")


def overrides(*settings: str) -> list[str]:
    """``--set`` options."""
    return [word for setting in settings for word in ("--set", setting)]


def sample(output: Path, samples: int, *options: str) -> list[str]:
    """Words of a `sample` command of the quickstart."""
    study = overrides(*CHEAP, f"study.samples={samples}")
    return ["sample", str(SCENE), "-o", str(output), *study, *options]


def wait_for_parts(job: subprocess.Popen, folder: Path) -> None:
    """Wait until the first finished samples are on disk."""
    deadline = time.time() + crowded(60.0)
    while not result_files(folder):
        assert job.poll() is None, finish(job)[1]
        assert time.time() < deadline
        time.sleep(0.02)


def start(
    words: Sequence[str],
    ranks: int = 2,
    program: Sequence[str] = (str(PROGRAM),),
    *,
    begin_warm: bool = False,
    **settings: str,
) -> subprocess.Popen:
    """Start a command on so many ranks (0: without mpiexec), in a process group of its own.

    With `begin_warm`, ranks are forks of a process that has loaded everything: for all but a kill, and an import
    that is to fail.
    """
    launch = [str(MPIEXEC), "-n", str(ranks)] if ranks else []
    python = warm().words(program) if begin_warm else [sys.executable, *program]
    return began([*launch, *python, *words], **settings)


def began(words: Sequence[str], place: Path | None = None, **settings: str) -> subprocess.Popen:
    """A program that has been started, in a folder, what it says in one pipe."""
    return subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        cwd=place,
        env=os.environ | {"PYTHONPATH": str(ROOT)} | settings,
        start_new_session=True,
    )


def finish(job: subprocess.Popen, seconds: float = 400.0) -> tuple[int, str]:
    """Exit code and output; a job that does not end in time is killed and fails the test."""
    try:
        output, _ = job.communicate(timeout=crowded(seconds))
    except subprocess.TimeoutExpired:
        for process in ranks_of(job).values():
            kill(process)
        os.killpg(job.pid, signal.SIGKILL)
        output, _ = job.communicate()
        pytest.fail(f"the job did not end within {seconds} s:\n{output}")
    return job.returncode, output


def run(words: Sequence[str], ranks: int = 2, **settings: str) -> tuple[int, str]:
    """Exit code and output of a whole command."""
    plain = all(name.startswith("TEST_") for name in settings)
    loads = settings.get("TEST_FAIL", "").startswith("import ")
    return finish(start(words, ranks, begin_warm=plain and not loads, **settings))


def limited(kind: int, amount: int, words: Sequence[str], ranks: int = 0) -> tuple[int, str]:
    """Exit code and output of a command under a resource limit (what ulimit sets)."""
    limit = f"import os, resource, sys; resource.setrlimit({kind}, ({amount}, {amount}))\n"
    limit += "os.execvp(sys.argv[1], sys.argv[1:])"
    program = ("-c", limit, sys.executable, "-m", "hpcclear")
    return finish(start(words, ranks, program))


def kill(process: int, number: int = signal.SIGKILL) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, number)


def ranks_of(job: subprocess.Popen) -> dict[int, int]:
    """Process numbers of a job's ranks, by rank: those in its tree that a launcher gave a rank."""
    parents, found = {}, {}
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            parents[int(place.name)] = int(
                (place / "stat").read_text().rpartition(")")[2].split()[1]
            )
    for process in parents:
        above = process
        while above in parents and above != job.pid:
            above = parents[above]
        if above != job.pid:
            continue
        with contextlib.suppress(OSError):
            for entry in Path(f"/proc/{process}/environ").read_bytes().split(b"\0"):
                name, _, value = entry.partition(b"=")
                if name == b"PMI_RANK":
                    found[int(value)] = process
    return found


def remove_orphans() -> None:
    """Remove shared memory that killed ranks of MPICH left behind: nobody's, and a minute old."""
    used = set()
    for maps in Path("/proc").glob("[0-9]*/maps"):
        with contextlib.suppress(OSError):
            used |= {
                line.split()[-1] for line in maps.read_text().splitlines() if "/dev/shm" in line
            }
    for path in Path("/dev/shm").glob("mpich_shm_*"):
        with contextlib.suppress(OSError):
            if str(path) not in used and time.time() - path.stat().st_mtime > 60.0:
                path.unlink()


def result_files(folder: Path) -> list[Path]:
    """Every NetCDF file in a results folder, checkpoints included."""
    return sorted(path for path in folder.rglob("*.nc"))


def contents(folder: Path) -> dict[str, bytes]:
    """Bytes of all results by their name, but for the times, which may differ."""
    paths = [path for path in result_files(folder) if not path.name.endswith("timing.nc")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def check_readable(folder: Path) -> int:
    """Read every file there is; a file that a merge has just removed does not count. Number read."""
    count = 0
    for path in result_files(folder):
        try:
            netcdf.load(path)
        except InputError:
            assert not path.exists(), f"{path} cannot be read"
        else:
            count += 1
    return count


def wait_until(
    job: subprocess.Popen, moment: float, folder: Path, *, writing: bool = False
) -> None:
    """Read all files again and again until a moment (`time.time`), or the job's end.

    With `writing`, go on until a file is being written.
    """
    while job.poll() is None and time.time() < moment:
        check_readable(folder)
        time.sleep(0.02)
    patience = time.time() + 3.0
    while writing and job.poll() is None and time.time() < patience:
        if any(folder.rglob(".hpcclear-*.tmp")):
            return


class Warm:
    """A process that has loaded everything and becomes any program in a fork, in a tenth of a start's time.

    `programs` holds a `hpcclear` that does so: the same behind mpiexec and in a shell.
    """

    def __init__(self) -> None:
        # of its own, as a socket's name has to be short
        self._folder = tempfile.TemporaryDirectory(prefix="warm-")
        self.socket = Path(self._folder.name) / "socket"
        self.programs = Path(self._folder.name) / "bin"
        self.programs.mkdir()
        self._process = subprocess.Popen(
            [sys.executable, str(PROGRAM.with_name("warm.py")), str(self.socket)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"},
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline() == b"ready\n"
        shell = self.programs / "hpcclear"
        shell.write_text(f'#!/bin/sh\nexec {shlex.join(self.words(["-m", "hpcclear"]))} "$@"\n')
        shell.chmod(0o755)

    def words(self, program: Sequence[str]) -> list[str]:
        """What stands for `[sys.executable, *program]`, behind mpiexec too."""
        client = PROGRAM.with_name("client.py")
        return [sys.executable, "-I", "-S", str(client), str(self.socket), *program]

    def close(self) -> None:
        """End the process, and all that it became."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(crowded(60.0))
        self._folder.cleanup()


@functools.cache
def warm() -> Warm:
    """The one of this session of tests."""
    made = Warm()
    atexit.register(made.close)
    return made


def warm_command(*words: object, user: int | None = None) -> tuple[int, str]:
    """Exit code (negative: killed by a signal, which is how one that hangs ends) and output of a command.

    It is a process that began warm, without mpiexec, in a session of its own.
    """
    with tempfile.TemporaryFile() as output, open(os.devnull) as nothing:
        ours = {0: nothing.fileno(), 1: output.fileno(), 2: output.fileno()}
        asked = ["-m", "hpcclear", *(str(word) for word in words)]
        with client.request(str(warm().socket), asked, ours, user=user) as answer:
            answer.settimeout(crowded(120.0))
            try:
                code = int(answer.recv(16))
            except TimeoutError:
                answer.shutdown(socket.SHUT_WR)
                answer.settimeout(None)
                code = int(answer.recv(16))
        output.seek(0)
        return code, output.read().decode(errors="replace")
