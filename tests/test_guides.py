"""Guides with clearance: the published slider-crank, random linkages against the dense model, and what is refused."""

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
import rigid_slider as rigid
from dense_linkage import Contact, Dense, comes_as, start_of
from planar_scenes import planar_scene
from refusals import refused
from scipy.optimize import brentq

from hpcclear import load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.report.figures import guides, moving

PUBLISHED = Path(__file__).parents[1] / "jobs" / "loose_slider.toml"
ONE_TURN = {"numerics.averaged_revolutions": 1, "numerics.rtol": 1e-10}
SEPARATE, BLOCK = 0.7, 0.076 * (0.1**2 + 0.05**2) / 12
"""A restitution, and the inertia of a solid block, kg m^2, with which impacts are separate."""
CHI, MU, RAMP, GRAVITY = 0.4, 0.05, 0.02, 9.81


@pytest.fixture(scope="module")
def published():
    return load_scene(PUBLISHED).with_(ONE_TURN)


# ---- the published slider-crank ----------------------------------------------------------------------
@pytest.mark.nightly
def test_before_the_first_impact_the_motion_is_that_of_three_free_angles(published):
    """At 1 ms and up to the impact at 2.69 ms to 1e-6 of an own fine integration; contacts have no part in it."""
    response = simulate(published)
    time = response["time"].to_numpy()
    times = np.array([*time[time < 2.69e-3], 1e-3])
    order = np.argsort(times)
    state = rigid.before_impact(times[order])
    at_1_ms = state[:, times[order] == 1e-3][:, 0]
    assert at_1_ms[0] / (2 * math.pi) == pytest.approx(2.32543e-2, rel=1e-3)  # Siconos' steps
    assert at_1_ms[3] == pytest.approx(139.233, rel=1e-3)
    own = state[:, np.argsort(order)][:, :-1]
    early = response.isel(time=slice(0, own.shape[1]))
    for name, k, scale in (
        ("crank_angle", 0, 1.0),
        ("rod_angle", 1, 1.0),
        ("crank_speed", 3, 150.0),
    ):
        np.testing.assert_allclose(early[name].to_numpy(), own[k], rtol=0, atol=1e-6 * scale)
    assert early["time"].to_numpy()[-1] > 1e-3
    first, second = guides.touches(response)[:2]  # both corners of the upper side at once
    assert {first.contact, second.contact} == {"guide.front_left", "guide.back_left"}
    assert [first.turn, second.turn] == pytest.approx(
        [rigid.impacts(1, 1e-4)[0].crank / (2 * math.pi)] * 2, abs=1e-7
    )


def restitution(damping):
    """Of a law F = K d^n (1 + a d'/d'_0), any n: the root of a (1 + e) = ln((1 + a)/(1 - a e))."""
    return brentq(
        lambda e: damping * (1 + e) - math.log((1 + damping) / (1 - damping * e)),
        1e-3, (1 - 1e-12) / damping,
    )  # fmt: skip


@pytest.mark.nightly
def test_impacts_converge_to_those_of_rigid_bodies(published, monkeypatch):
    """A slider tilted by 5 mrad, so that corners hit one by one: corners and crank angles, with 1, 10, 100 times the stiffness,
    and the first ten with 1e5 times.

    Rigid impacts accumulate; those are seen that are further apart than an impact lasts. Errors fall with this duration, like
    the stiffness to the power -0.4: 4e-4, 1.5e-4, 6e-5 and 4e-6 rad at most.
    """
    damping = (1 - rigid.RESTITUTION**2) / rigid.RESTITUTION  # Gonthier's
    monkeypatch.setattr(rigid, "RESTITUTION", restitution(damping))
    expected = rigid.impacts(10, 1e-4, tilt=5e-3)
    errors = []
    for factor, same in ((1.0, 5), (10.0, 6), (100.0, 7), (1e5, 10)):
        changes = {"effects.contact.force_at": factor * 20e3, "joints.guide.start_tilt": 5e-3}
        response = simulate(published.with_(changes))
        seen = guides.touches(response)
        found = [one.contact.removeprefix("guide.") for one in seen[:same]]
        assert found == [one.corner for one in expected[:same]]
        late = [a.turn * 2 * math.pi - b.crank for a, b in zip(seen, expected, strict=False)]
        errors.append(np.abs(late[:same]))
        kinetic = float(response["kinetic_energy"][0])
        assert float(np.abs(response["energy_residual"]).max()) < 1e-9 * kinetic
    assert errors[0][0] < 1e-9  # nothing has touched before
    for coarse, fine, times in zip(errors, errors[1:], (10.0, 10.0, 1e3), strict=False):
        fallen = fine[1 : len(coarse)] / coarse[1:]
        np.testing.assert_allclose(fallen, times**-0.4, rtol=0.1)
    assert [
        found.max() < most for found, most in zip(errors, (4e-4, 2e-4, 6e-5, 4e-6), strict=True)
    ] == [True] * 4


