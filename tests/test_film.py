"""Oil films: the laws against closed forms and quadrature, and joints that carry oil."""

import math

import film_by_quadrature as quadrature
import numpy as np
import pytest

from hpcclear.dynamics.physics import film

ECCENTRICITIES = [1e-3, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 0.99]


def steady(force, eccentricity):
    """Load and attitude angle of a journal at rest that turns at 1 rad/s in a bearing that does not, over their scales."""
    w = (0.0, -0.5 * eccentricity)
    fx, fy = force(1, 1.0, (eccentricity, 0.0), w, 1.0 - eccentricity**2)
    return math.hypot(fx, fy), math.atan2(fy, -fx)


@pytest.mark.parametrize("e", ECCENTRICITIES)
def test_short_bearing_carries_what_ocvirk_says(e):
    """W = mu omega R L^3/c^2 e sqrt(16 e^2 + pi^2 (1 - e^2))/(4 (1 - e^2)^2)."""
    load, attitude = steady(film.short_force, e)
    expected = e / (4 * (1 - e**2) ** 2) * math.sqrt(16 * e**2 + math.pi**2 * (1 - e**2))
    assert load == pytest.approx(expected, rel=1e-10)
    assert attitude == pytest.approx(math.atan(math.pi * math.sqrt(1 - e**2) / (4 * e)), rel=1e-10)


@pytest.mark.parametrize("e", ECCENTRICITIES)
def test_long_bearing_carries_what_sommerfeld_says(e):
    """With half the film: W = 6 mu omega L R^3/c^2 e sqrt(4 e^2 + pi^2 (1 - e^2))/((2 + e^2)(1 - e^2))."""
    load, attitude = steady(film.long_force, e)
    root = math.sqrt(4 * e**2 + math.pi**2 * (1 - e**2))
    assert 12 * load == pytest.approx(6 * e * root / ((2 + e**2) * (1 - e**2)), rel=1e-10)
    assert attitude == pytest.approx(math.atan(math.pi * math.sqrt(1 - e**2) / (2 * e)), rel=1e-10)


@pytest.mark.parametrize("model", ["short", "long"])
def test_forces_are_those_of_the_pressure_above_ambient(model):
    """Any eccentricity and any velocity, wedge and squeeze together."""
    rng = np.random.default_rng(7)
    law = getattr(film, f"{model}_force")
    for eccentricity in (0.0, *rng.uniform(0.0, 0.95, 30)):
        angle = rng.uniform(0.0, 2.0 * math.pi)
        e = eccentricity * np.array([math.cos(angle), math.sin(angle)])
        w = rng.normal(size=2) * 10.0 ** rng.uniform(-6, 3)
        force = np.array(law(1, 1.0, tuple(e), tuple(w), 1.0 - eccentricity**2))
        expected = getattr(quadrature, model)(e, w)
        assert np.abs(force - expected).max() <= 1e-8 * np.hypot(*expected)
        assert force @ w < 0.0  # it takes energy away


@pytest.mark.parametrize("model", ["short", "long"])
def test_a_film_at_rest_or_centred_has_no_odd_direction(model):
    law = getattr(film, f"{model}_force")
    assert law(1, 1.0, (0.3, -0.2), (0.0, 0.0), 0.87) == (0.0, 0.0)
    fx, fy = law(1, 1.0, (0.0, 0.0), (0.6, -0.8), 1.0)
    assert (fx, fy) == pytest.approx((-math.pi / 2 * 0.6, math.pi / 2 * 0.8), rel=1e-13)


def test_a_journal_that_leaves_the_wall_is_hardly_held():
    """Terms that are each 1e6 times larger cancel: what is left is still the quadrature's."""
    e, w = np.array([0.998, 0.0]), np.array([-1.0, 1e-3])
    force = np.array(film.short_force(1, 1.0, tuple(e), tuple(w), 1.0 - 0.998**2))
    assert force == pytest.approx(quadrature.short(e, w), rel=1e-7)


def test_the_angle_of_the_half_circle():
    for psi in np.linspace(1e-3, math.pi - 1e-3, 300):
        for r in (0.1, 1.0):
            found = film.half_circle_angle(-r * math.cos(psi), r * math.sin(psi), r)
            assert found == pytest.approx(psi, rel=1e-12)


def test_a_film_gets_no_thinner_than_the_roughness():
    """From the depth itself to the floor without a kink."""
    floor = 0.01
    for depth in (1.0, 0.3, 0.021):
        assert film.film_thickness(depth, floor) == pytest.approx(depth, rel=1e-14)
    for depth in (0.0, -0.5):
        assert film.film_thickness(depth, floor) == floor
    depth = np.linspace(-0.01, 0.04, 5001)
    seen = np.array([film.film_thickness(d, floor) for d in depth])
    slope = np.diff(seen) / np.diff(depth)
    assert (slope >= -1e-9).all() and slope.max() < 1.0 + 1e-9
    assert np.abs(np.diff(slope)).max() < 1.01 * (depth[1] - depth[0]) / (2.0 * floor)
