"""Tables of results: what they hold, and that other programs read from every format what was written."""

import json
import re

import numpy as np
import opened
import pandas as pd
import pytest
import report_data as data
import xarray as xr
from click.testing import CliRunner
from scipy.io import loadmat

import hpcclear
from hpcclear.base.errors import InputError
from hpcclear.cli import cli
from hpcclear.report.export import FORMATS, export
from hpcclear.report.tables import to_table

IDEAL = ['joints.crank_rod={kind="ideal"}', 'joints.rod_slider={kind="ideal"}', "effects.friction=none"]  # fmt: skip
SHORT = ["numerics.transient_revolutions=0", "output.instants_per_revolution=60"]


@pytest.fixture(scope="module")
def ideal() -> xr.Dataset:
    """The response of a mechanism without clearance, which takes no kernel."""
    return hpcclear.simulate(hpcclear.load_scene("jobs/slider_crank.toml", [*IDEAL, *SHORT]))


def test_a_response_without_clearance_has_a_row_for_each_instant(ideal):
    table = to_table(ideal, ("SI",))
    assert len(table) == ideal.sizes["time"] > 100
    np.testing.assert_array_equal(table["time [s]"], ideal["time"])
    np.testing.assert_array_equal(table["slider_position [m]"], ideal["slider_position"])
    assert table.attrs["objective [m]"] == 0.0
    assert table.attrs["status"] == "ok"


def test_a_sample_has_one_row_with_its_joints_as_columns_and_words_for_codes():
    samples = data.samples()
    table = to_table(samples)
    assert len(table) == samples.sizes["sample"]
    assert "peak_contact_force crank_rod [N]" in table
    assert list(table["status"][-4:]) == ["ok", *["step_cap"] * 3]
    assert table["flags"][0] == "latched+beyond_hertz"
    assert table["objective [m]"][-3:].isna().all()


@pytest.mark.parametrize(
    ("overrides", "units", "heading", "factor"),
    [
        ([], (), "C [mm]", 1e3),
        (['study.variables.C={range=["290 um", "1 mm"]}'], (), "C [um]", 1e6),
        (
            ["study.variables.C={range=[3e-4, 1e-3]}", "study.random.C.range=[3e-4, 1e-3]"],
            (),
            "C [mm]",
            1e3,
        ),
        (None, (), "C [m]", 1.0),
        ([], ("SI",), "C [m]", 1.0),
        ([], ("kN", "um"), "C [um]", 1e6),
    ],
)
def test_units_are_those_asked_for_else_those_of_the_scene(overrides, units, heading, factor):
    samples = data.samples()
    if overrides is not None:
        scene = hpcclear.load_scene("jobs/quickstart.toml", overrides)
        samples = samples.assign_attrs(scene.origin)
    table = to_table(samples, units)
    np.testing.assert_allclose(table[heading], factor * samples["C"], rtol=1e-15)
    if "kN" in units:
        np.testing.assert_allclose(table["peak_contact_force crank_rod [kN]"][0], 5.0)


def test_a_unit_that_fits_nothing_is_refused_with_those_that_do():
    with pytest.raises(InputError, match=r"--unit = 'rpm'.*fits no quantity.*N, kg, kg m\^2, m$"):
        to_table(data.samples(), ["rpm"])
    with pytest.raises(InputError, match=r"--unit = 'kN, N': .*the same quantities"):
        to_table(data.samples(), ["mm", "kN", "N"])
    with pytest.raises(InputError, match="no result"):
        to_table(xr.Dataset())


def _read(path):
    """Columns of a file, by heading, as another program reads them."""
    if path.suffix == ".csv":
        return pd.read_csv(path, keep_default_na=True)
    if path.suffix == ".xlsx":
        return pd.read_excel(path, sheet_name="data")
    if path.suffix == ".parquet":
        return pd.read_parquet(path)
    content = loadmat(path)
    return {name: values.ravel() for name, values in content.items() if not name.startswith("__")}


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("kind", ["samples", "response", "verification"])
def test_what_is_read_back_equals_what_was_written(tmp_path, ideal, kind, ending):
    made = {"samples": data.samples, "response": lambda: ideal, "verification": data.verification}
    opened.write(made[kind](), tmp_path / "r.nc")
    table = export(tmp_path / "r.nc", tmp_path / f"r{ending}")
    first = (tmp_path / f"r{ending}").read_bytes()
    export(tmp_path / "r.nc", tmp_path / f"r{ending}")  # replaces its own file
    assert (tmp_path / f"r{ending}").read_bytes() == first
    found = _read(tmp_path / f"r{ending}")
    if ending != ".mat":
        assert list(found.columns) == list(table.columns)
    for heading in table:
        own = heading if ending != ".mat" else heading.partition(" [")[0]
        values = found[own.replace(" ", "_") if ending == ".mat" else own]
        if table[heading].dtype.kind in "fi":
            np.testing.assert_array_equal(np.asarray(values, float), table[heading])
        elif ending != ".mat":
            assert pd.Series(values).fillna("").astype(str).tolist() == table[heading].tolist()
        else:
            assert ["".join(one.ravel()) for one in values] == table[heading].tolist()


