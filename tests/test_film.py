"""Oil films: the laws against closed forms and quadrature, and joints that carry oil."""

import math
from functools import partial

import film_by_quadrature as quadrature
import numpy as np
import pytest
import rotors

from hpcclear import simulate
from hpcclear.base.outcome import Status
from hpcclear.laws import laws, reynolds as film
from hpcclear.laws.film import finite


def force_by(model, place, w, s2):
    """Force of a film over its scale."""
    return laws("film")[model].force((), 0, 1.0, place, w, s2, 0, 1)


short_force, long_force = (partial(force_by, model) for model in ("short", "long"))
ECCENTRICITIES = [1e-3, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95, 0.99]


def steady(force, eccentricity):
    """Load and attitude angle of a journal at rest that turns at 1 rad/s in a bearing that does not, over their scales."""
    w = (0.0, -0.5 * eccentricity)
    fx, fy = force((eccentricity, 0.0), w, 1.0 - eccentricity**2)
    return math.hypot(fx, fy), math.atan2(fy, -fx)


@pytest.mark.parametrize("e", ECCENTRICITIES)
def test_short_bearing_carries_what_ocvirk_says(e):
    """W = mu omega R L^3/c^2 e sqrt(16 e^2 + pi^2 (1 - e^2))/(4 (1 - e^2)^2)."""
    load, attitude = steady(short_force, e)
    expected = e / (4 * (1 - e**2) ** 2) * math.sqrt(16 * e**2 + math.pi**2 * (1 - e**2))
    assert load == pytest.approx(expected, rel=1e-10)
    assert attitude == pytest.approx(math.atan(math.pi * math.sqrt(1 - e**2) / (4 * e)), rel=1e-10)


@pytest.mark.parametrize("e", ECCENTRICITIES)
def test_long_bearing_carries_what_sommerfeld_says(e):
    """With half the film: W = 6 mu omega L R^3/c^2 e sqrt(4 e^2 + pi^2 (1 - e^2))/((2 + e^2)(1 - e^2))."""
    load, attitude = steady(long_force, e)
    root = math.sqrt(4 * e**2 + math.pi**2 * (1 - e**2))
    assert 12 * load == pytest.approx(6 * e * root / ((2 + e**2) * (1 - e**2)), rel=1e-10)
    assert attitude == pytest.approx(math.atan(math.pi * math.sqrt(1 - e**2) / (2 * e)), rel=1e-10)


@pytest.mark.parametrize("model", ["short", "long"])
def test_forces_are_those_of_the_pressure_above_ambient(model):
    """Any eccentricity and any velocity, wedge and squeeze together."""
    rng = np.random.default_rng(7)
    law = partial(force_by, model)
    for eccentricity in (0.0, *rng.uniform(0.0, 0.95, 30)):
        angle = rng.uniform(0.0, 2.0 * math.pi)
        e = eccentricity * np.array([math.cos(angle), math.sin(angle)])
        w = rng.normal(size=2) * 10.0 ** rng.uniform(-6, 3)
        force = np.array(law(tuple(e), tuple(w), 1.0 - eccentricity**2))
        expected = getattr(quadrature, model)(e, w)
        assert np.abs(force - expected).max() <= 1e-8 * np.hypot(*expected)
        assert force @ w < 0.0  # it takes energy away


@pytest.mark.parametrize("model", ["short", "long"])
def test_a_film_at_rest_or_centred_has_no_odd_direction(model):
    law = partial(force_by, model)
    assert law((0.3, -0.2), (0.0, 0.0), 0.87) == (0.0, 0.0)
    fx, fy = law((0.0, 0.0), (0.6, -0.8), 1.0)
    assert (fx, fy) == pytest.approx((-math.pi / 2 * 0.6, math.pi / 2 * 0.8), rel=1e-13)


def test_a_journal_that_leaves_the_wall_is_hardly_held():
    """Terms that are each 1e6 times larger cancel: what is left is still the quadrature's."""
    e, w = np.array([0.998, 0.0]), np.array([-1.0, 1e-3])
    force = np.array(short_force(tuple(e), tuple(w), 1.0 - 0.998**2))
    assert force == pytest.approx(quadrature.short(e, w), rel=1e-7)


def test_the_angle_of_the_half_circle():
    for psi in np.linspace(1e-3, math.pi - 1e-3, 300):
        for r in (0.1, 1.0):
            a, s = -r * math.cos(psi), r * math.sin(psi)
            sine = finite.half_angle_sine(a, s, r)
            angle, inverse = film.half_circle_angle(a, s, 3.0)
            assert angle == pytest.approx(psi, rel=1e-12)
            assert inverse == pytest.approx(1.0 / 3.0, rel=1e-15)
            assert sine == pytest.approx(math.sin(0.5 * psi), rel=1e-12)


