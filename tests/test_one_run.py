"""One lock and one key for all that a command writes: no directory holds results of two runs, and nobody's are lost."""

import contextlib
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import formula
import opened
import pytest
import report_data as data
from click.testing import CliRunner
from commands import contents
from formula_study import whole as study_scene
from patience import crowded
from streaming_run import make_made_up

from hpcclear.accuracy.profile import QUICK
from hpcclear.accuracy.run import run_accuracy
from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.ensemble.effects import run_effects
from hpcclear.ensemble.maps import run_map
from hpcclear.ensemble.session import Options, run_sample
from hpcclear.ensemble.statistics import run_statistics
from hpcclear.ensemble.trial import Wanted
from hpcclear.ensemble.wear import run_wear
from hpcclear.ranks.boundary import alone
from hpcclear.ranks.stopping import Stopped
from hpcclear.results import netcdf
from hpcclear.results.keys import KEY
from hpcclear.scene import Scene, load_scene
from hpcclear.study import run_study

ROOT = Path(__file__).parent.parent
JOBS = ROOT / "jobs"


QUIET = Options(style="quiet")
FRESH = Options(fresh=True, style="quiet")
SAMPLES = 5000  # two blocks


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr("hpcclear.ensemble.statistics.make_evaluator", make_made_up)


def random_scene(*overrides: str) -> Scene:
    job = JOBS / "quickstart.toml"
    return load_scene(job, ['study.method="monte-carlo"', f"study.samples={SAMPLES}", *overrides])


def scene(name: str, *overrides: str) -> Scene:
    return load_scene(JOBS / name, overrides)


def sample(place: Path, *overrides: str, options: Options = QUIET) -> None:
    run_sample(study_scene(*overrides), place / "out.nc", alone(), options=options)


def statistics(place: Path, *overrides: str, options: Options = QUIET) -> None:
    run_statistics(random_scene(*overrides), place / "out.nc", alone(), options=options)


def raw(place: Path, *overrides: str, options: Options = QUIET) -> None:
    """Samples in `place`, their statistics beside it, of every seed in a file of its own."""
    output = place.parent / f"sums{len(list(place.parent.glob('sums*.nc')))}.nc"
    run_statistics(random_scene(*overrides), output, alone(), raw=place, options=options)


def run(place: Path, *overrides: str, options: Options = QUIET) -> None:
    run_study(study_scene(*overrides), place, alone(), fresh=options.fresh, progress_style="quiet")


def make_map(place: Path) -> None:
    run_map(scene("hunt_crossley.toml"), ("C=0.1mm:1mm:2",), place / "out.nc", alone(), QUIET)


def wear(place: Path) -> None:
    run_wear(scene("wear.toml"), place / "out.nc", alone(), QUIET)


def effects(place: Path) -> None:
    wanted = Wanted(0.01, 64, 100.0, False)
    run_effects(scene("quickstart.toml"), place / "out.nc", alone(), QUIET, wanted)


def accuracy(place: Path) -> None:
    run_accuracy(scene("slider_crank.toml"), place, alone(), QUICK, str, QUIET)


def simulate(place: Path) -> None:
    words = ["simulate", str(JOBS / "slider_crank.toml"), "-o", str(place / "out.nc")]
    done = CliRunner().invoke(cli, words)
    if done.exception is not None:
        raise done.exception


FILES: dict[Callable[..., None], str] = {
    sample: "out.nc", statistics: "out.nc", raw: "samples-00000001.nc", make_map: "out.nc", wear: "out.nc",
    effects: "out.nc", simulate: "out.nc", run: "samples.nc", accuracy: "accuracy.nc",
}  # fmt: skip
"""Each command that writes, and a file that it writes."""


def planted(path: Path, **attributes: str) -> Path:
    """Samples of another run."""
    content = data.samples(6, 0)
    content.attrs |= {KEY: json.dumps({"command": "sample", "study.seed": "99"}), **attributes}
    opened.write(content, path)
    return path


