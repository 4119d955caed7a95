"""Ranks under mpiexec: equal results, errors that end the job, stops that can be resumed.

Every mpiexec has a time-out of its own; a job that hangs is killed and fails its test.
"""

import os
import pathlib
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import commands
import numpy as np
import pytest
from patience import crowded
from synthetic import design, make_sleeping, records_of

from hpcclear.base.outcome import OUTCOME
from hpcclear.ranks import boundary, launcher
from hpcclear.ranks.leading import run_points
from hpcclear.ranks.schedule import COLUMNS, Task
from hpcclear.ranks.stopping import STOP_SIGNALS, StopSwitch

PROGRAMS = pathlib.Path(__file__).parent / "mpi_programs"


pytestmark = pytest.mark.mpi


def start(ranks: int, program: str, *arguments: object, **settings: str) -> subprocess.Popen:
    """Start a program on so many ranks; 0 is without mpiexec."""
    return commands.start([*map(str, arguments)], ranks, (str(PROGRAMS / program),), **settings)


finish = partial(commands.finish, seconds=30.0)


def wait_for(path: pathlib.Path, job: subprocess.Popen) -> None:
    """Wait until a job has made a file."""
    deadline = time.monotonic() + crowded(20.0)
    while not path.exists():
        if time.monotonic() > deadline or job.poll() is not None:
            os.killpg(job.pid, signal.SIGKILL)
            pytest.fail(f"{path.name} was not reached:\n{job.communicate()[0]}")
        time.sleep(0.01)


@pytest.fixture(scope="module")
def runs(tmp_path_factory) -> dict[int, dict[str, np.ndarray]]:
    """What equal.py wrote on 0 (no mpiexec), 1, 2 and 3 ranks."""
    folder = tmp_path_factory.mktemp("equal")
    results = {}
    for ranks in (0, 1, 2, 3):
        code, output = finish(start(ranks, "equal.py", folder / f"{ranks}.npz"))
        assert code == 0, output
        with np.load(folder / f"{ranks}.npz") as archive:
            results[ranks] = dict(archive)
    return results


@pytest.mark.parametrize("ranks", [0, 1, 2, 3])
def test_any_number_of_ranks_gives_the_same_records(runs, ranks):
    run, expected = runs[ranks], records_of(np.arange(200), design(200))
    assert run["size"] == max(ranks, 1)
    assert run["full"].tobytes() == expected.tobytes()
    assert run["half"].tobytes() == expected.tobytes()
    assert run["few"].tobytes() == records_of(np.arange(1), design(200)[:1]).tobytes()
    assert run["none"].size == run["streamed"].size == 0
    assert run["none"].dtype == OUTCOME


def test_every_finished_record_is_delivered_once(runs):
    for run in runs.values():
        assert np.sort(run["seen"]["sample"]).tolist() == sorted([*range(200), *range(9)])


@pytest.mark.parametrize("ranks", [1, 2, 3])
def test_seconds_of_all_ranks_add_up_to_the_wall_time_of_a_stage(runs, ranks):
    table = runs[ranks]["seconds_full"]
    assert table.shape == (ranks, len(COLUMNS))
    assert (table >= 0.0).all()
    walls = table.sum(axis=1)
    np.testing.assert_allclose(walls, walls[0], rtol=1e-9)
    assert (table[:, COLUMNS.index("busy")] > 0.0).all()
    # 200 samples of 2 ms in 4 lanes are 0.1 s of work, whoever does it; sleeps only get longer
    assert table[:, COLUMNS.index("busy")].sum() > 0.09
    assert runs[ranks]["seconds_serial"][0, COLUMNS.index("write")] > 0.0


@pytest.mark.parametrize("ranks", [0, 1, 2, 3])
def test_every_rank_does_once_what_is_to_be_done_everywhere(runs, ranks):
    run = runs[ranks]
    assert run["called"].tolist() == [f"{ranks}.npz-{rank}" for rank in range(max(ranks, 1))]
    table = run["seconds_everywhere"]
    assert (table[:, COLUMNS.index("compile")] >= 0.05).all()
    np.testing.assert_allclose(table.sum(axis=1), table[0].sum(), rtol=1e-9)


