"""Nothing finished is ever lost: signals, time limits and program errors of the real commands; kills are in `test_kills`."""

import random
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import commands
import kills
import losses
import pytest
from kills import COMMANDS, OPTIONS, Undisturbed, files
from patience import crowded

pytestmark = [pytest.mark.mpi, pytest.mark.nightly]


@pytest.fixture(scope="module", params=["sample", "run"])
def undisturbed(request, tmp_path_factory) -> Iterator[Undisturbed]:
    """Each of the two commands that resume, and what comes of it when nothing disturbs it."""
    yield kills.undisturbed(request.param, tmp_path_factory.mktemp("undisturbed"))
    commands.remove_orphans()


@pytest.fixture
def place(tmp_path) -> Path:
    """An empty results folder."""
    folder = tmp_path / "results"
    folder.mkdir()
    return folder


only_sample = pytest.mark.parametrize("undisturbed", ["sample"], indirect=True)


# -- signals and the time limit -----------------------------------------------------------------


@pytest.mark.parametrize("moments", [2, pytest.param(10, marks=pytest.mark.full)])
@pytest.mark.parametrize("how", ["SIGTERM", "SIGINT", "SIGUSR1", "time limit"])
@pytest.mark.timeout(3600)
def test_a_stop_at_any_moment_ends_soon_and_can_be_resumed(tmp_path, undisturbed, how, moments):
    dice, slowest, late = random.Random(how), 0.0, 0
    if undisturbed.command is COMMANDS["run"]:
        if moments == 2 and how in ("SIGINT", "SIGUSR1"):
            pytest.skip("of a study in the long profile: signals of any name end in the same place")
        moments //= 2  # a study takes longer than all samples
    for moment in range(moments):
        folder = tmp_path / str(moment) / "results"
        folder.mkdir(parents=True)
        words, delay = undisturbed.words(folder), dice.uniform(0.05, 1.0 + undisturbed.work)
        began = [folder.parent / f"began{rank}" for rank in (0, 1)]
        settings = {"TEST_BEGAN": str(folder.parent / "began")}
        if how == "time limit":
            code, output = commands.run([*words, "--time-limit", str(delay)], **settings)
            told = began[0].stat().st_mtime + delay
        else:
            job = commands.start(words, begin_warm=True, **settings)
            while job.poll() is None and not all(mark.exists() for mark in began):
                time.sleep(0.02)  # a signal before that ends it as it would any program
            commands.wait_until(job, time.time() + delay, folder)
            told = time.time()
            commands.kill(job.pid, signal.Signals[how])
            code, output = commands.finish(job)
        elapsed = time.time() - told
        assert "Traceback" not in output
        assert elapsed < crowded(5.0) or (code == 0 and how == "time limit"), output
        slowest = max(slowest, elapsed)
        commands.check_readable(folder)
        if code == 0:  # it came too late
            late += 1
        else:
            assert code == 3, output
        assert commands.run(words)[0] == 0
        assert files(folder) == undisturbed.files
    print(f"{how}: {moments} moments, {late} after the end, the slowest took {slowest:.2f} s")


@only_sample
@pytest.mark.parametrize("ranks", [0, 2])
def test_a_second_interrupt_exits_at_once_and_breaks_nothing(tmp_path, undisturbed, ranks):
    words = commands.sample(tmp_path / "samples.nc", 100_000, *OPTIONS)
    # the first interrupt finds a root that does not listen
    job = commands.start(
        words, ranks, TEST_FAIL="sleep hpcclear.results.checkpoint:Checkpoint.flush 3"
    )
    commands.wait_for_parts(job, tmp_path)
    time.sleep(1.5)
    commands.kill(job.pid, signal.SIGINT)
    time.sleep(1.0)
    assert job.poll() is None
    told = time.time()
    commands.kill(job.pid, signal.SIGINT)
    code, output = commands.finish(job, 10.0)
    assert time.time() - told < crowded(2.0)
    assert code == 3 or ranks, output  # mpiexec aborts the job by itself, with a code of its own
    assert "Traceback" not in output
    assert commands.check_readable(tmp_path) > 0


# -- program errors -----------------------------------------------------------------------------

BEFORE = [
    "call hpcclear.scene:load_scene",
    "call hpcclear.ensemble.session:design",
    "call hpcclear.base.lock:Lock.acquire",
    "call hpcclear.results.checkpoint:Checkpoint._open",
    "import hpcclear.ensemble.session",
    "import hpcclear.scene",
]
DURING = ["import hpcclear.dynamics.evaluation.evaluator", "maker", "simulation"]
NO_MORE_SAVES = [
    "call hpcclear.results.checkpoint:Checkpoint.flush 2",
    "call hpcclear.results.dataset:samples_dataset 2",
]
AFTER = [
    *NO_MORE_SAVES,
    "once hpcclear.results.checkpoint:Checkpoint.flush 2",
    "once hpcclear.results.dataset:write_bytes 3",
    "call hpcclear.ranks.progress:Progress.add 5",
    "call hpcclear.results.checkpoint:Checkpoint.finish",
    "call hpcclear.ensemble.session:timing_of",
    "call hpcclear.cli.printing:describe_run",
]
CASES = [(case, 0) for case in BEFORE + DURING + AFTER] + [(case, 1) for case in DURING]


def fail_and_resume(place: Path, undisturbed: Undisturbed, case: str, rank: int) -> int:
    """Let a command fail, then resume it; how many samples were done again."""
    before, after = place.parent / "before.log", place.parent / "after.log"
    mark = place.parent / "mark.log"
    words = undisturbed.words(place)
    if (
        "flush" in case or case in NO_MORE_SAVES
    ):  # a fast machine is done before there is a second one
        words = [*words, "--checkpoint-interval", "0.2"]
    settings = {"TEST_FAIL": case, "TEST_RANK": str(rank), "TEST_MARK": str(mark)}
    code, output = commands.run(words, TEST_LOG=str(before), **settings)
    elapsed = time.time() - mark.stat().st_mtime
    assert code == 1, output
    assert elapsed < crowded(5.0)
    assert output.count("Traceback") == 1, output
    assert output.count(f"hpcclear failed on rank {rank} of 2 in stage") == 1, output
    assert "raised on purpose" in output
    commands.check_readable(place)
    assert commands.run(words, TEST_LOG=str(after))[0] == 0
    assert files(place) == undisturbed.files
    return losses.loss_of(before, [after], None).samples


@only_sample
@pytest.mark.parametrize(("case", "rank"), CASES)
def test_a_program_error_at_any_stage_is_reported_once_and_work_is_saved(
    place, undisturbed, case, rank
):
    again = fail_and_resume(place, undisturbed, case, rank)
    # All is saved, unless each save from some moment on fails: then what came after the last good one is lost.
    assert again == 0 or case in NO_MORE_SAVES
    assert again > 0 or case not in NO_MORE_SAVES
