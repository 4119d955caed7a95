"""What people bring: tables from any program, curves from files, in whatever way they were written."""

import math
from pathlib import Path

import kinds_of_tables
import numpy as np
import pytest
import report_data as data

from hpcclear.base.errors import InputError
from hpcclear.base.pieces import periodic
from hpcclear.report.html.content import Content
from hpcclear.report.html.origin import inputs
from hpcclear.scene import load_scene
from hpcclear.scene.loading import scene_of_text
from hpcclear.scene.points import read_points

JOBS = Path(__file__).parents[1] / "jobs"
ALL = kinds_of_tables.kinds()


@pytest.mark.parametrize("kind", ALL, ids=[kind.words.replace(" ", "-") for kind in ALL])
def test_each_file_is_read_rightly_or_refused_with_the_cause(kind, tmp_path):
    right, shown = kinds_of_tables.outcome(kind, tmp_path)
    assert right, shown
    refused = isinstance(kind.expected, str)
    assert shown.startswith("refused" if refused else "read")


def pressure_file(folder, angles, law, name="p.csv"):
    path = folder / name
    path.write_bytes(kinds_of_tables.curve(angles, law))
    return path


def with_file(scene, key, row):
    content = scene.resolved()
    table = content
    *owners, leaf = key.split(".")
    for owner in owners:
        table = table.setdefault(owner, {})
    table[leaf] = row
    return load_scene(content)


def test_a_pressure_is_a_force_on_the_piston(tmp_path):
    path = pressure_file(tmp_path, np.arange(0.0, 360.0, 2.0), kinds_of_tables.compressed)
    base = load_scene(JOBS / "slider_crank.toml")
    row = {"file": str(path), "bore": "42 mm", "ambient": "1 bar"}
    angles = np.linspace(0.0, 2 * math.pi, 777)
    area, pressure = math.pi / 4 * 0.042**2, 1e5 * kinds_of_tables.compressed(np.degrees(angles))

    def at(row, angles=angles):
        return periodic(
            with_file(base, "effects.slider_load", row).effects.slider_load, 2 * math.pi
        ).at(angles)

    force = -area * (pressure - 1e5)
    np.testing.assert_allclose(at(row), force, atol=2e-4 * np.ptp(force))
    np.testing.assert_allclose(at({**row, "pushes": "+x"}), -force, atol=2e-4 * np.ptp(force))
    by_area = {"file": str(path), "area": f"{1e6 * area!r} mm2", "ambient": 1e5}
    np.testing.assert_allclose(at(by_area), at(row), rtol=1e-12)
    later = at({**row, "zero": "90 deg"}, angles + math.pi / 2)
    np.testing.assert_allclose(later, at(row), atol=1e-3 * np.ptp(force))
    back = at({**row, "clockwise": True}, -angles)
    np.testing.assert_allclose(back, at(row), atol=1e-3 * np.ptp(force))


def test_no_kink_at_the_seam(tmp_path):
    """Wherever a file begins, the curve and its slope at the seam are those of anywhere else."""
    base, near = load_scene(JOBS / "slider_crank.toml"), np.linspace(-0.05, 0.05, 2001)
    row = {"bore": "42 mm", "ambient": "1 bar"}
    slopes = []
    for k, begin in enumerate((0.0, -180.0, 90.0)):
        path = pressure_file(
            tmp_path, begin + np.arange(0.0, 361.0), kinds_of_tables.compressed, f"{k}.csv"
        )
        load = with_file(
            base, "effects.slider_load", {**row, "file": str(path)}
        ).effects.slider_load
        slopes.append(np.diff(periodic(load, 2 * math.pi).at(near)) / np.diff(near))
    for slope in slopes:
        assert np.abs(np.diff(slope)).max() < 0.01 * np.abs(slope).max()
        np.testing.assert_allclose(slope, slopes[0], rtol=5e-3)


def test_measured_ends_that_nearly_meet_are_joined(tmp_path):
    base = load_scene(JOBS / "slider_crank.toml")
    angles = np.arange(0.0, 361.0)
    path = pressure_file(
        tmp_path, angles, lambda a: kinds_of_tables.compressed(a) + 0.05 * a / 360.0
    )
    row = {"file": str(path), "bore": "42 mm", "ambient": "1 bar"}
    load = with_file(base, "effects.slider_load", row).effects.slider_load
    middle = kinds_of_tables.compressed(0.0) + 0.025
    assert load[0][1] == pytest.approx(-math.pi / 4 * 0.042**2 * 1e5 * (middle - 1.0), rel=1e-9)
    assert len(load) == 360


LINKAGE = JOBS / "linkages" / "four_stroke.toml"


