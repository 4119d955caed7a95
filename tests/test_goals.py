"""What a case makes small and keeps below limits: quantiles, probabilities, formulas, from the scene to the answer."""

from pathlib import Path

import numpy as np
import opened
import pytest
from commands import overrides, run
from margins import fewest
from refusals import refused
from scipy import stats
from scipy.stats import qmc

from hpcclear.base.arithmetic import FormulaError, names_in, value_of
from hpcclear.base.verdict import Verdict
from hpcclear.scene import Scene, load_scene
from hpcclear.statistics.random.replicates import exceedance, quantile

QUICKSTART = Path(__file__).parent.parent / "jobs" / "quickstart.toml"
RANDOM = ["C", "m2", "m3", "u2", "I2"]
MASS = {"formula": "m2 + m3"}


# -- formulas ---------------------------------------------------------------------------------------


def test_a_formula_is_arithmetic_of_its_variables() -> None:
    text = "2*(m2 + m3)**2/m2 - -0.5e1"
    assert names_in(text) == ("m2", "m3")
    m2, m3 = np.array([0.1, 0.2]), np.array([0.3, 0.5])
    np.testing.assert_allclose(
        value_of(text, {"m2": m2, "m3": m3}), 2 * (m2 + m3) ** 2 / m2 + 5, rtol=1e-15
    )
    for none in ("1/m2", "m2/m2", "(m2 - 1)**0.5", "(1e99 + m2)**9"):
        assert np.isnan(value_of(none, {"m2": 0.0}))


@pytest.mark.parametrize(
    "text",
    ["", "m2 +", "m2.real", "f(m2)", "m2 if m3 else 1", "m2[0]", "'m2'", "m2 < m3", "True", "m2**m3", "m2**99", "1e999",
     "m2" + "+1" * 200, "__import__('os')", "(lambda: 1)()", "m2 // 2", "2j", "-" * 150 + "m2.x", "9**9**9"],
)  # fmt: skip
def test_nothing_else_is_a_formula(text: str) -> None:
    with pytest.raises(FormulaError):
        names_in(text)


# -- the scene --------------------------------------------------------------------------------------


def with_case(**entries: object) -> Scene:
    return load_scene(QUICKSTART).with_({"study.cases": {"robust": {"random": RANDOM, **entries}}})


def test_words_tables_and_units_of_the_objective() -> None:
    scene = with_case(
        objectives=["quantile", {"statistic": "exceedance", "limit": "0.4 mm"}],
        constraints=[{**MASS, "most": 0.4}, {"statistic": "mean", "most": "0.5 mm"},
                     {"statistic": "exceedance", "limit": 5e-4, "most": "1 %"}],
    )  # fmt: skip
    case = scene.required_study.case("robust")
    assert [goal.words("m") for goal in case.goals] == [
        "95th percentile of f",
        "probability of f above 0.0004 m",
    ]
    assert [one.most for one in case.kept] == [0.4, 5e-4, 0.01]
    levels = {0.91: "91st", 0.12: "12th", 0.5012: "50.12th", 0.99999999: "99.999999th"}
    for level, place in levels.items():
        goal = with_case(objectives=[{"statistic": "quantile", "level": level}])
        (known,) = goal.required_study.case("robust").goals
        assert known.words("m") == f"{place} percentile of f"
    assert load_scene(scene.resolved()) == scene
    assert load_scene(QUICKSTART).required_study.case("robust").plain
    goals = ["mean", {"statistic": "exceedance", "limit": "2 kN"}]
    cases = {"robust": {"random": RANDOM, "objectives": goals}}
    force = scene.with_({"study.objective": "mean-contact-force", "study.cases": cases})
    assert force.required_study.case("robust").goals[1].limit == 2000.0


