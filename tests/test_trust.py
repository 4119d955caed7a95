"""How far a result says it can be trusted: half-widths by replicas, flags."""

import numpy as np
import pytest
from margins import at_least, at_most, bootstrap, fewest, ratio_of_medians

from hpcclear.base.outcome import Flag, Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.evaluation.evaluator import PERTURBATIONS
from hpcclear.ensemble.api import as_points
from hpcclear.scene import load_scene
from hpcclear.scene.points import latin_hypercube

SCENE = "jobs/quickstart.toml"


@pytest.fixture(scope="module")
def box(shift):
    """600 random scenes of Table 3's box, C from 0.3 to 1 mm, each with its uncertainty at two tolerances."""
    scene = load_scene(SCENE, [f"study.seed={2 + shift}"])
    points = latin_hypercube(scene, 600)
    both = (scene.with_({"numerics.rtol": rtol}) for rtol in (1e-6, 3e-7))
    return [evaluate_records(one, points, perturbations=PERTURBATIONS) for one in both]


def test_runs_at_two_tolerances_overlap_within_their_stated_uncertainties(box):
    one, other = box
    apart = np.abs(one["objective"] - other["objective"])
    stated = one["objective_uncertainty"] + other["objective_uncertainty"]
    at_least(np.count_nonzero(apart <= stated), fewest(len(apart), 0.95))


def test_the_stated_uncertainty_is_no_excuse(box):
    """Its median is at most three times the median difference: 2.2 to 2.7 and 1.5 to 1.8 times over three seeds.

    The ratio scatters by an eighth over 600 scenes, so it is its lower limit that must not pass 3.
    """
    one, other = box
    apart = np.abs(one["objective"] - other["objective"])
    for records in box:
        stated = records["objective_uncertainty"]
        at_most(bootstrap(ratio_of_medians, stated, apart, side="lower"), 3.0)


def test_well_posed_scenes_state_a_small_uncertainty(shift):
    contact = 'effects.contact={law="hunt-crossley", damping=0.5}'
    seed = f"study.seed={1 + shift}"
    scene = load_scene(SCENE, [contact, seed])
    records = evaluate_records(scene, latin_hypercube(scene, 24), perturbations=PERTURBATIONS)
    at_most(np.median(records["objective_uncertainty"] / records["objective"]), 1e-5)
    assert (records["flags"] & Flag.LATCHED == 0).all()


def test_penetration_beyond_hertz_is_flagged():
    scene = load_scene("jobs/slider_crank.toml")
    record = evaluate_records(scene, as_points(scene, {"m1": 0.3}))[0]
    assert record["flags"] & Flag.BEYOND_HERTZ
    # a wide clearance at a low speed hardly deforms
    wide = {f"joints.{joint}.clearance": 1e-3 for joint in ("crank_rod", "rod_slider")}
    gentle = scene.with_({"drive.speed": "60 rpm", **wide})
    record = evaluate_records(gentle, as_points(gentle, {"m1": 0.3}))[0]
    assert record["status"] == Status.OK
    assert not record["flags"] & Flag.BEYOND_HERTZ


def test_an_impact_just_before_the_end_of_a_revolution_is_met():
    """This sample strikes within the last 1 % of a step that would end the revolution; it was tried for ever once."""
    scene = load_scene(
        "jobs/slider_crank.toml",
        [
            "mechanism.rod.mass=0.34291349981467410",
            "mechanism.rod.mass_center=0.10129649712920465",
            "mechanism.rod.inertia=0.0014369236130354981",
            "mechanism.slider.mass=0.20708013443922535",
            "joints.crank_rod.clearance=0.001",
            "joints.rod_slider.clearance=0.001",
            "numerics.max_steps=20000",
        ],
    )
    for method in ("auto", "fehlberg"):
        record = evaluate_records(
            scene.with_({"numerics.method": method}), as_points(scene, {"m1": 0.3}), 1
        )
        assert record["status"] == Status.OK


LAWS = (
    {"law": "lankarani-nikravesh", "restitution": 0.9},
    {"law": "hunt-crossley", "damping": 0.5},
)
CHAOTIC = (LAWS[0], 1e-5)


@pytest.mark.parametrize(
    ("contact", "rtol"),
    [
        pytest.param(
            contact,
            rtol,
            marks=[] if (contact, rtol) == CHAOTIC else pytest.mark.full,
            id=f"{contact['law']}-{rtol:g}",
        )
        for contact in LAWS
        for rtol in (1e-5, 1e-7, 1e-9)
    ],
)
def test_the_stated_uncertainty_holds_the_true_objective(contact, rtol, shift):
    """In 94 % or more, its median 1.7 to 2.7 times the error's, over 2000 designs (`analysis/uncertainty.py`); asked: 92 %, 3.

    A stricter copy may reach the step cap; what is not known counts as not held.
    """
    scene = load_scene(SCENE, [f"study.seed={3 + shift}"]).with_({"effects.contact": contact})
    points = latin_hypercube(scene, 300)
    truth = evaluate_records(scene.with_({"numerics.rtol": 1e-11}), points)["objective"]
    records = evaluate_records(
        scene.with_({"numerics.rtol": rtol}), points, perturbations=PERTURBATIONS
    )
    error, stated = np.abs(records["objective"] - truth), records["objective_uncertainty"]
    at_least(np.count_nonzero(error <= stated), fewest(len(truth), 0.92))
    known = np.isfinite(stated)
    at_most(bootstrap(ratio_of_medians, stated[known], error[known], side="lower"), 3.0)