@contextlib.contextmanager
def locked(folder: Path, name: str) -> Iterator[None]:
    """Another process holds a lock."""
    code = "import sys, pathlib\nfrom hpcclear.base.lock import Lock\n"
    code += (
        "Lock(pathlib.Path(sys.argv[1]), sys.argv[2]).acquire()\nprint('held', flush=True)\ninput()"
    )
    words = [sys.executable, "-c", code, str(folder), name]
    job = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT)
    assert job.stdin is not None
    assert job.stdout is not None
    try:
        assert job.stdout.readline() == b"held\n"
        yield
    finally:
        job.stdin.close()
        job.wait(crowded(60.0))
        job.stdout.close()


@pytest.fixture(scope="module")
def busy(tmp_path_factory):
    """A directory in which another process holds every lock there is."""
    folder = tmp_path_factory.mktemp("busy") / "place"
    folder.mkdir()
    with contextlib.ExitStack() as stack:
        stack.enter_context(locked(folder, ".hpcclear.lock"))
        stack.enter_context(locked(folder, ".out.nc.lock"))
        yield folder


@pytest.mark.parametrize(("kept", "said"), [(None, None), (-2000, "cut off")], ids=["whole", "cut"])
@pytest.mark.parametrize("command", FILES, ids=lambda command: command.__name__)
def test_what_another_run_left_is_refused_and_stays(tmp_path, command, kept, said):
    place = tmp_path / "place"
    place.mkdir()
    path = planted(place / FILES[command])
    before = path.read_bytes()[:kept]
    path.write_bytes(before)
    with pytest.raises(InputError, match=said):
        command(place)
    assert contents(place) == {path.name: before}


@pytest.mark.parametrize("command", FILES, ids=lambda command: command.__name__)
def test_a_place_at_which_another_process_works_is_refused(busy, command):
    with pytest.raises(InputError, match="holds it"):
        command(busy)
    assert not contents(busy)


@pytest.mark.parametrize("command", [sample, raw, statistics, run], ids=lambda c: c.__name__)
@pytest.mark.shortened(2)  # an edited study is in test_own_models
def test_the_same_command_finds_its_results_and_another_seed_does_not(
    tmp_path, command, monkeypatch
):
    place = tmp_path / "place"
    place.mkdir()
    command(place)
    before = contents(place)
    for changed in ("study.seed=17", "drive.speed=500"):
        with pytest.raises(InputError, match=changed.partition("=")[0]):
            command(place, changed)
        assert contents(place) == before
    command(place)
    assert contents(place) == before
    command(place, "study.seed=17", options=FRESH)  # beside it
    assert {name: text for name, text in contents(place).items() if name in before} == before


# -- samples that are kept beside their statistics --------------------------------------------------


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Finished statistics, and the directory of their samples."""
    place = tmp_path_factory.mktemp("kept")
    patch = pytest.MonkeyPatch()
    patch.setattr("hpcclear.ensemble.statistics.make_evaluator", make_made_up)
    folder = place / "raw"
    run_statistics(random_scene(), place / "sums.nc", alone(), raw=folder, options=QUIET)
    patch.undo()
    return place


@pytest.fixture
def kept(tmp_path, finished):
    """A copy of them, to be damaged."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    return tmp_path / "sums.nc", tmp_path / "raw"


@pytest.mark.parametrize("name", ["samples-00000000.nc", "samples-00000001.nc"])
@pytest.mark.parametrize("fault", ["cut", "gone", "another's"])
def test_statistics_that_are_finished_notice_what_became_of_their_samples(kept, name, fault):
    output, folder = kept
    path = folder / name
    before = path.read_bytes()
    if fault == "cut":
        path.write_bytes(before[:-1000])
    elif fault == "gone":
        path.unlink()
    else:
        path.unlink()
        planted(path)
    found = contents(folder)
    with pytest.raises(InputError):
        run_statistics(random_scene(), output, alone(), raw=folder, options=QUIET)
    assert contents(folder) == found