@pytest.mark.parametrize(
    ("entries", "key", "reason"),
    [
        ({"objectives": ["mean", "median"]}, "objectives.1", "'median': is not one of the known values. Did you"),
        ({"constraints": [{"statistic": "percentile", "most": "5 kN"}]}, "constraints.0.statistic", "is a quantile"),
        ({"constraints": [{"statistic": "exceedance", "limit": 1, "most": 5}]}, "constraints.0.most", "5: must be above 0 and"),
        ({"constraints": [{"statistic": "exceedance", "limit": 1, "most": 0}]}, "constraints.0.most", "it is a probability"),
        ({"constraints": [{"statistic": "mean", "most": -1}]}, "constraints.0.most", "at least 0 m: no design has less"),
        ({"constraints": [{"statistic": "deviation", "of": "frame-force-level-at-1Hz", "most": -1}]}, "constraints.0.most", ""),
        ({"objectives": ["mean", {"statistic": "mean", "of": "mean-gap"}]}, "objectives.1", "'mean': is an objective already"),
        ({"objectives": ["mean", MASS, {"formula": "m2+m3"}]}, "objectives.2", "'m2+m3': is an objective already"),
        ({"constraints": [{"statistic": "mean", "most": most} for most in (5e-4, 4e-4)]}, "constraints.1", "already"),
        ({"objectives": []}, "objectives", "needs an objective"),
        ({"objectives": ["mean", {"statistic": "exceedance"}]}, "objectives.1.limit", "threshold is missing"),
        ({"objectives": ["mean", {"statistic": "exceedance", "limit": "3 N"}]}, "objectives.1.limit", "does not fit"),
        ({"objectives": ["mean", {"statistic": "quantile", "level": 1.5}]}, "objectives.1.level", "below 1"),
        ({"objectives": ["mean", {"statistic": "mean", "level": 0.5}]}, "objectives.1.level", "belongs to"),
        ({"objectives": ["mean", {"formula": "m2 + C"}]}, "objectives.1.formula", "'C' is no design variable"),
        ({"objectives": ["mean", {"formula": "m2 +"}]}, "objectives.1.formula", "cannot be read"),
        ({"objectives": ["mean", {"formula": "m2 - m2 + 1"}]}, "objectives.1.formula", "same for all designs"),
        ({"constraints": [{"formula": "(u2 - 0.11)**0.5", "most": 1}]}, "constraints.0.formula", "no real value"),
        ({"constraints": [{"formula": "m2 + m3", "most": 0.1}]}, "constraints.0.most", "no design keeps it"),
        ({"objectives": ["mean", {"formula": "m3 + 1 / (m2 - 0.2)"}]}, "objectives.1.formula", "divides by m2 - 0.2"),
        ({"objectives": ["mean", {"formula": "(1e9*m2)**9**2"}]}, "objectives.1.formula", "a power that"),
        ({"objectives": ["mean", {"statistic": "mean", "formula": "m2"}]}, "objectives.1", "either"),
        ({"constraints": [MASS]}, "constraints.0.most", "missing"),
        ({"constraints": [{"statistic": "mean", "of": "peak-contact-pressure", "most": 1}]}, "constraints.0.of", "pressure"),
        ({"objectives": ["mean", {"statistic": "mean", "of": "contact-half-angle"}]}, "objectives.1.of", "geometry"),
    ],
)  # fmt: skip
def test_goals_that_make_no_sense_are_refused(entries: dict[str, object], key: str, reason: str) -> None:  # fmt: skip
    with refused(f"study.cases.robust.{key}", said=reason):
        with_case(**entries)


# -- limits -----------------------------------------------------------------------------------------


def smooth(u: np.ndarray) -> np.ndarray:
    """A sum whose distribution function is known: of a normal and twice another."""
    return stats.norm.ppf(u[..., 0]) + 2.0 * stats.norm.ppf(u[..., 1])


SPREAD = 5.0**0.5


def replicated(seed: int, method: str, length: int = 32) -> np.ndarray:
    if method == "monte-carlo":
        return smooth(np.random.default_rng(seed).random((16 * length, 1, 2)))
    rng = np.random.default_rng(seed)
    return smooth(np.stack([qmc.Sobol(2, rng=rng).random(length) for _ in range(16)]))


@pytest.mark.parametrize("method", ["qmc", "monte-carlo"])
@pytest.mark.parametrize("share", [0.2, 0.05, 0.005, 0.0002])
def test_limits_of_a_probability_hold(method: str, share: float, shift: int) -> None:
    limit = SPREAD * stats.norm.isf(share)
    held = 0
    for seed in range(200):
        found = exceedance(replicated(seed + 1000 * shift, method), limit, 0.95)
        assert 0.0 <= found.lower <= found.value <= found.upper <= 1.0
        held += found.lower <= share <= found.upper
    assert held >= fewest(200, 0.95), held


def test_a_probability_that_never_came_has_the_limits_of_as_many_draws() -> None:
    found = exceedance(np.zeros((16, 32)), 1.0, 0.95)
    assert (found.value, found.lower) == (0.0, 0.0)
    assert found.upper == pytest.approx(1 - 0.025 ** (1 / 512))
    always = exceedance(np.full((16, 32), 2.0), 1.0, 0.95)
    assert (always.value, always.upper) == (1.0, 1.0)
    assert always.lower == pytest.approx(0.025 ** (1 / 512))
    few = exceedance(np.full((16, 32), np.nan), 1.0, 0.95)
    assert np.isnan([few.value, few.lower, few.upper, *few.shifts]).all()


@pytest.mark.parametrize("order", [0.9, 0.95])
def test_few_draws_have_limits_of_a_quantile_and_these_hold(order: float, shift: int) -> None:
    """100 draws, as a short study has: the upper limit was beyond the largest of them, so not known."""
    true = SPREAD * stats.norm.ppf(order)
    held = 0
    for seed in range(400):
        draws = smooth(np.random.default_rng(seed + 1000 * shift).random((100, 1, 2)))
        found = quantile(draws, order, 0.95)
        assert np.isfinite([found.lower, found.upper]).all()
        held += found.lower <= true <= found.upper
    assert held >= fewest(400, 0.95), held
    # all lie below the quantile once in eight times, or more
    twenty = quantile(draws[:20], order, 0.95)
    assert np.isnan(twenty.upper)


