"""Constraints are decided honestly: verdicts over looks and designs, what an answer says of them, what a decision costs."""

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import opened
import pytest
import report_data as data
from formula_study import scene_of
from margins import most
from scipy import stats

from hpcclear.base.objectives import Usual
from hpcclear.base.verdict import Verdict
from hpcclear.report import constraints, scatter
from hpcclear.report.answer import answer
from hpcclear.report.html.content import Content
from hpcclear.report.screen import Level
from hpcclear.report.screens import screen_of
from hpcclear.results import dataset
from hpcclear.results.content import Results, each
from hpcclear.scene.cases import Constraint
from hpcclear.scene.stages import Verification
from hpcclear.statistics.random.replicates import Limited
from hpcclear.study import failures, goals, tolerance, verdicts
from hpcclear.study.optimisation import Choice

# -- verdicts ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.011, 0.05])
def test_what_breaks_a_constraint_is_hardly_ever_called_kept(share, shift):
    """Of 12 designs that all break it, looked at up to six times, in 300 studies: at most as often as the confidence says."""
    settings, limit = Verification(most_samples=16384), float(stats.norm.isf(share))
    goal = Constraint(statistic="exceedance", limit=limit, most=0.01)
    wrong = 0
    for study in range(300):
        rng = np.random.default_rng(1000 * shift + study)
        shares = rng.binomial(1024, share, (12, 16, 1))  # hits of 1024 values of each replicate
        for hits in shares:
            values = np.where(np.arange(1024) < hits, limit + 1.0, limit - 1.0)
            values = rng.permuted(values, axis=1)
            for length in (32, 64, 128, 256, 512, 1024):
                seen = values[:, :length]
                if verdicts.settled(goal, seen, Choice("", "", {}), settings, 12):
                    told = goals.goal_value(goal, seen, {}, verdicts.level(settings, 12, seen.size))
                    wrong += (
                        verdicts.of_interval(goal, told, seen.size, 0.9).verdict is Verdict.HOLDS
                    )
                    break
    assert wrong <= most(300, 0.05), wrong


def test_looks_at_a_design_share_its_error():
    """Half of it at the last, all of it at the end of the interval that can be wrong."""
    settings, looks = Verification(most_samples=8192), [8192 >> k for k in range(7)]
    tails = [(1.0 - verdicts.level(settings, 12, one)) / 2.0 for one in looks]
    np.testing.assert_allclose(tails, 0.05 / 12 * 0.5 ** np.arange(1, 8), rtol=1e-9)


def test_what_is_not_decided_has_a_price():
    """Half the reach needs four times the simulations; where nothing was exceeded the upper limit falls as one over them."""
    goal = Constraint(statistic="exceedance", limit=1.0, most=0.01)
    one = Limited(0.008, np.zeros(16), 0.004, 0.012)
    assert verdicts.of_interval(goal, one, 2048, 0.95) == (Verdict.UNDECIDED, 8192.0)
    none = goals.goal_value(goal, np.zeros((16, 8)), {}, 0.95)
    found = verdicts.of_interval(goal, none, 128, 0.95)
    assert found == (Verdict.UNDECIDED, 512.0)  # 368, by doubling
    enough = goals.goal_value(goal, np.zeros((16, 32)), {}, 0.95)
    assert verdicts.of_interval(goal, enough, 512, 0.95).verdict is Verdict.HOLDS
    at = Limited(0.01, np.zeros(16), 0.004, 0.012)
    assert np.isnan(verdicts.of_interval(goal, at, 2048, 0.95).price)


def test_what_the_tolerance_leaves_open_no_simulations_decide():
    """Of a half-width of 4e-3 the tolerance has half: what is left to the samples falls to 0, or is not enough."""
    goal = Constraint(statistic="exceedance", limit=1.0, most=0.01)
    near, far = (Limited(x, np.zeros(16), 0.0, x + 0.004) for x in (0.0085, 0.007))
    assert verdicts.of_interval(goal, near, 2048, 0.95, 0.002) == (Verdict.UNDECIDED, np.inf)
    assert verdicts.of_interval(goal, far, 2048, 0.95, 0.002).price == 8192.0
    case = SimpleNamespace(goals=[], kept=[goal])
    run = SimpleNamespace(
        study=SimpleNamespace(case=lambda name: case, verification=Verification())
    )
    one = [np.array([[x]]) for x in (0.0085, 0.0045, 0.0125, 2048.0)]
    true = dict(zip(("goal", "sure_lower", "sure_upper", "counted"), one, strict=True))
    for taken, price in ((0.0, 16384.0), (0.002, np.inf)):
        true["taken"] = np.array([[taken]])
        found = verdicts.decided(run, [Choice("", "made", {})], true)
        assert found["price"][0, 0] == price


