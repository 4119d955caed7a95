"""The automatic choice of method on stiff scenes: when it is made, that it is right, and that it pays."""

from pathlib import Path

import numpy as np
import pytest

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.lowering import implicit_method, parameters, problem_of, start_states
from hpcclear.scene import Scene, load_scene

ROOT = Path(__file__).parent.parent
SLIDER = at.OUT_STATE + 3
STIFF = {
    "friction, latched": (
        {"law": "lankarani-nikravesh", "restitution": 0.9},
        {"law": "coulomb", "coefficient": 0.3, "ramp_speed": 1e-4},
    ),
    "friction, fixed": (
        {"law": "hunt-crossley", "damping": 0.5},
        {"law": "coulomb", "coefficient": 0.3, "ramp_speed": 1e-4},
    ),
    "damping 50": ({"law": "hunt-crossley", "damping": 50.0}, None),
    "damping 500": ({"law": "hunt-crossley", "damping": 500.0}, None),
}


def scene_of(name: str, method: str, rtol: float) -> Scene:
    contact, friction = STIFF[name]
    changes = {
        "effects.contact": contact,
        "numerics.method": method,
        "numerics.rtol": rtol,
        "numerics.transient_revolutions": 0,
        "numerics.averaged_revolutions": 1,
        "numerics.max_steps": 100_000_000,
    }
    if friction is not None:
        changes["effects.friction"] = friction
    return load_scene(ROOT / "jobs" / "slider_crank.toml").with_(changes)


def one_turn(scene: Scene, state: np.ndarray) -> np.ndarray:
    """Outcome row of one revolution from a start state (1, STATE)."""
    lanes = Lanes(problem_of(scene), 1)
    lanes.queue(parameters(scene), state, np.zeros(1, np.int64))
    while lanes.pending:
        lanes.advance(10.0)
    return lanes.collect()[1][0]


def settled(name: str) -> np.ndarray:
    """A state three revolutions after the start, from a tight run: from rest these scenes are ill-posed."""
    scene = scene_of(name, "dormand-prince", 1e-9)
    state = start_states(scene, parameters(scene))
    for _ in range(3):
        row = one_turn(scene, state)
        contacts = row[at.OUT_ACTIVE_12 : at.OUT_INVERSE_IMPACT_23 + 1]
        moving = row[at.OUT_STATE : at.OUT_STATE + 2 * at.MAX_COORDINATES]
        state = np.concatenate([moving, contacts])[None]
    return state


@pytest.mark.parametrize("name", STIFF)
def test_automatic_choice_is_right_and_cheaper(name: str):
    state = settled(name)
    exact = one_turn(scene_of(name, "dormand-prince", 1e-12), state)
    chosen = one_turn(scene_of(name, "auto", 1e-7), state)
    explicit = one_turn(scene_of(name, "dormand-prince", 1e-7), state)
    assert chosen[at.OUT_STATUS] == exact[at.OUT_STATUS] == 0.0
    # it takes implicit steps, and not only those
    assert 0.0 < chosen[at.OUT_STIFF_STEPS] < chosen[at.OUT_ATTEMPTS]
    assert abs(chosen[SLIDER] - exact[SLIDER]) < 1e-7
    # an implicit step takes the time of two explicit ones; evaluations do not tell, it has eight of them at a time
    weighted = chosen[at.OUT_ATTEMPTS] + chosen[at.OUT_STIFF_STEPS]
    assert weighted < 0.6 * explicit[at.OUT_ATTEMPTS]


def test_scenes_that_are_not_stiff_do_not_pay():
    paper = load_scene(ROOT / "jobs" / "slider_crank.toml")
    assert implicit_method(paper) == "never"
    assert implicit_method(load_scene(ROOT / "jobs" / "robust_slider_crank.toml")) == "never"
    assert implicit_method(paper.with_({"numerics.method": "switching"})) == "stiff"
    for name in STIFF:
        assert implicit_method(scene_of(name, "auto", 1e-6)) == "stiff"
        assert implicit_method(scene_of(name, "dormand-prince", 1e-6)) == "never"


def test_restitution_that_damps_hard_counts_as_stiff():
    paper = load_scene(ROOT / "jobs" / "slider_crank.toml")
    soft = {"effects.contact": {"law": "flores", "restitution": 0.1}}
    assert implicit_method(paper.with_(soft)) == "stiff"
    assert implicit_method(paper.with_({"effects.contact": {"law": "hertz"}})) == "never"
