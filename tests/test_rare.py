"""Rare failures: indices from few values, probabilities by importance sampling, and designs at the edge of what is allowed."""

from types import SimpleNamespace

import numpy as np
import opened
import pytest
from commands import contents
from formula_study import formula, on_ranks, scene_of
from margins import at_least, at_most, fewest
from scipy import stats

from hpcclear.base.errors import InputError
from hpcclear.base.verdict import Verdict
from hpcclear.ranks.boundary import alone
from hpcclear.report.merit import recommended
from hpcclear.scene.cases import Constraint
from hpcclear.scene.points import Points
from hpcclear.statistics.random import tail
from hpcclear.statistics.random.importance import OWN, REPEATS, Rare
from hpcclear.study import rare
from hpcclear.study.failures import Failures, WeightedDraws, excess_of

# -- indices ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("exact", [-1.0, 0.5, 2.3, 3.7])
def test_an_index_is_extrapolated_beyond_the_largest_value(exact, shift):
    """Of 256 values, the largest of which has an index of 2.9: without bias, and with a scatter that steers."""
    rng = np.random.default_rng(shift)
    found = tail.index(5.0 + 2.0 * rng.standard_normal((200, 256)), 5.0 + 2.0 * exact)
    assert found.mean() == pytest.approx(exact, abs=0.12)
    assert found.std() < 0.6


# -- probabilities ----------------------------------------------------------------------------------


def answered(asking, f):
    try:
        u = next(asking)
        while True:
            u = asking.send(f(u))
    except StopIteration:
        return


def estimated(f, dimensions: int, limit: float, seed: int, length: int = 128) -> Rare:
    made = Rare(dimensions, limit)
    answered(made.prepared(np.random.default_rng([seed, 0])), f)
    for round_ in range(1, 4):
        rngs = [np.random.default_rng([seed, round_, k]) for k in range(REPEATS)]
        answered(made.lengthened(length, rngs), f)
        if not made.begun_anew():
            break
    return made


def plane(u):
    return u.sum(axis=1) / u.shape[1] ** 0.5


def rough(u):
    """A plane with waves that are far too short to be seen: of a sine of a normal phase that is uniform."""
    return plane(u) + 0.3 * np.sin(400.0 * (u[:, 0] - u[:, 1]))


def waves(limit: float) -> float:
    phases = np.linspace(0.0, 2.0 * np.pi, 2001)[:-1]
    return float(stats.norm.sf(limit - 0.3 * np.sin(phases)).mean())


