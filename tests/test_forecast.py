"""What a study is expected to simulate, from a pilot over the box, against what it does."""

import sys
import tomllib
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from hpcclear.base.errors import InputError
from hpcclear.ensemble.simulate import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.scene import load_scene
from hpcclear.study import extent, forecast, run_study, simulations

sys.path.insert(0, str(Path(__file__).parent / "mpi_programs"))

import formula

STUDY = """
[study]
seed = 3
samples = 20
test_samples = 8
[study.variables]
m2 = { range = [0.105, 0.42] }
m3 = { range = [0.07, 0.28] }
C = { range = ["0.3 mm", "1 mm"] }
[study.random]
C = { distribution = "uniform", range = ["0.3 mm", "1 mm"] }
m2 = { distribution = "normal", deviation = 0.01 }
[study.cases.robust]
random = ["C", "m2"]
objectives = ["mean", "deviation"]
[study.sensitivity]
groups = []
[study.surrogate]
r2 = 0.5
restarts = 0
[study.swarm]
particles = 10
iterations = 5
runs = 1
archive = 8
[study.verification]
designs = 4
infill_rounds = 2
infill_designs = 6
infill_samples = 64
response_windows = 2
response_copies = 2
"""
KINDS = {
    "usual": [],
    "accurate": ["study.accuracy={mean=1e-3, deviation=2e-3}"],
    "percentile": ['study.cases.robust.objectives=[{statistic="quantile"}, {formula="m2"}]'],
    "draws": ["study.verification.samples=400"],
}


@pytest.mark.parametrize(
    "kind",
    [
        "usual",
        "draws",
        pytest.param("accurate", marks=pytest.mark.full),
        pytest.param("percentile", marks=pytest.mark.full),
    ],
)
def test_a_study_takes_what_its_forecast_says(kind, tmp_path, monkeypatch):
    """Within a factor of 1.5; all of them: ``python -m pytest tests/test_forecast.py -m ""``."""
    formula.replace_dynamics(monkeypatch.setattr)
    scene = load_scene(tomllib.loads(formula.PHYSICS + STUDY), KINDS[kind])
    said, seconds = forecast.expected(scene, partial(sample_points, scene, ranks=alone()), 1e-6)
    assert seconds > 0.0
    counted = []

    def counting(scene, points, *arguments, **named):
        counted.append(len(points))
        return sample_points(scene, points, *arguments, **named)

    monkeypatch.setattr(simulations, "sample_points", counting)
    run_study(scene, tmp_path / "it", alone(), progress_style="quiet")
    assert said == pytest.approx(sum(counted), rel=0.5), (said, sum(counted))
    assert sum(counted) < 1.5 * said


def test_without_a_pilot_the_most_is_said():
    """Where it would take long, or its designs make no mechanism."""
    scene = load_scene(tomllib.loads(formula.PHYSICS + STUDY))
    most = sum(extent.samples_of(scene).values())

    def refused(points):
        raise InputError("points", 1, "make no mechanism", "Narrow the ranges")

    assert forecast.expected(scene, refused, 1e-3) == (most, 1e-3)
    assert forecast.expected(scene, np.asarray, 60.0) == (most, 60.0)
