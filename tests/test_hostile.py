"""Files, limits and words that no one means well with: a message and a documented exit code, never harm or a hang."""

import contextlib
import os
import random
import resource
import shutil
import signal
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import opened
import pytest
import report_data as data
from click.testing import CliRunner, Result
from commands import CHEAP, MPIEXEC, ROOT, SCENE, finish, limited, overrides, run, sample, start
from patience import crowded

from hpcclear.base.errors import LEAST_ADDRESS_SPACE, LEAST_BESIDE_OTHERS, InputError
from hpcclear.cli import cli
from hpcclear.ranks.stopping import StopSwitch
from hpcclear.report.html import guard
from hpcclear.report.html.page import write_report
from hpcclear.results import files, netcdf
from hpcclear.scene import load_scene
from hpcclear.scene.points import read_points

pytestmark = pytest.mark.timeout(600)


def refused(answer: tuple[int, str]) -> bool:
    """Whether a command ended with exit code 2 and without a traceback."""
    return answer[0] == 2 and "Error: " in answer[1] and "Traceback" not in answer[1]


# -- places -------------------------------------------------------------------------------------


@pytest.fixture(params=[b"three years of work", b"", b"\x89HDF\r\n", b"%PDF-1.7"])
def thesis(tmp_path, request) -> Path:
    path = tmp_path / "thesis.nc"
    path.write_bytes(request.param * 1000)
    return path


@pytest.mark.parametrize("words", [["simulate", str(SCENE)], ["sample", str(SCENE), "--fresh"]])
def test_results_never_replace_what_this_program_did_not_write(thesis, words):
    before = thesis.read_bytes()
    code, output = run([*words, "-o", str(thesis), *overrides(*CHEAP, "study.samples=40")], 0)
    assert thesis.read_bytes() == before
    if "--fresh" in words:
        assert code == 0, output
    else:
        assert refused((code, output)), output
        assert "the existing file was not written by hpcclear" in " ".join(output.split())


def test_times_beside_a_result_do_not_replace_a_users_file(tmp_path):
    (tmp_path / "samples.timing.nc").write_text("mine")
    assert refused(run(sample(tmp_path / "samples.nc", 40), 0))
    assert (tmp_path / "samples.timing.nc").read_text() == "mine"


def test_devices_and_pipes_are_refused(tmp_path):
    pipe, device = tmp_path / "pipe.nc", tmp_path / "full.nc"
    os.mkfifo(pipe)
    places = [pipe, Path("/dev/stdout")]
    if os.geteuid() == 0:
        os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 7))
        places.append(device)
    for place in places:
        with pytest.raises(InputError, match="regular file"):
            files.probe(place, netcdf.SEAL)
        assert refused(run(["simulate", str(SCENE), "-o", str(place)], 0))
    assert stat.S_ISFIFO(pipe.lstat().st_mode)


@pytest.mark.nightly
def test_figures_and_pages_replace_only_figures_and_pages_of_ours(tmp_path):
    def drawn(place: Path) -> Result:
        return CliRunner().invoke(cli, ["check", str(SCENE), "--no-cost", "--sketch", str(place)])

    for ending in ("png", "svg", "pdf"):
        sketch = tmp_path / f"sketch.{ending}"
        assert drawn(sketch).exit_code == 0
        first = sketch.read_bytes()
        assert drawn(sketch).exit_code == 0
        assert sketch.read_bytes() == first
        sketch.write_bytes(b"a photograph")
        assert isinstance(drawn(sketch).exception, InputError)
        assert sketch.read_bytes() == b"a photograph"
    opened.write(data.response(3), tmp_path / "mine.nc")
    write_report(tmp_path)
    write_report(tmp_path)
    (tmp_path / "report.html").write_text("<p>my own words</p>")
    with pytest.raises(InputError):
        write_report(tmp_path)


LONG = "x" * 300
DEEP = "/tmp/" + "x/" * 3000
NO_TEXT = "bad\udcff"


@pytest.mark.parametrize("place", [LONG, DEEP + "x", NO_TEXT], ids=["long", "deep", "no text"])
@pytest.mark.parametrize(
    "words",
    [
        ["init", "{}.toml"],
        ["check", "{}.toml", "--no-cost"],
        ["simulate", str(SCENE), "-o", "{}.nc"],
        ["sample", str(SCENE), "-o", "{}.nc"],
        ["sample", str(SCENE), "-o", "x.nc", "--points", "{}.csv"],
        ["run", str(SCENE), "-o", "{}"],
        ["report", "{}"],
    ],
    ids=lambda words: words[0],
)
def test_paths_that_cannot_be_are_refused(place, words):
    answer = run([word.format(place) for word in words], 0)
    assert refused(answer), answer
    assert len(answer[1]) < 1500


# -- limits of the machine ----------------------------------------------------------------------


