"""Contact and friction laws: restitution, published factors, dimensions, shapes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from hpcclear.dynamics.contacts.laws import in_lanes
from hpcclear.laws import laws
from hpcclear.laws.checks import check
from hpcclear.laws.friction import ambrosio, coulomb
from hpcclear.laws.hertz_contact import (
    elastic,
    latched_factor,
    reduced_compliance,
    sphere_stiffness,
)
from hpcclear.scene.contacts.pin_in_bearing import PinInBearing

LATCHED = sorted(name for name, law in laws("contact").items() if law.latched)


def factor(law, restitution):
    """a(c_e) of a law."""
    found = laws("contact")[law].once(restitution)["damping"]
    return found


def rebound(damping, mass=0.3, stiffness=5e9, speed=1.7):
    """Rebound over approach speed of a mass that strikes a wall with one of the latched laws."""

    def motion(t, y):
        force = elastic(max(y[0], 0.0), stiffness) * latched_factor(y[1], 1 / speed, damping)
        return [y[1], -max(force, 0.0) / mass]

    def separates(t, y):
        return y[0] + (1.0 if t == 0.0 else 0.0)

    separates.terminal = True
    separates.direction = -1
    # the contact lasts about three times (m^2 / (K^2 v))^(1/5)
    duration = (mass**2 / (stiffness**2 * speed)) ** 0.2
    depth = (mass * speed**2 / stiffness) ** 0.4
    result = solve_ivp(
        motion, (0, 60 * duration), [0.0, speed], method="DOP853", events=separates,
        rtol=1e-11, atol=[1e-12 * depth, 1e-12 * speed], max_step=duration / 10,
    )  # fmt: skip
    return -result.y_events[0][0][1] / speed


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("law", LATCHED)
def test_free_impact_obeys_the_restitution_relation(law, restitution):
    a = factor(law, restitution)
    e = rebound(a)
    most = min(1.0, 1 / a) * (1 - 1e-15)  # of F = K d^n (1 + a d'/d'_0), whatever K, n and mass
    exact = brentq(lambda e: a - math.log1p(a) + a * e + math.log1p(-a * e), 1e-9, most, xtol=1e-14)
    assert e == pytest.approx(exact, abs=1e-6)


def test_lankarani_nikravesh_asked_for_a_half_returns_0_725():
    """The law is exact only near 1 (method: K, mass and exponent do not matter)."""
    a = factor("lankarani-nikravesh", 0.5)
    assert rebound(a) == pytest.approx(0.725, abs=5e-4)
    assert rebound(a, mass=2.0, stiffness=1e8, speed=0.2) == pytest.approx(rebound(a), abs=1e-7)


@pytest.mark.parametrize("law", LATCHED)
def test_perfect_restitution_has_no_damping(law):
    assert factor(law, 1.0) == 0.0


# a(c_e) worked out by hand from the formulas as published
PUBLISHED = {
    "lankarani-nikravesh": {0.9: 0.1425, 0.5: 0.5625},  # 3 (1 - c^2) / 4
    "flores": {0.9: 8 / 45, 0.5: 1.6},  # 8 (1 - c) / (5 c)
    "gonthier": {0.9: 19 / 90, 0.5: 1.5},  # (1 - c^2) / c
    "hu-guo": {0.9: 1 / 6, 0.5: 1.5},  # 3 (1 - c) / (2 c)
    "herbert-mcwhannell": {0.9: 0.6 / 3.64, 0.5: 1.0},  # 6 (1 - c) / ((2 c - 1)^2 + 3)
    "lee-wang": {0.9: 0.075, 0.5: 0.375},  # 3 (1 - c) / 4
}


@pytest.mark.parametrize("law", LATCHED)
def test_damping_factors_are_the_published_ones(law):
    for restitution, expected in PUBLISHED[law].items():
        assert factor(law, restitution) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("law", ["flores", "gonthier", "hu-guo"])
def test_laws_for_soft_contacts_stop_nearly_everything(law):
    """Laws that divide by c_e send the rebound to 0 with it; Lankarani-Nikravesh does not."""
    assert rebound(factor(law, 0.1)) < 0.15
    assert rebound(factor("lankarani-nikravesh", 0.1)) > 0.5


@settings(deadline=None)  # the first call compiles
@given(
    depth=st.floats(0, 1e-3),
    rate=st.floats(-50, 50),
    damping=st.floats(0, 5),
    speed=st.floats(1e-3, 50),
)
def test_a_contact_never_pulls_and_touches_softly(depth, rate, damping, speed):
    par = np.array([3e9, damping])
    for name in ("hertz", "hunt-crossley", "flores"):
        law = in_lanes(laws("contact")[name])
        force = law.force(par, 0, depth, rate, 1 / speed, 1.0, 0, 1)
        assert force >= 0.0
        assert law.force(par, 0, 0.0, rate, 1 / speed, 1.0, 0, 1) == 0.0


def test_hertz_is_the_cited_form():
    """Eq. 4 with R_J under the root: 4 / (3 (h_B + h_J)) sqrt(R_B R_J / c), the paper's materials."""
    h = [reduced_compliance(E, nu) for E, nu in ((0.5e9, 0.38), (206.8e9, 0.29))]
    shape = PinInBearing.shape({"bearing_radius": 0.02, "clearance": 0.05e-3}.get)
    K = sphere_stiffness(*h, shape.radius)
    expected = 4 / 3 / (0.8556 / 0.5e9 + 0.9159 / 206.8e9) * math.sqrt(0.02 * 0.01995 / 5e-5)
    assert pytest.approx(expected, rel=1e-12) == K
    assert elastic(1e-4, K) == pytest.approx(K * 1e-6, rel=1e-14)


@pytest.mark.parametrize("kind", ["contact", "friction"])
def test_our_laws_pass_the_checks_of_users_laws(kind):
    """Units, finiteness, sign and energy, with the parameters below."""
    for name, law in laws(kind).items():
        values = {one.name: VALUES[one.name] for one in law.parameters}
        if name != "none":
            check(law, tuple(values.items()))


VALUES = {
    "force_at": 1e3,
    "depth_at": 2e-6,
    "exponent": 1.5,
    "greatest_damping": 50.0,
    "full_depth": 1e-6,
    "restitution": 0.8,
    "damping": 0.5,
    "coefficient": 0.1,
    "ramp_speed": 0.01,
    "speeds": (0.001, 0.01),
    "static_coefficient": 0.15,
    "stribeck_speed": 0.01,
    "bristle_stiffness": 1e5,
    "bristle_damping": 0.3,
    "viscous_coefficient": 0.02,
}


@settings(deadline=None)  # the first call compiles
@given(speed=st.floats(-10, 10), mu=st.floats(0, 1))
def test_friction_opposes_sliding_and_is_full_beyond_the_ramp(speed, mu):
    for ratio, arguments, full in (
        (coulomb.ratio, (speed, mu, 100.0), 0.01),
        (ambrosio.ratio, (speed, mu, 1e-3, 100.0), 0.011),
    ):
        found = ratio(*arguments)
        assert found * speed >= 0.0
        assert abs(found) <= mu * (1 + 1e-12)
        if abs(speed) >= full:
            assert abs(found) == pytest.approx(mu, rel=1e-12)
    assert ambrosio.ratio(0.5e-3, mu, 1e-3, 100.0) == 0.0