# -- the answer -------------------------------------------------------------------------------------


def verified(verdict: Verdict, price: float, excess: list[float]):
    """Two designs and the baseline of one case, whose constraints all stand so."""
    names = ["robust alpha", "robust beta", "robust original"]
    values = np.array([1.0, 2.0, 3.0])
    coords, columns = data.simulated(names, 4096)
    columns |= {
        "case": np.array(["robust"] * 3), "random": np.array(["C"] * 3),
        "mean_true": values, "deviation_true": 0.1 * values,
        "first_goal": np.array(["mean of f"] * 3), "second_goal": np.array(["m2"] * 3),
        "first_unit": np.array(["m"] * 3), "second_unit": np.array([""] * 3),
        "first_usual": np.array([Usual.MEAN] * 3, np.int8), "second_usual": np.array([Usual.OTHER] * 3, np.int8),
        **data.constrained([verdict] * 3, [price] * 3),
        "constraint_excess": np.array(excess),
    }  # fmt: skip
    for name in ("first", "second"):
        columns |= {f"{name}_{end}": values for end in ("true", "lower", "upper")}
    content = dataset.dataset("verification", coords | {"constraint": np.arange(1)}, columns)
    content.attrs["method"] = "qmc"
    return content


@pytest.mark.parametrize(
    ("verdict", "price", "excess", "nearest"),
    [
        (Verdict.FAILS, np.nan, [0.2, 0.1, 0.3], "robust beta"),
        (Verdict.UNDECIDED, 8192.0, [0.2, 0.1, 0.3], "robust beta"),
        (Verdict.UNDECIDED, 8192.0, [-0.1, -0.2, 0.3], "robust alpha"),
        (Verdict.UNDECIDED, np.inf, [-0.1, -0.2, 0.3], "robust alpha"),
    ],
)
def test_no_design_is_recommended_within_constraints_that_it_may_break(
    verdict, price, excess, nearest
):
    lines = answer({"verification": verified(verdict, price, excess)})
    text = {line.label: line.text for line in lines}
    first = screen_of(Content(Path("out"), {"verification": verified(verdict, price, excess)}))
    assert first.headline.startswith("No simulated design")
    assert first.header[-1] == "nearest"
    assert [one.label for one in first.tiles[:2]] == ["mean of f", "m2"]  # what is made small
    assert first.tiles[2].before  # of the constraint, as it has the value of the baseline too
    assert text["criterion"].startswith(f"{nearest}: ")
    assert first.trust[0].level is Level.RED
    assert "within the constraints" not in " ".join(one.text for one in lines)
    decides = "study.verification.most_samples=8192 to decide the constraints"
    advised = " ".join(first.steps)
    assert (decides in advised) is (price == 8192.0)
    assert ("a smaller numerics.rtol" in advised) is (price == np.inf)
    assert (constraints.OPEN in text["constraint"]) is (price == np.inf)
    assert ("about 8192 simulations would decide" in text["constraint"]) is (price == 8192.0)


def test_a_design_that_surely_satisfies_them_is_recommended():
    text = {
        line.label: line.text
        for line in answer({"verification": verified(Verdict.HOLDS, np.nan, [-0.1, -0.2, -0.3])})
    }
    assert ": lowest mean of f within the constraints of 3" in text["criterion"]
    assert text["constraint"].endswith(": satisfied")


# -- a study ----------------------------------------------------------------------------------------

STUDY = """
[random]
C = { distribution = "uniform", range = ["0.4 mm", "0.9 mm"] }
[cases.light]
random = ["C"]
objectives = [{ formula = "m2" }, "mean"]
constraints = [{ statistic = "exceedance", limit = "0.47 mm", most = "0.1 %" }]
[verification]
designs = 2
most_samples = 8192
infill_rounds = 2
infill_designs = 4
"""


def share_above(m2: float, limit: float = 0.47e-3) -> float:
    """Exactly, by the formula of the study: f is linear in C."""
    constant = 1e-4 * (4 - 5 * m2 + 3 * 0.14 - 10 * 0.06 + 500 * 2.6e-4)
    least = (limit - constant) / (0.1 + 0.5 * m2)
    return float(np.clip((0.9e-3 - least) / 0.5e-3, 0.0, 1.0))


