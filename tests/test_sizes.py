"""Sizes come from one place: sums over any number of coordinates, what does not fit is refused."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from running import scene_with

from hpcclear.base.jit import FASTMATH, lane_function
from hpcclear.base.lowering.compiled import Compiled
from hpcclear.base.lowering.values import kind_of
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.arguments import Stepped, rules_of
from hpcclear.dynamics.layout.views import Start
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.stepping.explicit import tableau as tab
from hpcclear.dynamics.stepping.explicit.combine import Step, stage_state, step_error
from hpcclear.scene import load_scene

W = 4
NONE_OPEN = Stepped(rules_of(at.Effects()), np.zeros(0, np.int64))


@lane_function
def last_stage_and_error(n, effects, work, room, par, weights, stages, W):
    step = Step(work, room, par, weights, n, 1e-3, W)
    stage_state(step, stages - 1, stages - 1, W)
    step_error(effects, step, stages, W)


@pytest.mark.parametrize("pair", [tab.DORMAND_PRINCE, tab.PRINCE_DORMAND], ids=lambda p: p.name)
@pytest.mark.parametrize("n", [1, 4, 7, at.MAX_COORDINATES])
def test_a_stage_and_its_error_reach_every_coordinate(n: int, pair: tab.Tableau):
    """Of any number of coordinates, once each, and no number beside them is touched."""
    s = pair.stages - 1
    rng = np.random.default_rng(n)
    work, par = rng.normal(size=(at.WORK, W)), np.ones((at.PARAMETERS, W))
    room = rng.normal(size=(pair.stages, at.MAX_COORDINATES, W))
    atol = par[at.tolerance_rows(n)] = rng.uniform(0.5, 1.0, (2 * n, W))
    stages = room[:, :n].copy()
    work[at.STEP] = 1e-2
    work[at.STRICTER] = 4.0
    before = work.copy()
    given = n, NONE_OPEN, *(one.ravel() for one in (work, room, par, pair.packed()))
    known = {"W": W, "stages": pair.stages}
    Compiled(last_stage_and_error, kind_of(given).parts, FASTMATH, **known)(*given)
    h = before[at.STEP]
    q, v, a = (before[row : row + n] for row in (at.Q, at.V, at.ACC))
    stages[s - 1] = a  # the latest, put away on the way
    combined = np.einsum("j,jkw->kw", pair.a[s], stages)
    twice = np.einsum("j,jkw->kw", (pair.a @ pair.a)[s], stages)
    qs, vs = work[at.QS : at.QS + n], work[at.VS : at.VS + n]
    np.testing.assert_allclose(vs, v + h * combined, rtol=1e-12)
    np.testing.assert_allclose(qs, q + h * (pair.a[s].sum() * v + h * twice), rtol=1e-12)
    stages[s] = a
    error_v = h * np.einsum("j,jkw->kw", pair.e, stages)
    error_q = h * h * np.einsum("j,jkw->kw", pair.e @ pair.a, stages)
    scale_q = atol[:n] + 1e-3 * np.maximum(abs(q), abs(qs))
    scale_v = atol[n:] + 1e-3 * np.maximum(abs(v), abs(vs))
    mean = ((error_q / scale_q) ** 2 + (error_v / scale_v) ** 2).sum(axis=0) / (2 * n)
    np.testing.assert_allclose(work[at.ERROR], 4.0 * mean, rtol=1e-9)
    for row in (*range(at.QS, at.QS + n), *range(at.VS, at.VS + n), at.ERROR):
        before[row] = work[row]
    np.testing.assert_array_equal(work, before)


def test_what_does_not_fit_is_refused():
    problem = problem_of(scene_with())
    with pytest.raises(ValueError, match="88 coordinates at most, not 89"):
        replace(problem, coordinates=89)
    many = np.eye(15)
    with pytest.raises(ValueError, match="pairs of 14 stages at most"):
        tab.Tableau("long", 2, 1, many, many[0], many[0], "none")
    with pytest.raises(ValueError, match="not 3"):
        tab.Tableau("askew", 2, 1, many, many[0, :3], many[0, :3], "none")
    with pytest.raises(ValueError, match=f"a row of Start holds {Start.size} numbers, not 21"):
        Start(np.zeros((3, 21)))


def test_a_scene_of_too_many_coordinates_is_refused_with_their_number():
    bar = {"mass": 1.0, "length": 0.1, "inertia": 1e-3}
    names = ["crank", *(f"bar{k}" for k in range(at.MAX_COORDINATES + 1))]
    pins = {
        f"pin_{k}": {"kind": "revolute", "journal": f"{k}.a", "bearing": "ground.o"} for k in names
    }
    motor = {"kind": "constant-speed", "body": "crank", "speed": 10.0}
    mechanism = {
        "kind": "planar", "bodies": dict.fromkeys(names, bar), "joints": pins, "drives": {"motor": motor},
    }  # fmt: skip
    with refused(reason="88 at most", match="89"):
        problem_of(load_scene({"mechanism": mechanism, "effects": {"contact": {"law": "hertz"}}}))
