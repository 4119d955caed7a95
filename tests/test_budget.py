"""One accuracy for a whole study: what a pilot makes of values, how it is shared out, what a study makes of it."""

import pathlib
import subprocess
import sys
import tomllib
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from commands import warm
from patience import crowded

from hpcclear.base.errors import InputError
from hpcclear.ensemble.simulate import sample_points
from hpcclear.ranks.boundary import alone
from hpcclear.results import dataset
from hpcclear.scene import load_scene
from hpcclear.statistics.random.allocation import Evidence, cheapest, evidence
from hpcclear.study import budget, extent, run_study, simulations

PROGRAMS = pathlib.Path(__file__).parent / "mpi_programs"
MPIEXEC = pathlib.Path(sys.executable).parent / "mpiexec"
sys.path.insert(0, str(PROGRAMS))

import formula  # noqa: E402

STUDY = """
[study]
seed = 3
samples = 20
test_samples = 8
accuracy = { mean = 0.001, deviation = 0.002 }
[study.variables]
m2 = { range = [0.105, 0.42] }
C = { range = ["0.3 mm", "1 mm"] }
[study.random]
C = { distribution = "uniform", range = ["0.3 mm", "1 mm"] }
m2 = { distribution = "uniform", half_width = 0.005 }
[study.cases]
play = ["C", "m2"]
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
designs = 2
infill_rounds = 1
infill_designs = 4
response_windows = 2
response_copies = 2
"""
BIAS = 15.0  # of f over rtol: 1.5 % at 1e-3, 0.15 % at 1e-4, 0.015 % at 1e-5


def scene_of(*overrides: str):
    return load_scene(tomllib.loads(formula.PHYSICS + STUDY), overrides)


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch):
    formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr(formula, "BIAS", BIAS)


# -- from values to a split -------------------------------------------------------------------------


def pilot_values(biases, noise=0.0, designs=6, length=16, seed=1):
    """Values at each tolerance and the true one: deviation a tenth of the mean, all of it too large by the biases."""
    rng = np.random.default_rng(seed)
    exact = 1.0 + 0.1 * rng.standard_normal((designs, 16, length))
    wild = [0.1 * noise * rng.standard_normal(exact.shape) for _ in range(len(biases) + 1)]
    return np.stack([exact * (1.0 + b) + w for b, w in zip((*biases, 0.0), wild, strict=True)])


def of(pairs, evaluations=None):
    count = len(pairs)
    evaluations = np.ones(count) if evaluations is None else np.array(evaluations)
    return evidence(10.0 ** -np.arange(3.0, 3.0 + count), evaluations, pairs, pairs[-1], 0.95)


def test_a_bias_is_found_and_the_error_of_independent_draws_falls_as_their_root():
    found = of(pilot_values((0.02, -0.003), length=64))
    expected = [
        [0.02 / 0.75] * 2,
        [0.003 / 0.5] * 2,
    ]  # against a tolerance that leaves a half in ten
    np.testing.assert_allclose(found.bias, expected, rtol=0.05)
    assert (found.doubt < 2e-3).all()
    np.testing.assert_allclose(found.power, 0.5, atol=0.12)
    expected = 2.13 * 0.1 / np.sqrt(1024)  # Student's t of 15
    np.testing.assert_allclose(found.reach[:, 0], expected, rtol=0.5)


def test_what_chance_does_to_pairs_is_doubt_and_no_bias():
    known = np.array([of(pilot_values((0.0,), 0.5, seed=k)).bias[0] for k in range(40)])
    doubt = np.array([of(pilot_values((0.0,), 0.5, seed=k)).doubt[0] for k in range(40)])
    apart = np.sqrt(2.0) * 0.5 * 0.1 / np.sqrt(16 * 16 * 6) / 0.5  # mean of six designs
    np.testing.assert_allclose(doubt[:, 0].mean(), apart, rtol=0.1)
    single = apart * np.sqrt(6)
    assert np.sqrt((known[:, 0] ** 2).mean()) < single  # root mean square of b alone is `single`
    assert (known == 0.0).mean() > 0.3


