"""What a user wrote is what he reads: the unit and the digits of each entry, wherever it is shown; six digits of others."""

import re
import tomllib
from pathlib import Path

import pytest

from hpcclear import load_scene
from hpcclear.base.errors import InputError
from hpcclear.base.units import factor
from hpcclear.report.figures import labels
from hpcclear.scene.loading import scene_of_text

ROOT = Path(__file__).parent.parent
BASE = tomllib.loads((ROOT / "jobs" / "slider_crank.toml").read_text())

UNITS = {
    "mechanism.rod.length": ("m", ["mm", "cm", "in", "ft"], 0.12),
    "joints.crank_rod.clearance": ("m", ["mm", "um", "in", "thou"], 3e-4),
    "drive.speed": ("rad/s", ["rpm", "deg/s", "rad/s"], 523.6),
    "joints.crank_rod.bearing.youngs_modulus": ("Pa", ["MPa", "GPa", "bar", "psi"], 5e8),
    "mechanism.slider.mass": ("kg", ["g", "lb", "kg"], 0.14),
    "effects.slider_load": ("N", ["N", "kN", "lbf", "kgf"], -200.0),
    "mechanism.rod.inertia": ("kg*m**2", ["kg*mm^2", "lb*in^2"], 2.5e-4),
    "mechanism.crank.mass_center": ("m", ["mm", "in"], 0.025),
    "effects.gravity": ("m/s**2", ["mm/s^2", "ft/s^2"], 9.81),
}
CASES = [(path, unit) for path, (_, units, _) in UNITS.items() for unit in units]
POSITIVE = [(p, u) for p, u in CASES if UNITS[p][0] in ("m", "Pa", "kg") and "center" not in p]


def written(path: str, unit: str) -> tuple[str, str]:
    """Three digits of the usual value in a unit, as an entry and as TOML."""
    si, _, usual = UNITS[path]
    number = f"{usual / float(factor(unit, si)):.3g}"
    return f"{number} {unit}", f"{path}={number} {unit}"


def long_numbers(text: str) -> list[str]:
    """Numbers of more than six digits."""
    numbers = re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e[+-]?\d+)?(?![\w.])", text)
    return [one for one in numbers if len(re.sub(r"e.*|\D", "", one).strip("0")) > 6]


@pytest.mark.parametrize(("path", "unit"), CASES)
def test_an_entry_keeps_its_unit_and_digits(path, unit):
    """In words, in TOML, in a text with values of a file, after other changes, and on pages."""
    text, setting = written(path, unit)
    si = UNITS[path][0]
    scene = load_scene(BASE, [setting])
    value = scene.number(path)
    assert scene.shown(path) == text
    changed = scene.with_({"numerics.rtol": 1e-7})
    for one in (scene, changed, scene_of_text(scene.text, "file")):
        words = " ".join((*one.effects_on(), *one.warnings))
        assert long_numbers(words) == []
    for one in (scene, changed):
        assert f'"{text}"' in one.to_toml()
        assert load_scene(tomllib.loads(one.to_toml())) == one
    half = scene.shown(path, 0.73 * value)
    assert half.endswith(f" {unit}")
    assert long_numbers(half) == []
    with labels.in_units_of(scene.text):
        assert labels.quantity(value, si) == text


@pytest.mark.parametrize("length", ["in", "ft", "cm"])
@pytest.mark.parametrize("force", ["lbf", "kgf"])
def test_pages_are_in_the_system_of_the_user(length, force):
    """Lengths, speeds, forces and moduli that nobody wrote are in his units; those of SI in a readable size."""
    sizes = {"length": length, "force": force, "speed": "rpm", "modulus": "psi"}
    changes = ["effects.slider_load=-200 N", *written_in(sizes)]
    scene = load_scene(BASE, changes)
    with labels.in_units_of(scene.text):
        assert labels.quantity(1.23e-3, "m").endswith(f" {length}")
        assert labels.quantity(5.0, "N").endswith(f" {force}")
        assert labels.scale("rad/s", [100.0]).unit == "rpm"
        assert labels.scale("Pa", [1e6]).unit == "psi"
    with labels.in_units_of(load_scene(BASE).text):
        assert labels.quantity(1.23e-3, "m") == "1.23 mm"


def written_in(units: dict[str, str]) -> list[str]:
    """Overrides of all entries with a unit of the base scene."""
    of = {"m": "length", "N": "force", "rad/s": "speed", "Pa": "modulus"}
    scene = load_scene(BASE, ["effects.slider_load=-200 N"])
    return [
        f"{path}={float(scene.number(path) / factor(units[of[si]], si)):.6e} {units[of[si]]}"
        for path in scene.numeric_paths()
        if (si := scene.unit(path)) in of and "start" not in path
    ]


@pytest.mark.parametrize(("path", "unit"), POSITIVE)
def test_a_refusal_has_the_units_of_the_user(path, unit):
    """The entry as written, and bounds in its unit."""
    number = written(path, unit)[0].split()[0]
    with pytest.raises(InputError) as caught:
        load_scene(BASE, [f"{path}=-{number} {unit}"])
    said = str(caught.value)
    assert f"'-{number} {unit}'" in said
    assert f"must be above 0 {unit}" in said
    assert long_numbers(said) == []


@pytest.mark.parametrize("radius", ["20 mm", "0.8 in"])
def test_a_plain_number_for_millimetres_is_recognised(radius):
    changes = ["joints.crank_rod.clearance=0.3", f"joints.crank_rod.bearing_radius={radius}"]
    with pytest.raises(InputError) as caught:
        load_scene(BASE, changes)
    said = str(caught.value)
    assert said.startswith("joints.crank_rod.clearance = 0.3: ")
    assert f"({radius})" in said
    assert '0.3 is 300 mm; if mm are meant, write "0.3 mm"' in said


def test_texts_with_files_and_fits_keep_what_was_written(tmp_path):
    (tmp_path / "load.csv").write_text("crank_angle [deg],force [N]\n0,-100\n90,-250\n270,-50\n")
    file = tmp_path / "scene.toml"
    own = (ROOT / "jobs" / "slider_crank.toml").read_text()
    own = own.replace('speed = "5000 rpm"', 'speed = "1470 rpm"')
    own = own.replace("[effects]", '[effects]\nslider_load = { file = "load.csv" }')
    file.write_text(own)
    scene = load_scene(file)
    assert '"1470 rpm"' in scene.text
    assert '"206.8 GPa"' in scene.text
    assert "153.938" not in scene.text
    assert scene_of_text(scene.text, "file") == scene
    fit = load_scene(BASE, ["joints.crank_rod.clearance=0.02 mm", "drive.speed=1470 rpm"])
    assert fit.with_({"joints.crank_rod.fit": "40 H7/f7"}).to_toml().count('"1470 rpm"') == 1