@pytest.mark.parametrize("method", ["qmc", "monte-carlo"])
@pytest.mark.parametrize("order", [0.5, 0.95])
def test_shifts_of_a_quantile_are_as_large_as_it_scatters(method: str, order: float, shift: int) -> None:  # fmt: skip
    """Standard errors from shifts against the deviation of 300 estimates, known to 4 %; plain draws' against the formula."""
    found = [quantile(replicated(s + 1000 * shift, method), order, 0.95) for s in range(300)]
    scatter = np.std([one.value for one in found])
    mean = np.sqrt(np.mean([one.error**2 for one in found]))
    assert (
        abs(np.mean([one.value for one in found]) - SPREAD * stats.norm.ppf(order))
        < 6 * scatter / 300**0.5 + 0.01
    )
    assert 0.8 < mean / scatter < 1.5
    if method == "monte-carlo":
        density = stats.norm.pdf(stats.norm.ppf(order)) / SPREAD
        assert mean == pytest.approx(np.sqrt(order * (1 - order) / 512) / density, rel=0.15)


# -- a study ----------------------------------------------------------------------------------------

SMALL = (
    "study.samples=40", "study.test_samples=10", "study.sensitivity.groups=[]", "study.sensitivity.sobol_samples=0",
    "study.swarm.runs=1", "study.swarm.particles=16", "study.swarm.iterations=10", "study.surrogate.r2=0.5",
    "study.surrogate.rmae=2.0", "study.accuracy={mean=0.05, deviation=0.2}",
    "study.verification.most_samples=512", "study.verification.infill_rounds=2", "study.verification.infill_samples=64",
    "study.verification.infill_designs=4", "study.verification.designs=2", "study.verification.audit_samples=0",
    "study.verification.response_copies=2", "study.verification.response_windows=2",
    'study.cases={heavy={random=["C"], objectives=["quantile", {formula="m2 + m3"}], '
    'constraints=[{formula="m2 + m3", most=0.4}, {statistic="exceedance", limit="0.4 mm", most="20 %"}]}, '
    'calm={random=["C", "m2"], objectives=[{statistic="exceedance", limit="0.3 mm"}, "deviation"]}}',
)  # fmt: skip


def words(folder: Path) -> list[str]:
    quiet = ["-o", str(folder), "--progress", "quiet"]
    return ["run", str(QUICKSTART), *quiet, *overrides(*SMALL)]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    folder = tmp_path_factory.mktemp("goals") / "results"
    code, output = run(words(folder), 1)
    assert code == 0, output
    return folder, output


def test_alpha_and_beta_have_the_least_of_what_was_asked_for(study: tuple[Path, str]) -> None:
    found = opened.read(study[0] / "verification.nc", "verification")
    for case in ("heavy", "calm"):
        own = found.isel(
            design=[k for k, one in enumerate(found["case"].to_numpy()) if one == case]
        )
        kept = (own["constraint_verdict"] != Verdict.FAILS).all("constraint").to_numpy()
        for end, goal in (("alpha", "first"), ("beta", "second")):
            best = own.sel(design=f"{case} {end}")
            assert not (best["constraint_verdict"] == Verdict.FAILS).any()
            others = own.isel(design=kept)
            assert float(best[f"{goal}_lower"]) <= float(others[f"{goal}_upper"].min())
    heavy = found.sel(design="heavy beta")
    assert heavy["first_goal"].item() == "95th percentile of f"
    assert float(heavy["first_true"]) == float(heavy["percentile"])
    assert float(heavy["second_true"]) == pytest.approx(float(heavy["m2"] + heavy["m3"]))
    assert found.sel(design="calm beta")["second_unit"].item() == "m"
    assert float(found.sel(design="calm beta")["second_true"]) == float(
        found.sel(design="calm beta")["deviation_true"]
    )
    assert "mean and deviation" not in found["dominated"].attrs["long_name"]


def test_the_front_tells_what_was_searched(study: tuple[Path, str]) -> None:
    front = opened.read(study[0] / "front.nc", "front")
    first, second = (front[f"searched_{name}_goal"].to_numpy() for name in ("first", "second"))
    assert [*first] == ["95th percentile of f", "probability of f above 0.0003 m"]
    assert [*second] == ["m2 + m3", "standard deviation of f"]
    heavy = front.sel(case="heavy")
    known = np.isfinite(heavy["searched_second"].to_numpy())
    assert known.any()
    mass = (heavy["m2"] + heavy["m3"]).to_numpy()[known]
    np.testing.assert_allclose(heavy["searched_second"].to_numpy()[known], mass)
    assert (mass <= 0.4).all()
    assert (heavy["searched_first"].to_numpy()[known] > heavy["mean"].to_numpy()[known]).all()
    assert np.isnan(front["hypervolume"]).all()


@pytest.mark.nightly
@pytest.mark.mpi
def test_ranks_change_no_byte(study: tuple[Path, str], tmp_path: Path) -> None:
    folder = tmp_path / "two"
    code, output = run(words(folder), 2)
    assert code == 0, output
    for name in ("front.nc", "verification.nc", "samples.nc", "chaos.nc"):
        assert (folder / name).read_bytes() == (study[0] / name).read_bytes(), name
