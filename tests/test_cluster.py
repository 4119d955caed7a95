"""Jobs on several nodes: the same bytes as one process; and whatever dies, nothing of a job is left or hangs.

Nodes are namespaces (`tests/cluster/box.py`), which need root; the launcher is MPICH's, started as it starts ssh.
"""

import os
import shlex
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from cluster import slurm
from cluster.box import Box, refusal
from commands import (
    CHEAP,
    MPIEXEC,
    ROOT,
    SCENE,
    began,
    finish,
    overrides,
    ranks_of,
    run,
    sample,
    start,
)
from patience import crowded

from hpcclear.base.host import process_fields
from hpcclear.ranks import launcher, life
from hpcclear.ranks.watch import Neighbour, silence

REFUSAL = refusal()
pytestmark = pytest.mark.timeout(900)
FULL = pytest.mark.full
SILENCE = 6.0
DOCUMENTED = {0, 1, 2, 3}
PLAIN = ["-m", "hpcclear"]


@pytest.fixture
def box(tmp_path, request) -> Iterator[Box]:
    if REFUSAL:
        pytest.skip(REFUSAL)
    with Box(getattr(request, "param", 2), tmp_path) as made:
        yield made


def ended(box: Box, job: subprocess.Popen, seconds: float = 60.0) -> tuple[int, str]:
    """Exit code and output of a job that is about to end; none of its processes may be left after a minute."""
    assert box.wait_until_empty(crowded(seconds)) < float("inf"), box.left()
    try:
        output, _ = job.communicate(timeout=crowded(30.0))
    except subprocess.TimeoutExpired:
        job.kill()
        pytest.fail("the launcher hangs")
    return job.returncode, output


@pytest.mark.parametrize("box", [2, pytest.param(4, marks=FULL)], indirect=True)
def test_samples_of_several_nodes_are_those_of_one_process(box, tmp_path):
    here, there = (tmp_path / name / "samples.nc" for name in ("here", "there"))
    for place in (here, there):
        place.parent.mkdir()
    assert run(sample(here, 400), 0)[0] == 0
    job = box.start(sample(there, 400))
    code, output = ended(box, job, 200.0)
    assert code == 0, output
    assert there.read_bytes() == here.read_bytes()


@pytest.fixture
def slurmed(box) -> Iterator[slurm.Slurm]:
    if slurm.refusal():
        pytest.skip(slurm.refusal())
    with slurm.Slurm(box) as made:
        yield made


@FULL
@pytest.mark.parametrize("box", [2, 4], indirect=True)
def test_samples_of_a_slurm_job_are_those_of_one_process(box, slurmed, tmp_path):
    here, there = (tmp_path / name / "samples.nc" for name in ("here", "there"))
    for place in (here, there):
        place.parent.mkdir()
    assert run(sample(here, 400), 0)[0] == 0
    code, output = ended(box, slurmed.job(sample(there, 400), 1), 200.0)
    assert code == 0, output
    assert there.read_bytes() == here.read_bytes()


@FULL
@pytest.mark.parametrize("what", ["cut", "root", "remote", "node", "term"])
def test_whatever_dies_under_slurm_nothing_is_left(box, slurmed, tmp_path, what):
    output = tmp_path / "samples.nc"
    words = sample(output, 2_000_000, "--checkpoint-interval", "1")
    job = slurmed.job(words, 2, HPCCLEAR_SILENCE=str(SILENCE))
    until_it_saves(job, output)
    strike(box, what)
    code, text = ended(box, job)
    assert code != 0, text  # often srun's own: MPICH may crash when it writes to who is dead
    assert code == 3 or what != "term", text
    assert list(tmp_path.glob(".samples.nc.parts/part-*.nc"))