def test_ten_separate_impacts_converge_to_those_of_rigid_bodies(published, monkeypatch):
    """The published slider turns so easily that rigid impacts accumulate. With the inertia of a solid block of its size, a
    restitution of 0.7 and a tilt of 10 mrad the first twelve are 0.15 ms apart or more: corners and crank angles with 1, 10
    and 100 times the stiffness, whose errors fall like the stiffness to the power -0.4, and their limit.
    """
    damping = (1 - SEPARATE**2) / SEPARATE
    monkeypatch.setattr(rigid, "RESTITUTION", restitution(damping))
    monkeypatch.setattr(rigid, "TURNING", BLOCK)
    expected = rigid.impacts(12, 1e-4, tilt=1e-2)
    assert min(b.time - a.time for a, b in itertools.pairwise(expected)) > 1.5e-4
    scene = published.with_(
        {
            "effects.contact.restitution": SEPARATE, "mechanism.slider.inertia": BLOCK,
            "joints.guide.start_tilt": 1e-2,
        }
    )  # fmt: skip
    late = []
    for factor in (1.0, 10.0, 100.0):
        seen = guides.touches(simulate(scene.with_({"effects.contact.force_at": factor * 20e3})))
        assert [one.contact.removeprefix("guide.") for one in seen[:12]] == [
            one.corner for one in expected
        ]
        late.append([a.turn * 2 * math.pi - b.crank for a, b in zip(seen, expected, strict=False)])
    soft, stiff, stiffest = np.array(late)
    assert np.abs(np.array(late)[:, 0]).max() < 1e-9  # nothing has touched before
    for coarse, fine in ((soft, stiff), (stiff, stiffest)):
        np.testing.assert_allclose(fine[1:] / coarse[1:], 10**-0.4, rtol=0.07)
    most = [np.abs(one[:10]).max() for one in (soft, stiff, stiffest)]
    np.testing.assert_array_less(most, (1.3e-2, 5.1e-3, 2.1e-3))
    share = 10**-0.4
    limit = (stiffest - share * stiff) / (1 - share)  # of stiffness without bounds
    assert np.abs(limit[:10]).max() < 3e-5


# ---- random linkages against the dense model ---------------------------------------------------------
LAWS = {
    "effects": {
        "gravity": GRAVITY, "contact": {"law": "hunt-crossley", "damping": CHI},
        "friction": {"law": "coulomb", "coefficient": MU, "ramp_speed": RAMP},
    },
    "numerics": {
        "rtol": 1e-11, "method": "dormand-prince", "transient_revolutions": 0, "averaged_revolutions": 1,
    },
    "output": {"instants_per_revolution": 2000},
}  # fmt: skip


