"""Objectives of chosen joints: what the kernel averages and what records hold, of a slider-crank and of a linkage."""

from pathlib import Path

import numpy as np
import pytest
from running import scene_with

from hpcclear import load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.ensemble.api import evaluate

ROOT = Path(__file__).parents[1]
SHORT = {"numerics.transient_revolutions": 0, "numerics.averaged_revolutions": 2}
ROCKER = ROOT / "jobs" / "linkages" / "crank_rocker.toml"


def of(scene, *joints, objective=None):
    """The scene with its objective of these joints."""
    changes = {**SHORT, "numerics.objective_joints": joints}
    return scene.with_(changes | ({"study.objective": objective} if objective else {}))


@pytest.mark.parametrize(("path", "joint", "place"), [
    (ROOT / "jobs" / "quickstart.toml", "rod_slider", 1),
    (ROCKER, "o3", 1),
])  # fmt: skip
def test_f_is_the_mean_gap_of_the_joint_that_is_named(path, joint, place):
    """And every other number is what it is without a choice."""
    scene = load_scene(path)
    every, one = (simulate(of(scene, *names)) for names in ((), (joint,)))
    gaps = every["mean_gap"].to_numpy()
    assert float(every["objective"]) == pytest.approx(np.hypot(*gaps), rel=1e-15)
    assert float(one["objective"]) == gaps[place]
    np.testing.assert_array_equal(one["mean_gap"], gaps)
    assert one.attrs["objective"] == f"mean gap between journal and bearing, of {joint}"


def test_all_joints_named_is_none_named():
    scene = load_scene(ROCKER)
    every, both = (simulate(of(scene, *names)) for names in ((), ("o3", "o2")))
    assert float(every["objective"]) == float(both["objective"])


@pytest.mark.parametrize("name", ["mean-contact-force", "peak-contact-force"])
def test_forces_are_of_the_joint_that_is_named(name):
    scene = load_scene(ROCKER)
    columns = {"mechanism.bodies.coupler.mass": [0.25, 0.3, 0.35]}
    field = name.replace("-", "_")
    for joint in ("o2", "o3"):
        found = evaluate(of(scene, joint, objective=name), columns)
        np.testing.assert_array_equal(found["objective"], found[field].sel(joint=joint))
        assert found.attrs["objective"].endswith(f", of {joint}")
    both = evaluate(of(scene, objective=name), columns)
    np.testing.assert_array_equal(both["objective"], both[field].max("joint"))


@pytest.mark.parametrize(("joints", "objective", "said"), [
    (("o1",), None, "'o1' is not a joint with clearance"),
    (("o2", "o2"), None, "named twice"),
    (("o2",), "peak-crank-moment", "is of no joint"),
])  # fmt: skip
def test_a_choice_that_means_nothing_is_refused(joints, objective, said):
    with pytest.raises(InputError, match=said) as caught:
        of(load_scene(ROCKER), *joints, objective=objective)
    assert caught.value.key == "numerics.objective_joints"
    bare = {"study": None, "numerics.objective": objective, "numerics.objective_joints": joints}
    with pytest.raises(InputError, match=said.replace("is of", 'numerics.objective = ".*" is of')):
        load_scene(ROCKER).with_(bare)


def test_limits_are_of_all_joints():
    with pytest.raises(InputError, match="all joints"):
        of(scene_with({"numerics.target_error": 0.01}), "crank_rod")
