"""Checkpoints and locks: nothing finished is lost, nothing of others is touched."""

import contextlib
import errno
import fcntl
import json
import multiprocessing
import os
import random
import subprocess
import sys
import time
from collections import Counter
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from pathlib import Path

import numpy as np
import opened
import pytest
import xarray as xr
from patience import crowded

from hpcclear.base.errors import InputError, StorageError
from hpcclear.base.outcome import (
    IMPACTS,
    LEVELS,
    MAPPED,
    ON_REQUEST,
    RESPONSES,
    STEADY,
    Status,
    failed,
    recast,
    record_type,
    unknown,
)
from hpcclear.results import dataset, files, netcdf
from hpcclear.results.checkpoint import Checkpoint, discard, unfinished
from hpcclear.results.keys import check_key, key_attribute
from hpcclear.results.lock import Holder, Lock
from hpcclear.results.places import fresh_sibling
from hpcclear.results.provenance import provenance
from hpcclear.scene import load_scene
from hpcclear.scene.record import record_of

JOBS = Path(__file__).parents[1] / "jobs"
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


class Clock:
    """A clock that a test turns."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


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
        checkpoint = Checkpoint(tmp_path / str(kept), KEY, names=("m2", "C"))
        for first in range(0, 55, 5):
            records = outcomes(first, 5)
            checkpoint.add(records, np.stack([records["sample"], 0.5 * records["sample"]], 1))
            checkpoint.flush()
        assert len(parts(tmp_path / str(kept))) == 4  # eight merged, and three
        found.append((*checkpoint.contents(), checkpoint.completed()))
    for one, two in zip(*found, strict=True):
        assert len(one) == 55
        assert one.tobytes() == two.tobytes()


def test_a_stretch_of_samples_is_found_without_reading_parts_that_hold_none_of_it(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("hpcclear.results.checkpoint._KEPT", 4)
    checkpoint = Checkpoint(tmp_path / "c", KEY)
    for first in (0, 5, 10):
        checkpoint.add(outcomes(first, 5))
        checkpoint.flush()
    checkpoint.add(outcomes(15, 5))  # not on disk yet
    read, looked = dataset.read, []
    monkeypatch.setattr(
        dataset, "read", lambda path, *kind: looked.append(path) or read(path, *kind)
    )
    assert checkpoint.completed(8, 4).tobytes() == outcomes(8, 4).tobytes()
    assert len(looked) == 2
    assert checkpoint.completed(13, 4).tobytes() == outcomes(13, 4).tobytes()
    assert checkpoint.completed(20, 9).size == 0
    assert len(looked) == 3


def test_samples_reach_disk_when_the_interval_is_over_and_not_before(tmp_path):
    clock = Clock()
    checkpoint = Checkpoint(tmp_path / "c", KEY, interval=5.0, clock=clock)
    add(checkpoint, outcomes(0, 3))
    clock.now += 4.9
    add(checkpoint, outcomes(3, 3))
    assert parts(tmp_path / "c") == []
    clock.now += 0.2
    add(checkpoint, outcomes(6, 1))
    assert len(parts(tmp_path / "c")) == 1
    add(checkpoint, outcomes(7, 1))
    clock.now += 4.0
    add(checkpoint, outcomes(8, 1))
    assert len(parts(tmp_path / "c")) == 1
    checkpoint.flush()
    assert len(parts(tmp_path / "c")) == 2
    again = Checkpoint(tmp_path / "c", KEY)
    assert again.completed().tobytes() == outcomes(0, 9).tobytes()
    assert again.problems == []


def test_any_order_of_samples_gives_the_same_records(tmp_path):
    checkpoint = Checkpoint(tmp_path / "c", KEY, interval=0.0)
    order = np.random.default_rng(0).permutation(50)
    for start in range(0, 50, 6):
        add(checkpoint, outcomes(0, 50)[order[start : start + 6]])
    assert checkpoint.completed().tobytes() == outcomes(0, 50).tobytes()
    assert Checkpoint(tmp_path / "c", KEY).completed().tobytes() == outcomes(0, 50).tobytes()


def test_the_number_of_files_grows_with_the_logarithm_only(tmp_path):
    checkpoint = Checkpoint(tmp_path / "c", KEY, interval=0.0)
    most = 0
    for sample in range(80):
        add(checkpoint, outcomes(sample, 1))
        most = max(most, len(parts(tmp_path / "c")))
    assert most <= 7 * 3 + 1  # 80 < 8**3
    assert Checkpoint(tmp_path / "c", KEY).completed().tobytes() == outcomes(0, 80).tobytes()


def test_parts_are_datasets_of_their_own(tmp_path):
    checkpoint = Checkpoint(
        tmp_path / "c",
        KEY,
        names=("m2", "mechanism.rod.length"),
        units={"mechanism.rod.length": "m"},
        attributes=provenance("[mechanism]", "ab" * 32),
    )
    values = np.arange(8.0).reshape(4, 2)
    add(checkpoint, outcomes(0, 4), values)
    checkpoint.flush()
    (part,) = parts(tmp_path / "c")
    with xr.open_dataset(tmp_path / "c" / part, engine="h5netcdf") as found:
        np.testing.assert_array_equal(found["m2"], values[:, 0])
        assert found["mechanism_rod_length"].attrs["units"] == "m"
        np.testing.assert_array_equal(found["objective"], outcomes(0, 4)["objective"])
    with pytest.raises(ValueError, match="shape"):
        add(checkpoint, outcomes(4, 1))
    again = Checkpoint(tmp_path / "c", KEY, names=("mechanism.rod.length", "m2"))
    assert again.completed().tobytes() == outcomes(0, 4).tobytes()


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


def test_finish_removes_what_was_written_here(tmp_path):
    checkpoint = Checkpoint(tmp_path / "c", KEY, interval=0.0)
    add(checkpoint, outcomes(0, 3))
    checkpoint.save_stage("fit", {"x": [1.0]})
    checkpoint.finish()
    assert not (tmp_path / "c").exists()


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


def test_time_in_calls_is_measured(tmp_path):
    clock = Clock()
    checkpoint = Checkpoint(tmp_path / "c", KEY, interval=5.0, clock=clock)
    opened = checkpoint.seconds
    assert opened > 0
    add(checkpoint, outcomes(0, 3))
    assert checkpoint.seconds == opened
    checkpoint.flush()
    assert checkpoint.seconds > opened


def test_a_full_disk_keeps_samples_in_memory_and_the_last_parts_on_disk(tmp_path, monkeypatch):
    checkpoint = Checkpoint(tmp_path / "c", KEY, interval=0.0)
    add(checkpoint, outcomes(0, 3))

    def full(*args: object) -> int:
        raise OSError(errno.ENOSPC, "")

    with monkeypatch.context() as patch:
        patch.setattr(os, "write", full)
        with pytest.raises(StorageError, match="No space left"):
            add(checkpoint, outcomes(3, 3))
    assert Checkpoint(tmp_path / "c", KEY).completed().tobytes() == outcomes(0, 3).tobytes()
    checkpoint.flush()
    assert Checkpoint(tmp_path / "c", KEY).completed().tobytes() == outcomes(0, 6).tobytes()


def test_what_killed_runs_were_writing_is_removed_and_who_writes_tries_again(tmp_path, monkeypatch):
    leftover, kept = ".hpcclear-0123456789abcdef.tmp", (".hpcclear-notes.tmp", "part.tmp")
    for name in (leftover, *kept):
        (tmp_path / name).touch()
    rename, removed = os.replace, []

    def rename_after_a_clean_up(source: str, target: str, **options: int) -> None:
        if not removed:
            removed.append(source)
            files.remove_leftovers(tmp_path)
        rename(source, target, **options)

    monkeypatch.setattr(os, "replace", rename_after_a_clean_up)
    files.write_bytes(tmp_path / "x", b"content")
    assert len(removed) == 1
    assert (tmp_path / "x").read_bytes() == b"content"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*kept, "x"])


# -- keys, stages, places -----------------------------------------------------------------------


def test_another_run_is_refused_with_the_differing_keys(tmp_path):
    checkpoint = Checkpoint(tmp_path / "c", KEY)
    add(checkpoint, outcomes(0, 3))
    checkpoint.flush()
    before = {path: path.read_bytes() for path in (tmp_path / "c").iterdir()}
    other = {**KEY, "seed": "1", "scene.effects.gravity": "9.81"}
    with pytest.raises(InputError) as caught:
        Checkpoint(tmp_path / "c", other)
    message = str(caught.value)
    assert "seed: 0 there, 1 now" in message
    assert "scene.effects.gravity: nothing there, 9.81 now" in message
    assert "speed" not in message
    assert "--fresh" in message
    assert {path: path.read_bytes() for path in (tmp_path / "c").iterdir()} == before


def test_final_files_carry_the_key_too(tmp_path):
    final = dataset.samples_dataset([], np.empty((3, 0)), {}, outcomes(0, 3), key_attribute(KEY))
    opened.write(final, tmp_path / "x.nc")
    found = opened.read(tmp_path / "x.nc")
    check_key(found, dict(reversed(KEY.items())), tmp_path / "x.nc")
    with pytest.raises(InputError, match="version"):
        check_key(found, {**KEY, "version": "0.2.0"}, tmp_path / "x.nc")
    for forged in ("[1]", "{", "[" * 100_000):
        with pytest.raises(InputError, match="seed: nothing there"):
            check_key(found.assign_attrs(run_key=forged), KEY, tmp_path / "x.nc")


def test_stages_come_back_bit_for_bit(tmp_path):
    data = {
        "weights": np.random.default_rng(0).random((3, 4, 2)),
        "special": np.array([np.nan, -0.0, np.inf]),
        "count": np.int64(2**62),
        "seeds": np.array([2**63, 5], np.uint64),
        "accepted": np.array([True, False]),
        "names": np.array(["m2", "mässe"]),
        "state": '{"bit_generator": "PCG64"}',
        "nothing": np.empty((0, 2)),
    }
    checkpoint = Checkpoint(tmp_path / "c", KEY)
    assert checkpoint.load_stage("fit-1") is None
    checkpoint.save_stage("fit-1", data)
    found = Checkpoint(tmp_path / "c", KEY).load_stage("fit-1")
    assert found is not None
    assert set(found) == set(data)
    for name, values in data.items():
        expected = np.asarray(values)
        assert found[name].dtype == expected.dtype, name
        assert found[name].shape == expected.shape, name
        assert found[name].tobytes() == expected.tobytes(), name
    with pytest.raises(InputError, match="another run"):
        Checkpoint(tmp_path / "c", {**KEY, "seed": "5"}).load_stage("fit-1")
    (tmp_path / "c" / "stage-fit-1.nc").write_bytes(b"\x89HDF")
    assert checkpoint.load_stage("fit-1") is None
    assert "stage-fit-1.nc" in checkpoint.problems[0]


@pytest.mark.parametrize("name", ["", "../x", "a/b", "a.b", "a\0b"])
def test_stage_names_lead_nowhere_else(tmp_path, name):
    checkpoint = Checkpoint(tmp_path / "c", KEY)
    with pytest.raises(ValueError, match="no name"):
        checkpoint.save_stage(name, {})


def test_objects_are_no_stage_results(tmp_path):
    with pytest.raises(ValueError, match="cannot hold"):
        Checkpoint(tmp_path / "c", KEY).save_stage("fit", {"x": np.array([{}])})


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


def test_fresh_results_lie_beside_the_old_ones(tmp_path):
    (tmp_path / "study").mkdir()
    assert fresh_sibling(tmp_path / "study") == tmp_path / "study-2"
    assert fresh_sibling(tmp_path / "study") == tmp_path / "study-3"
    assert (tmp_path / "study-3").is_dir()
    (tmp_path / "run.v1").mkdir()
    assert fresh_sibling(tmp_path / "run.v1") == tmp_path / "run.v1-2"
    (tmp_path / "x.nc").write_text("")
    (tmp_path / "x-2.nc").symlink_to("nowhere")
    assert fresh_sibling(tmp_path / "x.nc") == tmp_path / "x-3.nc"
    with pytest.raises(InputError):
        fresh_sibling(tmp_path / "x.nc" / "y")


# -- kills --------------------------------------------------------------------------------------


def work(folder: str, safe: Connection) -> None:
    """Simulate for ever, four samples a round; say after each round how many are safe."""
    root = Path(folder)
    checkpoint = Checkpoint(root / "c", KEY, interval=0.0, names=("m2",))
    done = len(checkpoint.completed())
    while True:
        safe.send_bytes(b"%d" % done)
        add(checkpoint, outcomes(done, 4), np.ones((4, 1)))
        done += 4
        final = checkpoint.completed()
        content = dataset.samples_dataset(["m2"], np.ones((len(final), 1)), {}, final)
        opened.write(content, root / "final.nc")
        checkpoint.save_stage("fit", {"x": np.full(1000, done)})


def kill_once(folder: Path, rounds: int, delay: float, context: BaseContext) -> int:
    """Kill a writer `delay` seconds into a round; how many samples it had called safe."""
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(str(folder), sender))
    process.start()
    sender.close()
    safe = [receiver.recv_bytes() for _ in range(rounds)]
    time.sleep(delay)
    process.kill()
    process.join()
    with contextlib.suppress(EOFError, OSError):  # the last message may be cut off
        while True:
            safe.append(receiver.recv_bytes())
    return int(safe[-1])


@pytest.mark.parametrize(
    "kills",
    [
        pytest.param(10, id="10", marks=pytest.mark.nightly),
        pytest.param(250, id="250", marks=pytest.mark.full),
    ],
)
def test_kills_at_random_moments_lose_nothing_that_was_safe(tmp_path, kills):
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["hpcclear.results.checkpoint", "pint"])
    moments = random.Random(kills)
    for _ in range(kills):
        safe = kill_once(tmp_path, moments.randint(1, 3), moments.uniform(0.0, 0.06), context)
        for path in tmp_path.rglob("*.nc"):
            netcdf.load(path)
            with xr.open_dataset(path, engine="h5netcdf") as opened:
                opened.load()
        checkpoint = Checkpoint(tmp_path / "c", KEY, names=("m2",))
        found = checkpoint.completed()
        assert len(found) >= safe
        assert found.tobytes() == outcomes(0, len(found)).tobytes()
        assert len(parts(tmp_path / "c")) <= 40
    assert len(found) >= 4 * kills / 2


# -- lock ---------------------------------------------------------------------------------------


def leave(folder: Path, **changes: object) -> Path:
    """A lock file as a killed run leaves it."""
    holder = {**Holder.this_process().__dict__, **changes}
    path = folder / ".hpcclear.lock"
    path.write_text(json.dumps(holder))
    return path


def test_a_second_run_is_refused_and_told_who_holds_the_lock(tmp_path):
    with Lock(tmp_path):
        with pytest.raises(InputError, match=f"process {os.getpid()} on "), Lock(tmp_path):
            pass
        code = "from pathlib import Path\nfrom hpcclear.results.lock import Lock\n"
        code += f"Lock(Path({str(tmp_path)!r})).acquire()"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        assert done.returncode == 1
        assert f"process {os.getpid()} on " in done.stderr
        with Lock(tmp_path, ".other.lock"):
            pass
    assert list(tmp_path.iterdir()) == []
    with Lock(tmp_path):
        pass


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
        "from pathlib import Path\nfrom hpcclear.results.lock import Lock\nimport time\n"
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


def test_a_record_has_what_the_scene_requests():
    plain = load_scene(JOBS / "robust_slider_crank.toml")
    assert not {*ON_REQUEST, *STEADY, *MAPPED} & {*record_of(plain).names}
    for changes, fields in (
        ({"numerics.levels": [1000.0]}, {*RESPONSES, *IMPACTS, *LEVELS}),
        ({"numerics.energy": True}, {"energy_error"}),
        ({"numerics.target_error": 0.01}, {*STEADY}),
    ):
        found = {*record_of(plain.with_(changes)).names}
        assert found - {*record_of(plain).names} == fields
    assert record_of(plain.with_({"numerics.levels": [1000.0]}))["contact_force_level"].shape == (
        2,
        1,
    )
    corners = record_of(load_scene(JOBS / "loose_slider.toml"))
    assert corners["mean_gap"].shape == (4,)