ERRORS = [
    "worker on root",
    "worker on a rank",
    "workers everywhere",
    "maker on root",
    "call on root",
    "call on a rank",
    "call on a rank, root busy",
    "call on a rank, root late",
    "import on a rank",
    "first on node",
    "payload",
    "callback",
    "serial",
    "stray record",
    "deaf root",
]


@pytest.mark.parametrize("how", ERRORS)
@pytest.mark.shortened(6)
def test_a_program_error_is_reported_once_and_ends_every_rank(how, tmp_path):
    code, output = finish(start(3, "failing.py", how, tmp_path / "mark"))
    elapsed = time.time() - (tmp_path / "mark").stat().st_mtime
    assert code == 1, output
    assert output.count("Traceback") == 1, output
    assert output.count("hpcclear failed on rank") == 1, output
    assert elapsed < crowded(5.0)


def test_a_report_names_rank_stage_and_sample(tmp_path):
    _, output = finish(start(2, "failing.py", "worker on a rank", tmp_path / "mark"))
    assert "on rank 1 of 2 in stage 'sampling'" in output
    assert "sample" in output.partition("in stage")[2].splitlines()[0]
    assert "raised on purpose" in output


@pytest.mark.parametrize(
    "how",
    [
        "bad input",
        "bad input on a rank",
        "bad input in a call on a rank",
        "bad input on every rank",
        "deaf root, bad input",
    ],
)
@pytest.mark.shortened(3)
def test_bad_input_on_any_rank_is_a_message_and_exit_code_2(how, tmp_path):
    code, output = finish(start(3, "failing.py", how, tmp_path / "mark"))
    assert code == 2, output
    assert "Traceback" not in output
    assert output.count("crank.length = -1.0: must be positive. Give a length in metres.") == 1
    assert time.time() - (tmp_path / "mark").stat().st_mtime < crowded(5.0)


@pytest.mark.parametrize("how", ["exit code", "system exit"])
@pytest.mark.parametrize("ranks", [0, 2])
def test_the_program_may_choose_the_exit_code(ranks, how, tmp_path):
    assert finish(start(ranks, "failing.py", how, tmp_path / "mark")) == (1, "")


def stop_and_resume(folder: pathlib.Path, where: str, number: int, ranks: int) -> str:
    job = start(ranks, "stopping.py", where, folder)
    wait_for(folder / "ready", job)
    time.sleep(0.05)
    told = time.time()
    os.kill(job.pid, number)
    code, output = finish(job)
    assert code == 3, output
    assert time.time() - told < crowded(5.0)
    assert "Traceback" not in output
    return output


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGUSR1])
@pytest.mark.parametrize("ranks", [0, 2])
@pytest.mark.shortened(4)
def test_a_signal_stops_a_run_that_then_resumes_to_the_same_result(ranks, number, tmp_path):
    output = stop_and_resume(tmp_path, "sampling", number, ranks)
    assert f"{number.name} was received" in output
    before = np.frombuffer((tmp_path / "records").read_bytes(), OUTCOME)
    assert 0 < before.size < 800
    code, output = finish(start(3, "stopping.py", "resumed", tmp_path))
    assert code == 0, output
    after = np.frombuffer((tmp_path / "records").read_bytes(), OUTCOME)
    assert np.sort(after["sample"]).tolist() == list(range(800))  # nothing was done twice
    expected = records_of(np.arange(800), design(800))
    assert np.load(tmp_path / "result.npy").tobytes() == expected.tobytes()


@pytest.mark.parametrize(
    "where", ["begin", "polling", "deaf", "set-up of a rank", "call of a rank"]
)
@pytest.mark.shortened(3)
def test_a_signal_is_obeyed_in_every_state(where, tmp_path):
    stop_and_resume(tmp_path, where, signal.SIGTERM, 2)


def test_a_signal_to_one_rank_only_stops_the_job(tmp_path):
    job = start(2, "stopping.py", "sampling", tmp_path)
    wait_for(tmp_path / "ready", job)
    os.kill(commands.ranks_of(job)[1], signal.SIGTERM)
    code, output = finish(job)
    assert code == 3, output
    assert output.count("SIGTERM was received on rank 1") == 1