def test_failed_simulations_are_left_out_in_pairs():
    values = pilot_values((0.02,), length=64)
    values[0, :, 3, ::2], values[1, :, 5, 1::3] = np.nan, np.nan
    np.testing.assert_allclose(of(values).bias, [[0.04, 0.04]], rtol=0.05)


def test_a_tolerance_that_was_not_looked_at_is_not_known_and_its_price_is_that_of_the_others():
    values = pilot_values((0.02, -0.003, 0.001), length=64)
    values[[1, 3]] = np.nan
    found = of(values, [1.0, np.nan, 4.0, np.nan])
    np.testing.assert_allclose(found.bias[0], (0.02 - 0.001) / 0.75, rtol=0.05)
    assert np.isnan(found.bias[1:]).all()
    np.testing.assert_allclose(found.evaluations, [1.0, 2.0, 4.0, 8.0])
    split = cheapest(found, np.array([0.2, 0.2]), price(), (64, 2**20))
    assert split is not None
    assert split.rung == 0
    assert cheapest(found, np.array([0.01, 0.01]), price(), (64, 2**20)) is None


def test_values_without_scatter_need_no_simulations():
    found = of(np.full((2, 3, 16, 4), 2.0))
    assert found.points_for(np.array([0.01, 0.01]), 128, 4096) == 128
    assert (found.tolerance_shares(True) == 0.0).all()


EVIDENCE = Evidence(
    np.array([1e-3, 1e-4, 1e-5, 1e-6]), np.array([1.0, 1.5, 2.5, 4.0]),
    np.array([[0.01, 0.02], [0.001, 0.004], [0.0, 0.001]]), np.zeros((3, 2)),
    64, 256, np.tile([[0.002, 0.02], [0.004, 0.04]], (3, 1)), np.array([0.5, 0.5]), 0.95,
)  # fmt: skip


def price(fixed=0.0, each=1.0):
    """Evaluations by rung and points, where all is simulated at the rung."""
    return lambda rung, points: float(EVIDENCE.evaluations[rung]) * (fixed + each * points)


def test_the_share_of_a_tolerance_holds_biases_of_other_designs():
    """In 95 % of 4000 cases, where they scatter as those of the pilot's six do; by the normal quantile it were 90 %."""
    rng = np.random.default_rng(5)
    six, others = 1e-3 * rng.standard_normal((6, 4000)), 1e-3 * rng.standard_normal(4000)
    known = np.sqrt((six**2).mean(axis=0))
    inside = [
        abs(b) <= replace(EVIDENCE, bias=np.full((3, 2), k)).tolerance_shares(False)[0, 0]
        for b, k in zip(others, known, strict=True)
    ]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.012)  # 3.5 standard errors


@pytest.mark.parametrize("asked", [0.1, 0.06, 0.03, 0.015, 0.01, 0.005])
def test_the_cheapest_split_is_that_of_brute_force(asked):
    wanted, t = np.array([asked, asked]), 2.44691  # Student's quantile of six designs
    found = cheapest(EVIDENCE, wanted, price(1000.0, 10.0), (64, 2**20))
    best = np.inf
    for rung in range(3):
        room = 1.0 - (t * EVIDENCE.bias[rung] / asked) ** 2
        if room.min() <= 1.0 - 0.75**2:
            continue
        each = []
        for reach in EVIDENCE.reach:
            exact = (256 * reach**2 / (asked**2 * room)).max()
            each.append(next(2**k for k in range(6, 30) if 2**k >= exact))
        best = min(best, EVIDENCE.evaluations[rung] * (1000.0 + 10.0 * np.mean(each)))
    assert found is not None
    assert found.evaluations == pytest.approx(best)
    np.testing.assert_allclose(found.tolerance**2 + found.samples**2, wanted**2)


