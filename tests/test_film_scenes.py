"""Scenes whose joints carry oil: energy, hard cases, both ways to write a slider-crank, what is refused and what is told."""

import numpy as np
import pytest
from refusals import refused
from running import SCENE, closes, run, scene_with

from hpcclear import simulate
from hpcclear.base.outcome import Status
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import implicit_method
from hpcclear.scene import load_scene
from hpcclear.scene.points import Points

JOINTS = ("crank_rod", "rod_slider")
OIL = {"viscosity": "10 mPa*s", "length": "20 mm", "model": "short"}


def oiled(rtol=1e-6, clearance="0.1 mm", joints=JOINTS, **film):
    """The paper's slider-crank with oil in its joints, two revolutions from the start."""
    changes = {f"joints.{joint}.film": OIL | film for joint in joints}
    changes |= {f"joints.{joint}.clearance": clearance for joint in JOINTS}
    return scene_with(changes | {"numerics.energy": True}, 2, rtol)


# ---- hard cases: each ends as it says, and its energy closes ---------------------------------------------


@pytest.mark.parametrize("model", ["short", "long", "finite"])
@pytest.mark.parametrize("clearance", ["0.02 mm", "0.3 mm"])
@pytest.mark.shortened(3)
def test_any_oil_ends_in_a_stated_way_and_keeps_the_energy_balance(model, clearance):
    """Viscosities from 1e-4 to 10 Pa s: from joints that strike through the film to such that creep in it."""
    for viscosity in (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0):
        scene = oiled(model=model, clearance=clearance, viscosity=viscosity)
        closes(scene)


@pytest.mark.parametrize("eccentricity", [0.99, 0.9999, 1.0, 1.02])
@pytest.mark.shortened(2)
def test_a_start_in_the_thinnest_film_or_in_contact(eccentricity):
    scene = oiled(viscosity=1e-3, clearance="0.2 mm")
    start = [eccentricity * 2e-4, 0.0]
    scene = scene.with_({f"joints.{joint}.start_eccentricity": start for joint in JOINTS})
    closes(scene)


@pytest.mark.parametrize("roughness", ["0.1 um", "1 um", "50 um"])
@pytest.mark.shortened(1)
def test_film_and_contact_at_once(roughness):
    """So little oil that the journal meets its bearing through it: contact joins in, and nothing jumps."""
    scene = oiled(viscosity=1e-4, clearance="0.3 mm", length="0.5 mm", roughness=roughness)
    assert (closes(scene).out.deepest[:2] > 1e-6).all()


@pytest.mark.parametrize(
    ("speed", "viscosity"), [("50 rpm", 0.01), ("5 rpm", 0.01), ("5 rpm", 1.0)]
)
def test_slow_bearings_take_few_steps_and_show_their_peaks_between_them(speed, viscosity):
    """Explicit steps are held up by the oil for ever; and a film multiplies what velocities between two steps are off by."""
    scene = oiled(viscosity=viscosity, clearance="0.02 mm")
    response = simulate(scene.with_({"drive.speed": speed, "effects.slider_load": -200.0}))
    assert (int(response.status), response.rhs_evaluations < 60_000) == (Status.OK, True)
    shown = response.contact_force.max("time")
    np.testing.assert_allclose(shown, response.peak_contact_force, rtol=0.01)


# ---- one law, whoever writes it down ------------------------------------------------------------------------


def test_oil_in_one_joint_leaves_the_other_dry():
    scene = oiled(joints=["crank_rod"], viscosity=0.05)
    response = simulate(scene)
    assert int(response["status"]) == Status.OK
    penetration = response["penetration"].to_numpy().max(axis=0)
    assert penetration[0] == 0.0 < penetration[1]


def test_films_of_two_models_and_no_viscosity_at_all():
    """A finite film in one joint, a short one in the other; without viscosity neither is there."""
    dry = oiled(joints=[], clearance="0.3 mm")
    films = {
        f"joints.{joint}.film": OIL | {"model": model}
        for joint, model in zip(JOINTS, ("short", "finite"), strict=True)
    }
    closes(dry.with_(films))
    none = {f"joints.{joint}.film.viscosity": 0.0 for joint in JOINTS}
    calm = {
        "effects.contact": {"law": "hunt-crossley", "damping": 0.5},
        "effects.friction": {"law": "none"},
        "numerics.method": "dormand-prince",
        "numerics.averaged_revolutions": 1,
    }
    off, on = run(dry.with_(calm)), run(dry.with_(films | calm).with_(none))
    np.testing.assert_allclose(on.q[-1], off.q[-1], rtol=0, atol=1e-11)


