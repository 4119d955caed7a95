"""Cartesian coordinates with multipliers against minimal ones; constraint violation; what the feedback does."""

import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, run, scene_with
from scipy.interpolate import CubicHermiteSpline

from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.planar.response import violation

X3, Y3, PHI1 = 5, 6, 8  # of the slider and the crank among the nine coordinates
IDEAL = {"joints.crank_rod": {"kind": "ideal"}, "joints.rod_slider": {"kind": "ideal"}}
TORQUE = {"kind": "torque", "torque": 5.0, "initial_speed": "5000 rpm", "flywheel_inertia": 1e-2}


def both(changes, revolutions=1):
    """The same scene in minimal coordinates and with multipliers, at rtol 1e-8."""
    scene = scene_with(changes, revolutions)
    return run(scene), run(scene.with_({"numerics.formulation": "baumgarte"})), scene


def largest_violation(scene, result):
    linkage = linkage_of(scene.with_({"numerics.formulation": "baumgarte"}))
    return violation(linkage, result.q.T, result.v.T, result.time).max()


@pytest.mark.parametrize(
    ("contact", "revolutions"),
    [(HUNT_CROSSLEY, 1), (HUNT_CROSSLEY, 10), pytest.param(LATCHED, 1, marks=pytest.mark.full)],
    ids=str,
)
def test_formulations_agree(contact, revolutions):
    minimal, nine, scene = both({"effects.contact": contact}, revolutions)
    assert nine.q[-1, X3] == pytest.approx(minimal.q[-1, 3], abs=1e-9)
    path = CubicHermiteSpline(nine.time, nine.q[:, X3], nine.v[:, X3])
    assert np.abs(path(minimal.time[1:-1]) - minimal.q[1:-1, 3]).max() < 1e-7
    assert largest_violation(scene, nine) < 1e-9
    assert nine.out.objective == pytest.approx(minimal.out.objective, rel=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("ideal_joint", ["crank_rod", "rod_slider"])
@pytest.mark.parametrize("drive", [None, TORQUE], ids=["speed", "torque"])
def test_formulations_agree_with_one_ideal_joint(ideal_joint, drive):
    changes = {f"joints.{ideal_joint}": {"kind": "ideal"}, "effects.contact": HUNT_CROSSLEY}
    changes |= {"effects.gravity": 9.81, "effects.guide_friction": {"coefficient": 0.1}}
    if drive is not None:
        changes["drive"] = drive
    minimal, nine, scene = both(changes)
    assert nine.q[-1, X3] == pytest.approx(minimal.q[-1, 1], abs=1e-7)
    assert largest_violation(scene, nine) < 1e-9


@pytest.mark.full
def test_formulations_agree_without_clearance():
    minimal, nine, scene = both({**IDEAL, "effects.friction": {"law": "none"}, "drive": TORQUE})
    assert nine.q[-1, X3] == pytest.approx(minimal.q[-1, 1], abs=1e-8)
    assert nine.v[-1, PHI1] == pytest.approx(minimal.v[-1, 2], abs=1e-5)
    assert largest_violation(scene, nine) < 1e-9
    assert nine.out.objective == 0.0


@pytest.mark.parametrize("b", [250.0, 100.0, 0.0])
@pytest.mark.shortened(1)
def test_an_offset_of_the_slider_decays_as_asked(b):
    """(1 + b t) exp(-b t), the critically damped answer; with no feedback the offset stays."""
    scene = scene_with(
        {
            "effects.contact": HUNT_CROSSLEY,
            "numerics.formulation": "baumgarte",
            "numerics.alpha": b,
            "numerics.beta": b,
        }
    )
    shift = np.zeros((2, 9))
    shift[0, Y3] = 1e-6
    nine = run(scene, shift=shift)
    expected = 1e-6 * (1 + b * nine.time) * np.exp(-b * nine.time)
    np.testing.assert_allclose(nine.q[:, Y3], expected, rtol=1e-3)
    assert (expected[-1] < 0.2e-6) == (b == 250.0)
