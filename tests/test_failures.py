"""Failures are explained: by which status, in which ranges, what to do; corners are tried; plans answer in stages."""

from pathlib import Path

import numpy as np
import pytest
import report_data as data

from hpcclear.base.outcome import OUTCOME, Status
from hpcclear.cli.check import lines
from hpcclear.dynamics import evaluation
from hpcclear.ensemble.corners import MOST, corners, tried
from hpcclear.report.failures import SampledVariable, explained, where
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.designs import _cell
from hpcclear.report.screens import screen_of
from hpcclear.results.content import Results, Variable
from hpcclear.scene import load_scene

JOBS = Path(__file__).parent.parent / "jobs"


def columns(count: int, variables: int, seed: int) -> list[SampledVariable]:
    rng = np.random.default_rng(seed)
    return [SampledVariable(f"x{k}", "kg", 1.0 + rng.random(count)) for k in range(variables)]


# -- samples ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_the_range_in_which_samples_fail_is_named(seed):
    """A band of one of five variables, another one each time: it is named, with its ends, and how many fail there."""
    made, guilty = columns(500, 5, seed), seed % 5
    low = 1.0 + 0.1 * seed
    failed = (made[guilty].values > low) & (made[guilty].values < low + 0.2)
    told = where(failed, made)
    inside = made[guilty].values[failed]
    assert told.startswith(f"all at x{guilty} {inside.min():.4g} to {inside.max():.4g} kg (range 1")
    assert told.endswith(f"where {failed.sum()} of {failed.sum()} failed")


@pytest.mark.parametrize("seed", range(8))
def test_a_corner_of_two_variables_is_named_and_no_third(seed):
    made = columns(800, 5, seed)
    failed = (made[1].values < 1.3) & (made[3].values > 1.7)
    told = where(failed, made)
    assert "x1 " in told
    assert "x3 " in told
    assert not any(f"x{k} " in told for k in (0, 2, 4))
    assert told.endswith(f"where {failed.sum()} of {failed.sum()} failed")


@pytest.mark.parametrize("seed", range(8))
def test_failures_without_a_place_are_not_given_one(seed):
    """By chance one case in 100 variables passes the limit; a third of 500 samples is far from the least distance of 0.3."""
    failed = np.random.default_rng(100 + seed).random(500) < 0.3
    assert where(failed, columns(500, 5, seed)) == "spread over the ranges of all variables"


def failing_samples():
    """60 samples of which those with the lightest rods reached max_steps."""
    samples = data.samples(60, failed=1)
    light = samples["m2"] < 0.2
    samples["status"][:] = np.where(light, int(Status.STEP_CAP), 0)
    return samples, int(light.sum())


def test_samples_say_by_which_status_where_and_what_to_do():
    samples, count = failing_samples()
    (text,) = explained(samples)
    assert text.startswith(f"{count} of 60 samples step_cap: {Status.STEP_CAP.message}; all at m2 ")
    assert "(range " in text
    assert text.endswith(f". {Status.STEP_CAP.remedy}")
    assert f"{count} of 60 " in screen_of(Content(Path(), {"samples": samples})).doubt


# -- corners ---------------------------------------------------------------------------------------------


def crank_and_rod(**study):
    """Each bound by itself makes a mechanism; the longest crank with the shortest rod does not."""
    variables = {
        "r": {"path": "mechanism.crank.length", "range": [0.04, 0.07]},
        "l": {"path": "mechanism.rod.length", "range": [0.06, 0.12]},
    }
    return load_scene(JOBS / "hunt_crossley.toml").with_(
        {"study": {"samples": 8, "variables": variables, **study}}
    )


def test_all_corners_are_tried_and_those_that_make_no_mechanism_named():
    found = tried(crank_and_rod(), simulate=False)
    assert len(found.points) == 4
    assert list(map(tuple, found.points.values[list(found.refused)])) == [(0.07, 0.06)]
    told = dict(lines(found, simulate=False))
    assert told["corners"] == "4 (all corners): 3 can be assembled"
    assert told["refused"].startswith("1 of 4 corners: ")
    assert "rod" in told["refused"]


@pytest.mark.parametrize(("shortest", "word"), [(0.01, "assembled"), (0.088, "cannot turn")])
def test_short_couplers_at_which_a_linkage_does_not_close_or_locks_are_named(shortest, word):
    scene = load_scene(JOBS / "linkages" / "crank_rocker.toml")
    path = "mechanism.bodies.coupler.length"
    study = {"samples": 8, "variables": {"L": {"path": path, "range": [shortest, 0.12]}}}
    found = tried(scene.with_({"study": study}), simulate=False)
    assert list(found.refused) == [0]
    assert word in found.refused[0]


@pytest.mark.parametrize("count", [1, 3, 6, 7, 12])
def test_corners_of_many_variables_are_a_balanced_selection(count):
    scene = load_scene(JOBS / "hunt_crossley.toml")
    paths = [path for path in scene.numeric_paths() if path.startswith(("mechanism.", "joints."))][
        :count
    ]
    variables = {
        f"v{k}": {"path": path, "range": [scene.number(path), 1.001 * scene.number(path) + 1e-9]}
        for k, path in enumerate(paths)
    }
    scene = load_scene(JOBS / "hunt_crossley.toml").with_(
        {"study": {"samples": 8, "variables": variables}}
    )
    found = corners(scene).values
    assert len(found) == min(2**count, MOST)
    assert len(np.unique(found, axis=0)) == len(found)
    upper = found > found.min(axis=0)
    np.testing.assert_array_equal(upper.sum(axis=0), len(found) // 2)
    assert upper.all(axis=1).any()
    assert (~upper).all(axis=1).any()


def test_corners_that_fail_say_by_which_status_and_where(monkeypatch):
    """Of what is simulated, over two revolutions, long cranks stall."""
    seen = []

    def outcomes(scene, points):
        seen.append(scene.numerics)
        records = np.zeros(len(points), OUTCOME)
        records["status"] = np.where(points.values[:, 0] > 0.05, int(Status.STALLED), 0)
        return records

    monkeypatch.setattr(evaluation, "evaluate_records", outcomes)
    found = tried(crank_and_rod(), simulate=True)
    assert seen[0].transient_revolutions + seen[0].averaged_revolutions == 2
    told = dict(lines(found, simulate=True))
    assert told["corners"] == "4 (all corners): 2 can be assembled and complete two revolutions"
    assert told["failed"].startswith(f"1 of 4 corners stalled: {Status.STALLED.message}")
    assert told["failed"].endswith(Status.STALLED.remedy)


def test_a_percentile_without_one_end_has_no_half_width():
    ends = {"p": 13e-3, "p_lower": 12e-3, "p_upper": np.nan}
    one = Results({k: Variable((), np.array(v), {"units": "m"}) for k, v in ends.items()})
    assert _cell(one["p"], one, labels.of(one["p"])) == "13, interval not stated"
