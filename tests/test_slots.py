"""Pins in slots with clearance: closed forms, random linkages against the dense model, and what is refused."""

import math
from pathlib import Path

import numpy as np
import pytest
from planar_scenes import planar_scene
from refusals import refused
from test_guides import GRAVITY, LAWS, dense_through_contact
from test_loads import machine

from hpcclear import load_scene, simulate
from hpcclear.dynamics.setup.parameters import joint_numbers
from hpcclear.report.bearings import outside
from hpcclear.scene.points import Numbers

JOB = Path(__file__).parents[1] / "jobs" / "loose_slot.toml"
MASS, INERTIA, RADIUS, CLEARANCE = 0.2, 2e-5, 0.01, 1e-3
SOFT = {part: {"youngs_modulus": "2 GPa", "poisson_ratio": 0.4} for part in ("bearing", "journal")}


def roller(tilt, offset, friction, **contact):
    """A pin alone in a slot of the ground, which falls by `tilt` (rad); beside it a wheel that turns once a second."""
    bodies = {"roller": {"mass": MASS, "inertia": INERTIA, "points": {"o": [0.0, 0.0]}}}
    slot = {
        "kind": "slot", "point": "roller.o", "line": "ground.o", "angle": -tilt, "clearance": CLEARANCE,
        "pin_radius": RADIUS, "materials": SOFT, "start_offset": offset,
    }  # fmt: skip
    effects = {"gravity": GRAVITY, "contact": contact or {"law": "hertz"}, "friction": friction}
    scene = machine(
        {}, bodies, {"slot": {"kind": "slide", "point": "roller.o", "line": "ground.o"}}, turns=1
    )
    return scene.with_({"mechanism.joints.slot": slot, "effects": effects})


def stiffness_of(scene):
    """Of a sphere on a plane."""
    h = (1 - 0.4**2) / 2e9
    expected = 4 / (3 * 2 * h) * math.sqrt(RADIUS)
    numbers = joint_numbers(scene, Numbers(scene, None), "slot.left")
    assert numbers["stiffness"] == pytest.approx(expected, rel=1e-12)
    return expected


@pytest.mark.parametrize("coefficient", [0.05, 0.4])
def test_a_pin_slides_or_rolls_down_its_slot(coefficient):
    """Pressed to the lower wall by its weight. It slides: a = g (sin - mu cos), or rolls: a = g sin/(1 + J/(m r^2))."""
    tilt = 0.4
    still = roller(tilt, 0.0, "none")
    depth = (MASS * GRAVITY * math.cos(tilt) / stiffness_of(still)) ** (2 / 3)
    friction = {"law": "coulomb", "coefficient": coefficient, "ramp_speed": 1e-4}
    found = simulate(roller(tilt, -CLEARANCE - depth, friction))
    assert outside(found).endswith(" in slot.right, Hertz' limit is 2.5 mm")
    time, arm = found["time"].to_numpy(), RADIUS - depth / 2
    assert (coefficient > math.tan(tilt) / (1 + MASS * arm**2 / INERTIA)) == (coefficient > 0.1)
    if coefficient > 0.1:
        ahead = GRAVITY * math.sin(tilt) / (1 + INERTIA / (MASS * arm**2))
        turning = -ahead / arm
    else:
        ahead = GRAVITY * (math.sin(tilt) - coefficient * math.cos(tilt))
        turning = -coefficient * MASS * GRAVITY * math.cos(tilt) * arm / INERTIA
    along = np.array([math.cos(tilt), -math.sin(tilt)])
    moved = (
        np.stack([found[f"body_{k}"].sel(body="roller").to_numpy() for k in "xy"], axis=1) @ along
    )
    np.testing.assert_allclose(moved - moved[0], 0.5 * ahead * time**2, atol=2e-4 * time[-1])
    spin = found["body_spin"].sel(body="roller").to_numpy()
    np.testing.assert_allclose(spin, turning * time, atol=2e-2)
    np.testing.assert_allclose(
        found["contact_force"].to_numpy(), [[0.0, MASS * GRAVITY * math.cos(tilt)]] * len(time), rtol=1e-5, atol=1e-9
    )  # fmt: skip


