"""Searches of pymoo in the swarm's place: fronts, evaluations, constraints, bits, and what is said where it is missing."""

import subprocess
import sys

import formula
import numpy as np
import opened
import pytest
from formula_study import whole
from refusals import refused
from test_mopso import dtlz2

from hpcclear.ranks.boundary import alone
from hpcclear.scene.stages import FEWEST
from hpcclear.statistics.search import foreign
from hpcclear.statistics.search.asking import SearchTask, SwarmSettings, minimise
from hpcclear.statistics.search.pareto import Front, hypervolume
from hpcclear.study import run_study

UNIT = np.array([[0.0, 1.0]] * 6)


def search(name: str, function=dtlz2, seed: int = 1, bounds=UNIT, objectives: int = 3) -> Front:
    rng = np.random.default_rng(seed)
    task = SearchTask(bounds, objectives, rng, 50, SwarmSettings(particles=40))
    return minimise(getattr(foreign, name)(task), function, task, 60)


@pytest.mark.parametrize("name", foreign.ALGORITHMS)
@pytest.mark.shortened(3)
def test_the_front_of_dtlz2_is_found_with_the_evaluations_of_a_swarm(name):
    """The octant of the unit sphere: the hypervolume below 1.1 is 0.807 with endless points, 0.71 to 0.74 with 60."""
    asked = []

    def counted(points):
        asked.append(points)
        return dtlz2(points)

    found = search(name, counted)
    assert sum(map(len, asked)) == 2000
    assert all(((points >= 0.0) & (points <= 1.0)).all() for points in asked)
    assert hypervolume(found.values, np.full(3, 1.1)) > 0.69
    assert len(found.values) == 60
    np.testing.assert_array_equal(dtlz2(found.points), found.values)
    better = (found.values[:, None] <= found.values).all(axis=2)
    assert better.sum() == 60  # each but for itself
    assert (np.diff(found.values[:, 0]) >= 0.0).all()


@pytest.mark.parametrize("name", foreign.ALGORITHMS)
@pytest.mark.shortened(3)
def test_a_seed_has_its_bits(name):
    first, again, other = (search(name, seed=seed) for seed in (3, 3, 4))
    assert first.points.tobytes() == again.points.tobytes()
    assert first.values.tobytes() == again.values.tobytes()
    assert first.points.tobytes() != other.points.tobytes()


@pytest.mark.parametrize("name", foreign.ALGORITHMS)
@pytest.mark.shortened(3)
def test_constraints_are_handed_over_and_kept(name):
    """Least x and least y where x + y >= 1: without the constraint everything goes to nought, with it to a line."""
    broken = []

    def line(points):
        missing = 1.0 - points[:, 0] - points[:, 1]
        broken.append((missing > 0.0).mean())
        return points[:, :2] * (1.0 + points[:, 2:].sum(axis=1, keepdims=True)), missing

    found = search(name, line, bounds=UNIT[:3], objectives=2)
    assert (found.points[:, 0] + found.points[:, 1] >= 1.0).all()
    assert sum(broken) > 0.0
    assert hypervolume(found.values, np.full(2, 1.1)) > 0.6  # 0.71 with endless points


def test_designs_that_fail_stand_on_no_front():
    failed = []

    def half(points):
        values = dtlz2(points)
        failed.append((points[:, 0] > 0.5).sum())
        values[points[:, 0] > 0.5] = np.nan
        return values

    found = search("NSGA2", half)
    assert 0 < sum(failed) < 1000  # it turns away from them
    assert np.isfinite(found.values).all()
    assert (found.points[:, 0] <= 0.5).all()
    nothing = search("NSGA3", lambda points: np.full((len(points), 3), np.nan))
    assert len(nothing.values) == 0


# -- in a study -------------------------------------------------------------------------------------


def scene_of(*overrides: str):
    small = (
        "study.samples=30",
        "study.verification.infill_rounds=0",
        "study.verification.designs=2",
    )
    algorithm = ("study.sensitivity.groups=[]", "study.swarm.algorithm=pymoo:NSGA2")
    return whole(*small, *algorithm, *overrides)


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)


def test_a_study_searches_with_it_to_the_same_bytes(tmp_path):
    for place in ("one", "two"):
        run_study(scene_of(), tmp_path / place, alone(), progress_style="quiet")
    for name in ("front.nc", "verification.nc"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    front = opened.read(tmp_path / "one" / "front.nc", "front")
    least = front["m2"].where(front["deviation"] == front["deviation"].min("solution"))
    np.testing.assert_allclose(least.min("solution"), 0.105, atol=0.02)  # as the swarm finds it
    swarm = scene_of().with_({"study.swarm.algorithm": None})
    run_study(swarm, tmp_path / "swarm", alone(), progress_style="quiet")
    other = opened.read(tmp_path / "swarm" / "front.nc", "front")
    assert front["mean"].shape != other["mean"].shape or not front["mean"].equals(other["mean"])


def test_where_pymoo_is_missing_it_is_said_before_anything_is_simulated(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymoo", None)
    with refused("study.swarm.algorithm", reason="not installed", remedy="pip install 'pymoo>="):
        run_study(scene_of(), tmp_path / "none", alone(), progress_style="quiet")
    assert not (tmp_path / "none").exists()


def test_the_swarm_needs_no_pymoo():
    code = "import sys; sys.modules['pymoo'] = None; import hpcclear.study, hpcclear.statistics.search.foreign"
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("entry", "key", "reason"),
    [
        ("study.swarm.algorithm=pymoo:NSGA5", "study.swarm.algorithm", "there is no pymoo.py"),
        ("study.swarm.algorithm=NSGA2", "study.swarm.algorithm", "not a known search"),
        (f"study.swarm.particles={FEWEST - 1}", "study.swarm.particles", f"at least {FEWEST}"),
    ],
)
def test_what_it_cannot_be_is_refused(entry, key, reason):
    with refused(key, reason=reason):
        scene_of(entry)
