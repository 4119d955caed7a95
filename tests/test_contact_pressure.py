"""Peak pressure and contact angle of each sample: those of its own clearance, as objectives, constraints and columns."""

from pathlib import Path

import numpy as np
import pytest

from hpcclear import evaluate, load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.laws import laws, numbers
from hpcclear.laws.hertz_contact import dundurs

COMPRESSOR = Path(__file__).parents[1] / "jobs" / "compressor.toml"
CLEARANCE = "joints.crank_rod.clearance"
"""Of the crank pin, m: the design variable of these tests."""
HERTZ_SPHERE = {"law": "hunt-crossley", "damping": 0.5}


def short(changes=None):
    """The compressor over two revolutions."""
    numerics = {"transient_revolutions": 1, "averaged_revolutions": 1, "objective": None}
    changes = {f"numerics.{key}": value for key, value in numerics.items()} | (changes or {})
    return load_scene(COMPRESSOR).with_(changes)


def expected(scene, clearance, force):
    """Pressure and half angle of the crank pin by the formulae of the plane problem."""
    pin = scene.joints.crank_rod
    moduli, ratios = (
        [getattr(one, name) for one in (pin.bearing, pin.journal)]
        for name in ("youngs_modulus", "poisson_ratio")
    )
    alpha, beta = dundurs(moduli, ratios)
    given = {
        "force": force, "clearance": clearance, "bearing_radius": pin.bearing_radius, "length": pin.length,
        "compliance": sum((1.0 - nu**2) / e for e, nu in zip(moduli, ratios, strict=True)),
        "dundurs_alpha": alpha, "dundurs_beta": beta,
    }  # fmt: skip
    line = laws("geometry")["line"]
    return [numbers.evaluate(one, given) for one in (line.pressure, line.half_angle)]


def test_samples_have_the_pressures_of_their_own_clearances():
    """A sample of the scene's own clearance is its response, bit for bit; the others have their own formulae."""
    scene = short()
    clearances = np.array([scene.number(CLEARANCE), 4e-5, 1e-4])
    found = evaluate(scene, {CLEARANCE: clearances})
    forces = found["peak_contact_force"].sel(joint="crank_rod").to_numpy()
    pressures, angles = expected(scene, clearances, forces)
    at_pin = found.sel(joint="crank_rod")
    np.testing.assert_allclose(at_pin["peak_contact_pressure"], pressures, rtol=1e-12)
    np.testing.assert_allclose(at_pin["contact_half_angle"], angles, rtol=1e-12)
    assert len(set(pressures)) == 3
    alone = simulate(scene)
    for name in ("peak_contact_pressure", "contact_half_angle"):
        np.testing.assert_array_equal(alone[name], found[name].isel(sample=0))
    assert found["peak_contact_pressure"].attrs["units"] == "Pa"


@pytest.mark.parametrize("name", ["peak-contact-pressure", "contact-half-angle"])
def test_they_are_objectives_with_a_half_width(name):
    scene = short({"numerics.objective": name})
    found = evaluate(scene, {CLEARANCE: [3e-5]})
    field = name.replace("-", "_")
    assert float(found["objective"][0]) == found[field].to_numpy().max()
    alone = simulate(scene.with_({CLEARANCE: 3e-5}))
    assert float(alone["objective"]) == float(found["objective"][0])
    assert 0.0 <= float(alone["objective_uncertainty"]) < np.inf


def test_a_sphere_has_no_pressure():
    found = evaluate(short({"effects.contact": HERTZ_SPHERE}), {CLEARANCE: [3e-5]})
    assert "peak_contact_pressure" not in found
    with pytest.raises(InputError, match="geometry of contact with a pressure"):
        short({"effects.contact": HERTZ_SPHERE, "numerics.objective": "peak-contact-pressure"})