def test_a_pin_falls_from_wall_to_wall():
    """Through both clearances: h = 2 c, then so deep that m g (h + d) = 2/5 K d^(5/2), and up again."""
    scene = roller(0.0, CLEARANCE, "none").with_({"output.instants_per_revolution": 0})
    found = simulate(scene)
    stiffness = stiffness_of(scene)
    forces = found["contact_force"].to_numpy()
    time, lower = found["time"].to_numpy(), forces[:, 1]
    fall = math.sqrt(2 * 2 * CLEARANCE / GRAVITY)
    begun = np.flatnonzero((lower[1:] > 0) & (lower[:-1] == 0))[0]
    assert time[begun] - 1e-12 <= fall <= time[begun + 1]
    deepest = np.roots(
        [
            1.0,
            0,
            0,
            -5 / 2 * MASS * GRAVITY / stiffness,
            0,
            -5 / 2 * MASS * GRAVITY * 2 * CLEARANCE / stiffness,
        ]
    )
    root = float(deepest[(np.abs(deepest.imag) < 1e-12) & (deepest.real > 0)].real[0])  # of sqrt(d)
    assert found["peak_contact_force"].to_numpy()[1] == pytest.approx(stiffness * root**3, rel=1e-6)
    offset = found["guide_offset"].to_numpy()[:, 0]
    later = time > 1.9 * fall
    assert offset[later].max() == pytest.approx(CLEARANCE, rel=1e-2)
    assert float(np.abs(found["energy_residual"]).max()) < 1e-9 * float(found["kinetic_energy"][0])


def random_lever(seed):
    """A crank pin in the slot of a lever; with torque or at a constant speed."""
    rng = np.random.default_rng(seed)
    u, clearance = rng.uniform, rng.uniform(5e-5, 2e-4)
    bodies = {
        "crank": {"length": u(0.04, 0.06), "mass": 0.3, "inertia": 1e-4, "start_angle": u(0, 6)},
        "lever": {"length": 0.25, "mass": 0.6, "inertia": 3e-3, "start_angle": 1.1},
    }
    joints = {
        "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
        "o3": {"kind": "revolute", "journal": "lever.a", "bearing": "ground.p"},
        "way": {
            "kind": "slot", "point": "crank.b", "line": "lever.a", "angle": u(-0.1, 0.1), "clearance": clearance,
            "pin_radius": u(0.004, 0.01), "materials": SOFT, "start_offset": u(-0.5, 0.5) * clearance,
        },
    }  # fmt: skip
    drive = {"kind": "constant-speed", "body": "crank", "speed": u(60.0, 120.0)}
    if seed % 2:
        drive = {
            "kind": "torque",
            "body": "crank",
            "torque": u(0, 5),
            "initial_speed": u(60.0, 120.0),
        }
    ground = {"o": [0.0, 0.0], "p": [u(-0.01, 0.01), -0.1]}
    return planar_scene(bodies, joints, {"motor": drive}, ground=ground, **LAWS)


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=[] if k < 2 else pytest.mark.full) for k in range(20)]
)
def test_random_slots_move_as_in_the_dense_model(seed):
    response, pressed = dense_through_contact(random_lever(seed), 1e-2)
    assert pressed.any()
    work = float(np.abs(np.diff(response["driving_work"].to_numpy())).sum())
    kinetic = float(response["kinetic_energy"].max())
    assert float(np.abs(response["energy_residual"]).max()) < 1e-7 * max(work, kinetic)


def test_the_job_s_pin_changes_walls_and_follows_the_slot_without_clearance():
    scene = load_scene(JOB)
    assert scene.contact_labels() == ("slot.left", "slot.right")
    found = simulate(scene)
    slot = {"kind": "slot", "point": "crank.b", "line": "lever.a"}
    ideal = simulate(
        scene.with_(
            {"mechanism.joints.slot": slot, "effects.contact": None, "effects.friction": "none"}
        )
    )
    apart = (found["body_angle"] - ideal["body_angle"].interp(time=found["time"])).sel(body="lever")
    # clearance over the nearest place of the pin
    assert 1e-4 < float(np.abs(apart).max()) < 2 * 5e-5 / 0.06
    forces = found["contact_force"].to_numpy()
    assert (forces.max(axis=0) > 50.0).all()
    assert (forces.min(axis=1) == 0.0).all()  # one wall at a time
    work = float(np.abs(np.diff(found["driving_work"].to_numpy())).sum())
    assert float(np.abs(found["energy_residual"]).max()) < 1e-4 * work


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"mechanism.joints.slot.pin_radius": None}, "mechanism.joints.slot.pin_radius"),
        ({"mechanism.joints.slot.clearance": 0.0}, "mechanism.joints.slot.clearance"),
        ({"mechanism.joints.slot.point": "crank.z"}, "mechanism.joints.slot.point"),
        ({"effects.contact": {"law": "hertz", "geometry": "line"}}, "mechanism.joints.slot.width"),
    ],
)
def test_wrong_slots_are_refused_by_name(changes, key):
    with refused(key):
        simulate(load_scene(JOB).with_(changes))
