"""Observed order of every method, with steps of one length through the stepper itself."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hpcclear.dynamics.explicit.tableau import TABLEAUS, Tableau
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import Problem, problem_of
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.views import Parameters, Settings
from hpcclear.scene import Scene, load_scene

SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
STRETCH = 0.1  # of a revolution: both contacts stay loaded, so every law is smooth along the motion
COARSEST = {
    4: 576,
    5: 192,
}  # steps by order: the leading error term rules, and round-off is far away
SCALES = np.array([1e-3, 1e-3, 1e-2, 1e-3, 1.0, 1.0, 50.0, 1.0])  # m, rad; m/s, rad/s


class ConstantSteps(Problem):
    """A step-size controller that accepts every step and asks for the same again."""

    def settings(self) -> Settings:
        s = super().settings()
        s.rtol = s.atol = 1e300  # the error is 0, its rough logarithm -1023
        s.exponent, s.beta = 0.152003 / (0.5 * 1023.0), 0.0  # cancels the safety factor
        return s


@pytest.fixture(scope="module")
def scene() -> Scene:
    """The outer dead centre, where inertia presses both journals into their bearings.

    No damping: with it, terms of higher order hide the leading one until round-off does.
    """
    return load_scene(SCENE).with_(
        {
            "effects.contact": {"law": "hunt-crossley", "damping": 0.0},
            # a ramp so wide that friction is smooth, too
            "effects.friction": {"law": "coulomb", "coefficient": 0.1, "ramp_speed": 1e3},
            "joints.crank_rod.start_eccentricity": [-0.8e-3, 0.0],
            "joints.rod_slider.start_eccentricity": [0.7e-3, 0.0],
            "numerics.transient_revolutions": 0,
            "numerics.averaged_revolutions": 1,
        }
    )


def state_after(scene: Scene, tableau: Tableau, steps: int) -> np.ndarray:
    """Coordinates, velocities and both mean gaps after a stretch in equal steps."""
    problem = replace(problem_of(scene, ledger=True), tableau=tableau)
    problem = ConstantSteps(**vars(problem))
    par = parameters(scene)
    p = Parameters(par)
    p.period *= STRETCH
    p.first_step = p.period / steps
    out = Lanes(problem, 1).run(par, start_states(scene, par))[0]
    assert out.status == 0
    assert out.attempts == steps
    n = problem.coordinates
    return np.r_[
        out.coordinates(n), out.velocities(n), out.mean_gap[:2], out.drive_work, out.dissipated
    ]


@pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=lambda t: t.name)
def test_observed_order(scene: Scene, tableau: Tableau):
    counts = COARSEST[tableau.order] * np.array([3, 4, 6, 8]) // 3
    exact = state_after(scene, tableau, 8 * counts[-1])
    errors = np.array([np.abs(state_after(scene, tableau, n) - exact) for n in counts])
    motion = np.linalg.norm(errors[:, :8] / SCALES, axis=1)
    slopes = -np.diff(np.log(motion)) / np.diff(np.log(counts))
    # Tsitouras' leading term is a seventh of Dormand and Prince's, so that the next one shows until round-off does.
    near = 0.4 if tableau.name == "tsitouras" else 0.2
    np.testing.assert_allclose(slopes, tableau.order, atol=near)
    # gaps and works are quadratures of the same method
    relative = np.linalg.norm(errors[:, 8:] / exact[8:], axis=1)
    overall = np.log(relative[0] / relative[-1]) / np.log(counts[-1] / counts[0])
    assert overall == pytest.approx(tableau.order, abs=max(near, 0.3))
