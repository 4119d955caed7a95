"""Order of every pair: its conditions, and as observed with steps of one length through the stepper itself."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hpcclear.dynamics.layout.views import Parameters, RunSettings
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.explicit.tableau import TABLEAUS, Tableau
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.dynamics.stepping.problem import Problem
from hpcclear.scene import Scene, load_scene

SCENE = Path(__file__).parent.parent / "jobs" / "slider_crank.toml"
STRETCH = 0.1  # of a revolution: both contacts stay loaded, so every law is smooth along the motion
COARSEST = {
    4: 576,
    5: 192,
    8: 24,
}  # steps by order: the leading error term rules, and round-off is far away
SCALES = np.array([1e-3, 1e-3, 1e-2, 1e-3, 1.0, 1.0, 50.0, 1.0])  # m, rad; m/s, rad/s


class ConstantSteps(Problem):
    """A step-size controller that accepts every step and asks for the same again."""

    def settings(self) -> RunSettings:
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
            "numerics.energy": True,
        }
    )


def state_after(scene: Scene, tableau: Tableau, steps: int) -> np.ndarray:
    """Coordinates, velocities and both mean gaps after a stretch in equal steps."""
    problem = replace(problem_of(scene), tableau=tableau)
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
    # Leading terms of these two are so small that the next one shows until round-off does.
    near = 0.4 if tableau.name in ("tsitouras", "prince-dormand") else 0.2
    np.testing.assert_allclose(slopes, tableau.order, atol=near)
    # gaps and works are quadratures of the same method
    relative = np.linalg.norm(errors[:, 8:] / exact[8:], axis=1)
    overall = np.log(relative[0] / relative[-1]) / np.log(counts[-1] / counts[0])
    assert overall == pytest.approx(tableau.order, abs=max(near, 0.3))


@cache
def trees(size: int) -> list[tuple]:
    """Rooted trees of so many nodes, each a sorted tuple of its root's branches."""

    def forests(left: int, largest: int) -> list[tuple]:
        if left == 0:
            return [()]
        return [
            (*forest, tree)
            for branch in range(1, min(left, largest) + 1)
            for tree in trees(branch)
            for forest in forests(left - branch, branch)
        ]

    return sorted({tuple(sorted(forest)) for forest in forests(size - 1, size - 1)})


def nodes_and_density(tree: tuple) -> tuple[int, int]:
    below = [nodes_and_density(branch) for branch in tree]
    nodes = 1 + sum(count for count, _ in below)
    return nodes, nodes * int(np.prod([density for _, density in below]))


def weights_of(a: np.ndarray, tree: tuple) -> np.ndarray:
    """Elementary weights of a tree at the stages."""
    found = np.ones(len(a))
    for branch in tree:
        found = found * (a @ weights_of(a, branch))
    return found


def largest_miss(a: np.ndarray, b: np.ndarray, order: int) -> float:
    """Of the conditions of one order (Butcher: one for each rooted tree)."""
    return max(
        abs(b @ weights_of(a, tree) - 1.0 / nodes_and_density(tree)[1]) for tree in trees(order)
    )


@pytest.mark.parametrize("tableau", TABLEAUS.values(), ids=lambda t: t.name)
def test_both_solutions_of_a_pair_meet_the_conditions_of_their_orders_and_no_more(tableau: Tableau):
    for weights, order in (
        (tableau.b, tableau.order),
        (tableau.b - tableau.e, tableau.error_order),
    ):
        assert max(largest_miss(tableau.a, weights, k) for k in range(1, order + 1)) < 1e-13
        assert largest_miss(tableau.a, weights, order + 1) > 1e-7
    assert (tableau.a[-1] == tableau.b).all()  # the last stage is the new point