def test_no_tolerance_is_good_enough_for_an_accuracy_below_all_biases():
    assert cheapest(EVIDENCE, np.array([0.001, 0.001]), price(), (64, 2**20)) is None


# -- a study ----------------------------------------------------------------------------------------


def contents(place: pathlib.Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(place)): path.read_bytes()
        for path in sorted(place.rglob("*.nc"))
        if path.name != "timing.nc"
    }


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A study in one go, and what it told."""
    place, told = tmp_path_factory.mktemp("budget") / "whole", []
    with pytest.MonkeyPatch.context() as patch:
        formula.replace_dynamics(patch.setattr)
        patch.setattr(formula, "BIAS", BIAS)
        run_study(scene_of(), place, alone(), progress_style="quiet", tell=told.append)
    return place, told


def test_the_split_is_recorded_with_its_evidence(done):
    found = dataset.read(done[0] / "budget.nc", "budget")
    bias = found["bias"].to_numpy()
    rtol = found["rtol"].to_numpy()
    whole = 1.0 - 0.5 ** np.log10(rtol[:-1] / rtol[-1])  # that of the last one is allowed for
    np.testing.assert_allclose(bias[:-1, 0], BIAS * (rtol[:-1] - rtol[-1]) / whole, rtol=1e-3)
    chosen = found["rtol"].to_numpy()[found["chosen"].to_numpy() == 1]
    assert chosen == pytest.approx([1e-5])  # 0.15 % at 1e-4 are more than is asked of the mean
    squares = found["tolerance_share"] ** 2 + found["sampling_share"] ** 2
    np.testing.assert_allclose(squares, [0.001**2, 0.002**2])
    assert found.attrs["sure"] == "yes"
    assert found.attrs["pilot_evaluations"] > 0
    assert (found["reached"] <= [0.001, 0.002]).all()


def test_what_was_told_was_reached(done):
    found = dataset.read(done[0] / "verification.nc")
    low, high, mid = 3e-4, 1e-3, 6.5e-4
    for k in range(found.sizes["design"]):
        one = found.isel(design=k)
        m2 = float(one["m2"])
        constant = 4 - 5 * m2 + 3 * 0.14 - 10 * 0.06 + 500 * 2.6e-4
        mean = 1e-4 * constant + (0.1 + 0.5 * m2) * mid
        assert abs(float(one["mean_true"]) / mean - 1) <= float(one["mean_within"]) <= 0.001
        play, mass = (high - low) ** 2 / 12, 0.005**2 / 3
        spread = (0.1 + 0.5 * m2) ** 2 * play + 0.25 * mass * play + (0.5 * mid - 5e-4) ** 2 * mass
        off = abs(float(one["deviation_true"]) / spread**0.5 - 1)
        assert off <= float(one["deviation_within"]) <= 0.002


def test_the_split_is_told_before_and_what_was_reached_after(done):
    said = " ".join(done[1])
    assert "Accuracy asked at 95%: 0.1 % of the mean and 0.2 % of the deviation." in said
    assert said.index("Split: rtol 1e-05") < said.index("Reached at 95%: ")
    assert "not by" not in said
    assert "cannot be promised" not in said


def test_a_study_that_is_stopped_after_each_stage_ends_with_the_same_bytes(done, tmp_path):
    assert formula.run_in_pieces(scene_of(), str(tmp_path / "out"), alone()) > 4
    assert contents(tmp_path / "out") == contents(done[0])


@pytest.mark.mpi
def test_the_number_of_ranks_changes_no_byte(done, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(scene_of().text)
    program = warm().words([str(PROGRAMS / "formula.py"), str(scene), str(tmp_path / "out")])
    made = subprocess.run(
        [str(MPIEXEC), "-n", "2", *program, str(BIAS)],
        capture_output=True,
        text=True,
        timeout=crowded(120),
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert contents(tmp_path / "out") == contents(done[0])


def test_a_pilot_whose_loosest_tolerance_is_surely_good_enough_looks_at_few(tmp_path, monkeypatch):
    monkeypatch.setattr(formula, "BIAS", 0.01 * BIAS)  # 0.015 % at 1e-3
    run_study(scene_of(), tmp_path / "out", alone(), progress_style="quiet")
    found = dataset.read(tmp_path / "out" / "budget.nc")
    assert found["rtol"][found["chosen"] == 1].to_numpy() == pytest.approx([1e-3])
    assert np.isfinite(found["bias"][0]).all()
    assert np.isnan(found["bias"][1:]).all()
    assert np.isfinite(found["evaluations"]).all()
    assert found.attrs["sure"] == "yes"


def test_an_accuracy_below_all_tolerances_is_not_promised(tmp_path, monkeypatch):
    told: list[str] = []
    small = scene_of("study.accuracy=1e-6", "study.verification.most_samples=256")
    monkeypatch.setattr(formula, "BIAS", 1e6)
    run_study(small, tmp_path / "out", alone(), progress_style="quiet", tell=told.append)
    said = " ".join(told)
    assert "cannot be promised" in said
    assert "most_samples will end" in said
    assert "not by" in said
    found = dataset.read(tmp_path / "out" / "budget.nc")
    assert found["rtol"].min() <= 1.001e-7  # it looked further
    assert found.attrs["sure"] == "no"


def test_a_tolerance_that_alpha_needs_tighter_than_the_pilot_is_taken(tmp_path, monkeypatch):
    """Half of alpha's samples scatter beyond the largest m2, where f is ten times as wrong: the pilot's designs do not."""
    monkeypatch.setattr(formula, "BEYOND", 10.0)
    told: list[str] = []
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet", tell=told.append)
    assert any("designs are verified at 1e-06" in text for text in told)
    found = dataset.read(tmp_path / "it" / "budget.nc", "budget")
    assert found["rtol"].to_numpy()[found["chosen"].to_numpy() == 1] == pytest.approx([1e-6])
    # 0.15 % at 1e-4 are more than is asked of the mean
    assert found.attrs["searched_rtol"] == pytest.approx(1e-5)
    alpha = dataset.read(tmp_path / "it" / "verification.nc").sel(design="play alpha")
    assert float(alpha["m2"]) == pytest.approx(0.42, abs=1e-3)
    # of the bias at 1e-5, 0.08 %, a half may be left
    assert 0.0003 < float(alpha["mean_within"]) <= 0.001
    assert formula.run_in_pieces(scene_of(), str(tmp_path / "out"), alone()) > 5
    assert contents(tmp_path / "out") == contents(tmp_path / "it")


@pytest.fixture
def made(monkeypatch):
    """Simulations by stage and tolerance, the pilot's left out."""
    count: Counter[tuple[str, float]] = Counter()

    def counted(scene, points, *arguments, stage, **named):
        count[stage.partition(":")[0].partition("-")[0], scene.numerics.rtol] += len(points)
        return sample_points(scene, points, *arguments, stage=stage, **named)

    monkeypatch.setattr(simulations, "sample_points", counted)
    return count