CASES = {
    "plane": (plane, 4, lambda limit: stats.norm.sf(limit)),
    "two sides": (
        lambda u: np.maximum(u[:, 0], -u[:, 1]),
        3,
        lambda limit: 1.0 - stats.norm.cdf(limit) ** 2,
    ),
    "rough": (rough, 4, waves),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("limit", [3.1, 3.9])
def test_limits_of_a_rare_failure_hold(name, limit, shift):
    """Of 1e-3 and 5e-5, by some 7000 values, in 20 repetitions; without bias, and to 15 % or better."""
    f, dimensions, exact = CASES[name]
    share = float(exact(limit))
    made = [estimated(f, dimensions, limit, 1000 * shift + seed) for seed in range(20)]
    found = [one.interval(0.95) for one in made]
    assert np.mean([one.simulations for one in made]) < 1e4
    held = sum(one.lower <= share <= one.upper for one in found)
    assert held >= fewest(20, 0.93), held
    values = np.array([one.value for one in found]) / share
    assert values.mean() == pytest.approx(1.0, abs=6 * values.std() / 20**0.5 + 1e-9)
    assert values.std() < 0.15


@pytest.mark.parametrize(("off", "expected"), [(0.0, 1.0), (0.1, 1.4)])
def test_limits_of_a_rare_failure_hold_what_the_tolerance_takes(off, expected):
    """A plane that is too low by a tenth: at 3.1 its probability is 1.37 times larger at a stricter tolerance."""
    made = estimated(plane, 4, 3.1, 3)
    before = made.interval(0.95)
    answered(made.paired(0.0), lambda u: plane(u) + off)
    found = made.interval(0.95)
    assert made.factor == pytest.approx(expected, abs=0.15)
    assert (found.lower, found.upper) == pytest.approx(
        (before.lower / made.factor, before.upper * made.factor)
    )
    if off:
        assert found.upper > stats.norm.sf(3.1 - off) > before.value


def test_what_cannot_fail_has_an_upper_limit_all_the_same():
    """f is bounded below the limit; an upper limit is that of a lower level."""
    made = estimated(lambda u: np.tanh(plane(u)), 3, 1.0 + 1e-9, 1)
    found = made.interval(0.95)
    assert (found.value, found.lower) == (0.0, 0.0)
    assert 0.0 < found.upper < 1e-6
    soon = Rare(3, 1.0 + 1e-9, negligible=1e-2)
    answered(soon.prepared(np.random.default_rng(2)), lambda u: np.tanh(plane(u)))
    assert soon.simulations < made.simulations


def chaotic(u):
    """Nothing that a density could follow, with the distribution of a normal number."""
    return stats.norm.ppf(np.mod(1e5 * u.sum(axis=1), 1.0))


@pytest.mark.parametrize(
    ("limit", "before"), [(6.0, (0, 8192)), (6.0, (1, 8192)), (2.0, (150, 8192))]
)
def test_where_weights_are_worth_nothing_all_draws_are_plain_and_count(limit, before):
    """Weighted draws would show no probability below 1e-2, and others no better than plain ones."""
    made = Rare(3, limit, 1e-12, before)
    answered(made.prepared(np.random.default_rng(1)), chaotic)
    answered(made.lengthened(128, [np.random.default_rng([2, k]) for k in range(REPEATS)]), chaotic)
    assert not made.begun_anew()
    assert made.plain
    assert (made.weights == 1.0).all()
    hits, draws = before[0] + int((made.f > limit).sum()), 8192 + 128 * REPEATS
    found = made.interval(0.95)
    assert (made.draws, found.value) == (draws, hits / draws)
    assert found.upper == pytest.approx(stats.beta.ppf(0.975, hits + 1, draws - hits))
    least = stats.beta.ppf(0.025, hits, draws - hits + 1) if hits else 0.0
    assert found.lower == pytest.approx(least)
    for f, dimensions, _ in CASES.values():
        assert not estimated(f, dimensions, 3.1, 1).plain


def test_values_that_failed_are_left_out_and_weights_are_bounded():
    def failing(u):
        return np.where(u[:, 2] > 0.0, np.nan, plane(u[:, :2]))

    made = estimated(failing, 3, 3.1, 5)
    assert (made.weights <= 1.0 / OWN).all()
    share = stats.norm.sf(3.1)
    found = made.interval(0.95)
    assert 0.5 * share < found.value < 3.0 * share


def test_inputs_too_far_out_to_make_a_mechanism_count_as_failed():
    """Importance sampling reaches further than any sample: a negative clearance ends no study."""

    def filled(names: tuple[str, ...], values: np.ndarray) -> Points:
        if (values < 0.0).any():
            raise InputError("C", -1.0, "is negative", "Narrow its distribution")
        return Points(names, values, (("joints.crank_rod.clearance",),))

    def judged(points: Points, stage: str) -> tuple[None, np.ndarray]:
        return None, 2.0 * points.values.T

    simulations = SimpleNamespace(filled=filled, judged=judged)
    run = SimpleNamespace(simulations=simulations, study=SimpleNamespace(further=()))
    values = np.array([[1.0], [-1.0], [2.0], [3.0], [-2.0]])
    np.testing.assert_array_equal(rare._valid(run, ("C",), values), values[:, 0] > 0.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rare, "rows_of", lambda run, choice, u: (("C",), u))
        (first,), (second,) = rare.simulated(run, [(None, values), (None, -values[:1])], "stage")
    np.testing.assert_array_equal(first, [2.0, np.nan, 4.0, 6.0, np.nan])
    np.testing.assert_array_equal(second, [np.nan])


# -- a study ----------------------------------------------------------------------------------------

STUDY = """
samples = 30
[variables]
m3 = { range = [0.07, 0.28] }
[random]
C = { distribution = "lognormal", mean = "0.5 mm", deviation = "0.05 mm", range = ["0.31 mm", "0.99 mm"] }
[cases.heavy]
random = ["C"]
objectives = [{ formula = "0 - m3" }, "mean"]
constraints = [{ statistic = "exceedance", limit = "0.475 mm", most = 5e-4 }]
[swarm]
particles = 16
iterations = 8
[verification]
designs = 1
most_samples = 4096
infill_rounds = 1
infill_designs = 6
"""


def share_above(values: np.ndarray, m2: float, m3: float) -> float:
    """Exactly, by the formula of the study: f is linear in C, whose quantiles are `values`."""
    constant = 1e-4 * (4 - 5 * m2 + 3 * m3 - 10 * 0.06 + 500 * 2.6e-4)
    least = (0.475e-3 - constant) / (0.1 + 0.5 * m2)
    return 1.0 - float(np.searchsorted(values, least)) / len(values)


@pytest.fixture(scope="module")
def done(carried_out):
    scene = scene_of(STUDY)
    return scene, opened.read(carried_out(scene) / "verification.nc", "verification")


def test_the_recommended_design_is_at_the_edge_of_a_rare_failure(done):
    """Plain samples of 4096 cannot show 5e-4; the heaviest slider whose share is that is met to 1 % of its mass."""
    scene, found = done
    law = scene.required_study.random_input("C").law
    values = law((np.arange(200000) + 0.5) / 200000)
    designs = zip(found["m2"].to_numpy(), found["m3"].to_numpy(), strict=True)
    shares = [share_above(values, float(a), float(b)) for a, b in designs]
    for share, verdict in zip(shares, found["constraint_verdict"].to_numpy()[:, 0], strict=True):
        assert not (verdict == Verdict.HOLDS and share > 5e-4)
    best = found.sel(design="heavy alpha")
    assert recommended(found) == "heavy alpha"
    assert best["constraint_verdict"].item() == Verdict.HOLDS
    assert int(best["rare_samples"]) > 0
    grid = [(a, b) for a in np.linspace(0.105, 0.42, 22) for b in np.linspace(0.07, 0.28, 106)]
    heaviest = max(b for a, b in grid if share_above(values, a, b) <= 5e-4)
    assert float(best["m3"]) > 0.99 * heaviest


FEW = (
    STUDY.replace(', "mean"]', "]").replace("0.475 mm", "0.21 mm").replace("samples = 4096", "samples = 1024")
)  # fmt: skip


def share_of_rough(c: np.ndarray, m3: float) -> float:
    """Exactly, of the rough f of the next test: its waves are so short that their phase is uniform, whatever c is."""
    phases = 2.0 * np.pi * np.mod(np.arange(len(c)) * 0.6180339887498949, 1.0)
    return float(np.mean(m3 + 0.02 * np.sin(phases) + 0.004 * (c - 5e-4) / 5e-5 > 0.21))


def test_few_simulations_still_show_a_design_at_the_edge(carried_out, shift):
    """f is rough, so that weighted draws scatter much: designs that nearly reach the edge stay open, one below is shown, but in
    one study of six, by 12 seeds.

    Which of them stay open, and their m2, which has no influence, are left to chance."""

    def rough(column):
        c, m3 = (column[path] for path in ("joints.crank_rod.clearance", "mechanism.slider.mass"))
        return 1e-3 * (m3 + 0.02 * np.sin(1e9 * c) + 0.004 * (c - 5e-4) / 5e-5)

    seeds, shown = range(3 + shift, 9 + shift), 0
    for seed in seeds:
        scene = scene_of(FEW, f"study.seed={seed}")
        c = scene.required_study.random_input("C").law((np.arange(400_000) + 0.5) / 400_000)
        file = carried_out(scene, objective=rough) / "verification.nc"
        found = opened.read(file, "verification").set_index(design="design")
        mass = dict(zip(found["design"].values, found["m3"].values, strict=True))
        codes = dict(zip(mass, found["constraint_verdict"].values[:, 0], strict=True))
        share = {name: share_of_rough(c, one) / 5e-4 for name, one in mass.items()}
        heaviest = max((mass[k] for k, one in codes.items() if one == Verdict.HOLDS), default=0.0)
        if codes["heavy alpha"] == Verdict.HOLDS:
            shown += 1
            assert mass["heavy alpha"] == heaviest
            at_most(share["heavy alpha"], 1.0)
            # a known part is sought, by a model that may be wrong by a factor of two
            at_least(share["heavy alpha"], 0.2)
        # lighter ones are left open as they are: they cannot be better
        open_ = [k for k, one in codes.items() if one == Verdict.UNDECIDED and mass[k] > heaviest]
        # an interval that holds 1 within a factor of two; at the edge by the model, which may be as wrong
        assert all(0.25 < share[name] < 4.0 for name in open_)
    at_least(shown, fewest(len(seeds), 5 / 6))


@pytest.mark.full
@pytest.mark.mpi
@pytest.mark.parametrize("way", ["two ranks", "in pieces"])
def test_rare_failures_have_the_same_bytes_on_any_way(way, tmp_path, monkeypatch, carried_out):
    """``python -m pytest tests/test_rare.py -m full -k same_bytes``"""
    scene = scene_of(STUDY)
    whole = contents(carried_out(scene))
    if way == "in pieces":
        formula.replace_dynamics(monkeypatch.setattr)
        assert formula.run_in_pieces(scene, str(tmp_path / "out"), alone()) > 3
    else:
        on_ranks(scene, tmp_path)
    assert contents(tmp_path / "out") == whole


@pytest.mark.parametrize(("count", "probability"), [(512, 2e-2), (512, 5e-2), (4096, 2e-2)])
def test_weighted_draws_that_miss_a_way_to_fail_are_not_believed(count, probability):
    """Of plain simulations more fail than the draws allow for: these decide. Where as many fail as they say, the draws do."""
    goal, said = Constraint(statistic="exceedance", limit=1.0, most=1e-3), 5e-4
    one = Failures.__new__(Failures)
    one.goals = [goal]
    one.drawn = {0: [WeightedDraws(0, np.zeros((REPEATS, 2)), np.full(REPEATS, said))]}
    ranks = np.random.default_rng(3).permutation(count).reshape(1, 16, -1)
    missed, fair = (np.where(ranks < round(p * count), 2.0, 0.0) for p in (probability, said))
    plain = excess_of(goal, missed, {})[:2]
    assert one.excess(0, 0, *plain, missed) == plain
    expected = tail.of_share(1e-3) - tail.of_share(said)
    assert one.excess(0, 0, 0.0, 0.0, fair)[0] == pytest.approx(expected)
