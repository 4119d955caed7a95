"""Checkpoints and locks: nothing finished is lost, nothing of others is touched."""

import contextlib
import errno
import fcntl
import json
import multiprocessing
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from patience import crowded

from hpcclear.base.errors import InputError
from hpcclear.base.lock import Holder, Lock
from hpcclear.base.outcome import Status, failed, recast, record_type, unknown
from hpcclear.results.checkpoint import Checkpoint, discard, unfinished

KEY = {"scene.drive.speed": "523.6", "seed": "0", "version": "0.1.0"}


def outcomes(first: int, count: int) -> np.ndarray:
    """Records that depend on the sample number alone, as those of a study do."""
    found = unknown(count)
    found["sample"] = np.arange(first, first + count)
    found["objective"] = np.sqrt(found["sample"] + 1.0)
    found["mean_gap"] = found["objective"][:, None] * [0.5, 0.25]
    for row in range(count):
        if found["sample"][row] % 7 == 3:
            found[row] = failed(int(found["sample"][row]), Status.NOT_FINITE, 5)[0]
    return found


def add(checkpoint: Checkpoint, *arguments: np.ndarray) -> None:
    """What a run does with every batch of samples."""
    checkpoint.add(*arguments)
    checkpoint.flush_when_due()


def parts(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("part-*.nc"))


# -- samples ------------------------------------------------------------------------------------


def test_parts_too_large_to_be_kept_are_read_from_their_files(tmp_path, monkeypatch):
    """The same samples and designs, merged or not, as where everything stays in memory."""
    found = []
    for kept in (50_000, 4):
        monkeypatch.setattr("hpcclear.results.checkpoint._KEPT", kept)
        checkpoint = Checkpoint(tmp_path / str(kept), KEY, units={"m2": "kg", "C": "m"})
        for first in range(0, 55, 5):
            records = outcomes(first, 5)
            checkpoint.add(records, np.stack([records["sample"], 0.5 * records["sample"]], 1))
            checkpoint.flush()
        assert len(parts(tmp_path / str(kept))) == 4  # eight merged, and three
        found.append((*checkpoint.contents(), checkpoint.completed()))
    for one, two in zip(*found, strict=True):
        assert len(one) == 55
        assert one.tobytes() == two.tobytes()


def test_unreadable_parts_and_leftovers_are_reported_and_done_again(tmp_path):
    folder = tmp_path / "c"
    checkpoint = Checkpoint(folder, KEY, interval=0.0)
    add(checkpoint, outcomes(0, 4))
    add(checkpoint, outcomes(4, 4))
    first = folder / parts(folder)[0]
    first.write_bytes(first.read_bytes()[:-1000])
    (folder / ".hpcclear-0123456789abcdef.tmp").write_bytes(b"half")
    (folder / "notes.txt").write_text("mine")
    again = Checkpoint(folder, KEY, interval=0.0)
    assert again.completed().tobytes() == outcomes(4, 4).tobytes()
    assert len(again.problems) == 2
    assert any(first.name in problem for problem in again.problems)
    add(again, outcomes(0, 4))
    assert Checkpoint(folder, KEY).completed().tobytes() == outcomes(0, 8).tobytes()
    assert first.name in parts(folder)  # never over what could not be read
    again.finish()
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]


def test_a_kill_between_merging_and_removing_leaves_nothing_twice(tmp_path, monkeypatch):
    folder = tmp_path / "c"
    checkpoint = Checkpoint(folder, KEY, interval=0.0)
    for sample in range(7):
        add(checkpoint, outcomes(sample, 1))
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", lambda self, missing_ok=False: None)
        add(checkpoint, outcomes(7, 1))
    assert len(parts(folder)) == 9
    again = Checkpoint(folder, KEY, interval=0.0)
    assert again.completed().tobytes() == outcomes(0, 8).tobytes()
    add(again, outcomes(8, 1))
    assert Checkpoint(folder, KEY).completed().tobytes() == outcomes(0, 9).tobytes()


