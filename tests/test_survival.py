"""Nothing finished is ever lost: kills, signals, time limits and program errors of the real commands."""

import itertools
import random
import signal
import subprocess
import sys
import time
from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from commands import (
    CHEAP,
    PROGRAM,
    SCENE,
    check_readable,
    finish,
    kill,
    overrides,
    ranks_of,
    remove_orphans,
    result_files,
    run,
    sample,
    start,
    wait_until,
)

from hpcclear import dataset
from hpcclear.checkpoint import INTERVAL as CHECKPOINT_INTERVAL
from hpcclear.ranks import FLUSH_INTERVAL

sys.path.insert(0, str(PROGRAM.parent))

import formula

pytestmark = pytest.mark.mpi
SAMPLES = 4000
INTERVAL = 0.5  # s
OPTIONS = ("--checkpoint-interval", str(INTERVAL), "--progress", "quiet")


@dataclass(frozen=True)
class Undisturbed:
    """A command and what comes of it when nothing disturbs it."""

    words: Callable[[Path], list[str]]
    """Words that put the results into a folder."""
    interval: float
    wall: float = 0.0
    files: dict[str, bytes] = field(default_factory=dict)


def files(folder: Path) -> dict[str, bytes]:
    """All that lies in a results folder, but for the times, which may differ."""
    found = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    return {name: path.read_bytes() for name, path in found.items() if name != "timing.nc"}


def sample_words(folder: Path) -> list[str]:
    return sample(folder / "samples.nc", SAMPLES, *OPTIONS)


def study_words(folder: Path) -> list[str]:
    """A study in which every stage is small."""
    scene = folder.parent / "study.toml"
    scene.write_text(SCENE.read_text().partition("[study]")[0] + formula.STUDY)
    return ["run", str(scene), "-o", str(folder), "--progress", "quiet", *overrides(*CHEAP)]


@pytest.fixture(scope="module", params=["sample", "run"])
def undisturbed(request, tmp_path_factory) -> Iterator[Undisturbed]:
    """Each of the two commands that resume."""
    words = {"sample": sample_words, "run": study_words}[request.param]
    place = tmp_path_factory.mktemp("undisturbed")
    for name in ("compiling", "results"):
        (place / name).mkdir()
        began = time.time()
        code, output = run(words(place / name))
        assert code == 0, output
    interval = INTERVAL if request.param == "sample" else CHECKPOINT_INTERVAL
    yield Undisturbed(words, interval, time.time() - began, files(place / "results"))
    remove_orphans()


@pytest.fixture
def place(tmp_path) -> Path:
    """An empty results folder."""
    folder = tmp_path / "results"
    folder.mkdir()
    return folder


only_sample = pytest.mark.parametrize("undisturbed", ["sample"], indirect=True)


# -- kills --------------------------------------------------------------------------------------


def simulated(log: Path) -> dict[int, list[float]]:
    """When each sample was finished, as often as it was."""
    times = defaultdict(list)
    for line in log.read_text().splitlines():
        moment, _, number = line.split()
        times[int(number)].append(float(moment))
    return times


def check_repeated(log: Path, kills: list[float], window: float) -> int:
    """Assert that no kill cost more samples than any `window` seconds held; the most that one cost."""
    times = simulated(log)
    lost = Counter(
        bisect_left(kills, moment - 0.1)
        for moments in times.values()
        for moment in sorted(moments)[:-1]
    )
    finished = np.sort(np.concatenate([*times.values()]))
    held = np.searchsorted(finished, finished + window, "right") - np.arange(finished.size)
    assert max(lost.values(), default=0) <= held.max()
    return max(lost.values(), default=0)


