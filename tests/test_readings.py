"""Numbers as people write them: thousands that may be decimals, widths in percent, units that depend on a row's kind."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from commands import SCENE

from hpcclear.base.errors import InputError
from hpcclear.base.unit_names import OTHERS, REFUSED, UNITS
from hpcclear.base.units import UnitError, to_si
from hpcclear.ensemble.maps import axis
from hpcclear.identify.inputs import Unknown
from hpcclear.scene import load_scene
from hpcclear.scene.curves import Pairs, by_angle, by_time
from hpcclear.scene.fields import Quantity
from hpcclear.scene.paths import _all_entries, _quantity, of_kinds, quantities
from hpcclear.scene.points import read_points
from hpcclear.scene.variables import StudyVariable

JOBS = Path(__file__).parents[1] / "jobs"

# ---- thousands --------------------------------------------------------------------------------------
SIZES = ("1", "3", "9", "12", "50", "99", "100", "210", "999")
BEHIND = ("000", "500", "050", "125", "999", "001")
DOUBTFUL = [
    f"{sign}{before}{mark}{behind}"
    for before, behind in itertools.product(SIZES, BEHIND)
    for mark in ",."
    for sign in ("", "-")
]
"""Three digits after the only comma or point."""

PLAIN = {
    "0.300": 0.3, "-0.125": -0.125, "1.5e3": 1500.0, "1.500e3": 1500.0, "12.3456": 12.3456, "1500.000": 1500.0, "3.00": 3.0,
    "3.0000": 3.0, "3": 3.0, "3000": 3000.0, ".500": 0.5, "00.125": 0.125, "1.250E-2": 0.0125, "3.": 3.0,
}  # fmt: skip
"""Numbers that are read in one way alone."""

MENDED = {
    "1,234.5": "1234.5", "1.234,5": "1234.5", "3,000,000": "3000000", "3.000.000": "3000000", "1'234.5": "1234.5",
    "5 000": "5000", "1,234,567.25": "1234567.25", "0,3": "0.3", "0,300": "0.300", "12,34": "12.34", "1,5e3": "1.5e3",
    "3_000": "3000",
}  # fmt: skip
"""Numbers that are refused, and how to write them."""


@pytest.mark.parametrize("unit", ["rpm", "MPa", "mm", "kg m^2", "/min", "%", ""])
def test_three_digits_behind_one_sign_are_refused_with_both_readings(unit):
    for text in DOUBTFUL:
        digits = text.replace(",", ".")
        with pytest.raises(UnitError) as caught:
            to_si(f"{text} {unit}", "m")
        rest = f" {unit}" if unit else ""
        assert caught.value.reason == f"may be {digits}{rest} or {re.sub('[.,]', '', text)}{rest}"
        for written in caught.value.remedy.removeprefix("Write ").split(" or "):
            number = written.removesuffix(rest)
            assert float(number) in (float(digits), float(digits.replace(".", "")))
            assert to_si(f"{number} mm", "m") == pytest.approx(1e-3 * float(number))


@pytest.mark.parametrize("text", PLAIN)
def test_numbers_that_are_no_riddle_are_read(text):
    assert to_si(f"{text} mm", "m") == pytest.approx(1e-3 * PLAIN[text], rel=1e-15)


@pytest.mark.parametrize("text", MENDED)
def test_signs_between_digits_are_answered_with_the_number(text):
    with pytest.raises(UnitError) as caught:
        to_si(f"{text} mm", "m")
    assert f": {MENDED[text]} mm" in caught.value.remedy
    assert to_si(f"{MENDED[text]} mm", "m") > 0.0


def both(call, *arguments) -> None:
    """A call is refused with both readings of 3,000 or 3.000."""
    with pytest.raises(InputError) as caught:
        call(*arguments)
    assert "3.000 rpm or 3000 rpm" in str(caught.value)


@pytest.mark.parametrize("number", ["3,000", "3.000"])
def test_every_place_names_both_readings(number, tmp_path):
    """Scene, override, range of a study, axis of a map, unknown of an identification, cell of a table."""
    scene = load_scene(SCENE)
    text = f"{number} rpm"
    both(load_scene, SCENE, [f"drive.speed={text}"])
    both(load_scene, SCENE, [f'drive.speed="{text}"'])
    both(scene.with_, {"drive.speed": text})
    both(scene.with_, {"study.variables.n": {"path": "drive.speed", "range": [text, "5000 rpm"]}})
    both(axis, scene, f"drive.speed={text}:5000 rpm:4")
    both(Unknown.of, scene, f"drive.speed={text}:5000 rpm")
    table = tmp_path / "points.csv"
    table.write_text(f"C;drive.speed\n0.0003;{text}\n", encoding="utf-8")
    both(read_points, table, scene)


TABLES = {
    "time": (by_time("N"), "s"), "angle": (by_angle("N"), "rad"), "motion": (by_time("rad", "angle", fewest=4), "s"),
    "distance": (Pairs("m", "N"), "m"),
}  # fmt: skip


@pytest.mark.parametrize("kind", TABLES)
def test_one_number_with_decimals_decides_what_the_point_of_a_table_is(kind):
    """2.0005 s has a decimal point, so 2.001 s of another row has one, and 1.250 N beside it."""
    table, first = TABLES[kind]
    second = "rad" if kind == "motion" else "N"
    for decided, columns in (
        (True, (["0", "1.250", "2.0005", "2.125"], ["0", "2", "2", "0"])),
        (True, (["0", "1", "2.5", "3"], ["0", "1.250", "-1.250", "0"])),
        (True, (["0", ".5", "2.125", "3.375"], ["0", "2", "1", "0"])),
        (False, (["0", "1.250", "2.125", "3.375"], ["0", "2", "1", "0"])),
        (False, (["0", "1", "2", "3"], ["0", "-1.125", "1", "0"])),
        (False, (["0", "1.500e3", "2000", "2001"], ["0", "1.125", "1", "0"])),
    ):
        rows = [[f"{x} {first}", f"{y} {second}"] for x, y in zip(*columns, strict=True)]
        if decided:
            expected = np.array(columns, dtype=float).T
            np.testing.assert_allclose(table.convert(rows), expected, rtol=1e-15)
        else:
            with pytest.raises(InputError, match=r"may be -?[1-3]\.[0-9]{3} "):
                table.convert(rows)
    low, high = Quantity("m").range(["0.5 mm", "1.250 mm"], "")
    assert (low, high) == (0.5e-3, 1.25e-3)


# ---- widths in percent ------------------------------------------------------------------------------
VARIED = {
    "mechanism.slider.mass": ("300 g", "400 g"),
    "mechanism.rod.inertia": (2e-4, 4e-4),
    "mechanism.rod.mass_center": ("50 mm", "70 mm"),
    "mechanism.crank.length": ("45 mm", "52 mm"),
    "drive.speed": ("4000 rpm", "6000 rpm"),
    "joints.crank_rod.clearance": ("0.2 mm", "0.6 mm"),
    "joints.crank_rod.bearing.youngs_modulus": ("0.4 GPa", "0.6 GPa"),
    "joints.crank_rod.bearing.poisson_ratio": (0.3, 0.4),
    "effects.friction.coefficient": (0.005, 0.02),
    "effects.contact.restitution": (0.5, 0.9),
}
SLIDER_CRANK = load_scene(SCENE.with_name("slider_crank.toml")).with_({"study": None})


@pytest.mark.parametrize("path", VARIED)
@pytest.mark.parametrize("name", ["x", "m3", "C", "long_name_2"])
@pytest.mark.parametrize("row", [
    {"distribution": "uniform", "half_width": "10 %"},
    {"distribution": "truncated-normal", "half_width": "10 percent", "deviation": "5%"},
])  # fmt: skip
def test_a_width_in_percent_follows_the_design_for_any_variable(path, name, row):
    """Whatever its name and unit, with a path of its own or without: of the value that each design has."""
    bounds = VARIED[path]
    for own in ({}, {"path": path}):
        table = {
            "variables": {name: {"path": path, "range": list(bounds)}},
            "random": {name: {**row, **own}},
            "samples": 64,
        }
        study = SLIDER_CRANK.with_({"study": table}).study
        low, high = study.variable(name).bounds
        for value in (low, 0.5 * (low + high), high):
            law = study.law(study.random_input(name), {name: value})
            assert law.span == pytest.approx((-0.1 * value, 0.1 * value))


def test_a_width_in_percent_of_a_number_the_study_does_not_vary_is_of_the_scene():
    table = {
        "variables": {"C": {"range": ["0.2 mm", "0.6 mm"]}},
        "random": {
            "mu": {
                "path": "effects.friction.coefficient",
                "distribution": "uniform",
                "half_width": "10 %",
            }
        },
    }
    scene = SLIDER_CRANK.with_({"study": table})
    assert scene.study.random_input("mu").half_width == pytest.approx(0.1 * 0.01)
    assert any("10 % of 0.01" in one.read for one in scene.readings)


# ---- units by kind ----------------------------------------------------------------------------------
ENTRIES = [
    (path, kind, quantity)
    for path, field, kinds in _all_entries()
    if (quantity := _quantity(field))
    for kind in kinds or ("",)
]
TARGETS = sorted({quantity.unit for _, _, quantity in ENTRIES} - {""})


@pytest.mark.parametrize("path", sorted({path for path, _, _ in ENTRIES}))
def test_an_entry_has_the_unit_of_its_own_kind_as_a_study_variable(path):
    """All kinds of rows with all their entries: its own unit is read and printed, every other is refused."""
    for general, kind, quantity in ENTRIES:
        if general != path:
            continue
        concrete = path.replace("*", "own")
        content = {"mechanism": {"loads": {"own": {"kind": kind}}}}
        with of_kinds(content):
            bounds = (quantity.least or 0.0, quantity.most)
            low = max(bounds[0], quantity.above or 0.0) + 0.1
            row = {"name": "x", "path": concrete}
            unit = quantity.unit or "%"
            scale = 100.0 if not quantity.unit else 1.0
            ends = [f"{scale * low:.3} {unit}", f"{scale * (low + 0.05):.3} {unit}"]
            variable = StudyVariable.model_validate({**row, "range": ends})
            assert variable.unit == quantity.unit
            assert variable.range == pytest.approx((low, low + 0.05))
            for other in TARGETS:
                if other == quantity.unit or {other, quantity.unit} <= {"rad/s", "Hz", "1/s"}:
                    continue
                if {other, quantity.unit} <= {"N*m", "J"}:
                    continue
                with pytest.raises(ValueError, match="does not fit"):
                    StudyVariable.model_validate({**row, "range": [f"1 {other}", f"2 {other}"]})
        assert quantities()[concrete].unit == quantity.unit  # of the scene read last


ROWS = {
    "spring": (
        {"first": "lever.b", "second": "ground.o", "length": "100 mm"},
        {"stiffness": "N/m", "damping": "N*s/m"},
    ),
    "torsion-spring": ({"body": "lever"}, {"stiffness": "N*m/rad", "damping": "N*m*s/rad"}),
    "cylinder": ({"first": "lever.b", "second": "ground.o", "force": "3 N"}, {"damping": "N*s/m"}),
}
QUICK_RETURN = load_scene(JOBS / "linkages" / "quick_return.toml").with_({"study": None})


@pytest.mark.parametrize(
    ("kind", "entry"), [(kind, entry) for kind, (_, own) in ROWS.items() for entry in own]
)
def test_a_load_s_entry_is_read_and_printed_in_the_unit_of_its_kind(kind, entry, tmp_path):
    """By a study's path, a map's axis, a heading and an unknown, whatever other scenes of this process have under that name."""
    row, units = ROWS[kind]
    path, unit = f"mechanism.loads.own.{entry}", units[entry]
    given = {**row, "kind": kind, **{one: f"2 {units[one]}" for one in units}}
    table = {
        "variables": {"own": {"path": path, "range": [f"1 {unit}", f"1e3 {unit}"]}},
        "samples": 40,
    }
    scene = QUICK_RETURN.with_({"mechanism.loads.own": given, "study": table})
    for other in {"spring", "torsion-spring"} - {kind}:
        others = {one: f"2 {its}" for one, its in ROWS[other][1].items()}
        wrong = {"kind": other, **ROWS[other][0], **others}
        QUICK_RETURN.with_({"mechanism.loads.own": wrong})
    assert scene.unit(path) == scene.study.variable("own").unit == unit
    assert axis(scene, f"{path}=1 k{unit}:2 k{unit}:2")[2] == pytest.approx([1e3, 2e3])
    assert Unknown.of(scene, f"{path}=1 k{unit}:2 k{unit}").upper == pytest.approx(2e3)
    wrong = "N/m" if "m" in unit.partition("/")[0] else "N*m/rad"
    for call in (axis, Unknown.of):
        with pytest.raises(InputError, match="does not fit"):
            call(scene, f"{path}=1 {wrong}:2 {wrong}" + (":2" if call is axis else ""))
    place = tmp_path / "points.csv"
    place.write_text(f"own [k{unit}]\n0.5\n", encoding="utf-8")
    assert read_points(place, scene).values[0, 0] == pytest.approx(500.0)


# ---- units of our own table -------------------------------------------------------------------------
def test_units_are_those_of_a_registry_beside_this_package():
    """Pint knows most of them: the same size and dimensions. What its versions differ in is refused."""
    from pint import UndefinedUnitError, UnitRegistry

    registry, compared = UnitRegistry(), 0
    for name, (size, powers) in (UNITS | OTHERS).items():
        if name in ("%", "‰", "PS", "dimensionless") or name in (
            "prads",
            "Trads",
        ):  # of another meaning there
            continue
        try:
            found = registry.Quantity(1.0, name).to_root_units()
        except UndefinedUnitError:
            continue
        expected = registry.UnitsContainer({base: float(power) for base, power in powers.items()})
        assert found.magnitude == pytest.approx(float(size), rel=1e-9), name
        assert found.units._units == expected, name
        compared += 1
    assert compared > 500
    assert not (UNITS | OTHERS).keys() & REFUSED.keys()


@pytest.mark.parametrize(
    "name",
    ["furlong", "chain", "rod", "quarter", "drachm", "pond", "ton", "Da", "bohr", "oersted", "LMH"],
)
def test_units_that_are_read_differently_are_refused(name):
    """Found by comparing all units of pint 0.24.4 with 0.25.3 and survey feet with international ones."""
    for target in ("m", "kg", "N", ""):
        with pytest.raises(UnitError):
            to_si(f"3 {name}", target)
