"""An accuracy of a whole study: pairs at a stricter tolerance, and limits that hold what the tolerance takes."""

import tomllib
from collections import Counter
from types import SimpleNamespace

import formula_study
import numpy as np
import opened
import pytest
from commands import contents
from formula_study import formula, on_ranks
from refusals import refused

from hpcclear.base.outcome import Status
from hpcclear.ensemble.session import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.scene import load_scene
from hpcclear.statistics.random.pooled import together
from hpcclear.study import run_study, simulations, stages, tolerance, truth
from hpcclear.study.optimisation import Choice

STUDY = """
accuracy = { mean = 0.005, deviation = 0.01 }
[random]
m2 = { distribution = "uniform", half_width = 0.005 }
[cases]
play = ["C", "m2"]
[verification]
designs = 2
infill_rounds = 1
infill_designs = 4
"""
BIAS = 15.0  # of f over rtol: 0.15 % at 1e-4
SHARE = BIAS * (1e-4 - 1e-6) / (1.0 - 0.25)  # that of pairs at 1e-6, which leave a quarter of it


def scene_of(*overrides: str):
    return formula_study.scene_of(STUDY, "numerics.rtol=1e-4", *overrides)


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr(formula, "BIAS", BIAS)


# -- like numbers -----------------------------------------------------------------------------------


@pytest.mark.parametrize("scatter", [0.0, 0.5, 2.0])
def test_what_is_known_of_like_numbers_together_is_as_exact_as_stated(scatter):
    rng = np.random.default_rng(52)
    true = 1.0 + scatter * rng.standard_normal((400, 12))
    errors = rng.uniform(0.2, 2.0, true.shape)
    values = true + errors * rng.standard_normal(true.shape)
    each = [together(*row, 1.0) for row in zip(values, errors, strict=True)]
    found, doubt = np.moveaxis(each, 1, 0)
    assert (abs(found - true) <= 1.96 * doubt).mean() > 0.935
    assert (doubt < errors).mean() > 0.95
    assert ((found - true) ** 2).mean() < 0.7 * (errors**2).mean()


# -- pairs of values --------------------------------------------------------------------------------


apart = tolerance._apart


def drawn(seed=1, length=64):
    """Values of mean 1 and deviation 0.1."""
    return 1.0 + 0.1 * np.random.default_rng(seed).standard_normal((16, length))


def test_a_bias_is_found_to_the_last_digit_where_pairs_meet_the_same_scatter():
    exact = drawn()
    bias, error = apart(1.02 * exact, exact)
    np.testing.assert_allclose(bias, 0.02, rtol=1e-9)  # mean, deviation
    assert (error < 1e-12).all()
    wider, _ = apart(1.0 + 1.5 * (exact - 1.0), exact)
    assert wider[0] == pytest.approx(0.0, abs=5e-3)
    assert wider[1] == pytest.approx(0.5, abs=1e-3)


def test_what_chance_does_to_pairs_is_within_its_standard_error():
    """Of 60 pairs of independent draws; and the error is that of two means of 1024 values."""
    found = [apart(drawn(2 * k), drawn(2 * k + 1)) for k in range(60)]
    bias, error = (np.array([one[part][:2] for one in found]) for part in (0, 1))
    np.testing.assert_allclose(error[:, 0].mean(), np.sqrt(2.0) * 0.1 / 32.0, rtol=0.1)
    np.testing.assert_allclose((bias / error).std(axis=0), 1.0, atol=0.35)


@pytest.mark.parametrize("shift", [0.02, -0.02])
def test_quantiles_and_probabilities_move_as_f_moved_and_stretched(shift):
    rows = (
        '[{statistic="quantile", level=0.9}, {statistic="exceedance", limit="1.1 m"}, "deviation"]'
    )
    scene = scene_of(f'study.cases.play={{random=["C"], objectives={rows}}}')
    whole = np.stack([drawn(), np.zeros((16, 64))])
    part, none = np.full((1, 2), shift), np.zeros((1, 2))
    run, choice = SimpleNamespace(study=scene.required_study), Choice("", "play", {"m2": 0.2})
    bias, error = tolerance._shares(run, choice, whole, part, none)
    values = np.array([one.value for one in truth.estimates_of(run, choice, whole)])
    np.testing.assert_allclose(bias[:4], 0.02 * values[:4], rtol=1e-9)  # the quantile is the fourth
    ends = [((1.0 + x) * whole[0] > 1.1).mean() for x in (shift, -shift)]
    assert bias[4] == pytest.approx(abs(ends[0] - ends[1]) / 2.0, rel=1e-6)
    assert (error == 0.0).all()
    bias, error = tolerance._shares(run, choice, whole, none, part)
    np.testing.assert_allclose(error[:2], 0.02 * values[:2], rtol=1e-9)  # independent of each other
    assert error[3] == pytest.approx(0.02 * np.hypot(values[0], values[3] - values[0]), rel=1e-9)
    assert (bias == 0.0).all()
    taken = tolerance.Taken(np.full((1, 1, 2), 0.5), np.full((1, 1, 2), 0.5), 15)
    true = tolerance._widened(run, [choice], [whole], taken)
    assert (true["goal_lower"][0, 1], true["goal_upper"][0, 1]) == (0.0, 1.0)  # a probability
    assert true["goal_lower"][0, 2] == 0.0  # a standard deviation


