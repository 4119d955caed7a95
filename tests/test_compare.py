"""A response beside measurements: found again where it was shifted, and errors measured as they were made."""

import re

import numpy as np
import opened
import pytest
import report_data as data
import xarray as xr
from click.testing import CliRunner

from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.report import overlay_figure
from hpcclear.report.compare import compare


@pytest.fixture(scope="module")
def response() -> xr.Dataset:
    return data.response()


def table(path, columns: dict[str, np.ndarray]):
    """A CSV file of these columns."""
    cells = zip(*(map(repr, values.tolist()) for values in columns.values()), strict=True)
    rows = [",".join(columns), *map(",".join, cells)]
    path.write_text("\n".join(rows) + "\n")
    return path


def measured(response, path, axis, *, gain=1.0, noise=0.0, shift=0.0):
    """What a gauge might give of the last revolutions: every third instant, in kN."""
    shown = response.isel(time=slice(-400, -50, 3))
    milliseconds = 1e3 * shown["time"] - shift
    across = milliseconds if axis == "time [ms]" else np.degrees(shown["crank_angle"]) % 360.0
    force = 1e-3 * shown["contact_force"].sel(joint="crank_rod").to_numpy()
    dice = np.random.default_rng(0).normal(0.0, noise, len(force))
    return table(
        path, {axis: np.asarray(across), "contact_force crank_rod [kN]": gain * force + dice}
    )


@pytest.mark.parametrize("axis", ["time [ms]", "crank_angle (deg)"])
def test_a_series_of_the_response_itself_is_met_without_error(response, tmp_path, axis):
    found = compare(response, measured(response, tmp_path / "m.csv", axis))
    (one,) = found.quantities
    assert found.axis == axis.partition(" ")[0].removeprefix("crank_")
    assert one.norms["correlation"] == pytest.approx(1.0, abs=1e-6)
    assert one.norms["relative_rms"] < (1e-9 if found.axis == "angle" else 1e-2)


def test_a_shifted_series_is_found_again_by_its_correlation(response, tmp_path):
    path = measured(response, tmp_path / "m.csv", "time [ms]", shift=7.3)
    aligned, as_it_stands = compare(response, path), compare(response, path, "none")
    turn = float(response["time"][-1]) / 4
    assert (aligned.shift - 7.3e-3 + turn / 2) % turn - turn / 2 == pytest.approx(0.0, abs=1e-5)
    assert aligned.quantities[0].norms["rms"] < 0.05 * as_it_stands.quantities[0].norms["rms"]


def test_norms_are_those_of_the_errors_that_were_made(response, tmp_path):
    path = measured(response, tmp_path / "m.csv", "crank_angle [deg]", gain=1.1)
    (one,) = compare(response, path).quantities
    truth = one.measured / 1.1
    np.testing.assert_allclose(one.norms["rms"], 0.1 * np.sqrt(np.mean(truth**2)), rtol=1e-6)
    np.testing.assert_allclose(one.norms["largest"], 0.1 * truth.max(), rtol=1e-6)
    np.testing.assert_allclose(one.norms["mean"], -0.1 * truth.mean(), rtol=1e-6)
    np.testing.assert_allclose(one.norms["peak"], -0.1 * truth.max(), rtol=1e-6)
    assert one.unit == "N"


@pytest.mark.parametrize(
    ("head", "reason"),
    [
        ("speed [rpm],crank_moment [N m]", "neither time nor angle"),
        ("time [mm],crank_moment [N m]", "does not fit"),
        ("time [s],crank_moment [kN]", "does not fit"),
        ("time [s],contact_force", "Use one of: contact_force crank_rod, contact_force rod_slider"),
        ("time [s],crank_momnt", "Did you mean 'crank_moment'"),
        ("time [s]", "no series"),
        ("time [s],crank_moment [N m],crank_moment [kN mm]", "another column is crank_moment"),
        ("time [s],time [ms],crank_moment [N m]", "another column is time"),
    ],
)
def test_a_table_that_cannot_be_compared_is_refused(response, tmp_path, head, reason):
    row = ",".join("1" for _ in head.split(","))
    (tmp_path / "m.csv").write_text(f"{head}\n{row}\n{row}\n{row}\n")
    with pytest.raises(InputError, match=re.escape(reason)):
        compare(response, tmp_path / "m.csv")


def test_nothing_is_aligned_by_a_constant_and_times_that_fall_are_refused(response, tmp_path):
    opened.write(response, tmp_path / "r.nc")
    path = table(tmp_path / "m.csv", {"time [s]": np.arange(3.0), "crank_moment": np.zeros(3)})
    words = ["compare", str(tmp_path / "r.nc"), str(path)]
    told = CliRunner().invoke(cli, words).output
    assert "not aligned, shifted by 0 s" in told
    assert "nan" not in told
    assert "has 3 rows for" in told
    table(path, {"time [s]": 1e3 * np.arange(3.0), "crank_moment": np.zeros(3)})
    assert "Check the unit" in str(CliRunner().invoke(cli, words).exception)
    table(path, {"time [s]": np.array([0.0, 2.0, 1.0]), "crank_moment": np.zeros(3)})
    assert "do not rise" in str(CliRunner().invoke(cli, words).exception)


