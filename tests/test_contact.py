"""Contact and friction laws: restitution, published factors, dimensions, shapes."""

import math
from types import SimpleNamespace

import numpy as np
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_lane import PLAIN
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from hpcclear.dynamics.physics import contact, friction

LATCHED = sorted(contact.LATCHED_LAWS)
UNITS = pint.UnitRegistry()
Q = UNITS.Quantity


def rebound(damping, mass=0.3, stiffness=5e9, speed=1.7):
    """Rebound over approach speed of a mass that strikes a wall with one of the latched laws."""

    def motion(t, y):
        force = contact.normal_force(None, 1, stiffness, damping, max(y[0], 0.0), y[1], 1 / speed)
        return [y[1], -force / mass]

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


def relation(e, a):
    """Zero for the rebound ratio e of F = K d^n (1 + a d'/d'_0), whatever K, n and mass."""
    return a - math.log1p(a) + a * e + math.log1p(-a * e)


@pytest.mark.parametrize("restitution", [0.3, 0.5, 0.9])
@pytest.mark.parametrize("law", LATCHED)
def test_free_impact_obeys_the_restitution_relation(law, restitution):
    a = contact.LATCHED_LAWS[law](restitution)
    e = rebound(a)
    exact = brentq(relation, 1e-9, min(1.0, 1 / a) * (1 - 1e-15), args=(a,), xtol=1e-14)
    assert e == pytest.approx(exact, abs=1e-6)


def test_lankarani_nikravesh_asked_for_a_half_returns_0_725():
    """The law is exact only near 1 (method: K, mass and exponent do not matter)."""
    a = contact.lankarani_nikravesh(0.5)
    assert rebound(a) == pytest.approx(0.725, abs=5e-4)
    assert rebound(a, mass=2.0, stiffness=1e8, speed=0.2) == pytest.approx(rebound(a), abs=1e-7)


@pytest.mark.parametrize("law", LATCHED)
def test_perfect_restitution_has_no_damping(law):
    assert contact.LATCHED_LAWS[law](1.0) == 0.0


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
        assert contact.LATCHED_LAWS[law](restitution) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("law", ["flores", "gonthier", "hu-guo"])
def test_laws_for_soft_contacts_stop_nearly_everything(law):
    """Laws that divide by c_e send the rebound to 0 with it; Lankarani-Nikravesh does not."""
    assert rebound(contact.LATCHED_LAWS[law](0.1)) < 0.15
    assert rebound(contact.lankarani_nikravesh(0.1)) > 0.5


@settings(deadline=None)  # the first call compiles
@given(
    depth=st.floats(0, 1e-3),
    rate=st.floats(-50, 50),
    damping=st.floats(0, 5),
    speed=st.floats(1e-3, 50),
)
def test_a_contact_never_pulls_and_touches_softly(depth, rate, damping, speed):
    for fixed, latched in ((None, None), (1, None), (None, 1)):
        force = contact.normal_force(fixed, latched, 3e9, damping, depth, rate, 1 / speed)
        assert force >= 0.0
        assert contact.normal_force(fixed, latched, 3e9, damping, 0.0, rate, 1 / speed) == 0.0


def test_hertz_is_the_cited_form():
    """Eq. 4 with R_J under the root: 4 / (3 (h_B + h_J)) sqrt(R_B R_J / c), the paper's materials."""
    h = [contact.reduced_compliance(E, nu) for E, nu in ((0.5e9, 0.38), (206.8e9, 0.29))]
    K = contact.contact_stiffness(*h, 0.02, 0.05e-3)
    expected = 4 / 3 / (0.8556 / 0.5e9 + 0.9159 / 206.8e9) * math.sqrt(0.02 * 0.01995 / 5e-5)
    assert pytest.approx(expected, rel=1e-12) == K
    assert contact.elastic_force(K, 1e-4) == pytest.approx(K * 1e-6, rel=1e-14)