@pytest.mark.parametrize("ranks", [0, 2])
def test_a_time_limit_stops_the_run(ranks, tmp_path):
    limit = crowded(2.0)  # s, from the start of the program: the first records come within it
    began = time.time()
    code, output = finish(start(ranks, "stopping.py", "limited", tmp_path, limit))
    assert code == 3, output
    assert limit < time.time() - began < limit + crowded(6.0)
    assert "the time limit was reached" in output
    assert (tmp_path / "records").stat().st_size > 0


def test_a_switch_leaves_a_process_that_goes_on_as_it_was():
    before = [signal.getsignal(number) for number in STOP_SIGNALS]
    with StopSwitch() as stop:
        assert not stop.is_set()
        os.kill(os.getpid(), signal.SIGUSR1)
        deadline = time.monotonic() + crowded(10.0)
        while not stop.is_set() and time.monotonic() < deadline:
            time.sleep(0.01)
        assert stop.reason == "SIGUSR1 was received"
    assert [signal.getsignal(number) for number in STOP_SIGNALS] == before
    assert "stop-switch" not in {thread.name for thread in threading.enumerate()}


def test_no_mpi_library_is_needed_in_one_process_but_named_when_missing(tmp_path):
    missing = {"MPI4PY_LIBMPI": str(tmp_path / "libmpi.so")}
    assert finish(start(0, "equal.py", tmp_path / "out.npz", **missing))[0] == 0
    code, output = finish(start(2, "equal.py", tmp_path / "out.npz", **missing))
    assert code == 2
    assert output.count("Error: MPI library") == 1
    assert "MPI4PY_LIBMPI" in output
    assert "Traceback" not in output


@pytest.mark.parametrize(("copies", "code"), [(1, 0), (2, 2)])
def test_a_process_that_has_left_mpi_may_run_again_by_itself(copies, code):
    """MPI starts only once: a second run used to abort the interpreter."""
    program = (
        "from hpcclear.ranks.boundary import describe_mpi, run_on_ranks\n"
        "describe_mpi()\n"  # loads the library, as `check` does
        "import os\n"
        "assert run_on_ranks(lambda ranks: 0) == 0\n"
        f"os.environ['OMPI_COMM_WORLD_SIZE'], os.environ['OMPI_COMM_WORLD_RANK'] = '{copies}', '0'\n"
        "raise SystemExit(run_on_ranks(lambda ranks: 0))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    assert ("has left MPI" in done.stderr) == (code == 2)


def test_one_process_in_a_notebook_gets_plain_exceptions():
    ranks = boundary.alone()
    result = run_points(ranks, Task("sleep", make_sleeping, {"cost": 1e-4}), design(20))
    assert result.tobytes() == records_of(np.arange(20), design(20)).tobytes()
    with pytest.raises(ArithmeticError, match="on purpose"):
        run_points(ranks, Task("sleep", make_sleeping, {"cost": 1e-4, "fails_at": 3}), design(20))


@pytest.mark.parametrize(
    ("environment", "size", "rank"),
    [
        ({}, ("", 1), None),
        ({"SLURM_NTASKS": "8", "SLURM_PROCID": "0"}, ("", 1), None),
        ({"SLURM_STEP_NUM_TASKS": "8", "SLURM_PROCID": "5"}, ("SLURM_STEP_NUM_TASKS", 8), 5),
        ({"PMI_SIZE": "1", "PMI_RANK": "0"}, ("", 1), 0),
        ({"PMI_SIZE": "3", "PMI_RANK": "2", "SLURM_PROCID": "0"}, ("PMI_SIZE", 3), 2),
        (
            {"OMPI_COMM_WORLD_SIZE": "2", "OMPI_COMM_WORLD_RANK": "1"},
            ("OMPI_COMM_WORLD_SIZE", 2),
            1,
        ),
    ],
)
def test_launchers_are_recognised(environment, size, rank):
    assert launcher.launched_size(environment) == size
    assert launcher.launched_rank(environment) == rank
    assert launcher.is_launched(environment) == (rank is not None)


def test_every_library_is_kept_to_one_thread():
    script = (
        "import numpy; from hpcclear.ranks.launcher import pin_threads; pin_threads()\n"
        "import scipy.linalg, numba, threadpoolctl\n"
        "print({i['num_threads'] for i in threadpoolctl.threadpool_info()},"
        " numba.get_num_threads())"
    )
    root = PROGRAMS.parent.parent
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=root)
    assert run.stdout.split() == ["{1}", "1"], run.stderr
