"""Friction of pins without clearance by their reactions: closed forms, own integration, energies; `test_generated` has it on
linkages against the dense model."""

import math
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from running import RIGID
from scipy.integrate import solve_ivp
from test_loads import INERTIA, PIN, START, STIFFNESS, angle_of, machine

from hpcclear import load_scene, simulate

SLIDER_CRANK = Path(__file__).parents[1] / "jobs" / "slider_crank.toml"
MASS, GRAVITY = 0.5, 9.81
RUBS = {"coefficient": 0.2, "radius": 0.01, "ramp_speed": 1e-4}


def joints(**friction):
    return {"pivot": {**PIN, "journal": "pendulum.o", "friction": {**RUBS, **friction}}}


def test_a_wheel_comes_to_rest_under_its_own_weight():
    """The weight alone loads its pin: w = w0 - mu r m g t/J, then it stays."""
    pins = {"wheel_pin": {**PIN, "journal": "wheel.o", "friction": RUBS}}
    drive = {
        "kind": "torque", "body": "wheel", "torque": 0.0, "initial_speed": 10.0, "expected_speed": 10.0,
    }  # fmt: skip
    scene = machine({}, {}, pins, drive, turns=3).with_({"effects.gravity": GRAVITY})
    found = simulate(scene)
    time, slowing = found["time"].to_numpy(), 0.2 * 0.01 * 1.0 * GRAVITY / 1e-2
    np.testing.assert_allclose(found["crank_speed"].to_numpy(), 10.0 - slowing * time, rtol=1e-8)
    lost = found["dissipated_energy"].to_numpy()
    expected = 0.5e-2 * (100.0 - (10.0 - slowing * time) ** 2)
    np.testing.assert_allclose(lost, expected, atol=1e-9)


@pytest.mark.parametrize("ramp", [1e-4, 1e-5])
def test_a_swing_on_a_spring_settles_within_its_dead_band(ramp):
    """About +-b, b = mu r m g/k, half a period each, amplitudes down by 2 b; it rests where the spring holds less than b.

    What friction's ramp adds is in proportion to it.
    """
    spring = {"kind": "torsion-spring", "body": "pendulum", "stiffness": STIFFNESS}
    scene = machine({"coil": spring}, joints=joints(ramp_speed=ramp)).with_(
        {"effects.gravity": GRAVITY}
    )
    found = simulate(scene)
    time, band = found["time"].to_numpy(), 0.2 * 0.01 * MASS * GRAVITY / STIFFNESS
    half = math.pi / math.sqrt(STIFFNESS / INERTIA)
    k = np.floor(time / half)
    amplitude = START - (2 * k + 1) * band
    expected = (-1.0) ** k * (amplitude * np.cos(math.pi * (time / half - k)) + band)
    swings = (START - band) // (2 * band)  # that begin beyond the dead band
    moving = k < swings
    assert 10 < swings < time[-1] / half - 2
    angle = angle_of(found, "pendulum")
    np.testing.assert_allclose(angle[moving], expected[moving], atol=0.5 * ramp)
    rest = time > (swings + 2) * half
    assert np.abs(angle[rest]).max() <= band * (1 + 1e-6)
    assert np.ptp(angle[rest]) < ramp / 0.01 * (time[-1] - time[rest][0])  # no faster than the ramp
    residual = np.abs(found["energy_residual"].to_numpy()).max()
    assert residual < 1e-7 * 0.5 * STIFFNESS * START**2