def test_two_turns_of_a_four_stroke_engine(tmp_path):
    base = load_scene(LINKAGE)
    key = next(
        f"mechanism.loads.{row.name}.size" for row in base.mechanism.loads if row.kind == "force"
    )
    degrees = np.arange(-360.0, 360.0)
    row = {
        "file": str(pressure_file(tmp_path, degrees, kinds_of_tables.indicated)),
        "bore": "80 mm",
        "ambient": "1 bar",
    }
    size = next(
        one.size for one in with_file(base, key, row).mechanism.loads if one.kind == "force"
    )
    angles = np.radians(degrees[::7])
    expected = math.pi / 4 * 0.08**2 * 1e5 * (kinds_of_tables.indicated(degrees[::7]) - 1.0)
    np.testing.assert_allclose(
        periodic(size, 4 * math.pi).at(angles), expected, atol=2e-3 * np.ptp(expected)
    )
    # a compressor's turn in a scene of two is repeated
    one = pressure_file(tmp_path, np.arange(0.0, 360.0), kinds_of_tables.compressed, "one.csv")
    twice = next(
        r.size
        for r in with_file(base, key, {**row, "file": str(one)}).mechanism.loads
        if r.kind == "force"
    )
    assert len(twice) == 720
    np.testing.assert_allclose(
        periodic(twice, 4 * math.pi).at(angles),
        periodic(twice, 4 * math.pi).at(angles + 2 * math.pi),
        atol=1e-9 * np.ptp(expected),
    )
    wrong = {**row, "pushes": "-x"}
    with pytest.raises(InputError, match="belongs to the load on a slider"):
        with_file(base, key, wrong)


@pytest.mark.parametrize(
    ("turns", "angle_of", "own", "expected"),
    [
        (4, {}, 2, 4),
        (2, {"angle_of": "rod"}, 1, 1),  # it repeats with each turn of this body
        (3, {}, 2, "has two turns, and the entry repeats after 3 turns"),
        (0, {}, 1, "must be from 1 to 64"),
    ],
)
def test_a_file_is_repeated_until_its_entry_repeats(turns, angle_of, own, expected, tmp_path):
    content = load_scene(LINKAGE).resolved()
    content["mechanism"]["drives"]["motor"]["turns"] = turns
    path = pressure_file(tmp_path, np.arange(0.0, 360.0 * own), kinds_of_tables.indicated)
    size = {"file": str(path), "bore": "80 mm", "ambient": "1 bar"}
    content["mechanism"]["loads"]["gas"] |= {"size": size, **angle_of}
    if isinstance(expected, str):
        with pytest.raises(InputError, match=expected):
            load_scene(content)
    else:
        rows = next(one.size for one in load_scene(content).mechanism.loads if one.name == "gas")
        angles, forces = np.array(rows).T
        np.testing.assert_allclose(np.diff(angles), np.radians(1.0), rtol=1e-9)
        np.testing.assert_array_equal(np.resize(forces[: 360 * own], 360 * expected), forces)


def test_a_torque_and_a_motion_from_files(tmp_path):
    (tmp_path / "t.csv").write_text(
        "phi;M\ndeg;Nm\n"
        + "\n".join(f"{k};{5 + k / 90:.4f}".replace(".", ",") for k in range(0, 360, 10))
    )
    base = load_scene(JOBS / "slider_crank.toml")
    drive = {
        "kind": "torque",
        "initial_speed": "300 rpm",
        "torque": {"file": str(tmp_path / "t.csv")},
    }
    torque = with_file(base, "drive", drive).drive.torque
    assert len(torque) == 36
    assert torque[9] == (pytest.approx(math.pi / 2), 6.0)
    times = np.linspace(0.0, 0.5, 26)
    lines = [f"{1e3 * t:.6f},{20 * math.sin(4 * math.pi * t):.9f}" for t in times]
    (tmp_path / "m.csv").write_text("time [ms],angle [deg]\n" + "\n".join(lines))
    linkage = load_scene(JOBS / "linkages" / "crank_rocker.toml")
    name, body = linkage.mechanism.drives[0].name, linkage.mechanism.drives[0].body
    moved = {"kind": "table", "body": body, "angle": {"file": str(tmp_path / "m.csv")}}
    angle = with_file(linkage, f"mechanism.drives.{name}", moved).mechanism.drives[0].angle
    np.testing.assert_allclose(np.array(angle)[:, 0], times, atol=1e-9)
    np.testing.assert_allclose(
        np.array(angle)[:, 1], np.radians(20 * np.sin(4 * np.pi * times)), atol=1e-10
    )


