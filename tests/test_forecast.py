"""What a study is expected to simulate, from a pilot over the box, against what it does."""

from functools import partial

import numpy as np
import pytest
from formula_study import formula, scene_of

from hpcclear.base.errors import InputError
from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.study import forecast, simulations, stages

STUDY = """
[variables]
m3 = { range = [0.07, 0.28] }
[random]
m2 = { distribution = "normal", deviation = 0.01 }
[cases.robust]
random = ["C", "m2"]
objectives = ["mean", "deviation"]
[verification]
designs = 4
infill_rounds = 2
infill_designs = 6
infill_samples = 64
"""
KINDS = {
    "usual": [],
    "accurate": ["study.accuracy={mean=1e-3, deviation=2e-3}"],
    "percentile": ['study.cases.robust.objectives=[{statistic="quantile"}, {formula="m2"}]'],
    "draws": ["study.verification.samples=400"],
    "one objective": ['study.cases.robust.objectives=["deviation"]'],
}


@pytest.mark.parametrize(
    "kind",
    [
        "usual",
        "draws",
        "one objective",
        pytest.param("accurate", marks=pytest.mark.full),
        pytest.param("percentile", marks=pytest.mark.full),
    ],
)
@pytest.mark.shortened(1)
def test_a_study_takes_what_its_forecast_says(kind, monkeypatch, carried_out):
    """Within a factor of 2, as 85 % of random studies; all of them: ``python -m pytest tests/test_forecast.py -m ""``."""
    formula.replace_dynamics(monkeypatch.setattr)
    scene = scene_of(STUDY, *KINDS[kind])
    said, seconds = forecast.expected(scene, partial(sample_points, scene, ranks=alone()), 1e-6)
    assert seconds > 0.0
    counted = []

    def counting(scene, points, *arguments, **named):
        counted.append(len(points))
        return sample_points(scene, points, *arguments, **named)

    monkeypatch.setattr(simulations, "sample_points", counting)
    carried_out(scene)
    assert 0.5 * said < sum(counted) < 2.0 * said


def test_without_a_pilot_the_most_is_said():
    """Where it would take long, or its designs make no mechanism."""
    scene = scene_of(STUDY)
    most = sum(stages.samples_of(scene).values())

    def refused(points):
        raise InputError("points", 1, "make no mechanism", "Narrow the ranges")

    assert forecast.expected(scene, refused, 1e-3) == (most, 1e-3)
    assert forecast.expected(scene, np.asarray, 60.0) == (most, 60.0)
