"""The plan: cost measured on samples, the job that follows from it."""

import re
from pathlib import Path

import pytest

from hpcclear.accuracy.plan import Plan, Row, measure
from hpcclear.cli.plan import RESERVE, slurm
from hpcclear.ensemble.session import design, sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.scene import load_scene

JOBS = Path(__file__).parent.parent / "jobs"
SCENE = load_scene(JOBS / "hunt_crossley.toml").with_(
    {
        "study": {
            "samples": 512,
            "variables": {"m2": {"range": [0.105, 0.42]}, "C": {"range": ["0.3 mm", "1 mm"]}},
        },
        "numerics.transient_revolutions": 1,
        "numerics.averaged_revolutions": 1,
    }
)


@pytest.fixture
def made() -> Plan:
    rows = (Row(None, SCENE, 2e-3, ""), Row(1e-3, SCENE, 1e-3, "because"))
    return Plan(rows, 100_000, None, 3.0, 400e6, 5, workers=2)


def test_the_job_asks_for_enough(made: Plan):
    lines = "\n".join(slurm(made, made.rows[0]))
    hours, minutes, seconds = map(int, re.search(r"--time=(\d+):(\d+):(\d+)", lines).groups())
    asked = 3600 * hours + 60 * minutes + seconds
    assert asked >= RESERVE * made.wall_seconds(made.rows[0], 100_000, 2)
    assert asked <= 3.0 * made.wall_seconds(made.rows[0], 100_000, 2) + 180.0
    assert "--ntasks=2" in lines
    memory = int(re.search(r"--mem-per-cpu=(\d+)M", lines).group(1))
    assert 1.2 * 400e6 < memory * 2**20 < 3 * 400e6


def test_a_measured_plan_orders_the_ladder_and_names_its_settings():
    found = measure(SCENE, alone(), (1e-2, 1e-5))
    assert [row.error for row in found.rows] == [None, 1e-2, 1e-5]
    file, loose, strict = found.rows
    assert file.scene == SCENE
    for row in (loose, strict):
        limit = re.match(r"half-width (\S+), met by 100 %", row.reached).group(1)
        assert float(limit) <= row.error
    assert file.reached == ""
    assert found.samples == SCENE.study.samples
    assert all(row.seconds > 0.0 for row in found.rows)
    assert 50e6 < found.memory < 20e9


@pytest.mark.full
def test_core_seconds_of_a_long_run_are_predicted():
    """A minute on this process; the machine should have nothing else to do."""
    scene = SCENE.with_({"numerics.transient_revolutions": 20})
    plan = measure(scene, alone(), ())
    count = int(60.0 / plan.rows[0].seconds)
    points = design(scene.with_({"study.samples": count}), None)
    ranks = alone()
    sample_points(scene, points, ranks, stage="long")
    busy = ranks.stage_seconds["long"][0, 0]
    assert plan.rows[0].seconds * count == pytest.approx(busy, rel=0.2)
