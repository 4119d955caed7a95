"""The pair of order 8, for tight tolerances: its results beside those of another pair, and what surrounds a step."""

import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, closes, run, scene_with

from hpcclear.dynamics.layout.views import Outcome

TIGHT = "prince-dormand"

DRY = {"law": "none"}
RAMP = {"law": "coulomb", "coefficient": 0.05, "ramp_speed": 0.1}
AMBROSIO = {"law": "ambrosio", "coefficient": 0.05, "speeds": [1e-3, 0.1]}
TORQUE = {"kind": "torque", "torque": 0.5, "initial_speed": 300.0}
IDEAL = {"kind": "ideal"}
CURVE = [[0.0, -10.0], [3.0, -50.0], [2.0 * np.pi, -10.0]]

CASES = {
    "Hunt-Crossley": {"effects.contact": HUNT_CROSSLEY, "effects.friction": RAMP},
    "latched": {"effects.contact": {**LATCHED, "restitution": 0.5}, "effects.friction": RAMP},
    "Ambrosio": {"effects.contact": HUNT_CROSSLEY, "effects.friction": AMBROSIO},
    "dry": {"effects.contact": HUNT_CROSSLEY, "effects.friction": DRY},
    "first joint": {"effects.contact": HUNT_CROSSLEY, "joints.rod_slider": IDEAL},
    "second joint": {
        "effects.contact": {**LATCHED, "restitution": 0.5}, "joints.crank_rod": IDEAL
    },
    "torque": {"effects.contact": HUNT_CROSSLEY, "drive": TORQUE},
    "torque, one joint": {
        "effects.contact": HUNT_CROSSLEY, "drive": TORQUE, "joints.crank_rod": IDEAL
    },
    "everything": {
        "effects.contact": HUNT_CROSSLEY,
        "effects.gravity": 9.81,
        "effects.slider_load": CURVE,
        "effects.guide_friction": {"coefficient": 0.05, "ramp_speed": 0.1},
        "numerics.responses": True,
    },
}  # fmt: skip


def case(name: str, method: str, rtol: float, revolutions: int = 2):
    """One of the scenes with a method."""
    clearance = {
        f"joints.{joint}.clearance": 0.3e-3
        for joint in ("crank_rod", "rod_slider")
        if f"joints.{joint}" not in CASES[name]
    }
    return scene_with(
        clearance | CASES[name] | {"numerics.method": method, "numerics.energy": True},
        revolutions,
        rtol,
    )


def outcome(scene) -> Outcome:
    """Outcome of one sample; with its record, so that every test runs the same compiled stepper."""
    return run(scene).out


@pytest.mark.parametrize("name", CASES)
@pytest.mark.shortened(4)
def test_it_agrees_with_another_pair(name: str):
    """Two methods that share no coefficient, at tolerances where both have converged."""
    ours = outcome(case(name, TIGHT, 1e-11, 1))
    pair = outcome(case(name, "dormand-prince", 1e-11, 1))
    assert ours.status == pair.status == 0
    assert ours.evaluations < 0.7 * pair.evaluations
    names = ["objective", "mean_gap", "drive_work", "dissipated", "load_work", "time", "latched"]
    if name == "everything":
        names += ["mean_force", "acceleration_deviation"]
    for which in names:
        np.testing.assert_allclose(
            getattr(ours, which), getattr(pair, which), rtol=3e-8, err_msg=which
        )
    # |power| has a kink at each zero, which no method steps to: long steps feel it more; it is a scale and no result
    assert ours.absolute_drive_work == pytest.approx(pair.absolute_drive_work, rel=1e-4)
    np.testing.assert_allclose(ours.moving, pair.moving, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.shortened(4)
def test_a_tighter_tolerance_is_nearer(name: str):
    exact = outcome(case(name, TIGHT, 1e-12, 1)).objective
    errors = [
        abs(outcome(case(name, TIGHT, rtol, 1)).objective / exact - 1.0)
        for rtol in (1e-4, 1e-7, 1e-10)
    ]
    assert errors[0] < 1e-3
    assert errors[1] < 1e-6
    assert errors[2] < 1e-8


@pytest.mark.parametrize("name", CASES)
@pytest.mark.shortened(4)
def test_the_energy_balance_closes(name: str):
    closes(case(name, TIGHT, 1e-8))


def test_a_lost_cause_ends_with_a_status():
    scene = case("dry", TIGHT, 1e-6).with_({"numerics.max_steps": 20})
    lost = outcome(scene)
    assert lost.status == 1
    assert lost.attempts == 20