def test_pairs_take_what_verification_simulates_anyway(tmp_path, made):
    """At the tolerance that is verified at no simulation goes to anything but the designs that the table holds."""
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet")
    found = dataset.read(tmp_path / "it" / "verification.nc")
    ends = found["samples"].sel(design=["play alpha", "play beta"]).sum()
    once = found["samples"].sum() - ends  # they are ends of the swarm too, and stand there twice
    assert made["verification", 1e-5] == once
    assert 0 < made["pairs", 1e-6] < made["verification", 1e-5]


def test_a_study_is_searched_at_a_looser_tolerance_than_it_is_verified_at(tmp_path, made):
    run_study(scene_of("study.accuracy=0.0025"), tmp_path / "it", alone(), progress_style="quiet")
    assert {rtol for stage, rtol in made if stage in ("kriging", "check", "infill")} == {1e-4}
    assert {rtol for stage, rtol in made if stage in ("verification", "chaos")} == {1e-5}


def test_pairs_of_a_loose_tolerance_are_against_one_that_shows_what_it_does(tmp_path, made, monkeypatch):  # fmt: skip
    """From 1e-3 to 1e-5 half of a bias may be left."""
    monkeypatch.setattr(formula, "BIAS", 0.01 * BIAS)
    run_study(scene_of(), tmp_path / "it", alone(), progress_style="quiet")
    assert made["verification", 1e-3] > 0
    assert [rtol for stage, rtol in made if stage == "pairs"] == pytest.approx([1e-6])