def test_a_pendulum_decays_as_its_implicit_reaction_has_it():
    """Mass beside the pin: the reaction depends on the acceleration, N^2 = |R0 + D N|^2 by the formula for quadratics."""
    arm, coefficient, radius = 0.1, 0.3, 0.02
    bodies = {"pendulum": {"mass": MASS, "inertia": INERTIA, "center": [arm, 0.0],
              "points": {"o": [0.0, 0.0]}, "start_angle": -math.pi / 2 + 1.2}}  # fmt: skip
    pins = joints(coefficient=coefficient, radius=radius, ramp_speed=0.01)
    scene = machine({}, bodies, pins, turns=4).with_({"effects.gravity": GRAVITY})
    found = simulate(scene)
    about = INERTIA + MASS * arm**2

    def rates(_, y):
        angle, spin = y
        n = np.array([math.cos(angle), math.sin(angle)])
        t = np.array([-math.sin(angle), math.cos(angle)])
        ratio = coefficient * radius * np.clip(spin * radius / 0.01, -1, 1)
        free = -MASS * GRAVITY * arm * n[0] / about
        R = MASS * (arm * free * t - arm * spin**2 * n + [0.0, GRAVITY])
        D = -MASS * arm * ratio / about * t
        a, b, c = 1 - D @ D, R @ D, R @ R
        return [spin, free - ratio / about * (b + math.sqrt(b * b + a * c)) / a]

    time = found["time"].to_numpy()
    y = solve_ivp(
        rates, (0, time[-1]), [1.2 - math.pi / 2, 0.0], t_eval=time, method="DOP853", rtol=1e-12, atol=1e-13
    ).y  # fmt: skip
    np.testing.assert_allclose(angle_of(found, "pendulum"), y[0], atol=1e-8)
    swing = np.abs(y[0] + math.pi / 2)
    assert 0.01 < swing[-len(swing) // 4 :].max() < 0.1


@pytest.fixture(scope="module")
def held():
    """A slider-crank without clearance at a constant speed."""
    changes = {**RIGID, "effects.gravity": GRAVITY, "numerics.averaged_revolutions": 1}
    return load_scene(SLIDER_CRANK).with_(changes)


def test_friction_of_all_pins_is_felt_by_the_drive(held):
    """A little of it: by virtual work, the drive's torque rises by mu r |R| |turning|/speed of each pin."""
    radii = {"crank_frame": 0.01, "crank_rod": 0.008, "rod_slider": 0.006}
    small = 1e-7
    rubs = {
        f"joints.{name}": {
            "kind": "ideal", "friction": {"coefficient": small, "radius": r, "ramp_speed": 1e-9},
        }
        for name, r in radii.items()
    }  # fmt: skip
    free, rubbing = simulate(held), simulate(held.with_(rubs))
    speed = float(held.drive.speed)
    rod = free["rod_angle"].differentiate("time").to_numpy()
    forces = {
        "crank_frame": np.hypot(free["bearing_x"], free["bearing_y"]).to_numpy(),
        **{
            name: np.hypot(free["reaction_x"], free["reaction_y"]).to_numpy()[:, k]
            for k, name in enumerate(("crank_rod", "rod_slider"))
        },
    }
    turning = {"crank_frame": speed, "crank_rod": speed - rod, "rod_slider": rod}
    expected = sum(radii[n] * forces[n] * np.abs(turning[n]) / speed for n in radii)
    more = (rubbing["crank_moment"] - free["crank_moment"]).to_numpy() / small
    np.testing.assert_allclose(more[2:-2], expected[2:-2], rtol=2e-3)
    work = np.abs(np.diff(rubbing["driving_work"].to_numpy())).sum()
    assert float(np.abs(rubbing["energy_residual"]).max()) < 1e-9 * work
    strong = {f"{key}.friction.coefficient": 0.2 for key in rubs}
    lossy = simulate(held.with_(rubs).with_(strong))
    assert float(np.abs(lossy["energy_residual"]).max()) < 1e-9 * float(
        lossy["dissipated_energy"][-1]
    )


def test_with_clearance_elsewhere_and_a_free_crank_energies_close():
    friction = {"coefficient": 0.15, "radius": 0.01, "ramp_speed": 0.05}
    scene = load_scene(SLIDER_CRANK).with_({
        "joints.rod_slider": {"kind": "ideal", "friction": friction},
        "joints.crank_frame": {"kind": "ideal", "friction": friction},
        "numerics.averaged_revolutions": 1, "numerics.rtol": 1e-9, "numerics.transient_revolutions": 0,
    })  # fmt: skip
    found = simulate(scene)
    work = np.abs(np.diff(found["driving_work"].to_numpy())).sum()
    assert float(np.abs(found["energy_residual"]).max()) < 1e-7 * work
    loss = np.diff(found["dissipated_energy"].to_numpy())
    assert (loss > -1e-9 * work).all()


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"joints.crank_frame": {"kind": "ideal", "friction": {"coefficient": 0.1}}}, "joints.crank_frame.friction.radius"),
        ({"joints.crank_frame": {"kind": "ideal", "friction": {**RUBS, "coefficient": -0.1}}},
         "joints.crank_frame.friction.coefficient"),
        ({"joints.rod_slider": {"kind": "ideal", "friction": {**RUBS, "radius": 0.0}}}, "joints.rod_slider.friction.radius"),
    ],
)  # fmt: skip
def test_wrong_friction_is_refused_by_name(changes, key):
    with refused(key):
        load_scene(SLIDER_CRANK).with_(changes)