# In the long profile: what one interval holds is judged by rates, which a crowded machine upsets.
@pytest.mark.full
@pytest.mark.parametrize("kills", [5, 50])
@pytest.mark.timeout(3600)
def test_kills_of_any_rank_at_any_moment_lose_at_most_an_interval(tmp_path, undisturbed, kills):
    dice, done, lost, states = random.Random(kills), 0, 0, defaultdict(int)
    for turn in itertools.count():
        if done >= kills:
            break
        folder, log = tmp_path / str(turn) / "results", tmp_path / f"{turn}.log"
        folder.mkdir(parents=True)
        words, moments = undisturbed.words(folder), []
        for _ in range(4):  # up to four kills of one run
            job = start(words, TEST_LOG=str(log))
            moment = time.time() + dice.uniform(0.3, undisturbed.wall)
            wait_until(job, moment, folder, writing=dice.random() < 0.3)
            ranks = ranks_of(job)
            if job.poll() is not None or not ranks:
                break
            states["amid a write"] += any(folder.rglob(".hpcclear-*.tmp"))
            kill(ranks[dice.choice(sorted(ranks))])
            moments.append(time.time())
            code, output = finish(job, 20.0)
            states["too late"] += code == 0
            check_readable(folder)
            done += 1
        code, output = finish(job)
        code, output = run(words, TEST_LOG=str(log))
        assert code == 0, output
        assert files(folder) == undisturbed.files
        # what waits for the interval, and at the ranks before that
        lost = max(lost, check_repeated(log, moments, undisturbed.interval + FLUSH_INTERVAL + 0.5))
    print(f"{done} kills, each cost {lost} samples at most; {dict(states)}")


# -- signals and the time limit -----------------------------------------------------------------


@pytest.mark.parametrize("moments", [2, pytest.param(10, marks=pytest.mark.full)])
@pytest.mark.parametrize("how", ["SIGTERM", "SIGINT", "SIGUSR1", "time limit"])
@pytest.mark.timeout(900)
def test_a_stop_at_any_moment_ends_soon_and_can_be_resumed(tmp_path, undisturbed, how, moments):
    dice, slowest, late = random.Random(how), 0.0, 0
    for moment in range(moments):
        folder = tmp_path / str(moment) / "results"
        folder.mkdir(parents=True)
        words, delay = undisturbed.words(folder), dice.uniform(0.8, undisturbed.wall)
        if how == "time limit":
            began = folder.parent / "began.log"
            code, output = run([*words, "--time-limit", str(delay)], TEST_BEGAN=str(began))
            told = began.stat().st_mtime + delay
        else:
            job = start(words)
            wait_until(job, time.time() + delay, folder)
            told = time.time()
            kill(job.pid, signal.Signals[how])
            code, output = finish(job)
        elapsed = time.time() - told
        assert "Traceback" not in output
        assert elapsed < 5.0 or (code == 0 and how == "time limit"), output
        slowest = max(slowest, elapsed)
        check_readable(folder)
        if code == 0:  # it came too late
            late += 1
        else:
            assert code == 3, output
        assert run(words)[0] == 0
        assert files(folder) == undisturbed.files
    print(f"{how}: {moments} moments, {late} after the end, the slowest took {slowest:.2f} s")


@only_sample
@pytest.mark.parametrize("program", ["hpcclear", "-m hpcclear"])
@pytest.mark.parametrize("ranks", [0, 2])
def test_both_entry_points_obey_a_signal(tmp_path, undisturbed, program, ranks):
    words = sample(tmp_path / "samples.nc", 100_000, *OPTIONS)
    entry = ("-m", "hpcclear") if program == "-m hpcclear" else (_script(),)
    job = start(words, ranks, entry)
    wait_for_parts(job, tmp_path)
    kill(job.pid, signal.SIGTERM)
    code, output = finish(job, 10.0)
    assert code == 3, output
    assert output.count("SIGTERM was received") == 1
    assert "The same command goes on from here" in output


@only_sample
@pytest.mark.parametrize("ranks", [0, 2])
def test_a_second_interrupt_exits_at_once_and_breaks_nothing(tmp_path, undisturbed, ranks):
    words = sample(tmp_path / "samples.nc", 100_000, *OPTIONS)
    # the first interrupt finds a root that does not listen
    job = start(words, ranks, TEST_FAIL="sleep hpcclear.checkpoint:Checkpoint.flush 3")
    wait_for_parts(job, tmp_path)
    time.sleep(1.5)
    kill(job.pid, signal.SIGINT)
    time.sleep(1.0)
    assert job.poll() is None
    told = time.time()
    kill(job.pid, signal.SIGINT)
    code, output = finish(job, 10.0)
    assert time.time() - told < 2.0
    assert code == 3 or ranks, output  # mpiexec aborts the job by itself, with a code of its own
    assert "Traceback" not in output
    assert check_readable(tmp_path) > 0


