"""What a machine refuses: disks that fill up, memory that runs out, places taken by another run."""

import os
import resource
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import commands
import opened
import pytest

pytestmark = pytest.mark.mpi
TWO_RANKS = pytest.param(2, marks=pytest.mark.nightly)
OPTIONS = ("--checkpoint-interval", "0.2", "--progress", "quiet")


@pytest.fixture(scope="module", autouse=True)
def compiled(tmp_path_factory) -> Path:
    """A small result; the kernel is compiled afterwards."""
    output = tmp_path_factory.mktemp("compiled") / "samples.nc"
    code, text = commands.run(commands.sample(output, 64))
    assert code == 0, text
    return output


# -- the disk -----------------------------------------------------------------------------------


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A file system of 300 kB."""
    place = tmp_path / "disk"
    place.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", place], check=True)
    yield place
    subprocess.run(["umount", "--lazy", place], check=True)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may mount a file system")
@pytest.mark.parametrize("ranks", [0, TWO_RANKS])
def test_a_full_disk_ends_in_a_message_and_keeps_what_is_there(small_disk, compiled, ranks):
    earlier = small_disk / "earlier.nc"
    earlier.write_bytes(compiled.read_bytes())
    words = commands.sample(small_disk / "samples.nc", 20_000, *OPTIONS)
    code, output = commands.run(words, ranks)
    assert code == 1, output
    assert "Traceback" not in output
    assert output.count("No space left on device. Free some space") == 1, output
    assert "results written earlier are intact" in output
    assert earlier.read_bytes() == compiled.read_bytes()
    assert commands.check_readable(small_disk) > 1  # checkpoints up to the last that found room
    assert not list(small_disk.rglob("*.tmp"))
    assert not (small_disk / "samples.nc").exists()
    subprocess.run(["mount", "-o", "remount,size=100m", small_disk], check=True)
    kept = (
        sum(opened.read(p, "samples").sizes["sample"] for p in commands.result_files(small_disk))
        - 64
    )
    code, output = commands.run([*words[:-1], "log"], ranks)
    assert code == 0, output
    assert 0 < kept < 20_000
    assert opened.read(small_disk / "samples.nc", "samples").sizes["sample"] == 20_000


def test_a_limit_on_file_sizes_ends_in_a_message(tmp_path, compiled):
    earlier = tmp_path / "earlier.nc"
    earlier.write_bytes(compiled.read_bytes())
    words = commands.sample(tmp_path / "samples.nc", 4000, *OPTIONS)
    # one process: the limit would refuse MPI its shared memory, which counts as a file
    code, output = commands.limited(resource.RLIMIT_FSIZE, 60_000, words)
    assert code == 1, output
    assert "Traceback" not in output
    assert output.count("ulimit -f") == 1, output
    assert earlier.read_bytes() == compiled.read_bytes()
    commands.check_readable(tmp_path)
    assert commands.run(words, 0)[0] == 0


# -- memory -------------------------------------------------------------------------------------


@pytest.mark.parametrize("ranks", [0, TWO_RANKS])
def test_a_design_that_does_not_fit_into_memory_ends_in_a_message(tmp_path, compiled, ranks):
    earlier = tmp_path / "earlier.nc"
    earlier.write_bytes(compiled.read_bytes())
    words = commands.sample(tmp_path / "samples.nc", 500_000_000, *OPTIONS)
    code, output = commands.limited(resource.RLIMIT_AS, 4_000_000_000, words, ranks)
    assert code == 1, output
    assert output.count("out of memory") == 1, output
    assert "Traceback" not in output
    assert earlier.read_bytes() == compiled.read_bytes()


@pytest.mark.parametrize("rank", [0, 1])
@pytest.mark.shortened(1)
def test_memory_that_runs_out_during_the_run_ends_in_a_message(tmp_path, rank):
    words = commands.sample(tmp_path / "samples.nc", 4000, *OPTIONS)
    failing = {"TEST_FAIL": "simulation", "TEST_ERROR": "MemoryError", "TEST_RANK": str(rank)}
    code, output = commands.run(words, **failing)
    assert code == 1, output
    assert output.count("out of memory") == 1, output
    assert f"rank {rank} of 2" in output
    assert "Traceback" not in output
    commands.check_readable(tmp_path)
    assert commands.run(words)[0] == 0


# -- two runs in one place ----------------------------------------------------------------------


def test_a_second_run_on_one_output_is_refused(tmp_path):
    words = commands.sample(tmp_path / "samples.nc", 100_000, *OPTIONS)
    job = commands.start(words)
    commands.wait_for_parts(job, tmp_path)
    code, output = commands.run(words, 0)
    assert code == 2, output
    assert "holds it" in output
    assert f"process {commands.ranks_of(job)[0]}" in output
    assert "Wait for that run or stop it" in output
    assert job.poll() is None
    commands.kill(job.pid, signal.SIGTERM)
    assert commands.finish(job)[0] == 3


def test_unfinished_work_of_another_scene_is_refused_and_left_alone(tmp_path):
    output = tmp_path / "samples.nc"
    job = commands.start(commands.sample(output, 100_000, *OPTIONS))
    commands.wait_for_parts(job, tmp_path)
    commands.kill(job.pid, signal.SIGTERM)
    assert commands.finish(job)[0] == 3
    before = {path: path.read_bytes() for path in commands.result_files(tmp_path)}
    code, text = commands.run(commands.sample(output, 100), 0)
    assert code == 2, text
    assert "study.samples: 100000 there, 100 now" in text
    assert {path: path.read_bytes() for path in commands.result_files(tmp_path)} == before
    assert commands.run([*commands.sample(output, 100), "--fresh"], 0)[0] == 0
    assert {path: path.read_bytes() for path in before} == before
    assert (tmp_path / "samples-2.nc").exists()