def on_the_ground(rng):
    """A slider-crank askew, its guide with clearance."""
    bodies = {
        "crank": {"length": rng.uniform(0.04, 0.06), "mass": 0.3, "inertia": 1e-4, "start_angle": rng.uniform(0, 6)},
        "rod": {"length": rng.uniform(0.13, 0.17), "mass": 0.2, "inertia": 4e-4},
        "slider": {"mass": rng.uniform(0.1, 0.3), "inertia": 4e-5, "points": {"pin": [1e-3, 2e-3]}},
    }  # fmt: skip
    joints = {
        "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
        "o2": {"kind": "revolute", "journal": "crank.b", "bearing": "rod.a"},
        "o3": {"kind": "revolute", "journal": "slider.pin", "bearing": "rod.b"},
        "way": {"kind": "slide", "point": "slider.pin", "line": "ground.line", "angle": rng.uniform(-0.5, 0.5)},
    }  # fmt: skip
    bodies["slider"]["start_angle"] = joints["way"]["angle"]
    ground = {"o": [0.0, 0.0], "line": [0.0, rng.uniform(0.002, 0.01)]}
    return bodies, joints, ground


def on_a_lever(rng):
    """A block on a crank pin slides in the slot of a lever, with clearance."""
    bodies = {
        "crank": {"length": rng.uniform(0.04, 0.06), "mass": 0.3, "inertia": 1e-4, "start_angle": rng.uniform(0, 6)},
        "block": {"mass": rng.uniform(0.1, 0.3), "inertia": 4e-5, "points": {"pin": [1e-3, 2e-3]}},
        "lever": {"length": 0.25, "mass": 0.6, "inertia": 3e-3, "start_angle": 1.1},
    }  # fmt: skip
    joints = {
        "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
        "o2": {"kind": "revolute", "journal": "crank.b", "bearing": "block.pin"},
        "o3": {"kind": "revolute", "journal": "lever.a", "bearing": "ground.p"},
        "way": {"kind": "slide", "point": "block.pin", "line": "lever.a", "angle": rng.uniform(-0.1, 0.1)},
    }  # fmt: skip
    return bodies, joints, {"o": [0.0, 0.0], "p": [rng.uniform(-0.01, 0.01), -0.1]}


def random_scene(seed):
    rng = np.random.default_rng(seed)
    bodies, joints, ground = (on_the_ground, on_a_lever)[seed % 2](rng)
    clearance, length = rng.uniform(5e-5, 2e-4), rng.uniform(0.03, 0.05)
    joints["way"] |= {
        "clearance": clearance, "length": length, "height": rng.uniform(0.015, 0.025),
        "corner_radius": rng.uniform(1e-3, 3e-3),
        "start_offset": rng.uniform(-0.5, 0.5) * clearance,
        "start_tilt": rng.uniform(-0.5, 0.5) * clearance / length,
        "materials": {part: {"youngs_modulus": "2 GPa", "poisson_ratio": 0.4} for part in ("bearing", "journal")},
    }  # fmt: skip
    drive = {"kind": "constant-speed", "body": "crank", "speed": rng.uniform(60.0, 120.0)}
    return planar_scene(bodies, joints, {"motor": drive}, ground=ground, **LAWS)


def dense_through_contact(scene, last):
    """Positions are those of the dense model to 1e-8 m from the start through the first contact, and 1 ms after it, while
    the motion is regular, at most until `last` (s); the response, and at which instants so compared something is pressed.
    """
    mechanism = linkage_of(scene).mechanism
    laws = Contact(lambda rate: 1 + CHI * rate, lambda s: MU * min(max(s / RAMP, -1.0), 1.0))
    dense = Dense(mechanism, [laws], GRAVITY)
    start = start_of(dense)
    response = simulate(scene)
    time = response["time"].to_numpy()
    pressed = response["contact_force"].to_numpy().max(axis=1) > 1.0
    met = comes_as(response, dense, start, min(time[pressed.argmax()] + 1e-3, last))
    return response, pressed[:met]


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=[] if k == 1 else pytest.mark.full) for k in range(20)]
)
def test_random_guides_move_as_in_the_dense_model(seed):
    response, pressed = dense_through_contact(random_scene(seed), 6e-3)
    assert pressed.any()
    work = float(np.abs(np.diff(response["driving_work"].to_numpy())).sum())
    assert float(np.abs(response["energy_residual"]).max()) < 1e-7 * work