def test_a_result_carries_what_files_held(tmp_path):
    """Without the file the text of a result gives the same scene; it says which file it was."""
    path = pressure_file(tmp_path, np.arange(0.0, 360.0, 5.0), kinds_of_tables.compressed)
    (tmp_path / "c.csv").write_text("part;C [mm]\nA;0,31\nB;0,36\nC;0,44\n", encoding="cp1252")
    text = (JOBS / "quickstart.toml").read_text()
    row = 'C = { distribution = "uniform", range = ["0.3 mm", "1 mm"] }'
    new = 'C = { distribution = "samples", file = "c.csv" }'
    assert row in text
    load = 'slider_load = { file = "p.csv", bore = "20 mm", ambient = "1 bar" }'
    text = text.replace(row, new).replace("[effects]", f"[effects]\n{load}", 1)
    (tmp_path / "scene.toml").write_text(text)
    scene = load_scene(tmp_path / "scene.toml")
    assert scene.required_study.random_input("C").values == (3.1e-4, 3.6e-4, 4.4e-4)
    (load, file, read), (clearance, *_) = scene.readings
    assert (load, file, clearance) == ("effects.slider_load", "p.csv", "study.random.C")
    shown = "UTF-8, commas, decimal points, 72 rows, pressure from 1 to 8 bar, SHA-256"
    assert read.startswith(shown)
    before = scene.text
    path.unlink()
    assert scene_of_text(before, "result.nc") == scene
    assert "# effects.slider_load: 'p.csv' is read as" in before
    changed = scene.with_({"drive.speed": "900 rpm"})
    assert scene_of_text(changed.text, "result.nc") == changed
    result = data.response().assign_attrs(changed.origin)
    (table,) = inputs(Content(tmp_path, {}, {"response": result}))
    drawn = {name: value for _, name, value in table.rows}["p.csv"]
    x, y = np.array([point.split(",") for point in drawn["points"].split()], float).T
    np.testing.assert_allclose(
        y / 24.0, (kinds_of_tables.compressed(3.6 * x) - 1.0) / 7.0, atol=0.01
    )
    assert drawn["words"] == "-219.9 to 0 N"  # of 7 bar on a bore of 20 mm


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({"bore": "42 mm"}, "ambient = None: is missing"),
        ({}, "the unit 'bar' does not fit|the heading"),
        ({"pressure": "bar"}, "bore = None: is given twice or not at all. A pressure needs"),
        ({"pressure": "bar", "force": "N", "bore": "1 mm"}, "force = 'N': stands beside pressure"),
        ({"torque": "Nm"}, "torque = 'Nm': has no meaning here, where a force is read"),
        ({"bore": "42 mm", "ambient": "1 bar", "pressure": "kPa"}, "has the unit bar"),
        ({"bore": "42 mm", "ambient": "1 bar", "area": "5 cm2"}, "bore = .*is given twice"),
        ({"bore": "42 mm", "ambient": "1 bar", "pressure": "p2 [bar]"}, "pressure = 'p2': is no column"),
        ({"bore": "42 mm", "ambient": "1 bar", "diameter": 1}, "diameter = 1: is not a known key"),
        ({"bore": "42 mm", "ambient": "1 bar", "column": "p"}, "belongs to measured values"),
        ({"bore": "0 mm", "ambient": "1 bar"}, "bore = '0 mm': must be above 0"),
        ({"file": "p.csv#Run"}, "file = .*p.csv#Run': is text, without sheets"),
        ({"bore": 42, "ambient": "1 bar"}, "bore = 42: .* at most 5 m"),
        ({"bore": "42 mm", "ambient": "1 bar", "time": "s"}, "time = 's': has no meaning"),
    ],
)  # fmt: skip
def test_curves_that_are_none(row, words, tmp_path):
    path = pressure_file(tmp_path, np.arange(0.0, 360.0, 5.0), kinds_of_tables.compressed)
    with pytest.raises(InputError, match=words) as error:
        with_file(
            load_scene(JOBS / "slider_crank.toml"),
            "effects.slider_load",
            {**row, "file": str(path.parent / row.get("file", path))},
        )
    assert error.value.key.startswith("effects.slider_load")


def test_files_are_read_where_curves_are_only(tmp_path):
    path = pressure_file(tmp_path, np.arange(0.0, 360.0, 5.0), kinds_of_tables.compressed)
    base = load_scene(JOBS / "slider_crank.toml")
    with pytest.raises(InputError, match="no file is read here"):
        with_file(base, "mechanism.rod.mass", {"file": str(path)})
    with pytest.raises(InputError, match="no name of a table"):
        with_file(base, "effects.slider_load", {"file": 3})
    with pytest.raises(InputError, match="no such regular file"):
        with_file(base, "effects.slider_load", {"file": "none.csv", "bore": 1})
    with pytest.raises(InputError, match="files are read where a scene is loaded"):
        base.with_({"effects.slider_load": {"file": str(path), "bore": "42 mm", "ambient": 0}})


@pytest.mark.parametrize(
    "text",
    [
        " " * 90_000,
        "C" + " " * 90_000,
        "1," * 40_000,
        "(" * 90_000,
        "1 " * 40_000,
        "a in " * 18_000,
    ],
)
@pytest.mark.timeout(60)
def test_hostile_lines_take_no_time(text, tmp_path):
    path = tmp_path / "h.csv"
    for body in (f"{text}\n1\n", f"C\n{text}\n"):
        path.write_text(body)
        with pytest.raises(InputError):
            read_points(path, load_scene(JOBS / "slider_crank.toml"))
