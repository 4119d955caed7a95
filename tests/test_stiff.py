"""The automatic choice of method on stiff scenes: when it is made, that it is right, and that it pays."""

from pathlib import Path

import pytest

from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import implicit_method, problem_of
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.views import Outcome, Start
from hpcclear.scene import Scene, load_scene

ROOT = Path(__file__).parent.parent
SLIDER = 3
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


def one_turn(scene: Scene, start: Start) -> Outcome:
    """Outcome of one revolution from one start, as of a single response."""
    return Lanes(problem_of(scene, single=True), 1).run(parameters(scene), start)


def settled(name: str) -> Start:
    """A state three revolutions after the start, from a tight run: from rest these scenes are ill-posed."""
    scene = scene_of(name, "dormand-prince", 1e-9)
    start = start_states(scene, parameters(scene))
    for _ in range(3):
        start = one_turn(scene, start).end()
    return start


@pytest.mark.parametrize("name", STIFF)
def test_automatic_choice_is_right_and_cheaper(name: str):
    state = settled(name)
    exact = one_turn(scene_of(name, "dormand-prince", 1e-12), state)
    chosen = one_turn(scene_of(name, "auto", 1e-7), state)
    explicit = one_turn(scene_of(name, "dormand-prince", 1e-7), state)
    assert chosen.status == exact.status == 0.0
    # it takes implicit steps, and not only those
    assert 0.0 < chosen.stiff_steps < chosen.attempts
    missed = chosen.coordinates(4) - exact.coordinates(4)
    assert abs(missed[0, SLIDER]) < 1e-7
    # an implicit step takes the time of two explicit ones; evaluations do not tell, it has eight of them at a time
    weighted = chosen.attempts + chosen.stiff_steps
    assert weighted < 0.6 * explicit.attempts


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