def test_files_say_their_units_and_their_scene(tmp_path):
    from pyarrow import parquet

    opened.write(data.samples(), tmp_path / "s.nc")
    for ending in (".mat", ".parquet", ".xlsx"):
        export(tmp_path / "s.nc", tmp_path / f"s{ending}", ("mm",))
    content = loadmat(tmp_path / "s.mat", squeeze_me=True)
    assert str(content["units"]["objective"]) == "mm"
    assert "mean gap" in str(content["long_names"]["objective"])
    assert str(content["about_scene_hash"]) == "0" * 64
    about = parquet.read_metadata(tmp_path / "s.parquet").metadata
    assert json.loads(about[b"units"])["C [mm]"] == "mm"
    listed = pd.read_excel(tmp_path / "s.xlsx", sheet_name="quantities").set_index("heading")
    assert listed.loc["m2 [kg]", "unit"] == "kg"
    assert (pd.read_excel(tmp_path / "s.xlsx", sheet_name="about")["value"] == "0" * 64).any()


def test_text_of_a_cell_is_never_a_formula_nor_markup(tmp_path):
    from openpyxl import load_workbook

    hostile = data.claims()
    hostile["text"][0] = "=1+1 <b>&\x01"
    opened.write(hostile, tmp_path / "c.nc")
    export(tmp_path / "c.nc", tmp_path / "c.xlsx")
    cell = load_workbook(tmp_path / "c.xlsx")["data"]["B2"]
    assert (cell.value, cell.data_type) == ("=1+1 <b>& ", "s")


MARKS = ("=", "+", "-", "@", "\t", "\r", " =", "\t=", "＝", "＋", "－", "＠")
"""What a cell begins with that a spreadsheet reads as a formula; full-width signs too."""


def test_no_text_of_a_csv_file_is_read_as_a_formula(tmp_path):
    """In cells and headings, also where a spreadsheet of another country separates cells at semicolons; numbers stay."""
    labels = [f"{mark}cmd|' /C calc'!A0" for mark in MARKS]
    labels += [f"a;{mark}SUM(1)" for mark in "=+-@"] + ["-1.5", "+3e-7", "-inf", "a, -b", "x-1"]
    made = pd.DataFrame({"label": labels, "=signed": -1.5 - np.arange(len(labels))})
    (tmp_path / "s.csv").write_bytes(FORMATS[".csv"](made)[0])
    found = pd.read_csv(tmp_path / "s.csv", dtype=str, keep_default_na=False)
    for before, after in zip(labels, found["label"], strict=True):
        assert after.replace("'", "") == before.replace("'", "").replace("\r", "\n")
        for cell in re.split("[;\t\r\n]", after):
            try:
                float(cell)
            except ValueError:
                assert not cell.strip().startswith(MARKS), after
    assert list(found["label"][-5:]) == labels[-5:]
    assert list(found["'=signed"].astype(float)) == list(made["=signed"])


def test_what_somebody_else_wrote_is_not_replaced(tmp_path):
    opened.write(data.samples(), tmp_path / "s.nc")
    for ending in FORMATS:
        (tmp_path / f"s{ending}").write_text("mine")
        reason = "other headings" if ending == ".csv" else "not written by hpcclear"
        with pytest.raises(InputError, match=reason):
            export(tmp_path / "s.nc", tmp_path / f"s{ending}")
        assert (tmp_path / f"s{ending}").read_text() == "mine"


def test_statistics_of_several_samples_stand_side_by_side(tmp_path):
    for name, failed in (("H7g6", 1), ("H7f7", 3)):
        made = data.samples(200, failed).assign_attrs(sampling="monte-carlo")
        opened.write(made, tmp_path / f"{name}.nc")
    opened.write(data.timing(), tmp_path / "H7g6.timing.nc")  # fits/*.nc names it too
    files = [str(path) for path in sorted(tmp_path.glob("*.nc"))]
    words = ["--statistics", "--beyond", "0.3 mm", "-o", str(tmp_path / "fits.xlsx")]
    done = CliRunner().invoke(cli, ["export", *files, *words])
    assert done.exit_code == 0, done.output
    assert "3 of 200" in done.output
    sheets = pd.read_excel(tmp_path / "fits.xlsx", sheet_name=None)
    assert list(sheets) == ["data", "about"]
    assert str(tmp_path / "H7f7.nc") in sheets["about"]["value"].tolist()
    table = sheets["data"].set_index("statistic")
    ends = [f"{name} {end}" for name in ("H7f7", "H7g6") for end in ("value", "lower", "upper")]
    assert list(table.columns) == ["unit", *ends]
    assert all(table[end].dtype.kind == "f" for end in ends)
    assert table.loc["samples", "H7f7 value"] == 200
    assert table.loc["f > 0.3 mm", "unit"] == "%"
    for name in ("H7f7", "H7g6"):
        mean, lower, upper = table.loc[
            "mean of f", [f"{name} {e}" for e in ("value", "lower", "upper")]
        ]
        known = opened.read(tmp_path / f"{name}.nc")["objective"]
        per = {"m": 1.0, "mm": 1e3, "um": 1e6}[table.loc["mean of f", "unit"]]
        assert mean == pytest.approx(per * float(known.mean()))
        assert lower < mean < upper
    refused = CliRunner().invoke(cli, ["export", *files, "-o", str(tmp_path / "all.csv")])
    assert "Add --statistics" in str(refused.exception)
