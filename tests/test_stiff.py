"""The automatic choice of method on stiff scenes: when it is made, that it is right, and that it pays."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from hpcclear.dynamics.layout.views import Outcome, Start
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import implicit_method, problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.dynamics.stepping.lanes import Lanes
from hpcclear.ensemble.api import evaluate
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
    """Outcome of one revolution from one start."""
    return Lanes(problem_of(scene), 1).run(parameters(scene), start)


def settled(name: str) -> Start:
    """A state three revolutions after the start, from a tight run: from rest these scenes are ill-posed."""
    scene = scene_of(name, "dormand-prince", 1e-9)
    start = start_states(scene, parameters(scene))
    for _ in range(3):
        start = one_turn(scene, start).end()
    return start


@pytest.mark.parametrize("name", STIFF)
@pytest.mark.shortened(2)
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
    # eight implicit steps side by side take each the time of two explicit ones
    weighted = chosen.attempts + chosen.stiff_steps
    assert weighted < 0.6 * explicit.attempts


PLAY = "joints.crank_rod.clearance"


def ensemble(job: str, changes: dict, rtol: float, play: np.ndarray) -> xr.Dataset:
    """Samples of a job over the play in its first joint, two revolutions after so many as `changes` say."""
    scene = load_scene(ROOT / "jobs" / f"{job}.toml").with_({
        "study": None, "numerics.averaged_revolutions": 2, "numerics.rtol": rtol, "numerics.max_steps": 20_000,
        "joints.rod_slider.clearance": float(play.mean()), **changes,
    })  # fmt: skip
    return evaluate(scene, {PLAY: play})


def largest(found: xr.Dataset) -> np.ndarray:
    return found["peak_contact_force"].to_numpy().max(axis=1)


def test_a_film_is_as_good_and_no_dearer_at_a_loose_tolerance():
    """Its explicit steps stood at the edge of stability: peaks were five times too high at 1e-4; at 1e-3 lanes went to and fro
    between both kinds of steps until the cap on steps."""
    film = {"viscosity": 1.0, "length": "20 mm", "model": "short"}
    changes = {f"joints.{joint}.film": film for joint in ("crank_rod", "rod_slider")}
    changes["numerics.transient_revolutions"] = 0
    play = np.linspace(35e-6, 70e-6, 16)
    usual, *others = (ensemble("slider_crank", changes, one, play) for one in (1e-6, 1e-3, 1e-4))
    for loose in others:
        assert (loose["status"] == 0).all()
        assert largest(loose) == pytest.approx(largest(usual), rel=1e-3)
        f = usual["objective"].to_numpy()
        assert loose["objective"].to_numpy() == pytest.approx(f, rel=1e-6)
        assert loose["rhs_evaluations"].mean() < 1.1 * usual["rhs_evaluations"].mean()


AT_EDGE = {
    "friction that sticks": {
        "effects.friction": {"law": "coulomb", "coefficient": 0.02, "ramp_speed": 4e-4}
    },
    "contact that stays": {"effects.friction": {"law": "none"}, "effects.contact.damping": 5.0},
}


@pytest.mark.parametrize("name", AT_EDGE)
def test_forces_stand_at_a_loose_tolerance(name: str):
    """At the edge of stability errors grew to the tolerance: peaks were 2 to 60 % off, the moment up to three times too high.

    Better ones cost nothing: there steps are as short as ramp and contact want them, whatever the tolerance.
    """
    changes = AT_EDGE[name] | {
        "drive.speed": "1500 rpm", "numerics.responses": True, "numerics.transient_revolutions": 1,
    }  # fmt: skip
    play = np.linspace(4e-6, 6e-6, 8)
    exact, *others = (ensemble("hunt_crossley", changes, one, play) for one in (1e-7, 1e-3, 1e-4))
    bounds = {"slider_acceleration_deviation": 2e-3, "peak_crank_moment": 2e-2, "objective": 1e-3}
    for loose in others:
        assert largest(loose) == pytest.approx(largest(exact), rel=5e-3)
        for response, bound in bounds.items():
            values = loose[response].to_numpy()
            assert values == pytest.approx(exact[response].to_numpy(), rel=bound), response
        assert loose["rhs_evaluations"].mean() < 0.5 * exact["rhs_evaluations"].mean()


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