def test_pairs_are_a_hundred_times_stricter_or_as_strict_as_can_be():
    tight, left = tolerance.stricter(scene_of("numerics.atol=1e-7"))
    assert (tight.numerics.rtol, tight.numerics.atol) == pytest.approx((1e-6, 1e-9))
    assert tight.numerics.max_steps == 10 * scene_of().numerics.max_steps
    assert tolerance.stricter(scene_of("numerics.max_steps=9e15"))[0].numerics.max_steps == 2**53
    assert left == pytest.approx(0.25)
    tight, left = tolerance.stricter(scene_of("numerics.rtol=1e-13"))
    assert tight.numerics.rtol == pytest.approx(1e-14)
    assert left == pytest.approx(0.5)
    tight, left = tolerance.stricter(scene_of("numerics.target_error=0.02"))
    assert (tight.numerics.target_error, left) == (0.01, 0.5)


# -- a study ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def done(carried_out):
    """A study in one go, and what it told."""
    told: list[str] = []
    return carried_out(scene_of(), notify=told.append, BIAS=BIAS), told


def exact(m2):
    """Mean and standard deviation of a design without an error of the tolerance."""
    low, high, mid = 3e-4, 1e-3, 6.5e-4
    constant = 4 - 5 * m2 + 3 * 0.14 - 10 * 0.06 + 500 * 2.6e-4
    mean = 1e-4 * constant + (0.1 + 0.5 * m2) * mid
    play, mass = (high - low) ** 2 / 12, 0.005**2 / 3
    spread = (0.1 + 0.5 * m2) ** 2 * play + 0.25 * mass * play + (0.5 * mid - 5e-4) ** 2 * mass
    return mean, spread**0.5


def test_limits_hold_the_tolerance_and_the_truth(done):
    found = opened.read(done[0] / "verification.nc")
    for k in range(found.sizes["design"]):
        one = found.isel(design=k)
        for name, true, asked in zip(
            ("mean", "deviation"), exact(float(one["m2"])), (0.005, 0.01), strict=True
        ):
            value = float(one[f"{name}_true"])
            assert float(one[f"{name}_tolerance"]) == pytest.approx(SHARE, rel=1e-3)
            assert float(one[f"{name}_within"]) > SHARE
            if (one["design"].item(), name) in (("play alpha", "mean"), ("play beta", "deviation")):
                assert float(one[f"{name}_within"]) <= asked  # what others are known to is enough
            assert float(one[f"{name}_lower"]) <= true <= float(one[f"{name}_upper"])
            half = (float(one[f"{name}_upper"]) - float(one[f"{name}_lower"])) / 2.0
            assert half == pytest.approx(value * float(one[f"{name}_within"]))


def test_limits_hold_the_truth_where_designs_differ_in_what_the_tolerance_takes(
    tmp_path, monkeypatch
):
    """Most in the middle of the front, six times as much as at its ends; and unlike in sign and size from sample to sample."""
    hold: list[bool] = []
    for seed in range(8):  # all designs of a study meet the same scatter, and are missed together
        rng = np.random.default_rng([52, seed])
        where, rough = rng.uniform(0.15, 0.35), rng.uniform(0.0, 6.0)

        def unlike(mass, play, where=where, rough=rough):
            return 1.0 + 5.0 * np.exp(-(((mass - where) / 0.06) ** 2)) + rough * np.sin(1e9 * play)

        monkeypatch.setattr(formula, "worse", unlike)
        bare = scene_of().with_({"study.accuracy": None, "study.seed": 5 + seed}).to_toml()
        scene = load_scene(tomllib.loads(bare), ["study.verification.designs=12"])
        run_study(scene, tmp_path / str(seed), alone(), progress_style="quiet")
        found = opened.read(tmp_path / str(seed) / "verification.nc")
        found = found.isel(design=np.unique(found["m2"], return_index=True)[1])
        share = found["mean_tolerance"]
        assert share.max() > 2.0 * share.min()
        for name, true in zip(("mean", "deviation"), exact(found["m2"].values), strict=True):
            within = (found[f"{name}_lower"] <= true) & (true <= found[f"{name}_upper"])
            hold += within.values.tolist()
    assert len(hold) > 200
    assert np.mean(hold) > 0.95


@pytest.mark.mpi
def test_the_number_of_ranks_changes_no_byte(done, tmp_path):
    assert contents(on_ranks(scene_of(), tmp_path, BIAS)) == contents(done[0])


