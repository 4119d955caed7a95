"""What a study is expected to simulate, from a pilot over the box, against what it does."""

from functools import partial

import numpy as np
import pytest
from formula_study import formula, scene_of

from hpcclear.base.errors import InputError
from hpcclear.ensemble.samples import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.study import extent, forecast, simulations

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
    "statistics": ['study.surrogate.of="statistics"'],
    "one objective": ['study.cases.robust.objectives=["deviation"]'],
}


@pytest.mark.parametrize(
    "kind",
    [
        "usual",
        "draws",
        "statistics",
        "one objective",
        pytest.param("accurate", marks=pytest.mark.full),
        pytest.param("percentile", marks=pytest.mark.full),
    ],
)
@pytest.mark.shortened(1)
def test_a_study_takes_what_its_forecast_says(kind, monkeypatch, carried_out):
    """Within a factor of 1.5; all of them: ``python -m pytest tests/test_forecast.py -m ""``."""
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
    assert said == pytest.approx(sum(counted), rel=0.5), (said, sum(counted))
    assert sum(counted) < 1.5 * said


def rough(column):
    c = column["joints.crank_rod.clearance"]
    return 1e-4 * (column["mechanism.slider.mass"] + np.sin(1e9 * c)) + 0.1 * c


@pytest.mark.parametrize(("f", "search"), [(formula.objective, "f"), (rough, "statistics")])
def test_a_pilot_shows_which_search_follows(f, search, monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr(formula, "objective", f)
    said = {}
    for of in ("", "f", "statistics"):
        scene = scene_of(STUDY, *([f'study.surrogate.of="{of}"'] if of else []))
        pilot = partial(sample_points, scene, ranks=alone())
        said[of], _ = forecast.expected(scene, pilot, 1e-6)
    assert said["f"] != said["statistics"]
    assert said[""] == said[search]


def test_without_a_pilot_the_most_is_said():
    """Where it would take long, or its designs make no mechanism."""
    scene = scene_of(STUDY)
    most = sum(extent.samples_of(scene).values())

    def refused(points):
        raise InputError("points", 1, "make no mechanism", "Narrow the ranges")

    assert forecast.expected(scene, refused, 1e-3) == (most, 1e-3)
    assert forecast.expected(scene, np.asarray, 60.0) == (most, 60.0)