def test_a_kill_while_all_is_removed_leaves_nothing_to_go_on_from(tmp_path, monkeypatch):
    folder, unlink, left = tmp_path / "c", Path.unlink, iter(range(2))

    def removing(path: Path, missing_ok: bool = False) -> None:
        if path.name.startswith(("part", "stage")) and next(left, None) is None:
            raise KeyboardInterrupt
        unlink(path, missing_ok)

    checkpoint = Checkpoint(folder, KEY, interval=0.0)
    assert not unfinished(folder)
    for sample in range(4):
        add(checkpoint, outcomes(sample, 1))
    checkpoint.save_stage("fit", {"x": [1.0]})
    assert unfinished(folder)
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", removing)
        with pytest.raises(KeyboardInterrupt):
            checkpoint.finish()
    assert len(parts(folder)) == 2
    assert not unfinished(folder)
    again = Checkpoint(folder, KEY)
    assert again.completed().size == 0
    assert again.load_stage("fit") is None
    discard(folder)
    assert not folder.exists()


# -- keys, stages, places -----------------------------------------------------------------------


def test_a_link_in_place_of_the_directory_is_refused(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    (tmp_path / "c").symlink_to(outside)
    with pytest.raises(InputError, match="symbolic link"):
        Checkpoint(tmp_path / "c", KEY)
    (tmp_path / "f").write_text("")
    for place in (tmp_path / "f", tmp_path / "no" / "c"):
        with pytest.raises(InputError):
            Checkpoint(place, KEY)
    assert list(outside.iterdir()) == []


# -- lock ---------------------------------------------------------------------------------------


def leave(folder: Path, **changes: object) -> Path:
    """A lock file as a killed run leaves it."""
    holder = {**Holder.this_process()._asdict(), **changes}
    path = folder / ".hpcclear.lock"
    path.write_text(json.dumps(holder))
    return path


def no_flock(*args: object) -> None:
    raise OSError(errno.ENOLCK, "")


@pytest.fixture(params=["flock", "no flock"])
def flock(request, monkeypatch):
    if request.param == "no flock":
        monkeypatch.setattr(fcntl, "flock", no_flock)
    return request.param


@pytest.mark.parametrize(
    "stale",
    [
        {"pid": 2**22 + 1},
        {"started": "1"},
        {"boot": "another"},
        {"host": "elsewhere", "job": "77", "restart": "1"},
    ],
    ids=["process gone", "number reused", "host restarted", "job requeued"],
)
def test_a_stale_lock_is_recognised(tmp_path, flock, stale, monkeypatch):
    monkeypatch.setenv("SLURM_JOB_ID", "77")
    monkeypatch.setenv("SLURM_RESTART_COUNT", "2")
    path = leave(tmp_path, **stale)
    with Lock(tmp_path):
        assert Holder.parse(path.read_bytes()) == Holder.this_process()
    assert list(tmp_path.iterdir()) == []


def test_the_lock_of_a_killed_process_is_stale_even_before_it_is_reaped(tmp_path):
    code = (
        "from pathlib import Path\nfrom hpcclear.base.lock import Lock\nimport time\n"
        f"Lock(Path({str(tmp_path)!r})).acquire()\nprint('held', flush=True)\ntime.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) as process:
        assert process.stdout.readline() == b"held\n"
        with pytest.raises(InputError, match=f"process {process.pid} "):
            Lock(tmp_path).acquire()
        process.kill()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # dead, yet a zombie
        with Lock(tmp_path):
            pass


@pytest.mark.parametrize(
    "holder",
    [
        {},
        {"host": "elsewhere"},
        {"host": "elsewhere", "job": "77", "restart": "2"},
        {"host": "elsewhere", "job": "78"},
        {"host": "elsewhere", "job": "78; rm -rf /"},
    ],
    ids=["alive", "other host", "same job", "other job", "hostile job"],
)
def test_a_lock_that_may_be_alive_is_respected(tmp_path, flock, holder, monkeypatch):
    monkeypatch.setenv("SLURM_JOB_ID", "77")
    monkeypatch.setenv("SLURM_RESTART_COUNT", "2")
    monkeypatch.setenv("PATH", "/nowhere")
    path = leave(tmp_path, **holder)
    before = path.read_bytes()
    with pytest.raises(InputError, match=r"remove .*\.hpcclear\.lock"), Lock(tmp_path):
        pass
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("answer", "over"),
    [
        ("exit 0", True),
        ("echo RUNNING", False),
        ("echo PENDING", False),
        ("echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1", True),
        ("echo 'Unable to contact slurm controller' >&2; exit 1", False),
    ],
)
def test_slurm_is_asked_about_a_job_on_another_host(tmp_path, monkeypatch, answer, over):
    tool = tmp_path / "squeue"
    tool.write_text(f"#!/bin/sh\n{answer}\n")
    tool.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    monkeypatch.delenv("SLURM_JOB_ID", raising=False)
    folder = tmp_path / "results"
    folder.mkdir()
    leave(folder, host="elsewhere", job="4711")
    if over:
        with Lock(folder):
            pass
    else:
        with pytest.raises(InputError, match="Slurm job 4711"):
            Lock(folder).acquire()


@pytest.mark.parametrize(
    "text", ["", "{", "[1]", '{"pid": 3}', "[" * 3000, '{"pid": "x"}', "\ud800"], ids=range(7)
)
def test_a_lock_that_was_being_written_when_its_run_was_killed_is_stale(tmp_path, text):
    (tmp_path / ".hpcclear.lock").write_bytes(text.encode(errors="surrogatepass"))
    with Lock(tmp_path):
        pass


@pytest.mark.parametrize("pid", [0, -1, 2**70, True, "1", None, 1.5])
def test_hostile_process_numbers_do_no_harm(tmp_path, pid):
    leave(tmp_path, pid=pid)
    with contextlib.suppress(InputError):  # process 1 is alive
        Lock(tmp_path).acquire()


def test_without_flock_an_empty_lock_is_respected(tmp_path, monkeypatch):
    monkeypatch.setattr(fcntl, "flock", no_flock)
    (tmp_path / ".hpcclear.lock").write_text("")
    with pytest.raises(InputError, match="another run is taking it"):
        Lock(tmp_path).acquire()


def test_places_where_no_lock_can_be(tmp_path):
    (tmp_path / "elsewhere").write_text("precious")
    (tmp_path / ".hpcclear.lock").symlink_to(tmp_path / "elsewhere")
    for place in (tmp_path, tmp_path / "no", tmp_path / "elsewhere", Path("/proc")):
        with pytest.raises(InputError):
            Lock(place).acquire()
    assert (tmp_path / "elsewhere").read_text() == "precious"


def compete(folder: str, go: object, results: object, without_flock: bool) -> None:
    if without_flock:
        fcntl.flock = no_flock
    lock = Lock(Path(folder))
    go.wait()
    for _ in range(40):
        try:
            with lock:
                inside = Path(folder) / "inside"
                os.close(os.open(inside, os.O_CREAT | os.O_EXCL))  # fails if two are inside
                os.unlink(inside)
            results.put("held")
        except InputError:
            results.put("refused")
        except FileExistsError:
            results.put("broken")


@pytest.mark.parametrize("without_flock", [False, True])
def test_of_several_that_start_at_once_on_a_stale_lock_one_works(tmp_path, without_flock):
    leave(tmp_path, pid=2**22 + 1)
    context = multiprocessing.get_context("forkserver")
    go, results = context.Event(), context.Queue()
    arguments = (str(tmp_path), go, results, without_flock)
    processes = [context.Process(target=compete, args=arguments) for _ in range(4)]
    for process in processes:
        process.start()
    go.set()
    counts = Counter(results.get(timeout=crowded(60)) for _ in range(160))
    for process in processes:
        process.join()
    assert counts["broken"] == 0
    assert counts["held"] > 0
    assert list(tmp_path.iterdir()) == []


def test_records_of_a_variant_that_requests_less_come_back_as_they_were(tmp_path):
    """As effect screening has them: a variant with fewer contacts, a scene with levels and wear."""
    whole = record_type(4, 2, ("level", "wear"))
    made = recast(outcomes(0, 6), record_type(3))
    made["mean_gap"][:, 2] = 5e-4
    assert np.isnan(recast(made, whole)["sliding_work"]).all()
    for _ in range(2):  # from memory, then from the file
        with_levels = Checkpoint(tmp_path / "c", KEY, joints=tuple("abcd"), record=whole)
        if not len(with_levels.completed()):
            add(with_levels, made)
            with_levels.flush()
        kept = with_levels.completed()
        assert kept.dtype == whole
        assert recast(kept, made.dtype).tobytes() == made.tobytes()