def test_joints_and_contacts_are_named_by_f(published):
    scene = published.with_({"numerics.rtol": 1e-6})
    assert scene.clearance_joints() == ("guide",)
    labels = ("guide.front_left", "guide.front_right", "guide.back_right", "guide.back_left")
    assert scene.contact_labels() == labels
    gaps = simulate(scene)["mean_gap"].to_numpy()
    assert float(simulate(scene)["objective"]) == pytest.approx(math.sqrt((gaps**2).sum()))
    for chosen, own in ((["guide"], gaps), ([labels[2]], gaps[2:3])):
        found = simulate(scene.with_({"numerics.objective_joints": chosen}))
        assert float(found["objective"]) == pytest.approx(math.sqrt((own**2).sum()))


def test_series_say_where_the_slider_is_and_films_draw_it_there(published):
    response = simulate(published.with_({"output.instants_per_revolution": 300}))
    offset, tilt = (response[name].to_numpy()[:, 0] for name in ("guide_offset", "guide_tilt"))
    reach = np.hypot(*(response[f"eccentricity_{k}"].to_numpy() for k in "xy"))
    side = np.array([1, -1, -1, 1]) * offset[:, None]
    arm = (0.05 - 1e-4) * np.array([1, 1, -1, -1]) * np.array([1, -1, -1, 1])
    corner = side + arm * np.sin(tilt)[:, None] + (0.025 - 1e-4) * np.cos(tilt)[:, None]
    np.testing.assert_allclose(reach, corner, atol=1e-12)
    assert np.abs(offset).max() == pytest.approx(1e-3, rel=0.02)
    _, points, angles = moving.bodies(response)
    np.testing.assert_allclose(points[:, 4, 1] - points[0, 4, 1], offset, atol=1e-9)
    np.testing.assert_allclose(angles[:, 2], tilt)
    guides.guide_figure(response)
    with pytest.raises(InputError, match="no guide"):
        guides.guide_figure(response.drop_dims("guide"))


@pytest.mark.parametrize(
    ("changes", "key", "said"),
    [
        ({"joints.guide.corner_radius": 0.03}, "joints.guide.corner_radius", "height"),
        ({"joints.guide.wear": {"length": 0.02}}, "joints.guide.wear", "pins only"),
        ({"joints.guide.film": {"model": "short"}}, "joints.guide.film", "pins only"),
        ({"joints.guide.clearance": 0.0}, "joints.guide.clearance", "above 0"),
        ({"joints.guide.height": None}, "joints.guide.height", "missing"),
        ({"mechanism.slider.inertia": None}, "mechanism.slider.inertia", "inertia"),
        ({"effects.guide_friction": {"coefficient": 0.1}}, "effects.guide_friction", "corners"),
        ({"effects.contact": None}, "effects.contact", "contact law"),
        ({"effects.contact": {"law": "hertz", "geometry": "line"}}, "joints.guide.width", "of the slider"),
        ({"numerics.objective_joints": ["guide", "guide.back_left"]}, "numerics.objective_joints", "twice"),
        ({"numerics.objective_joints": ["guide.middle"]}, "numerics.objective_joints", "not a joint"),
    ],
)  # fmt: skip
def test_wrong_guides_are_refused_by_name(published, changes, key, said):
    with refused(key, said=said):
        published.with_(changes)


@pytest.mark.parametrize(
    ("changes", "key", "said"),
    [
        ({"length": None}, "length", "missing"),
        ({"materials": None}, "materials", "missing"),
        ({"clearance": None}, "length", "with clearance"),
        ({"friction": {"coefficient": 0.1}}, "friction", "effects.friction"),
        ({"bearing_radius": 0.01}, "bearing_radius", "is of pins"),
    ],
)
def test_wrong_guides_of_linkages_are_refused_by_name(changes, key, said):
    scene = random_scene(1)
    with refused(f"mechanism.joints.way.{key}", said=said):
        scene.with_({f"mechanism.joints.way.{name}": value for name, value in changes.items()})


def test_a_third_guide_has_no_room():
    scene = random_scene(0)
    content = scene.resolved()
    joints = content["mechanism"]["joints"]
    for k in (1, 2):
        joints[f"way_{k}"] = dict(joints["way"])
    with pytest.raises(InputError, match="more than 8 contacts"):
        problem_of(load_scene(content))
