"""Clearances of a study that are random as wear leaves them: their distribution, refusals, the study over ranks and a kill."""

import time
from pathlib import Path

import numpy as np
import opened
import pytest
from commands import finish, kill, overrides, ranks_of, run, start
from patience import crowded
from refusals import refused
from scipy import stats

import hpcclear
from hpcclear.base.errors import InputError
from hpcclear.base.quantiles import Empirical
from hpcclear.ensemble.session import design
from hpcclear.scene import load_scene
from hpcclear.scene.sampling import monte_carlo
from hpcclear.statistics.random import rules
from hpcclear.statistics.random.inputs import RandomVariable
from hpcclear.statistics.random.moments import RobustObjective
from hpcclear.statistics.surrogate.fitting import fit_kriging
from hpcclear.study import lives

SCENE = Path(__file__).parent.parent / "jobs" / "worn_study.toml"
SMALL = (
    "wear.lives=12", "wear.points=5", "wear.copies=2", "study.samples=30", "study.test_samples=8", "study.swarm.runs=1",
    "study.swarm.particles=10", "study.swarm.iterations=5", "study.verification.infill_rounds=0",
    "study.verification.designs=1", "study.verification.response_copies=2", "study.verification.response_windows=2",
    "study.surrogate.restarts=0", "study.surrogate.r2=0.5", "study.surrogate.rmae=1.0",
)  # fmt: skip


# ---- a distribution that is given by its values --------------------------------------------------


@pytest.fixture
def values():
    return Empirical(tuple(np.sort(np.random.default_rng(2).weibull(2.0, 60)).tolist()))


def test_a_gauss_rule_of_samples_is_exact_for_polynomials(values):
    nodes, weights = rules.rule(values, 6)
    known = np.array(values.values)
    for power in range(12):
        assert weights @ nodes**power == pytest.approx((known**power).mean(), rel=1e-11)
    assert abs(weights @ nodes**12 / (known**12).mean() - 1.0) > 1e-9  # and for no higher one
    nodes, weights = rules.rule(values, 70)  # more than there are values
    assert (weights > 0.0).sum() == 60
    assert weights @ nodes**40 == pytest.approx((known**40).mean(), rel=1e-12)


def test_moments_over_samples_are_those_of_each_value(values):
    rng = np.random.default_rng(4)
    bounds = np.array([[0.0, 1.0], [0.0, 3.0]])
    points = bounds[:, 0] + rng.random((60, 2)) * (bounds[:, 1] - bounds[:, 0])
    heights = np.sin(5 * points[:, 1]) + np.cos(7 * points[:, 0] * points[:, 1])
    model = fit_kriging(points, heights, bounds, rng=rng, names=("x", "c"))
    found = RobustObjective(model, ("x",), [RandomVariable("c", values)], tolerance=1e-12)
    known = np.array(values.values)
    for x in (0.1, 0.8):
        each = model.predict(np.column_stack([np.full(60, x), known]))
        expected = each.mean(), each.std()
        np.testing.assert_allclose(found(np.array([[x]]))[0], expected, rtol=1e-7)
        np.testing.assert_allclose(found.closed_form(np.array([[x]]))[0], expected, rtol=1e-7)


def test_draws_are_the_values_each_as_often():
    given = [4e-4, 3e-4, 5e-4, 3.5e-4]
    scene = load_scene(SCENE).with_(
        {f"study.random.{name}": {"distribution": "samples", "values": given} for name in ("C12", "C23")}
    )  # fmt: skip
    drawn = monte_carlo(scene, 4000).column("C12")
    there, times = np.unique(drawn, return_counts=True)
    np.testing.assert_array_equal(there, sorted(given))
    assert stats.chisquare(times).pvalue > 1e-6
    sobol = monte_carlo(scene, 64, replicate=1).column("C23")
    assert (np.unique(sobol, return_counts=True)[1] == 16).all()


# ---- what is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"wear": None}, "study.random.C12"),
        ({"wear.cycles": 1e5}, "study.random.C12.cycles"),
        ({"study.random.C12.cycles": -1.0}, "study.random.C12.cycles"),
        ({"study.random.C12.cycles": None}, "study.random.C12.cycles"),
        ({"study.random.C12.mean": 3e-4}, "study.random.C12.mean"),
        ({"joints.crank_rod.wear": None, "study.random.k12": None}, "study.random.C12"),
        ({"study.random.m2": {"distribution": "wear", "cycles": 1e5}}, "study.random.m2"),
        ({"study.variables.C12": None, "study.cases": {}}, "study.random.C12"),
        ({"study.random.m2": {"distribution": "samples", "values": [0.2]}}, "study.random.m2.values"),
        ({"study.random.m2": {"distribution": "samples", "values": [0.2, 9.0]}}, "study.random.m2"),
        ({"study.random.m2": {"distribution": "uniform", "half_width": 0.01, "values": [1, 2]}}, "study.random.m2.values"),
    ],
)  # fmt: skip
def test_what_lives_cannot_tell_is_refused(changes, key):
    with refused(key):
        load_scene(SCENE).with_(changes)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"wear.lives": 1}, "wear.lives"),
        ({"numerics.target_error": 1e-3}, "numerics.target_error"),
        (
            {"study.random.ended": {"path": "drive.speed", "distribution": "uniform", "half_width": 1.0}},
            "study.random.ended",
        ),
        (
            {"study.cases": {}, **{f"study.random.{n}": None for n in ("k12", "k23", "m2", "m3")},
             **{f"study.random.{n}.half_width": None for n in ("C12", "C23")}},
            "wear.lives",
        ),
    ],
)  # fmt: skip
def test_lives_that_cannot_be_followed_are_refused(changes, key):
    with refused(key):
        lives.check(load_scene(SCENE).with_(changes))