def test_a_tolerance_that_dominates_is_named_with_a_better_one(tmp_path, monkeypatch):
    monkeypatch.setattr(formula, "BIAS", 100.0)  # 1 % at 1e-4
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet")
    found = opened.read(tmp_path / "it" / "verification.nc")
    assert "tolerance dominates" in found.attrs["remarks"]
    # 1.3 % of 0.25 % by halves
    assert "Lower numerics.rtol, to 1e-07 say" in found.attrs["remarks"]
    assert (found["mean_within"] > 0.01).all()


def test_numbers_are_unknown_where_their_simulations_all_fail(tmp_path, monkeypatch):
    def failing(*arguments, **named):
        records = sample_points(*arguments, **named)
        if named["stage"].startswith(("pairs", "chaos", "worst")):
            records["status"], records["objective"] = Status.STEP_CAP, np.nan
        return records

    monkeypatch.setattr(simulations, "sample_points", failing)
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet")
    assert (opened.read(tmp_path / "it/verification.nc")["mean_tolerance_error"] > 0.0).all()


def test_each_design_has_its_own_share(tmp_path, monkeypatch):
    """Samples of some lie beyond a mass from which f is ten times as wrong."""
    monkeypatch.setattr(formula, "worse", lambda mass, play: np.where(mass > 0.4, 10.0, 1.0))
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet")
    found = opened.read(tmp_path / "it" / "verification.nc")
    inner, outer = found["m2"].values < 0.39, found["m2"].values > 0.41
    assert (found["mean_tolerance"][outer] > 4.0 * SHARE).all()
    np.testing.assert_allclose(found["mean_tolerance"][inner], SHARE, rtol=0.01)
    assert inner.any()
    assert outer.any()


@pytest.fixture
def made(monkeypatch):
    """Simulations by stage and tolerance."""
    count: Counter[tuple[str, float]] = Counter()

    def counted(scene, points, *arguments, stage, **named):
        count[stage.partition(":")[0].partition("-")[0], scene.numerics.rtol] += len(points)
        return sample_points(scene, points, *arguments, stage=stage, **named)

    monkeypatch.setattr(simulations, "sample_points", counted)
    return count


def test_pairs_are_of_points_that_are_verified_anyway(tmp_path, made):
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet")
    found = opened.read(tmp_path / "it" / "verification.nc")
    # an end may stand there under several names
    _, once = np.unique(found["m2"], return_index=True)
    assert made["verification", 1e-4] == found["samples"][once].sum()
    pairs = sum(count for (stage, _), count in made.items() if stage == "pairs")
    assert pairs == 64 * len(np.unique(found["m2"])) <= stages.samples_of(scene_of())["pairs"]
    assert [rtol for stage, rtol in made if stage == "pairs"] == pytest.approx([1e-6])


@pytest.mark.parametrize("override", ["study.verification.least_samples=512", "study.verification.samples=400"])  # fmt: skip
def test_without_an_accuracy_limits_hold_the_tolerance_too(tmp_path, made, override):
    """A few pairs in every study, of independent draws as of sequences; they do not ask for more samples."""
    bare = scene_of().with_({"study.accuracy": None}).to_toml()
    scene = load_scene(tomllib.loads(bare), [override])
    run_study(scene, tmp_path / "it", alone(), progress_style="quiet")
    pairs = sum(count for (stage, _), count in made.items() if stage == "pairs")
    assert 0 < pairs <= stages.samples_of(scene)["pairs"]
    assert pairs < 0.04 * sum(made.values())
    found = opened.read(tmp_path / "it" / "verification.nc")
    np.testing.assert_allclose(found["mean_tolerance"], SHARE, rtol=1e-3)
    half = (found["mean_upper"] - found["mean_lower"]) / 2.0
    assert (half > SHARE * found["mean_true"]).all()
    assert "mean_within" not in found


# -- what is refused, and what an earlier version wrote ----------------------------------------------


@pytest.mark.parametrize(
    ("overrides", "key", "value"),
    [
        (["study.accuracy=0"], "study.accuracy", 0),
        (["study.accuracy=1.5"], "study.accuracy", 1.5),
        (["study.accuracy='tight'"], "study.accuracy", "tight"),
        (["study.accuracy={mean=-1}"], "study.accuracy.mean", -1),
        (["study.accuracy={means=0.1}"], "study.accuracy.means", 0.1),
    ],
)
def test_nonsense_is_refused_with_key_value_and_remedy(overrides, key, value):
    with refused(key) as caught:
        scene_of(*overrides)
    assert value is ... or caught.value.value == value
    assert caught.value.reason


@pytest.mark.parametrize("entry", ["0.01", "'1 %'", "{mean = 0.01, deviation = 0.01}", "{deviation = 0.01}"])  # fmt: skip
def test_one_number_stands_for_mean_and_deviation(entry):
    scene = scene_of(f"study.accuracy={entry}")
    assert scene.study.accuracy.mean == scene.study.accuracy.deviation == 0.01
    assert load_scene(tomllib.loads(scene.to_toml())) == scene