@pytest.fixture
def with_units(monkeypatch):
    """The laws' own source run on quantities: compiled parts replaced by the Python they are made of."""
    for module, names, limits in (
        (contact, ("elastic_force", "damping_factor", "normal_force"), ("no_less",)),
        (friction, ("saturated", "share_of", "friction_ratio"), ("no_less", "no_more")),
    ):
        for name in names:
            monkeypatch.setattr(module, name, getattr(module, name).py_func)
        for name in limits:
            monkeypatch.setattr(module, name, PLAIN[getattr(module, name)])
        roots = SimpleNamespace(
            sqrt=lambda q: q**0.5,
            copysign=lambda x, y: x * np.sign(Q(y).magnitude),
        )
        monkeypatch.setattr(module, "math", roots)


FORMS = {
    "hertz": (None, None, Q(0.0, ""), Q(1.0, "")),
    "hunt-crossley": (1, None, Q(0.5, "s/m"), Q(1.0, "")),
}


def stiffness():
    h = contact.reduced_compliance(Q(0.5, "GPa"), 0.38)
    return contact.contact_stiffness(h, h, Q(20, "mm"), Q(0.3, "mm"))


@pytest.mark.parametrize("law", [*FORMS, *LATCHED])
def test_every_normal_law_takes_si_and_returns_newtons(with_units, law):
    if law in FORMS:
        fixed, latched, damping, inverse = FORMS[law]
    else:
        fixed, latched, damping = None, 1, contact.LATCHED_LAWS[law](Q(0.9, ""))
        inverse = 1 / Q(2.0, "m/s")
    force = contact.normal_force(
        fixed, latched, stiffness(), damping, Q(0.1, "mm"), Q(0.3, "m/s"), inverse
    )
    newtons = force.to("N").magnitude
    factor = 1 + 0.3 * {"hertz": 0.0, "hunt-crossley": 0.5}.get(law, Q(damping).magnitude / 2)
    assert newtons == pytest.approx(stiffness().to("N/m**1.5").magnitude * 1e-6 * factor, rel=1e-12)


def test_a_factor_of_the_wrong_dimension_is_noticed(with_units):
    """The check above can fail: a damping in s^2/m does not fit."""
    with pytest.raises(pint.DimensionalityError):
        contact.normal_force(
            1, None, stiffness(), Q(0.5, "s**2/m"), Q(0.1, "mm"), Q(0.3, "m/s"), 1.0
        )


@pytest.mark.parametrize(("coulomb", "ambrosio"), [(1, None), (None, 1)])
def test_every_friction_law_takes_si_and_returns_a_fraction(with_units, coulomb, ambrosio):
    speeds = {"dead_speed": Q(0.1, "cm/s"), "inverse_ramp": 1 / Q(1, "cm/s")}
    ratio = friction.friction_ratio(
        coulomb, ambrosio, Q(0.01, ""), *speeds.values(), Q(0.5, "cm/s")
    )
    expected = 0.005 if coulomb else 0.004
    assert (ratio * Q(100, "N")).to("N").magnitude == pytest.approx(100 * expected, rel=1e-12)


@settings(deadline=None)  # the first call compiles
@given(speed=st.floats(-10, 10), mu=st.floats(0, 1))
def test_friction_opposes_sliding_and_is_full_beyond_the_ramp(speed, mu):
    for coulomb, ambrosio, full in ((1, None, 0.01), (None, 1, 0.011)):
        ratio = friction.friction_ratio(coulomb, ambrosio, mu, 1e-3, 100.0, speed)
        assert ratio * speed >= 0.0
        # 1 + |x| - |x - 1| cancels what lies beyond the ramp, x up to 1000 here: 1000 roundings
        assert abs(ratio) <= mu * (1 + 1e-12)
        if abs(speed) >= full:
            assert abs(ratio) == pytest.approx(mu, rel=1e-12)
    assert friction.friction_ratio(None, 1, mu, 1e-3, 100.0, 0.5e-3) == 0.0
    assert friction.friction_ratio(None, None, mu, 1e-3, 100.0, speed) == 0.0
