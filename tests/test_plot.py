"""Figures and films of results by name; maps, bifurcations and Poincaré sections over any entry."""

import re
import shutil
import subprocess

import numpy as np
import opened
import pytest
import report_data as data
import xarray as xr
from click.testing import CliRunner
from PIL import Image

import hpcclear
from hpcclear import report
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Regime
from hpcclear.cli import cli, main
from hpcclear.ensemble.bifurcation import Observation, run_bifurcation
from hpcclear.ensemble.maps import SHAPE
from hpcclear.ranks.boundary import alone
from hpcclear.report.figures import motion
from hpcclear.report.figures.animation import RATE, animate
from hpcclear.report.figures.catalogue import drawings
from hpcclear.report.figures.portraits import CROSSINGS
from hpcclear.report.html.page import write_report
from hpcclear.results.content import Results

SCENE = "jobs/slider_crank.toml"
SHORT = ["numerics.transient_revolutions=0", "numerics.averaged_revolutions=1"]


def run(*words) -> object:
    return CliRunner().invoke(cli, list(map(str, words)))


def cells(*shape: int) -> xr.Dataset:
    """A map of the scene over a clearance, and over a speed."""
    count = int(np.prod(shape))
    samples = data.samples(count + 3).isel(sample=slice(count)).drop_vars(["m2", "m3", "u2", "I2"])
    grid = np.indices(shape).reshape(len(shape), -1)
    samples["C"] = ("sample", 1e-4 * (1 + grid[0]), samples["C"].attrs)
    if len(shape) > 1:
        attributes = {"role": "design_variable", "scene_path": "drive.speed", "units": "rad/s"}
        samples["drive_speed"] = ("sample", np.pi * (1 + grid[1]), attributes)
    for name, values in {
        "lyapunov_exponent": np.linspace(-2, 1, count),
        "lyapunov_exponent_limit": np.full(count, 0.1),
        "objective_limit": np.full(count, 1e-6),
        "period": np.where(np.arange(count) < 3, 1.0, np.nan),
        "attractors": np.ones(count),
        "steady_rtol": np.full(count, 1e-6),
        "steady_revolutions": np.full(count, 40.0),
    }.items():
        samples[name] = ("sample", values, {"long_name": name, "units": "1"})
    regimes = np.where(np.arange(count) < 3, Regime.REGULAR, Regime.CHAOTIC).astype("i1")
    samples["regime"] = ("sample", regimes)
    return samples.assign_attrs({SHAPE: " ".join(map(str, shape))})


# -- by name ---------------------------------------------------------------------------------------


def test_without_an_output_the_figures_are_listed_and_with_a_directory_all_are_drawn(tmp_path):
    opened.write(data.sensitivity(), tmp_path / "sensitivity.nc")
    opened.write(data.response(), tmp_path / "r.nc")
    listed = run("plot", tmp_path).output.partition(": ")[2].strip().split(", ")
    assert {"sensitivities", "sobol", "orbit"} <= set(listed)
    assert not {"samples", "front", "comparison"} & set(listed)
    done = run("plot", tmp_path, "-o", tmp_path / "figures", "--format", "svg")
    assert done.exit_code == 0, done.output
    missing = re.findall(r"no (\S+):", done.output)
    drawn = {path.stem for path in (tmp_path / "figures").glob("*.svg")}
    assert drawn | set(missing) == set(listed)
    assert "poincare" in missing


def test_a_figure_that_results_do_not_allow_is_refused_with_the_nearest(tmp_path):
    opened.write(data.response(), tmp_path / "r.nc")
    done = run("plot", tmp_path / "r.nc", "--figure", "orbits", "-o", tmp_path / "o.png")
    assert "Did you mean 'orbit'?" in str(done.exception)
    done = run("plot", tmp_path / "r.nc", "--animation", tmp_path / "o.avi")
    assert ".gif or .mp4" in str(done.exception)
    done = run("plot", tmp_path / "r.nc", "-o", tmp_path / "o.png")
    assert "name of one figure" in str(done.exception)
    done = run("plot", tmp_path / "r.nc", "--figure", "orbit", "--format", "pdf", "-o", "o.png")
    assert "o.png is of another format" in str(done.exception)
    assert not (tmp_path / "o.png").exists()
    opened.write(data.samples(), tmp_path / "s.nc")
    done = run("plot", tmp_path / "s.nc", "--animation", tmp_path / "o.gif")
    assert "no response" in str(done.exception)


# -- films ------------------------------------------------------------------------------------------


def test_a_gif_has_the_length_that_is_given_and_is_the_same_again(tmp_path):
    response = data.response()
    first, again = (animate(response, tmp_path / name, 0.6) for name in ("a.gif", "b.gif"))
    assert first.read_bytes() == again.read_bytes()
    film, length = Image.open(first), 0
    for k in range(film.n_frames):
        film.seek(k)
        length += film.info["duration"]
    assert length == 600
    assert film.n_frames == round(0.6 * RATE)
    frames = [np.asarray(film.convert("L")) for k in (0, 5) if film.seek(k) is None]
    assert (frames[0] != frames[1]).any()
    (tmp_path / "mine.gif").write_bytes(b"GIF89a")
    with pytest.raises(InputError, match="not written by hpcclear"):
        animate(response, tmp_path / "mine.gif", 0.2)


