"""Nine coordinates with multipliers against minimal ones; constraint violation; what the feedback does."""

import numpy as np
import pytest
from running import HUNT_CROSSLEY, LATCHED, run, scene_with
from scipy.interpolate import CubicHermiteSpline

from hpcclear.dynamics.linkage import ideal
from hpcclear.dynamics.linkage.baumgarte import PHI1, X3, Y3, constraint_violation
from hpcclear.dynamics.problem import effects_of

IDEAL = {"joints.crank_rod": {"kind": "ideal"}, "joints.rod_slider": {"kind": "ideal"}}
TORQUE = {"kind": "torque", "torque": 5.0, "initial_speed": "5000 rpm", "flywheel_inertia": 1e-2}


def both(changes, revolutions=1):
    """The same scene in minimal coordinates and with multipliers, at rtol 1e-8."""
    scene = scene_with(changes, revolutions)
    return run(scene), run(scene.with_({"numerics.formulation": "baumgarte"}))


def largest_violation(scene_joints, result):
    first, second = (name in scene_joints for name in ("crank_rod", "rod_slider"))
    return constraint_violation(first, second, result.par, result.q.T).max()


@pytest.mark.parametrize(
    ("contact", "revolutions"),
    [(HUNT_CROSSLEY, 1), (HUNT_CROSSLEY, 10), pytest.param(LATCHED, 1, marks=pytest.mark.full)],
    ids=str,
)
def test_formulations_agree(contact, revolutions):
    minimal, nine = both({"effects.contact": contact}, revolutions)
    assert nine.q[-1, X3] == pytest.approx(minimal.q[-1, 3], abs=1e-9)
    path = CubicHermiteSpline(nine.time, nine.q[:, X3], nine.v[:, X3])
    assert np.abs(path(minimal.time[1:-1]) - minimal.q[1:-1, 3]).max() < 1e-7
    assert largest_violation(("crank_rod", "rod_slider"), nine) < 1e-9
    assert nine.out.objective == pytest.approx(minimal.out.objective, rel=1e-6)


@pytest.mark.full
@pytest.mark.parametrize("ideal_joint", ["crank_rod", "rod_slider"])
@pytest.mark.parametrize("drive", [None, TORQUE], ids=["speed", "torque"])
def test_formulations_agree_with_one_ideal_joint(ideal_joint, drive):
    changes = {f"joints.{ideal_joint}": {"kind": "ideal"}, "effects.contact": HUNT_CROSSLEY}
    changes |= {"effects.gravity": 9.81, "effects.guide_friction": {"coefficient": 0.1}}
    if drive is not None:
        changes["drive"] = drive
    minimal, nine = both(changes)
    assert nine.q[-1, X3] == pytest.approx(minimal.q[-1, 1], abs=1e-7)
    open_joint = {"crank_rod": "rod_slider", "rod_slider": "crank_rod"}[ideal_joint]
    assert largest_violation((open_joint,), nine) < 1e-9


@pytest.mark.full
def test_formulation_follows_the_closed_form_without_clearance():
    scene = scene_with(
        {**IDEAL, "effects.friction": {"law": "none"}, "numerics.formulation": "baumgarte"}
    )
    nine = run(scene)
    exact = ideal.ideal_response(effects_of(scene), nine.par, None, nine.q[:-1, PHI1])
    assert np.abs(nine.q[:-1, X3] - exact[ideal.SLIDER_X]).max() < 1e-8
    assert np.abs(nine.v[:-1, X3] - exact[ideal.SLIDER_V]).max() < 1e-5
    assert largest_violation((), nine) < 1e-9
    assert nine.out.objective == 0.0


@pytest.mark.parametrize("b", [250.0, 100.0, 0.0])
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