@pytest.fixture(scope="module")
def done(carried_out):
    place = carried_out(scene_of(STUDY))
    kinds = ("verification", "contributions")
    return {kind: opened.read(place / f"{kind}.nc", kind) for kind in kinds}


def test_what_scatters_at_the_recommended_design_makes_all_of_its_scatter(done):
    """f is linear in C: all of the variance is its own, and half its scatter is half the deviation."""
    own = done["contributions"].sel(design="light alpha", input="C")
    assert float(own["contribution"]) == pytest.approx(1.0, abs=1e-3)
    assert float(own["halved"]) == pytest.approx(0.5, abs=1e-3)
    assert float(own["unexplained"]) == pytest.approx(0.0, abs=1e-9)
    lines = {line.label: line.text for line in answer(done)}
    assert [one[0] for one in scatter.shares(done["contributions"].sel(design="light alpha"))] == [
        "C"
    ]
    assert re.search(r"C 50(\.0)? ± [\d.]+ %", lines["tolerances"])


def test_verdicts_of_a_study_agree_with_the_truth(done):
    done = done["verification"]
    shares = [share_above(float(m2)) for m2 in done["m2"]]
    assert min(shares) < 0.001 < max(shares)
    verdicts = done["constraint_verdict"].to_numpy()[:, 0]
    for share, verdict in zip(shares, verdicts, strict=True):
        assert not (verdict == Verdict.HOLDS and share > 0.001)
        assert not (verdict == Verdict.FAILS and share < 0.001)
    unseen = done["constraint_true"].to_numpy() == 0.0
    assert (done["constraint_upper"].to_numpy()[unseen] > 0.0).all()
    for verdict, one in zip(verdicts, each(Results.of(done), "design"), strict=True):
        words = "; ".join(map(str, constraints.constraints_of(one)))
        assert f": {constraints.WORDS[verdict]}" in words
    best = done.sel(design="light alpha")
    assert best["constraint_verdict"].item() == Verdict.HOLDS
    assert int(best["rare_samples"]) > int(best["samples"])  # the rare failure needs more


def test_a_design_whose_verdict_the_tolerance_undoes_makes_way_for_others(monkeypatch):
    # all satisfied by samples alone
    monkeypatch.setattr(tolerance.contest, "shown", lambda *_: 1.0)
    case = SimpleNamespace(kept=[Constraint(statistic="exceedance", limit=1.0, most=0.5)])
    study = SimpleNamespace(verification=Verification(), case=lambda name: case)
    designs = [Choice("", "made", {"m2": 0.1 * k}) for k in range(2)]
    true = {"verdict": np.array([[Verdict.HOLDS], [Verdict.UNDECIDED]])}
    assert tolerance._undone(SimpleNamespace(study=study), designs, [None] * 2, true) == {1}


@pytest.mark.parametrize("seed", range(10))
def test_of_designs_that_always_fail_the_one_nearest_to_the_limit_violates_least(seed):
    """Random levels, scatters and limits: all probabilities are 1, or the scatter is a thousandth of the distance."""
    rng = np.random.default_rng(seed)
    limit = float(rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-4, 4))
    kept = Constraint(statistic="exceedance", limit=limit, most=float(10.0 ** rng.uniform(-3, -1)))
    levels = np.sort(abs(limit) * 10.0 ** rng.uniform(-1, 1, 6))
    scatter = levels * 10.0 ** rng.uniform(-3, -1.5)
    values = [
        (limit + level + own * np.clip(rng.standard_normal((16, 32)), -3.0, 3.0))
        for level, own in zip(levels, scatter, strict=True)
    ]
    assert all((one > limit).all() for one in values)
    beyond = np.array([[goals.beyond(kept, one)] for one in values])
    nearest = np.argsort([one.mean() - 3.0 * one.std() for one in values])
    broken = goals.excess([kept], np.ones((6, 1)), beyond)
    steered = [failures.excess_of(kept, one[None], {})[0] for one in values]
    for found in (broken, steered):
        assert int(np.argmin(found)) == nearest[0]
        assert len(set(np.round(found, 9))) == 6  # no plateau on which a search stands still
    inside = limit + abs(limit) * rng.standard_normal((16, 32))
    assert goals.beyond(kept, inside) == 0.0