def test_without_ffmpeg_an_mp4_is_refused_in_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(InputError, match=r"needs the program ffmpeg.*name the file '.*a\.gif'"):
        animate(data.response(), tmp_path / "a.mp4")


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_an_mp4_plays(tmp_path):
    film = animate(data.response(), tmp_path / "a.mp4", 0.6)
    words = ["ffmpeg", "-i", film, "-f", "null", "-"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert "Duration: 00:00:00.60" in done.stderr
    assert "frame=   15" in done.stderr


# -- maps and bifurcations ------------------------------------------------------------------------


def test_a_map_is_drawn_in_readable_units_and_shown_on_the_page(tmp_path):
    line, plane = (report.map_figure(cells(*shape)) for shape in ((6,), (4, 3)))
    assert line.axes[-1].get_xlabel() == "clearance $C$ (mm)"
    assert plane.axes[0].get_ylabel() == "speed of the drive (rpm)"
    with pytest.raises(InputError, match="no map"):
        report.map_figure(data.samples())
    opened.write(cells(6), tmp_path / "map.nc")
    page = write_report(tmp_path).read_text()
    assert "Largest Lyapunov exponent" in page
    assert "samples.nc" not in page


@pytest.mark.parametrize(
    ("name", "unit", "words"),
    [
        ("objective", "m", "mean gap of each revolution"),
        ("slider_velocity", "m/s", "slider velocity, at crank angle 90 deg"),
        (
            "max contact_force rod_slider",
            "N",
            "contact force of rod_slider, max of each revolution",
        ),
    ],
)
def test_an_observation_is_one_value_of_each_revolution(name, unit, words):
    response = Results.of(data.response(4))
    seen = Observation(name, np.pi / 2, 1, 3)
    what = seen.described(response)
    assert (what.unit, what.words) == (unit, words)
    *values, flags, status = seen(hpcclear.load_scene(SCENE), response)
    assert (len(values), flags, status) == (3, int(response["flags"]), 0)
    expected = {
        "objective": motion.objective_by_turn(response)[-3:],
        "slider_velocity": np.full(3, -0.05 * 2 * np.pi * 5000 / 60),
        "max contact_force rod_slider": np.full(3, 0.7 * 3e7 * 0.2 * 3e-4),
    }[name]
    np.testing.assert_allclose(values, expected, rtol=1e-9)
    response["status"].values[...] = 1
    *values, _, status = seen(hpcclear.load_scene(SCENE), response)
    assert (np.isnan(values).all(), status) == (True, 1)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        ("contact_force", "contact_force crank_rod, contact_force rod_slider"),
        ("slider_velocty", "Did you mean 'slider_velocity'"),
        ("max crank_momen", "Did you mean"),
    ],
)
def test_a_series_that_is_none_is_refused(name, remedy):
    with pytest.raises(InputError, match=remedy):
        Observation(name).described(Results.of(data.response()))


def test_a_bifurcation_over_a_speed_is_simulated_written_found_again_and_drawn(tmp_path):
    scene = hpcclear.load_scene(SCENE, SHORT)
    seen = Observation("slider_position", 0.0, 0, 2)
    words = (scene, "drive.speed=1000 rpm:3000 rpm:3", tmp_path / "b.nc", alone(), seen)
    found = run_bifurcation(*words)
    content = opened.read(tmp_path / "b.nc", "bifurcation")
    assert content["observed"].shape == (3, 2)
    speed = content["drive_speed"].values[1]
    changed = scene.with_({"drive.speed": speed, "numerics.averaged_revolutions": 2})
    response = hpcclear.simulate(changed)
    direct = motion.section(response, "slider_position")[1:]
    assert int(content["flags"][1]) == int(response["flags"]) > 0
    np.testing.assert_allclose(content["observed"][1], direct, rtol=1e-12)
    xr.testing.assert_identical(run_bifurcation(*words).content.to_xarray(), content)
    assert found.content["observed"].attrs["units"] == "m"
    axes = report.bifurcation_figure(content).axes[0]
    assert axes.get_xlabel() == "speed of the drive (rpm)"
    np.testing.assert_allclose(axes.lines[0].get_xdata(), np.repeat([1000, 2000, 3000], 2))
    assert len(hpcclear.to_table(content)) == 6
    with pytest.raises(InputError, match="no bifurcation"):
        report.bifurcation_figure(data.samples())


def test_a_poincare_section_has_at_least_200_points_or_is_not_drawn():
    few, many = data.response(CROSSINGS - 1, instants=12), data.response(CROSSINGS, instants=12)
    assert len(drawings({}, {"a": many})["poincare"]().axes) > 1
    with pytest.raises(InputError, match="at least 200 revolutions"):
        drawings({}, {"a": few})["poincare"]()
    late = many.assign_attrs(transient_turns=5)
    with pytest.raises(InputError, match="averaged_revolutions=200"):
        drawings({}, {"a": late})["poincare"]()


def test_a_file_that_is_left_out_is_named_and_no_file_becomes_a_directory(tmp_path, capsys):
    opened.write(data.response(), tmp_path / "response.nc")
    (tmp_path / "samples.nc").write_text("no results")
    before = (tmp_path / "response.nc").read_bytes()
    with pytest.raises(SystemExit) as ended:
        main(["plot", str(tmp_path), "-o", str(tmp_path / "response.nc")])
    told = " ".join(capsys.readouterr().err.split())
    assert ended.value.code == 2
    assert "samples.nc was left out" in told
    assert "response.nc': File exists" in told
    assert (tmp_path / "response.nc").read_bytes() == before