def wait_for_parts(job: subprocess.Popen, folder: Path) -> None:
    """Wait until the first finished samples are on disk."""
    deadline = time.time() + 60.0
    while not result_files(folder):
        assert job.poll() is None, finish(job)[1]
        assert time.time() < deadline
        time.sleep(0.02)


def _script() -> str:
    """The installed command, next to the interpreter."""
    return str(Path(sys.executable).parent / "hpcclear")


# -- program errors -----------------------------------------------------------------------------

BEFORE = [
    "call hpcclear.cli:_scene",
    "call hpcclear.batch:design",
    "call hpcclear.lock:Lock.acquire",
    "call hpcclear.checkpoint:Checkpoint._open",
    "import hpcclear.batch",
    "import hpcclear.scene",
]
DURING = ["import hpcclear.evaluator", "maker", "simulation"]
AFTER = [
    "call hpcclear.checkpoint:Checkpoint.flush 2",
    "call hpcclear.progress:Progress.add 5",
    "call hpcclear.dataset:samples_dataset 2",
    "call hpcclear.batch:discard",
    "call hpcclear.batch:timing_of",
    "call hpcclear.describe:describe_samples",
]
CASES = [(case, 0) for case in BEFORE + DURING + AFTER] + [(case, 1) for case in DURING]
STUDY_CASES = [
    "call hpcclear.cli:_scene",
    "import hpcclear.study",
    "call hpcclear.checkpoint:Checkpoint._open",
    "call hpcclear.study.sensitivities:analyse",
    "call hpcclear.study.surrogates:fit_all",
    "call hpcclear.study.optimisation:optimise",
    "call hpcclear.study.verification:moments",
    "call hpcclear.study.responses:simulate_all",
    "call hpcclear.study.claims:judge",
    "call hpcclear.checkpoint:Checkpoint.save_stage 2",
    "call hpcclear.study:_write_timing",
    "call hpcclear.checkpoint:Checkpoint.finish",
]


def fail_and_resume(place: Path, undisturbed: Undisturbed, case: str, rank: int) -> tuple[int, int]:
    """Let a command fail, then resume it; how many samples it had finished, how many were done again."""
    log, mark = place.parent / "samples.log", place.parent / "mark.log"
    log.touch()
    words = undisturbed.words(place)
    settings = {"TEST_FAIL": case, "TEST_RANK": str(rank), "TEST_MARK": str(mark)}
    code, output = run(words, TEST_LOG=str(log), **settings)
    elapsed = time.time() - mark.stat().st_mtime
    assert code == 1, output
    assert elapsed < 5.0
    assert output.count("Traceback") == 1, output
    assert output.count(f"hpcclear failed on rank {rank} of 2 in stage") == 1, output
    assert "raised on purpose" in output
    check_readable(place)
    before = len(simulated(log))
    assert run(words, TEST_LOG=str(log))[0] == 0
    assert files(place) == undisturbed.files
    return before, sum(len(times) > 1 for times in simulated(log).values())


@only_sample
@pytest.mark.parametrize(("case", "rank"), CASES)
def test_a_program_error_at_any_stage_is_reported_once_and_work_is_saved(
    place, undisturbed, case, rank
):
    before, again = fail_and_resume(place, undisturbed, case, rank)
    # What root was told of is saved; a rank may die with what it had not sent yet.
    limit = 0 if case in BEFORE + AFTER[3:] else 1500
    assert again <= limit, f"{again} of {before} samples were simulated again"


@pytest.mark.full
@pytest.mark.parametrize("undisturbed", ["run"], indirect=True)
@pytest.mark.parametrize("case", STUDY_CASES)
def test_a_program_error_at_any_stage_of_a_study_is_reported_once(place, undisturbed, case):
    assert fail_and_resume(place, undisturbed, case, 0)[1] == 0


@only_sample
def test_results_of_an_interrupted_run_are_datasets_of_their_own(tmp_path, undisturbed):
    words = sample(tmp_path / "samples.nc", 100_000, *OPTIONS)
    job = start(words)
    wait_for_parts(job, tmp_path)
    time.sleep(1.0)
    kill(job.pid, signal.SIGTERM)
    assert finish(job)[0] == 3
    parts = [dataset.read(path, "samples") for path in result_files(tmp_path)]
    numbers = np.concatenate([part["sample"] for part in parts])
    assert numbers.size == np.unique(numbers).size > 100
    assert all(np.isfinite(part["m2"]).all() for part in parts)
