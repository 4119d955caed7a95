"""A design in parts, as a job array makes them, merged: the bytes of one run."""

import contextlib
import time
from pathlib import Path

import opened
import pytest
from commands import CHEAP, SCENE, kill, overrides, run, sample, start
from patience import crowded

from hpcclear.base.errors import InputError
from hpcclear.ensemble.session import Options, design, run_merge, run_sample
from hpcclear.ensemble.split import Part
from hpcclear.ranks.boundary import alone
from hpcclear.scene import load_scene

pytestmark = pytest.mark.timeout(900)
SAMPLES = 430  # not a multiple of the number of parts
QUIET = Options(style="quiet")


@pytest.fixture(scope="module")
def scene():
    return load_scene(SCENE, [*CHEAP, f"study.samples={SAMPLES}"])


def make(scene, output: Path, *parts: Part, **options) -> None:
    for part in parts:
        run_sample(scene, output, alone(), part=part, options=QUIET, **options)


def merged(scene, output: Path) -> bytes:
    run_merge(scene, design(scene, None), output, alone())
    return output.read_bytes()


@pytest.fixture(scope="module")
def whole(scene, tmp_path_factory) -> bytes:
    output = tmp_path_factory.mktemp("whole") / "samples.nc"
    run_sample(scene, output, alone(), options=QUIET)
    return output.read_bytes()


@pytest.mark.nightly  # parts of any kind below
def test_twenty_parts_of_which_three_were_killed_are_the_bytes_of_one_run(tmp_path, scene, whole):
    output = tmp_path / "samples.nc"
    killed = [Part(number, 20) for number in (3, 7, 20)]
    # it hangs when it has saved samples and is about to write the result
    hang = {"TEST_FAIL": "sleep hpcclear.results.dataset:write 2"}
    for part in killed:
        words = sample(output, SAMPLES, "--part", str(part), "--checkpoint-interval", "0")
        job = start(words, 0, **hang)
        saved = part.place(output).with_name(f".{part.place(output).name}.parts")
        patience = time.monotonic() + crowded(120.0)
        while not list(saved.glob("part-*.nc")):
            assert job.poll() is None, job.communicate()[0]
            assert time.monotonic() < patience
            time.sleep(0.05)
        kill(job.pid)
        job.communicate()
        assert not part.place(output).exists()
    make(scene, output, *(part for k in range(20) if (part := Part(k + 1, 20)) not in killed))
    with pytest.raises(InputError, match=r"3/20, 7/20, 20/20.*3 are missing"):
        merged(scene, output)
    for part in killed:
        code, text = run(sample(output, SAMPLES, "--part", str(part)), 0)
        assert code == 0, text
    words = [
        "sample",
        "--merge",
        str(SCENE),
        *overrides(*CHEAP, f"study.samples={SAMPLES}"),
        "-o",
        str(output),
    ]
    code, text = run(words, 0)
    assert code == 0, text
    assert output.read_bytes() == whole
    assert run(words, 0)[0] == 0  # it is there already
    assert not list(tmp_path.glob(".*.parts"))


@pytest.mark.mpi
def test_a_part_on_two_ranks_is_that_of_one(tmp_path, scene, whole):
    output = tmp_path / "samples.nc"
    assert run(sample(output, SAMPLES, "--part", "1/2"), 2)[0] == 0
    make(scene, output, Part(2, 2))
    assert merged(scene, output) == whole


@pytest.mark.parametrize(
    "settings",
    [
        ["study.method=monte-carlo", "study.samples=37"],
        ["study.samples=21", "numerics.target_error=0.05", "numerics.max_steps=200000"],
    ],
    ids=["monte-carlo", "target error"],
)
def test_parts_of_any_kind_of_sampling_are_the_bytes_of_one_run(tmp_path, settings):
    scene = load_scene(SCENE, [*CHEAP, *settings])
    one, parts = tmp_path / "one.nc", tmp_path / "parts.nc"
    run_sample(scene, one, alone(), options=QUIET)
    make(scene, parts, *(Part(k, 3) for k in (2, 3, 1)))
    assert merged(scene, parts) == one.read_bytes()


@pytest.mark.parametrize("words", ["0/3", "4/3", "3", "a/b", "1/0", "-1/3", "1/3/5", "1/9999999"])
def test_what_is_no_part_is_refused(words):
    with pytest.raises(InputError):
        Part.parse(words)


def test_more_parts_than_samples_are_refused():
    with pytest.raises(InputError):
        Part(1, 20).rows(19)


def test_parts_of_another_run_or_division_and_damaged_ones_are_refused(tmp_path, scene):
    small = scene.with_({"study.samples": 12})
    output = tmp_path / "samples.nc"
    with pytest.raises(InputError, match="no part of it"):
        merged(small, output)
    make(small, output, Part(1, 2), Part(2, 2))
    other = scene.with_({"study.samples": 12, "study.seed": 99})
    with pytest.raises(InputError, match=r"another run.*study\.seed"):
        merged(other, output)
    second = Part(2, 2).place(output)
    honest = second.read_bytes()
    second.write_bytes(Part(1, 2).place(output).read_bytes())  # under another's name
    with pytest.raises(InputError, match="part"):
        merged(small, output)
    second.write_bytes(honest[:-100])
    with pytest.raises(InputError, match="cut off"):
        merged(small, output)
    second.write_bytes(honest)
    third = Part(1, 3).place(output)
    third.write_bytes(honest)
    with pytest.raises(InputError, match="different divisions"):
        merged(small, output)
    third.unlink()
    content = opened.read(second)
    assert len(content["sample"]) == 6
    merged(small, output)
    with contextlib.suppress(FileNotFoundError):
        output.unlink()


@pytest.mark.parametrize("words", [["--statistics"], ["--fresh"]])
def test_a_part_goes_with_samples_under_one_name(tmp_path, words):
    code, text = run(sample(tmp_path / "x.nc", 40, "--part", "1/2", *words), 0)
    assert code == 2, text
    assert "--part" in text