def test_angles_that_rise_are_taken_as_they_are_and_text_is_no_quantity(response, tmp_path):
    shown = response.isel(time=slice(-700, None, 150))
    force = shown["contact_force"].sel(joint="crank_rod").to_numpy()
    degrees = np.degrees(np.asarray(shown["crank_angle"]))
    columns = {"crank_angle [deg]": degrees, "contact_force crank_rod [N]": force}
    assert np.diff(degrees).min() > 180.0
    (one,) = compare(response, table(tmp_path / "m.csv", columns)).quantities
    assert one.norms["relative_rms"] < 1e-9
    table(tmp_path / "m.csv", columns | {"crank_moment [N m]": np.array(["OVR"] * len(force))})
    with pytest.raises(InputError, match="OVR"):
        compare(response, tmp_path / "m.csv")


@pytest.mark.parametrize(
    ("times", "contradicts"), [(1.0, False), (1.05, False), (1e-3, True), (2.0, True)]
)
def test_a_time_that_contradicts_the_angle_is_said(response, tmp_path, capsys, times, contradicts):
    shown = response.isel(time=slice(-400, -50, 3))
    columns = {
        "crank_angle [deg]": np.degrees(shown["crank_angle"]) % 360.0,
        "time [s]": times * shown["time"],
    }
    columns["crank_moment"] = shown["crank_moment"]
    path = table(tmp_path / "m.csv", {name: np.asarray(one) for name, one in columns.items()})
    compare(response, path)
    assert ("revolutions by its angle" in capsys.readouterr().err) is contradicts


def test_a_cell_that_is_no_number_is_named(tmp_path):
    (tmp_path / "m.csv").write_text("time [s],crank_moment\n0,1\n1,x\n2,3\n")
    with pytest.raises(InputError, match=r"line 3, column crank_moment = 'x'"):
        compare(data.response(), tmp_path / "m.csv")


def test_the_command_prints_norms_in_the_units_of_the_measurement_and_draws(response, tmp_path):
    opened.write(response, tmp_path / "r.nc")
    path = measured(response, tmp_path / "m.csv", "crank_angle [deg]", gain=2.0)
    path.write_text(path.read_text().replace("contact_force crank_rod", "gauge 1"))
    words = [
        "compare",
        str(tmp_path / "r.nc"),
        str(path),
        "--name",
        "gauge 1=contact_force crank_rod",
    ]
    done = CliRunner().invoke(cli, [*words, "-o", str(tmp_path / "o.svg")])
    assert done.exit_code == 0, done.output
    assert re.search(r"RMS error +[\d.e-]+ kN, 0.5 of the measured RMS", done.output)
    assert "by crank angle" in done.output
    assert (tmp_path / "o.svg").read_bytes().startswith(b"<?xml")
    panel = overlay_figure(
        compare(response, path, names={"gauge 1": "contact_force crank_rod"})
    ).axes[0]
    assert "kN" in panel.get_ylabel()


@pytest.mark.parametrize("axis", ["time [ms]", "crank_angle [deg]"])
def test_the_revolution_that_was_picked_is_told_with_the_errors_of_all(response, tmp_path, axis):
    made = response.copy(deep=True)
    turn = made["crank_angle"].to_numpy() / (2.0 * np.pi)
    wave = 100.0 * np.sin(2.0 * np.pi * turn)  # in each revolution more of it
    made["contact_force"][:] += (np.floor(turn + 1e-9) * wave)[:, None]
    shown = made.isel(time=slice(401, 590, 3))  # of the third
    across = 1e3 * shown["time"] if axis.startswith("time") else 360.0 * (turn[401:590:3] % 1.0)
    force = shown["contact_force"].sel(joint="crank_rod").to_numpy()
    path = table(
        tmp_path / "m.csv", {axis: np.asarray(across), "contact_force crank_rod [N]": force}
    )
    found = compare(made, path, "angle" if axis.startswith("crank") else "none")
    (one,) = found.quantities
    if axis.startswith("crank"):
        assert len(one.by_revolution) == found.revolutions == 4
        assert found.revolution == 3
        off = np.sqrt(np.mean(wave[401:590:3] ** 2))
        assert one.by_revolution == pytest.approx(off * np.array([2, 1, 0, 1]), abs=1e-6)
    peak = float(one.series.max())
    assert peak >= float(one.simulated.max())
    assert len(one.series) == len(found.series_x) > 2.5 * len(found.x)
    assert np.interp(found.x, found.series_x, one.series) == pytest.approx(one.simulated, abs=1.0)