@pytest.mark.parametrize("megabytes", [250, 500, 639, 700])
@pytest.mark.shortened(2)
def test_too_little_address_space_ends_in_a_message(tmp_path, megabytes):
    """With 400 or 500 MB Python, out of memory amid an import, once went on for ever."""
    words = sample(tmp_path / "x.nc", 40)
    code, output = limited(resource.RLIMIT_AS, megabytes * 2**20, words)
    assert "Traceback" not in output, output
    assert code == 0 or (code == 1 and "memory" in output), output


@pytest.mark.parametrize("kilobytes", [1, 2, 3])
def test_examples_that_do_not_fit_on_the_disk_leave_nothing_behind(tmp_path, kilobytes):
    words = ["init", str(tmp_path / "jobs"), "--jobs"]
    code, output = limited(resource.RLIMIT_FSIZE, kilobytes * 2**10, words)
    assert (code, list(tmp_path.iterdir())) == (1, []), output


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("ranks", "megabytes"),
    [
        (0, LEAST_ADDRESS_SPACE),
        pytest.param(2, LEAST_BESIDE_OTHERS, marks=pytest.mark.mpi),
        pytest.param(4, LEAST_BESIDE_OTHERS, marks=pytest.mark.mpi),
    ],
)
def test_the_address_space_that_is_said_to_be_enough_is(tmp_path, ranks, megabytes):
    words = sample(tmp_path / "x.nc", 40)
    assert run(words, 0)[0] == 0  # what it compiles is there
    (tmp_path / "x.nc").unlink()
    code, output = limited(resource.RLIMIT_AS, megabytes * 2**20, words, ranks)
    assert code == 0, output


@pytest.mark.parametrize("word", ["inf", "1e300", "1e10"])
def test_a_very_long_time_limit_leaves_signals_heard(word):
    with StopSwitch() as stop:
        stop.limit_time(float(word))
        time.sleep(0.1)  # for the thread to look at it
        os.kill(os.getpid(), signal.SIGTERM)
        patience = time.monotonic() + crowded(5.0)
        while not stop.is_set() and time.monotonic() < patience:
            time.sleep(0.01)
        assert stop.reason == "SIGTERM was received"


def test_too_few_file_handles_end_in_a_message(tmp_path):
    study = data.write_study(tmp_path)
    for words in (["report", str(study)], sample(tmp_path / "x.nc", 40)):
        code, output = limited(resource.RLIMIT_NOFILE, 6, words)
        assert code == 1, output
        assert "ulimit -n" in output, output
        assert "Traceback" not in output


# -- words and rank -----------------------------------------------------------------------------


def together(first: list[object], second: list[object]) -> tuple[int, str]:
    """Exit code and output of a job of two ranks, each with a command of its own."""
    done = subprocess.run(
        [MPIEXEC, "-n", "1", *first, ":", "-n", "1", *second],
        capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}, timeout=200,
    )  # fmt: skip
    return done.returncode, done.stdout + done.stderr


def on_two_ranks(first: list[str], second: list[str], *settings: str) -> tuple[int, str]:
    """A job whose ranks get different words, the second rank an environment of its own."""
    program = [sys.executable, "-m", "hpcclear"]
    environment = [word for setting in settings for word in ("-env", *setting.split("="))]
    return together([*program, *first], [*environment, *program, *second])


@pytest.mark.mpi
@pytest.mark.parametrize("alone", [0, 1])
@pytest.mark.parametrize("bad", [["--bogus"], ["--time-limit", "-3"]], ids=lambda bad: bad[0])
@pytest.mark.shortened(2)
def test_a_rank_that_alone_gets_a_bad_option_does_not_leave_the_others_waiting(
    tmp_path, bad, alone
):
    words = sample(tmp_path / "x.nc", 40)
    both = [words, words]
    both[alone] = [*words, *bad]
    answer = on_two_ranks(*both)
    assert refused(answer), answer
    assert answer[1].count(bad[0]) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.nightly
@pytest.mark.mpi
@pytest.mark.parametrize("megabytes", [200, LEAST_ADDRESS_SPACE])
@pytest.mark.parametrize("alone", [0, 1])
def test_a_rank_that_alone_has_too_little_address_space_does_not_leave_the_others_waiting(
    tmp_path, alone, megabytes
):
    """It ends the job before MPI starts: what MPI takes depends on the machine, and where it is too little MPI exits."""
    words = [sys.executable, "-m", "hpcclear", *sample(tmp_path / "x.nc", 40)]
    both = [words, words]
    both[alone] = ["bash", "-c", f'ulimit -v {megabytes * 1024}; exec "$@"', "bash", *words]
    code, output = together(*both)
    assert code == 1, output
    assert output.count(f"the limit of address space is {megabytes} MB") == 1, output
    assert list(tmp_path.iterdir()) == []