def test_no_tolerance_is_tightened_for_what_most_samples_ended(tmp_path):
    told: list[str] = []
    few = scene_of("study.verification.most_samples=128", "study.accuracy=0.002")
    run_study(few, tmp_path / "it", alone(), progress_style="quiet", tell=told.append)
    assert not any("designs are verified at" in text for text in told)
    assert "study.verification.most_samples ended them" in " ".join(told)


def test_simulations_of_a_study_are_those_of_its_split_searched_at_a_looser_tolerance():
    scene = scene_of("study.accuracy=0.0025")  # at 1e-4 0.15 %: less, but no margin
    made = budget.spread(scene, lambda label, one, points: budget.simulated(alone(), one, points))
    final = budget.settled(scene, made.split)
    assert final.numerics.rtol == made.split.rtol
    assert final.required_study.accuracy is None
    count = extent.samples_of(final, round(made.split.points))
    verified = count["verification"] + count["chaos"]
    search = count["kriging"] + count["check"] + count["infill"]
    assert sum(count.values()) == verified + search
    looser, each = (made.found.evaluations[k] for k in (made.searched, made.split.rung))
    assert made.split.evaluations == pytest.approx(verified * each + search * looser)
    assert looser < each
    assert budget.searching(scene, made).numerics.rtol == pytest.approx(1e-4)


# -- what is refused --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("overrides", "key", "value"),
    [
        (["study.accuracy=0"], "study.accuracy", 0),
        (["study.accuracy=1.5"], "study.accuracy", 1.5),
        (["study.accuracy='tight'"], "study.accuracy", "tight"),
        (["study.accuracy={mean=-1}"], "study.accuracy.mean", -1),
        (["study.accuracy={means=0.1}"], "study.accuracy.means", 0.1),
        (["numerics.rtol=1e-4"], "numerics.rtol", 1e-4),
        (["numerics.atol=1e-9"], "numerics.atol", 1e-9),
        (["numerics.target_error=1e-3"], "numerics.target_error", 1e-3),
        (["numerics.averaged_revolutions='auto'"], "numerics.averaged_revolutions", "auto"),
        (["study.verification.samples=100"], "study.verification.samples", 100),
        (["study.verification.method='monte-carlo'"], "study.verification.method", "monte-carlo"),
        (["study.verification.infill_samples=64"], "study.verification.infill_samples", 64),
        (["study.verification.least_samples=64"], "study.verification.least_samples", 64),
        (["study.verification.accuracy.mean=0.01"], "study.verification.accuracy", ...),
        (["study.cases={}"], "study.accuracy", ...),
    ],
)
def test_nonsense_is_refused_with_key_value_and_remedy(overrides, key, value):
    with pytest.raises(InputError) as caught:
        scene_of(*overrides)
    assert caught.value.key == key
    assert value is ... or caught.value.value == value
    assert caught.value.reason
    assert caught.value.remedy


@pytest.mark.parametrize("entry", ["0.01", "'1 %'", "{mean = 0.01, deviation = 0.01}", "{deviation = 0.01}"])  # fmt: skip
def test_one_number_stands_for_mean_and_deviation(entry):
    scene = scene_of(f"study.accuracy={entry}")
    assert scene.study.accuracy.mean == scene.study.accuracy.deviation == 0.01
    assert load_scene(tomllib.loads(scene.to_toml())) == scene