@FULL
def test_a_study_on_two_nodes_is_that_of_one_process(box, tmp_path):
    words = ["run", str(SCENE), *overrides(*CHEAP, "study.samples=60"), "-o"]
    assert run([*words, str(tmp_path / "here")], 0)[0] == 0
    code, output = ended(box, box.start([*words, str(tmp_path / "there")]), 600.0)
    assert code == 0, output
    names = {path.name for path in (tmp_path / "here").glob("*.nc")} - {"timing.nc"}
    assert "front.nc" in names
    for name in names:
        assert (tmp_path / "there" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


def working(
    box: Box, output: Path, ranks: int = 2, seconds: float | None = SILENCE
) -> subprocess.Popen:
    """A long job that has begun to save samples on all nodes; None: with the silence that is the default."""
    known = {} if seconds is None else {"HPCCLEAR_SILENCE": str(seconds)}
    job = box.start(sample(output, 2_000_000, "--checkpoint-interval", "1"), ranks, **known)
    until_it_saves(job, output)
    return job


def until_it_saves(job: subprocess.Popen, output: Path) -> None:
    """Wait until samples of a job are on disk."""
    parts = output.with_name(f".{output.name}.parts")
    patience = time.monotonic() + crowded(120.0)
    while not list(parts.glob("part-*.nc")):
        assert job.poll() is None, job.communicate()[0]
        assert time.monotonic() < patience, "the job does not begin"
        time.sleep(0.1)


def strike(box: Box, what: str) -> None:
    """What may happen to a job on two nodes of two ranks."""
    first, second = box.nodes
    if what == "cut":
        box.cut(second)
    elif what == "node":
        second.kill()
    elif what == "frozen":
        for process in second.processes(""):
            os.kill(process, signal.SIGSTOP)
    else:
        victim = second.ranks()[3] if what == "remote" else first.ranks()[0]
        os.kill(victim, signal.SIGTERM if what == "term" else signal.SIGKILL)


@pytest.mark.parametrize(
    ("what", "codes"),
    [
        pytest.param(
            "cut", {1}, marks=pytest.mark.nightly
        ),  # at the default silence: later MPICH crashes without a message
        pytest.param("root", DOCUMENTED | {9, 137, 255}, marks=FULL),  # the launcher's own
        pytest.param("remote", DOCUMENTED | {9, 137, 255}, marks=FULL),
        pytest.param("node", DOCUMENTED | {9, 137, 255}, marks=FULL),
        pytest.param("frozen", {1}, marks=FULL),
        pytest.param("term", {3}, marks=FULL),
        pytest.param("launcher", {-9}, marks=FULL),
    ],
)
def test_whatever_dies_nothing_is_left_and_the_same_command_goes_on(box, tmp_path, what, codes):
    output = tmp_path / "samples.nc"
    job = working(box, output, seconds=None if what == "cut" else SILENCE)
    if what == "launcher":
        job.kill()
    else:
        strike(box, what)
    if what == "frozen":  # they are what is left: nothing on the other node may be
        patience = time.monotonic() + crowded(60.0)
        first, second = box.nodes
        while first.processes() and time.monotonic() < patience:
            time.sleep(0.2)
        second.kill()
    code, text = ended(box, job)
    assert code in codes, (code, text)
    if what in ("cut", "frozen"):
        assert "nothing was heard of rank" in text
    parts = list(tmp_path.glob(".samples.nc.parts/part-*.nc"))
    assert parts  # for the same command to go on from
    words = [*sample(output, 2_000_000), "--time-limit", "2"]
    again = box.nodes[0].words([sys.executable, "-m", "hpcclear", *words])  # whose lock it is
    path = os.environ | {"PYTHONPATH": str(ROOT)}
    assert subprocess.run(again, env=path, timeout=crowded(120.0)).returncode == 3


def statistics(output: Path, samples: int, *options: str) -> list[str]:
    """Words of a command that sums samples up and keeps them, too."""
    words = sample(output, samples, "--set", "study.method=monte-carlo", *options)
    return [*words, "--statistics", "--raw", str(output.with_name(f"{output.stem}-raw"))]


def contents(output: Path) -> dict[str, bytes]:
    """All that `statistics` wrote, by name."""
    raw = output.with_name(f"{output.stem}-raw")
    return {path.name: path.read_bytes() for path in (output, *raw.glob("*.nc"))}


@pytest.mark.nightly
@pytest.mark.parametrize("box", [2, pytest.param(4, marks=FULL)], indirect=True)
def test_statistics_of_several_nodes_are_those_of_one_process(box, tmp_path):
    here, there = (tmp_path / name / "sums.nc" for name in ("here", "there"))
    for place in (here, there):
        place.parent.mkdir()
    assert finish(start(statistics(here, 20_000), 0, PLAIN))[0] == 0
    code, output = ended(box, box.start(statistics(there, 20_000), 3), 200.0)
    assert code == 0, output
    assert len(contents(there)) == 1 + 5  # statistics, and blocks of samples
    assert contents(there) == contents(here)


def beats_until_lost(neighbour: Neighbour, lives: Iterable[bool | None], patience: float) -> int:
    """Beats without a pulse after which a neighbour is given up; 0 if it is not."""
    for count, alive in enumerate(lives, 1):
        if neighbour.beat(alive, patience):
            return count
    return 0


@pytest.mark.parametrize("patience", [6, 48, float("inf")])
def test_who_is_silent_is_judged_by_what_the_system_says_of_it(patience):
    """Ended: given up after two beats; nothing known: after its patience; while it computes: never."""
    most = 200
    for lives, expected in (
        ([False] * most, 2),
        ([None] * most, patience if patience < most else 0),
        ([True] * most, 0),
        # starved of its processor for longer than it is borne, in turns
        ([True, None] * most, 2 * patience if patience < most else 0),
        ([None] * 3 + [False] * most, 4),
    ):
        assert beats_until_lost(Neighbour(), lives, patience) == expected


def test_a_system_that_calls_dead_who_sends_pulses_is_not_believed():
    """A connection that broke on a network of its own, while the ranks exchange messages on another."""
    neighbour = Neighbour()
    for _ in range(3):
        neighbour.heard(1)
        assert not neighbour.beat(False, 48)
    assert beats_until_lost(neighbour, [False] * 100, 48) == 48


def test_the_processor_time_of_a_process_says_whether_it_lives():
    """One that computes, one that sleeps, one that is stopped, one that has ended (a zombie until it is waited for), none."""
    program = "import sys, time; print(flush=True)\nwhile len(sys.argv) > 1: pass\ntime.sleep(600)"
    made = [
        subprocess.Popen([sys.executable, "-c", program, *more], stdout=subprocess.PIPE)
        for more in (["busy"], [], ["stopped"], ["ended"])
    ]
    try:
        for process in made:
            process.stdout.readline()
        known = [life.Process(_identity(process.pid)) for process in made]
        assert all(process.visible for process in known)
        made[2].send_signal(signal.SIGSTOP)
        made[3].kill()
        patience = time.monotonic() + crowded(20.0)
        while (found := [process.lives() for process in known]) != [True, None, None, False]:
            assert time.monotonic() < patience, found
            time.sleep(0.1)
        other = _identity(made[0].pid)._replace(started="1")  # another one has the number now
        assert life.Process(other).lives() is False
        assert not life.Process(other).visible
    finally:
        for process in made:
            process.kill()
            process.wait()
    assert known[0].lives() is False


def _identity(process: int) -> life.Identity:
    mine = life.identity()
    assert mine is not None
    return life.Identity(process, process_fields(process)[19], mine.namespace)


def test_a_connection_is_of_ranks_only_and_says_when_the_other_end_ends():
    root, other = life.Connections(), life.Connections()
    address = root.offer([3])
    assert address is not None
    address = address._replace(host="127.0.0.1")
    stranger = socket.create_connection(address[:2])
    stranger.sendall(bytes(24))  # not the word
    joining = threading.Thread(target=other.join, args=(3, 0, address))
    joining.start()
    while joining.is_alive():
        root.accept()
    assert stranger.recv(1) == b""
    assert root.lives(3) is None
    assert other.lives(0) is None
    with pytest.raises(ConnectionRefusedError):  # nobody else is due
        socket.create_connection(address[:2]).recv(1)
    other.close()
    patience = time.monotonic() + crowded(5.0)
    while root.lives(3) is not False:
        assert time.monotonic() < patience
    root.close()
    stranger.close()


def test_the_silence_can_be_set_and_a_slip_does_not_count():
    assert silence({}) == 120.0
    assert silence({"HPCCLEAR_SILENCE": "5"}) == 5.0
    assert silence({"HPCCLEAR_SILENCE": "0"}) == 0.0
    assert silence({"HPCCLEAR_SILENCE": "soon"}) == 120.0
    assert silence({"HPCCLEAR_SILENCE": "nan"}) == 120.0


@pytest.mark.nightly
@pytest.mark.parametrize("who", ["root", "remote", "beside"])
def test_a_rank_without_a_processor_for_60_s_is_kept(box, tmp_path, who):
    output = tmp_path / "samples.nc"
    job = working(box, output, seconds=None)
    first, second = box.nodes
    place, rank = {"root": (first, 0), "beside": (first, 1), "remote": (second, 2)}[who]
    victim = place.ranks()[rank]
    os.kill(victim, signal.SIGSTOP)
    time.sleep(60.0)
    assert job.poll() is None, job.communicate()[0]
    os.kill(victim, signal.SIGCONT)
    time.sleep(5.0)
    strike(box, "term")
    code, text = ended(box, job)
    assert code == 3, text
    assert "nothing was heard" not in text


def test_what_comes_from_the_launcher_ends_at_the_launcher(monkeypatch):
    """A process that no launcher started has no lineage: it goes on when the shell that started it ends (nohup, setsid)."""
    for name in (*launcher._RANK, "SLURM_PROCID", "SLURM_STEP_NUM_TASKS"):
        monkeypatch.delenv(name, raising=False)
    assert launcher.lineage() == {}
    monkeypatch.setenv("PMI_RANK", "0")
    assert launcher.lineage() == {os.getpid(): os.getppid()}
    assert not launcher.is_orphan({os.getpid(): os.getppid()})
    assert launcher.is_orphan({os.getpid(): os.getppid() + 1})
    assert launcher.is_orphan({2**22 + 1: 1})  # there is no such process


@pytest.mark.mpi
@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.nightly)])
def test_ranks_end_with_their_launcher_also_a_single_one_and_behind_a_shell(
    tmp_path, ranks, wrapped
):
    """The process of the launcher on this node is killed, which reports nothing to its ranks."""
    output = tmp_path / "samples.nc"
    words = [sys.executable, "-m", "hpcclear", *sample(output, 500_000)]
    words += ["--checkpoint-interval", "0.5", "--progress", "quiet"]
    if wrapped:
        words = ["sh", "-c", f"{shlex.join(words)}; true"]
    job = began([str(MPIEXEC), "-n", str(ranks), *words])
    until_it_saves(job, output)
    known = list(ranks_of(job).values())
    children = Path(f"/proc/{job.pid}/task/{job.pid}/children").read_text()
    proxies = [int(number) for number in children.split()]
    assert proxies
    for number in proxies:
        os.kill(number, signal.SIGKILL)
    patience = time.monotonic() + crowded(15.0)
    while any(process_fields(number)[:1] not in ([], ["Z"]) for number in known):
        assert time.monotonic() < patience, "a rank lives on"
        time.sleep(0.1)
    job.communicate(timeout=crowded(30.0))