def test_methods_agree_on_a_film():
    """Explicit steps, implicit ones, and those of order 8."""
    found = {}
    for method in ("dormand-prince", "radau", "prince-dormand"):
        scene = oiled(rtol=1e-9, viscosity=1e-3, clearance="0.3 mm", length="5 mm")
        found[method] = float(run(scene.with_({"numerics.method": method})).out.objective)
    best = found.pop("dormand-prince")
    assert found == {method: pytest.approx(best, rel=1e-6) for method in found}


# ---- the scene file ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entry", "value", "reason"),
    [
        ("viscosity", -1.0, "at least 0"),
        ("viscosity", "10 mm", "does not fit"),
        ("viscosity", 1e6, "at most"),
        ("viscosity", None, "missing"),
        ("length", 0.0, "above 0"),
        ("model", "wide", "not one of the known values"),
        ("roughness", "0.1 mm", "quarter of the clearance"),
        ("temperature", 300.0, "not a known key"),
    ],
)
def test_a_film_that_is_none_is_refused_with_the_reason(entry, value, reason):
    with refused(f"joints.crank_rod.film.{entry}", reason=reason):
        oiled().with_({f"joints.crank_rod.film.{entry}": value})


def test_a_joint_without_play_has_no_film():
    """Or implicit steps of the other one would go by the exponent of smooth motions, friction's ramp or not."""
    first, second = at.JOINTS[0].block, at.JOINTS[1].block
    rows = parameters(scene_with({"joints.rod_slider": {"kind": "ideal"}}))
    assert (rows[:, second + at.FILM_SCALE : second + at.JOINT_ROWS] == 0.0).all()
    rows = parameters(scene_with({"joints.crank_rod": {"kind": "ideal"}}))
    assert (rows[:, first + at.FILM_SCALE : first + at.JOINT_ROWS] == 0.0).all()


def test_a_finite_film_is_for_one_length_over_diameter():
    with refused("joints.crank_rod.film.model", reason="5 long"):
        oiled(model="finite", length="200 mm")
    scene = oiled(model="finite")
    points = Points(("L",), np.array([[0.02], [0.03]]), (("joints.crank_rod.film.length",),))
    with refused("joints.crank_rod.film.model", remedy="film.length"):
        parameters(scene, points)


def test_a_scene_tells_of_its_films():
    scene = oiled()
    assert "short oil film of 10 mPa*s in joint crank_rod" in scene.effects_on()
    assert implicit_method(scene) == "stiff"
    assert not any(".film" in text for text in scene.warnings)
    for film, word in (
        ({"viscosity": 30.0}, "mPa*s"),
        ({"length": "80 mm"}, "2 diameters long"),
        ({"model": "long"}, "0.5 diameters long"),
    ):
        assert any(word in text for text in oiled(**film).warnings)
    assert load_scene(SCENE).films() == {}


def test_numbers_of_a_film_may_be_varied():
    """Each sample has the film of its own viscosity, clearance and length."""
    scene = oiled()
    paths = [f"joints.crank_rod.{name}" for name in ("film.viscosity", "clearance", "film.length")]
    values = np.array(
        [[0.01, 1e-4, 0.02], [0.02, 1e-4, 0.02], [0.01, 2e-4, 0.02], [0.01, 1e-4, 0.04]]
    )
    points = Points(("mu", "C", "L"), values, tuple((path,) for path in paths))
    rows = parameters(scene, points)
    force, shear = (rows[:, at.JOINT_BLOCKS + k] for k in (at.FILM_SCALE, at.FILM_SHEAR))
    assert force == pytest.approx(force[0] * np.array([1, 2, 1 / 8, 8]))
    assert shear == pytest.approx(shear[0] * np.array([1, 2, 0.5, 2]))