@pytest.mark.mpi
def test_lanes_that_differ_from_rank_to_rank_are_refused(tmp_path):
    words = sample(tmp_path / "x.nc", 40)
    answer = on_two_ranks(words, words, "HPCCLEAR_LANES=8")
    assert refused(answer), answer
    assert "HPCCLEAR_LANES" in answer[1]


@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=pytest.mark.mpi)])
def test_a_time_limit_is_told_even_when_root_hears_nothing(tmp_path, ranks):
    words = [*sample(tmp_path / "x.nc", 40), "--time-limit", "0.5"]
    deaf = {"TEST_FAIL": "sleep hpcclear.ensemble.session:design"}
    code, output = finish(start(words, ranks, **deaf), 60)
    assert code == 3, output
    assert output.count("Stopped early: the time limit was reached") == 1, output


# -- scenes and tables --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["../../x", "<script>", "", "a b", "1st", "x" * 41, "a\nb"])
def test_names_of_cases_are_identifiers(name):
    scene = load_scene(SCENE)
    content = scene.resolved()
    cases = content["study"]["cases"]
    content["study"]["cases"] = {name: next(iter(cases.values()))}
    with pytest.raises(InputError, match="not a name"):
        load_scene(content)


def test_a_table_of_newlines_takes_no_memory(tmp_path):
    table = tmp_path / "points.csv"
    table.write_bytes(b"\n" * 8_000_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match="contains no points"):
        read_points(table, load_scene(SCENE))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 50_000  # kB
    table.write_bytes(b"C\n" + b"," * 1_000_000)
    with pytest.raises(InputError, match="characters"):
        read_points(table, load_scene(SCENE))


# -- forged results -----------------------------------------------------------------------------

DEEPLY = "a = " + "[" * 900 + "]" * 900


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    return data.write_study(tmp_path_factory.mktemp("study"))


def forged(path: Path, name: str, value: object) -> None:
    """Change a variable, or a global attribute, of a file and seal it again."""
    content = netcdf.load(path).to_xarray()
    if name in content.variables:
        values = content[name].to_numpy().copy()
        values.flat[::2] = value
        content[name] = (content[name].dims, values, content[name].attrs)
    else:
        content.attrs[name] = value
    opened.write(content, path)


FORGERIES = (
    ("samples", "objective", 1e308),
    ("samples", "objective", -np.inf),
    ("samples", "objective_spread", -1e300),
    ("samples", "scene", DEEPLY),
    ("samples", "scene", ".".join("x" * 20_000) + " = 1"),
    ("samples", "scene", "[" * 100_000),
    (
        "samples",
        "scene",
        '[effects]\ncontact = { law = "expression", force = "K*d**(9**999999999)" }',
    ),
    ("samples", "C", 1e300),
    ("kriging", "prediction", np.inf),
    ("sensitivity", "uncertainty", np.nan),
    ("front", "mean", 1e308),
    ("verification", "mean_true_lower", np.nan),
    ("verification", "mean_true", -1e308),
    ("claims", "verdict", 99),
    ("timing", "busy", -1e308),
    ("responses/original", "eccentricity_y", -np.inf),
    ("responses/original", "time", 1e300),
    ("responses/robust_alpha", "joint", "x"),
)


@pytest.mark.parametrize(("file", "name", "value"), FORGERIES, ids=lambda part: str(part)[:18])
def test_forged_results_are_refused_or_left_out(study, tmp_path, file, name, value):
    path = tmp_path / f"{file}.nc"
    path.parent.mkdir(exist_ok=True)
    shutil.copy(study / "claims.nc", tmp_path)  # a page there is in any case
    shutil.copy(study / f"{file}.nc", path)
    forged(path, name, value)
    assert "</html>" in write_report(tmp_path).read_text()


def test_what_takes_too_long_is_left_out(monkeypatch):
    monkeypatch.setattr(guard, "LONGEST", 0.2)
    troubles: list[str] = []

    def endless() -> None:
        while True:
            pass

    assert guard.attempt("It", endless, troubles) is None
    assert "takes longer" in troubles[0]
    assert guard.attempt("It", lambda: 3, troubles) == 3


@pytest.mark.full
@pytest.mark.timeout(7200)
def test_five_hundred_forged_files_make_a_page_or_a_refusal(study):
    odd = (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, -1.0, 1e18, -1e-300)
    paths = sorted(study.rglob("*.nc"))
    for number in range(500):
        dice = random.Random(number)
        path = dice.choice(paths)
        honest, content = path.read_bytes(), netcdf.load(path).to_xarray()
        names = [str(n) for n, v in content.variables.items() if v.dtype.kind == "f"]
        try:
            for name in dice.choices([*names, "scene"], k=dice.choice((1, 1, 3))):
                forged(path, name, DEEPLY if name == "scene" else dice.choice(odd))
            with contextlib.suppress(InputError):
                assert "</html>" in write_report(study).read_text()
        finally:
            path.write_bytes(honest)
