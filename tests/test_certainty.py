"""Numbers with limits: replicates, what can be told apart, and which designs are simulated until they decide."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit

from hpcclear.base.student import student
from hpcclear.scene import load_scene
from hpcclear.scene.sampling import monte_carlo
from hpcclear.scene.stages import REPLICATES
from hpcclear.statistics.random.replicates import limits, moments, quantile, surely_less
from hpcclear.statistics.search.certainty import Compared
from hpcclear.study import contest, tolerance, truth
from hpcclear.study.optimisation import Choice

ROBUST = Path(__file__).parent.parent / "jobs" / "robust_slider_crank.toml"
CASE = ("C", "m2", "m3", "u2", "I2")
DESIGN = {"m2": 0.2, "m3": 0.14, "u2": 0.06, "I2": 3e-4}


@pytest.mark.parametrize("confidence", [0.0, 0.1, 0.5, 0.95, 0.99, 0.9999, 0.999999])
def test_quantiles_of_student_are_those_of_scipy(confidence):
    for freedom in (*range(1, 70), 99, 100, 511, 999, 1000, 1001, 2.5, 1e5):
        expected = stdtrit(freedom, 0.5 + 0.5 * confidence)
        assert student(confidence, freedom) == pytest.approx(expected, rel=1e-10, abs=1e-14)
    assert math.isnan(student(confidence, 0))
    assert student(1.0, 3) == math.inf


def points(scene, count=64, first=0, replicate=0, **more):
    return monte_carlo(
        scene, count, random=CASE, design=DESIGN, first=first, replicate=replicate, **more
    ).values


# -- scrambled sequences ----------------------------------------------------------------------------


def test_a_longer_sequence_begins_with_the_shorter_one():
    scene = load_scene(ROBUST)
    whole = points(scene, 64)
    np.testing.assert_array_equal(whole[:32], points(scene, 32))
    np.testing.assert_array_equal(whole[32:], points(scene, 32, first=32))


# -- limits -----------------------------------------------------------------------------------------


def sobol(dimensions, length, seed):
    from scipy.stats import qmc

    rng = np.random.default_rng(seed)
    return np.stack(
        [qmc.Sobol(dimensions, scramble=True, rng=rng).random(length) for _ in range(REPLICATES)]
    )


FUNCTIONS = {
    "smooth": lambda u: np.exp(u[..., 0]) + u[..., 1] * u[..., 2],
    "kink": lambda u: abs(u[..., 0] - 0.4) + 0.3 * abs(u[..., 1] - u[..., 2]),
    "rough": lambda u: u[..., 0] + 0.2 * np.sin(1e4 * u[..., 0] * (1 + u[..., 1])),
}


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("method", ["qmc", "monte-carlo"])
def test_limits_hold_as_often_as_they_say(name, method):
    """200 repeats of mean, deviation and 95th percentile; 184 is two deviations below 190."""
    function, rng = FUNCTIONS[name], np.random.default_rng(5)
    truth = function(rng.random((2_000_000, 3)))
    exact = truth.mean(), truth.std(), np.quantile(truth, 0.95)
    held = np.zeros(3, int)
    for seed in range(200):
        if method == "qmc":
            values = function(sobol(3, 32, seed))
        else:
            values = function(np.random.default_rng(seed).random((512, 1, 3)))
        for k, one in enumerate(moments(values)):
            held[k] += (
                abs(one.value - exact[k])
                <= student(0.95, one.freedom) * one.error + 5e-4 * exact[k]
            )
        found = quantile(values, 0.95, 0.95)
        lower, upper = found.lower, found.upper
        held[2] += lower <= exact[2] <= upper
    assert (held >= 184).all(), held


def test_draws_have_the_classical_errors():
    values = np.random.default_rng(1).normal(3.0, 2.0, 1000)
    mean, deviation = moments(values[:, None])
    assert mean.value == pytest.approx(values.mean(), rel=1e-12)
    assert mean.error == pytest.approx(values.std(ddof=1) / 1000**0.5, rel=1e-12)
    assert deviation.value == pytest.approx(values.std(ddof=1), rel=1e-12)
    fourth = ((values - values.mean()) ** 4).mean()
    classical = np.sqrt((fourth - values.var() ** 2) / 1000) / (2 * values.std())
    assert deviation.error == pytest.approx(classical, rel=2e-3)


def test_failed_values_are_left_out_and_too_few_say_nothing():
    values = np.random.default_rng(2).random((16, 8))
    values[3] = np.nan
    values[5, 2:] = np.nan
    mean, deviation = moments(values)
    known = values[np.isfinite(values)]
    assert mean.value == pytest.approx(known.mean())
    assert mean.freedom == 14
    assert 0 < mean.error < 0.1
    assert deviation.value == pytest.approx(known.std(), rel=1e-2)
    few = np.full((16, 8), np.nan)
    few[:3, 0] = 1.0
    assert all(np.isnan(one.value) and np.isnan(one.error) for one in moments(few))
    none = quantile(few, 0.95, 0.95)
    assert np.isnan([none.value, none.lower, none.upper]).all()


# -- what can be told apart -------------------------------------------------------------------------


def test_common_scatter_tells_apart_what_single_limits_do_not():
    rng = np.random.default_rng(3)
    scatter = rng.normal(0.0, 1.0, 16)
    shifts = np.stack([scatter, scatter + rng.normal(0.0, 0.01, 16)])
    less = surely_less(np.array([5.0, 5.1]), shifts, 0.95)
    assert less.tolist() == [[False, True], [False, False]]
    apart = rng.normal(0.0, 1.0, (2, 16))
    assert not surely_less(np.array([5.0, 5.1]), apart, 0.95).any()


def compared(values, error=1e-3):
    shifts = np.random.default_rng(4).normal(0.0, error * 4.0, (2, len(values), 16))
    return Compared(np.array(values, float), shifts - shifts.mean(axis=2, keepdims=True), 0.95)


@pytest.mark.parametrize("size", [1e-9, 1.0, 3e4])
def test_round_off_makes_no_number_less_than_another(size):
    """Two designs with the same scatter have the same deviation but for its last bit: no replicate tells them apart."""
    values = size * np.array([1.0, 1.0 - 2e-16, 1.0 - 1e-9])
    shifts = np.tile(0.01 * size * np.random.default_rng(1).standard_normal(16), (3, 1))
    less = surely_less(values, shifts, 0.95)
    assert not less[:2, :2].any()
    assert less[2, :2].all()


def test_each_design_of_a_front_is_surely_better_than_each_other_somewhere():
    values = [
        (1, 5),
        (1.0005, 4),
        (2, 3),
        (2.0005, 3.0002),
        (3, 2),
        (4, 2.0003),
        (5, 5),
        (np.nan, 0),
    ]
    found = compared(values)
    assert found.best(0) == 1  # no worse in the first that could be told, and better in the second
    assert found.best(1) == 4
    front = found.front(10)
    assert set(front) == {1, 2, 4}
    assert found.one[2, 3]
    assert not found.one[0, 1]
    assert found.beaten.tolist() == [False] * 6 + [True, False]
    assert found.front(2) == [1, 4]


def test_a_design_that_is_nowhere_better_but_for_round_off_is_on_no_front():
    """The worse of two designs is farther from all others, and lies in what both have alike a last bit lower."""
    values = np.array([(1.0, 3.0), (2.0, 2.0), (2.5, 2.0 * (1.0 - 2e-16))])
    noise = np.random.default_rng(4).normal(0.0, 1e-3, (3, 16))
    shifts = np.stack([noise, np.tile(noise[0], (3, 1))])
    assert Compared(values, shifts, 0.95).front(10) == [0, 1]


# -- which end is one -------------------------------------------------------------------------------


def raced(monkeypatch, contest: int, origin: str = "search", last: str = "") -> list[int]:
    """Simulations of three designs of deviations 0.1, 0.1005 and 0.2 after 512, where 0.5 % is asked for."""
    scene = load_scene(ROBUST).with_(
        {
            "study.cases": {"one": {"random": ["C"], "objectives": ["deviation"]}},
            "study.accuracy": {"mean": 0.5, "deviation": 0.005},
            "study.verification": {"contest": contest, "most_samples": 4096},
        }
    )  # fmt: skip
    run = SimpleNamespace(study=scene.required_study)
    choices = [Choice("", "one", {"m2": 0.2 + 0.01 * k}, origin=origin) for k in range(3)]
    if last:
        choices[2] = Choice(last, "one", {"m2": 0.22}, origin="given")
    rng = np.random.default_rng(6)

    def drawn(run, some, stage, count, first=0):
        widths = [(0.1, 0.1005, 0.2)[choices.index(one)] for one in some]
        return [
            np.stack([1.0 + w * rng.standard_normal((16, count)), np.zeros((16, count))])
            for w in widths
        ]

    monkeypatch.setattr(truth, "drawn", drawn)
    made = drawn(run, choices, "", 32)
    return [one[0].size for one in truth.made(run, choices, made)]


def test_who_contests_an_end_gets_more_simulations(monkeypatch):
    """The one that is twice as wide is out at once; of the others each may get `contest` times the simulations of the least."""
    *close, third = raced(monkeypatch, 64)
    assert (max(close), third) == (4096, 512)  # most_samples
    assert min(close) > 512
    assert raced(monkeypatch, 64, "given") == [512, 512, 512]


def test_the_baseline_gets_as_many_simulations_as_the_best(monkeypatch):
    """It cannot be the best, but all changes are measured from it; other given designs stay as they are."""
    *close, third = raced(monkeypatch, 64, last="one original")
    assert third == max(close) == 4096
    assert raced(monkeypatch, 64, last="one printed")[2] == 512


def test_a_design_is_decided_before_a_verification_ends(monkeypatch):
    """Both percentiles are known well enough for their accuracy, and neither design is shown to keep its bound."""
    bound = {"statistic": "quantile", "level": 0.5, "most": 1.0}
    case = {"random": ["C"], "objectives": ["mean"], "constraints": [bound]}
    changes = {"study.cases": {"one": case}, "study.accuracy": {"mean": 0.5, "quantile": 0.5}}
    scene = load_scene(ROBUST).with_(changes | {"study.verification.most_samples": 8192})
    run = SimpleNamespace(study=scene.required_study)
    choices = [Choice("", "one", {"m2": 0.2 + 0.01 * k}, origin="search") for k in range(2)]
    rng = np.random.default_rng(6)

    def drawn(run, some, stage, count, first=0):
        values = [0.995 + 0.1 * rng.standard_normal((16, count)) for _ in some]
        return [np.stack([one, np.zeros_like(one)]) for one in values]

    monkeypatch.setattr(truth, "drawn", drawn)
    made = truth.made(run, choices, drawn(run, choices, "", 32))
    chances = [contest.shown(run, *one, 2) for one in zip(choices, made, strict=True)]
    assert max(chances) == 1.0


QUANTILE = {"statistic": "quantile", "level": 0.9, "most": 1.0}
RARE = {"statistic": "exceedance", "limit": 1.0, "most": 1e-3}


@pytest.mark.parametrize(
    ("bounds", "lengths"),
    [([], [8, 16, 24, 32, 48]), ([QUANTILE], [8, 16, 32, 64, 128]), ([RARE], [8, 16, 24, 32, 48])],
)
def test_designs_grow_by_half_unless_each_look_decides(bounds, lengths):
    case = {"random": ["C"], "objectives": ["mean"], "constraints": bounds}
    scene = load_scene(ROBUST).with_({"study.cases": {"one": case}})
    run, found = SimpleNamespace(study=scene.required_study), lengths[:1]
    for _ in lengths[1:]:
        found.append(contest.longer(run, Choice("", "one", {}), np.empty((2, 16, found[-1]))))
    assert found == lengths


def test_pairs_of_cases_that_grow_differently_are_no_more_than_their_designs(monkeypatch):
    cases = {
        "a": {"objectives": ["mean"], "constraints": [QUANTILE]},
        "b": {"objectives": ["mean"]},
    }
    cases = {name: {"random": ["C"]} | one for name, one in cases.items()}
    scene = load_scene(ROBUST).with_({"study.cases": cases})
    run = SimpleNamespace(study=scene.required_study, scene=scene, simulations=SimpleNamespace())
    run.of = lambda scene: SimpleNamespace(simulations=SimpleNamespace(next=0))
    made, strict = ([np.zeros((2, 16, n)) for n in sizes] for sizes in ((32, 24), (16, 16)))

    def lengthen(run, designs, made, rows, stage, more):
        for k in rows:
            made[k] = np.zeros((2, 16, made[k].shape[2] + more))

    monkeypatch.setattr(truth, "lengthen", lengthen)
    monkeypatch.setattr(tolerance, "_hidden", lambda *_: True)
    choices = [Choice("", name, {}) for name in cases]
    tolerance._lengthened(run, choices, made, strict, [0, 1], np.inf)
    assert [one.shape[2] for one in strict] == [32, 24]


def test_a_design_of_which_little_is_known_is_not_called_as_good():
    """The second is 3 % worse and lighter; its few simulations do not show that it is worse."""
    values = np.array([[1.00, 2.0], [1.03, 1.0]])
    shifts = np.zeros((2, 2, 16))
    shifts[0, 1] = np.random.default_rng(8).normal(0.0, 0.2, 16)
    assert Compared(values, shifts, 0.95).best(0) == 1
    assert Compared(values, shifts, 0.95, np.array([0.01, 0.01])).best(0) == 0


@pytest.mark.parametrize(
    ("draw", "exact", "least"),
    [
        (np.random.Generator.standard_normal, 1.0, 0.92),
        (lambda rng, shape: rng.lognormal(size=shape), ((np.e - 1.0) * np.e) ** 0.5, 0.87),
        (lambda rng, n: 0.1 * rng.standard_normal(n) + 3.0 * (rng.random(n) < 0.02), (0.01 + 9.0 * 0.02 * 0.98) ** 0.5, 0.92),
    ],
    ids=["normal", "lognormal", "a few far off"],
)  # fmt: skip
def test_limits_of_a_deviation_that_few_values_carry_hold(draw, exact, least, shift):
    """Of 512 values in 400 repetitions. Symmetric limits hold 82 % for the lognormal ones, whose samples miss their tail."""
    rng, held = np.random.default_rng(shift), 0
    for _ in range(400):
        low, high = limits(moments(draw(rng, (16, 32)))[1], 0.95)
        held += low <= exact <= high
    assert held >= least * 400 - 10
