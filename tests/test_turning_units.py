"""Every spelling of an angular speed, a frequency and an angle in every entry, against factors worked out by hand."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from commands import overrides, run
from running import scene_with

from hpcclear.base.units import UnitError, noting, to_si
from hpcclear.ensemble.maps import axis
from hpcclear.scene import load_scene
from hpcclear.scene.numerics import Numerics
from hpcclear.scene.paths import _entries, _quantity, quantities
from hpcclear.scene.points import read_points

JOBS = Path(__file__).parent.parent / "jobs"
TURN = 2.0 * math.pi

BY_TIME = {
    "min^-1": 1 / 60, "min**-1": 1 / 60, "min⁻¹": 1 / 60, "1/min": 1 / 60, "/min": 1 / 60, "s^-1": 1.0, "1/s": 1.0, "s⁻¹": 1.0,
    "1/h": 1 / 3600, "h^-1": 1 / 3600, "ms^-1": 1000.0, "1/minute": 1 / 60,
}  # fmt: skip
"""Turns a second where nothing says what is counted."""
NAMEPLATE = {unit: turns for unit, turns in BY_TIME.items() if "min" in unit}
"""Of these, what an angular speed may have: others may be radians."""
OF_TURNS = {
    "rpm": 1 / 60, "rps": 1.0, "turn/s": 1.0, "turn/min": 1 / 60, "cycle/s": 1.0, "cycle/min": 1 / 60, "revolution/s": 1.0,
    "revolution/min": 1 / 60, "rev/min": 1 / 60, "r/min": 1 / 60, "U/min": 1 / 60, "tr/min": 1 / 60, "turn*s^-1": 1.0,
    "deg/s": 1 / 360, "deg/min": 1 / 21600, "grad/s": 1 / 400, "rad/s": 1 / TURN, "mrad/s": 1e-3 / TURN,
    "rad/min": 1 / 60 / TURN, "krad/s": 1e3 / TURN, "arcmin/s": 1 / 21600,
}  # fmt: skip
"""Turns a second of an angular speed."""
IN_HERTZ = {"Hz": 1.0, "kHz": 1e3, "mHz": 1e-3}
ANGLES = {"rad": 1 / TURN, "mrad": 1e-3 / TURN, "deg": 1 / 360, "°": 1 / 360, "turn": 1.0, "revolution": 1.0, "grad": 1 / 400,
          "arcmin": 1 / 21600}  # fmt: skip
OTHERS = (
    "count/s",
    "cps",
    "Bq",
    "%",
    "m/s",
    "mm/m",
    "bit/s",
    "N*m/rad",
    "rad/s^2",
    "rad^2/s",
    "turn^2",
    "kg",
)
"""Neither an angle nor a speed of one."""

TARGETS = sorted(
    {q.unit for q in quantities().values()}
    | {q.unit for _, field, _ in _entries(Numerics, "numerics") if (q := _quantity(field))}
)
EVERY = {**BY_TIME, **OF_TURNS, **IN_HERTZ, **ANGLES}


def by_hand(unit: str, target: str) -> float | None:
    """One `unit` in the target; None where it has to be refused."""
    if target == "rad/s":
        turns = {**NAMEPLATE, **OF_TURNS}.get(unit)
        return None if turns is None else TURN * turns
    if target == "Hz":
        return {**BY_TIME, **OF_TURNS, **IN_HERTZ}.get(unit)
    if target == "1/s":
        return BY_TIME.get(unit)
    if target == "rad":
        return None if unit not in ANGLES else TURN * ANGLES[unit]
    return None


@pytest.mark.parametrize("target", TARGETS)
def test_every_spelling_in_every_unit_of_an_entry(target):
    """Whatever unit entries have: a table of what entries hold, not of what this test knows."""
    number = {"600": 600.0, "-2.5e1": -25.0}
    for unit, (text, value) in itertools.product((*EVERY, *OTHERS), number.items()):
        factor, said = by_hand(unit, target), []
        if factor is None and (unit, target) not in (
            ("%", ""),
            ("m/s", "m/s"),
            ("kg", "kg"),
            ("N*m/rad", "N*m/rad"),
        ):
            with pytest.raises(UnitError) as error:
                to_si(f"{text} {unit}", target)
            assert error.value.remedy, (unit, target)
        elif factor is not None:
            with noting(lambda written, read, said=said: said.append((written, read))):
                found = to_si(f"{text} {unit}", target)
            assert found == pytest.approx(value * factor, rel=1e-15), (unit, target)
            noted = unit in BY_TIME and target == "rad/s"  # nothing else leaves its unit open
            assert bool(said) == noted, (unit, target)
            if noted:
                rpm = value * 60.0 * BY_TIME[unit]
                assert float(said[0][1].split(" rpm")[0]) == pytest.approx(rpm, rel=1e-5)


@pytest.mark.parametrize(
    "target", [one for one in TARGETS if one not in ("", "Hz") and "rad" not in one]
)
def test_no_angle_hides_in_another_quantity(target):
    """2 pi or 57.3 lie between N m and N m/turn or N m/deg."""
    for angle in ("rad", "deg", "turn"):
        for text in (f"1 {target}*{angle}", f"1 {target}/{angle}"):
            with pytest.raises(UnitError):
                to_si(text, target)


TORQUE = {
    "kind": "torque",
    "torque": 5.0,
    "initial_speed": 0.0,
    "expected_speed": 30.0,
    "no_load_speed": 90.0,
}


SOME = {"rpm": 1 / 60, "turn/s": 1.0, "deg/s": 1 / 360, "rad/s": 1 / TURN}


@pytest.mark.parametrize(("unit", "turns"), [*NAMEPLATE.items(), *SOME.items()])
def test_entries_ranges_distributions_headings_and_axes_read_alike(unit, turns, tmp_path):
    speed = 600.0 * turns * TURN
    low, high = f"600 {unit}", f"900 {unit}"
    base = load_scene(JOBS / "slider_crank.toml")
    study = {
        "study.variables.v": {"path": "drive.speed", "range": [low, high]},
        "study.random.v": {
            "path": "drive.speed", "distribution": "truncated-normal",
            "mean": f"750 {unit}", "deviation": f"50 {unit}", "half_width": f"90 {unit}",
        },
    }  # fmt: skip
    scene = base.with_({"drive.speed": low, **study})
    assert scene.number("drive.speed") == pytest.approx(speed, rel=1e-15)
    assert scene.study.variable("v").range == pytest.approx((speed, 1.5 * speed), rel=1e-15)
    row = scene.study.random_input("v")
    expected = (1.25 * speed, speed / 12.0, 0.15 * speed)
    assert (row.mean, row.deviation, row.half_width) == pytest.approx(expected, rel=1e-15)
    written = load_scene(JOBS / "quickstart.toml", [f"drive.speed={low}"])
    assert written.number("drive.speed") == scene.number("drive.speed")
    assert bool(written.readings) == (unit in NAMEPLATE)
    assert {one.entry for one in written.readings} <= {"drive.speed"}
    torque = scene_with({"drive": {**TORQUE, **{k: low for k in TORQUE if k.endswith("_speed")}}})
    for name in ("initial_speed", "expected_speed", "no_load_speed"):
        assert torque.number(f"drive.{name}") == pytest.approx(speed, rel=1e-15)
    table = tmp_path / "points.csv"
    table.write_text(f"drive.speed [{unit}]\n600\n900\n", encoding="utf-8")
    assert read_points(table, base).values[:, 0] == pytest.approx([speed, 1.5 * speed], rel=1e-15)
    _, _, values = axis(base, f"drive.speed={low}:{high}:2")
    np.testing.assert_allclose(values, [speed, 1.5 * speed], rtol=1e-15)


def test_turns_and_radians_are_not_guessed():
    """One rule for whatever counts by time without a name: Hz, 1/s, 1/h."""
    for unit in (*IN_HERTZ, *(BY_TIME.keys() - NAMEPLATE.keys())):
        with pytest.raises(UnitError) as error:
            to_si(f"50 {unit}", "rad/s")
        assert error.value.remedy.startswith(f"{unit} may count turns or radians")


MOTOR = "drive={kind='torque', torque=5.0, initial_speed='60 rpm', expected_speed='1200 min^-1', no_load_speed='30 turn/s'}"


@pytest.mark.parametrize(
    ("job", "settings", "shown"),
    [
        ("slider_crank.toml", ["drive.speed='600 min^-1'"],
         ["drive.speed: 600 min^-1 (600 rpm)", "'600 min^-1' is read as 600 rpm"]),
        ("slider_crank.toml", [MOTOR],
         ["drive.initial_speed: 60 rpm", "drive.expected_speed: 1200 min^-1 (1200 rpm)",
          "drive.no_load_speed: 30 turn/s (1800 rpm)",
          "drive.expected_speed: '1200 min^-1'"]),
        ("linkages/three_rrr.toml", [], ["servo0.frequency: 10 Hz", "servo1.frequency: 20 Hz", "servo2.frequency: 10 Hz"]),
        ("linkages/press.toml", [], ["speed: 300 rpm"]),
        ("tolerances.toml", [], ["random C12, u2, m3; lowest cost, 95th percentile of f; 95th percentile of f at most 1.5 kN"]),
    ],
)  # fmt: skip
def test_check_prints_every_speed_and_every_frequency(job, settings, shown):
    code, output = run(
        ["check", str(JOBS / job), "--no-cost", "--details", *overrides(*settings)], 0
    )
    assert code == 0, output
    for text in shown:
        assert text in " ".join(output.split())