def test_fresh_statistics_keep_their_samples_in_a_directory_of_their_own(kept):
    output, folder = kept
    before = contents(folder)
    done = run_statistics(random_scene(), output, alone(), raw=folder, options=FRESH)
    assert done.output != output
    assert contents(folder) == contents(folder.with_name("raw-2")) == before


def test_finished_statistics_do_not_take_samples_of_another_seed_for_theirs(tmp_path):
    outputs = {seed: tmp_path / f"{seed}.nc" for seed in (1, 2)}
    folders = {seed: tmp_path / f"raw{seed}" for seed in (1, 2)}
    for seed, output in outputs.items():
        run_statistics(
            random_scene(f"study.seed={seed}"), output, alone(), raw=folders[seed], options=QUIET
        )
    before = contents(tmp_path)
    with pytest.raises(InputError, match=r"study\.seed: 2 there, 1 now"):
        run_statistics(random_scene("study.seed=1"), outputs[1], alone(), raw=folders[2])
    assert contents(tmp_path) == before


@pytest.mark.parametrize("change", ["nothing", "a file is gone", "another directory"])
def test_a_stopped_run_ends_with_all_its_samples(tmp_path, kept, monkeypatch, change):
    whole = contents(kept[1])
    output, folder = tmp_path / "stopped.nc", tmp_path / "kept"
    from hpcclear.ensemble.statistics import _Streaming

    finish = _Streaming._simulate

    def stop(self: _Streaming, *samples: object) -> None:
        finish(self, *samples)
        raise Stopped("now")

    with monkeypatch.context() as patch:
        patch.setattr(_Streaming, "_simulate", stop)
        with pytest.raises(Stopped):
            run_statistics(random_scene(), output, alone(), raw=folder, options=QUIET)
    assert not output.exists()
    if change == "a file is gone":
        (folder / "samples-00000000.nc").unlink()
    folder = tmp_path / "elsewhere" if change == "another directory" else folder
    run_statistics(random_scene(), output, alone(), raw=folder, options=QUIET)
    assert contents(folder) == whole
    assert netcdf.load(output).to_xarray().identical(netcdf.load(kept[0]).to_xarray())


# -- files in the directory of a run ----------------------------------------------------------------


@pytest.fixture(scope="module")
def studied(carried_out):
    """A directory with a finished study."""
    return carried_out(study_scene())


@pytest.mark.parametrize(
    "command", [sample, statistics, make_map, wear, effects], ids=lambda c: c.__name__
)
def test_no_file_of_another_run_goes_into_a_study(tmp_path, studied, command):
    before = {path: path.read_bytes() for path in studied.rglob("*") if path.is_file()}
    with pytest.raises(InputError, match="that directory holds results of another run"):
        command(studied)
    with locked(tmp_path, ".hpcclear.lock"), pytest.raises(InputError, match="holds it"):
        command(tmp_path)
    (tmp_path / "checkpoint").mkdir()
    planted(tmp_path / "checkpoint" / "part-00-000000.nc")
    with pytest.raises(InputError, match="an unfinished run"):
        command(tmp_path)
    assert before == {path: path.read_bytes() for path in studied.rglob("*") if path.is_file()}


# -- names of results -------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ["csv", "xlsx", "txt", "json", "mat", "parquet", "png", "CSV"])
@pytest.mark.parametrize("command", ["simulate", "sample", "merge", "map", "wear", "effects"])
def test_a_name_that_promises_another_format_is_refused(tmp_path, command, ending):
    output = tmp_path / f"x.{ending}"
    more = ["--x", "C=0.1mm:1mm:2"] if command == "map" else []
    done = CliRunner().invoke(cli, [command, str(JOBS / "wear.toml"), "-o", str(output), *more])
    assert done.exit_code == 2
    said = " ".join(done.output.replace("\u2502", " ").split())
    assert "NetCDF" in said
    assert "x.nc" in said
    assert list(tmp_path.iterdir()) == []