def test_a_film_gets_no_thinner_than_the_roughness():
    """From the depth itself to the floor without a kink."""
    floor = 0.01
    for depth in (1.0, 0.3, 0.021):
        assert film.film_thickness(-depth, 1.0, floor) == pytest.approx(depth, rel=1e-14)
    for depth in (0.0, -0.5):
        assert film.film_thickness(-2.0 * depth, 2.0, floor) == floor
    depth = np.linspace(-0.01, 0.04, 5001)
    seen = np.array([film.film_thickness(-d, 1.0, floor) for d in depth])
    slope = np.diff(seen) / np.diff(depth)
    assert (slope >= -1e-9).all()
    assert slope.max() < 1.0 + 1e-9
    assert np.abs(np.diff(slope)).max() < 1.01 * (depth[1] - depth[0]) / (2.0 * floor)


def coefficients(e):
    """Stiffness and damping of a short bearing at its place under a load in -y, over load and clearance, and load, clearance
    and speed: by differences of the law."""
    attitude = math.atan(math.pi * math.sqrt(1 - e**2) / (4 * e))
    place = e * np.array([math.sin(attitude), -math.cos(attitude)])

    def force(q, v):
        w = (v[0] + 0.5 * q[1], v[1] - 0.5 * q[0])
        return np.array(short_force(tuple(q), w, 1.0 - q @ q))

    still = np.zeros(2)
    step = 1e-6 * min(e, 1 - e)
    scale = 2 * step * np.hypot(*force(place, still))
    axes = np.eye(2) * step
    stiffness = [force(place - axis, still) - force(place + axis, still) for axis in axes]
    damping = [force(place, -axis) - force(place, axis) for axis in axes]
    return np.array(stiffness).T / scale, np.array(damping).T / scale


@pytest.mark.parametrize("e", [0.1, 0.4, 0.7, 0.9])
def test_small_motions_feel_the_coefficients_that_books_print(e):
    for found, printed in zip(coefficients(e), rotors.printed_coefficients(e), strict=True):
        assert found == pytest.approx(printed, rel=1e-7, abs=1e-7 * np.abs(printed).max())


def whirl(e):
    """At the limit of stability: mass times speed squared, over load and clearance; and the square of whirl over speed."""
    k, c = coefficients(e)
    held = (
        k[0, 0] * c[1, 1] + k[1, 1] * c[0, 0] - k[0, 1] * c[1, 0] - k[1, 0] * c[0, 1]
    ) / c.trace()
    ratio = np.linalg.det(k - held * np.eye(2)) / np.linalg.det(c)
    return held / ratio, ratio


def test_limits_of_whirl_are_the_known_ones():
    """A light rotor whirls at half its speed, from omega^2 m c/W = 24/pi on; none does beyond an eccentricity of 0.756."""
    speed, ratio = whirl(1e-3)
    assert speed == pytest.approx(24 / math.pi, rel=1e-5)
    assert ratio == pytest.approx(0.25, rel=1e-5)
    assert whirl(0.755)[1] > 0.0 > whirl(0.757)[1]


# ---- whole motions ------------------------------------------------------------------------------------


def places(scene):
    """Eccentricity over the clearance (t, 2), the response, and what the energies leave over of what passed through."""
    response = simulate(scene)
    place = np.hstack([response["eccentricity_x"], response["eccentricity_y"]]) / rotors.CLEARANCE
    # at the steps themselves: between ends of implicit steps that take half a revolution works are told by a cubic
    steps = simulate(scene.with_({"output.instants_per_revolution": 0}))
    passed = np.abs(np.diff(steps["driving_work"])).sum()
    return place, response, float(np.abs(steps["energy_residual"]).max()) / passed


@pytest.mark.parametrize(
    ("model", "load"), [("short", 20.0), ("short", 300.0), ("long", 300.0), ("long", 3000.0)]
)
@pytest.mark.shortened(2)
def test_a_journal_settles_where_the_load_is_carried(model, load):
    """Eccentricity and attitude angle that its Sommerfeld number goes with."""
    place, response, rest = places(rotors.rotor(150.0, load, 60, model=model))
    assert int(response["status"]) == Status.OK
    assert place[-1] == pytest.approx(rotors.equilibrium(model, 150.0, load), abs=1e-6)
    assert float(response["contact_force"][-1, 0]) == pytest.approx(load, rel=1e-5)
    assert rest < 1e-6


@pytest.mark.parametrize("load", [20.0, 120.0])
def test_oil_whirl_begins_at_the_known_speed(load):
    """On either side of the limit a small deviation decays or grows as fast as the linear theory says."""
    limit = rotors.whirl_speed(load)
    for speed in (0.9 * limit, 1.1 * limit):
        there = rotors.equilibrium("short", speed, load)
        turns = 24
        place, response, _ = places(rotors.rotor(speed, load, turns, start=tuple(there + 2e-4)))
        away = np.hypot(*(place - there).T)
        time = response["time"].to_numpy()
        half = len(time) // 2
        tops = [away[a:b].max() for a, b in ((half // 2, half), (half + half // 2, 2 * half))]
        rate = math.log(tops[1] / tops[0]) / (time[-1] / 2)
        expected = rotors.growth(speed, load)
        assert (expected > 0.0) == (speed > limit)
        assert rate == pytest.approx(expected, rel=0.1)