def test_only_a_study_follows_lives():
    scene = load_scene(SCENE)
    assert len(design(scene, None)) == 100  # a hypercube needs no distribution
    with pytest.raises(InputError, match="hpcclear run"):
        monte_carlo(scene, 4)


# ---- the study -----------------------------------------------------------------------------------


def words(folder: Path, *settings: str) -> list[str]:
    quiet = ["-o", str(folder), "--progress", "quiet"]
    return ["run", str(SCENE), *quiet, *overrides(*SMALL, *settings)]


def files(folder: Path) -> dict[str, bytes]:
    """Results but for the times."""
    found = [path for path in folder.rglob("*") if path.is_file() and path.name != "timing.nc"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("study") / "results"
    code, output = run(words(folder), 0)
    assert code == 0, output
    return folder


def test_designs_are_judged_by_the_clearances_of_lives(study):
    """Mean and deviation of the original against an independent draw of its own from the file of lives."""
    found = opened.read(study / "verification.nc").sel(design="worn original")
    last = opened.read(study / "wear.nc").sel(cycle=1e6)
    assert last.sizes["life"] == 12
    scene, rng, count = load_scene(SCENE), np.random.default_rng(6), 4000
    designs = {
        "C12": rng.choice(last.clearance.sel(joint="crank_rod").values, count),
        "C23": rng.choice(last.clearance.sel(joint="rod_slider").values, count),
        "m2": scene.number("mechanism.rod.mass") + 0.005 * rng.uniform(-1, 1, count),
        "m3": scene.number("mechanism.slider.mass") + 0.005 * rng.uniform(-1, 1, count),
    }
    f = hpcclear.evaluate(scene, designs).objective.values
    error = f.std() / np.sqrt(count)
    assert float(found.mean_true) == pytest.approx(f.mean(), abs=5.0 * error)
    assert float(found.deviation_true) == pytest.approx(f.std(ddof=1), rel=0.1)


def test_designs_are_told_over_lives_of_their_own(study, tmp_path):
    """Against the same lives by the other command, their f averaged by a finer rule."""
    found = opened.read(study / "verification.nc").sel(design="worn alpha")
    masses = (
        f"mechanism.rod.mass={float(found.m2)!r}",
        f"mechanism.slider.mass={float(found.m3)!r}",
    )
    words = ["wear", str(SCENE), "-o", str(tmp_path / "own.nc"), *overrides(*SMALL, *masses)]
    code, output = run(words, 0)
    assert code == 0, output
    own = opened.read(tmp_path / "own.nc")
    np.testing.assert_array_equal(
        own.objective, opened.read(study / "lives" / "worn_alpha.nc").objective
    )
    each = own.objective.interp(cycle=np.linspace(0.0, 1e6, 4001))
    assert float(found.life_mean) == pytest.approx(float(each.mean()), rel=1e-3)
    assert float(found.life_deviation) == pytest.approx(float(each.std()), rel=0.05)
    lives_ = each.mean("cycle").values
    half = stats.t.ppf(0.975, 11) * lives_.std(ddof=1) / np.sqrt(12)
    assert float(found.life_mean_upper - found.life_mean) == pytest.approx(half, rel=0.01)
    others = opened.read(study / "verification.nc")
    assert np.isfinite(others.life_mean.sel(design="worn original"))
    told = [
        str(name) for name in others.design.values if np.isfinite(others.life_mean.sel(design=name))
    ]
    assert sorted(told) == ["worn alpha", "worn beta", "worn original"]


@pytest.mark.nightly
@pytest.mark.mpi
def test_ranks_and_a_kill_among_the_lives_change_no_byte(study, tmp_path):
    expected = files(study)
    assert {"wear.nc", "verification.nc", "lives/worn_beta.nc"} <= expected.keys()
    folder = tmp_path / "two"
    code, output = run(words(folder), 2)
    assert code == 0, output
    assert files(folder) == expected
    folder = tmp_path / "killed"
    job, deadline = start(words(folder), 3), time.time() + crowded(120.0)
    # the lives have begun; a quick machine is through before it saves any
    while not (folder / ".wear.nc.parts").exists():
        assert job.poll() is None, finish(job)[1]
        assert time.time() < deadline
        time.sleep(0.005)
    time.sleep(0.5)
    kill(ranks_of(job)[1])
    finish(job)
    assert not (folder / "verification.nc").exists()
    code, output = run(words(folder), 3)
    assert code == 0, output
    assert files(folder) == expected


def test_ages_that_lives_do_not_reach_are_told(tmp_path):
    fast = (
        "joints.crank_rod.wear.bearing.coefficient=1e-9",
        "study.random.k12.deviation=1e-10",
        "study.random.k12.half_width=2e-10",
    )
    code, output = run(words(tmp_path / "gone", *fast), 0)
    assert code == 2, output
    assert "study.random.C12.cycles" in output


def test_a_study_says_that_its_lives_had_not_settled_and_leave_the_range(tmp_path):
    hasty = ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1", "wear.copies=4")
    narrow = "study.variables.C23.range=[0.28e-3,0.35e-3]"  # it ends behind its lives
    code, output = run(words(tmp_path / "hasty", *hasty, narrow), 0)
    assert code == 2, output
    assert "raise numerics.transient_revolutions" in output
    assert "study.variables.C23.range" in output
    assert "service lives have clearances from" in output
