"""Three and more things made small: fronts that are surfaces, from the scene to the page, on a front that is known."""

from pathlib import Path

import formula
import numpy as np
import opened
import pytest
import xarray as xr
from formula_study import whole
from refusals import refused

from hpcclear.base.verdict import Verdict
from hpcclear.ranks.boundary import alone
from hpcclear.report.constraints import constraints_of
from hpcclear.report.html import designs, picture
from hpcclear.report.html.content import read
from hpcclear.results.content import Results, each
from hpcclear.scene import Scene
from hpcclear.statistics.search.certainty import Compared
from hpcclear.study import run_study

UNIT = 1e-4  # m, of mean and deviation on the sphere
MEAN, DEVIATION = 2.0, 1.0  # where its centre lies
RIM = 0.9  # the formula is no larger, so that nothing has an infinite slope
THIRD = f"{RIM} * (m3 - 0.07) / 0.21"
LOW, HIGH = 3e-4, 1e-3  # C
ENDS = ("alpha", "beta", "gamma")


def on_sphere(m2: np.ndarray, m3: np.ndarray, u2: np.ndarray) -> np.ndarray:
    """DTLZ2 (Deb et al. 2002): the front is an octant of the unit sphere, where u2 is 0.06; (..., 3)."""
    angle = 0.5 * np.pi * (m2 - 0.105) / 0.315
    third = RIM * (m3 - 0.07) / 0.21
    reach = np.sqrt(1.0 - third**2) * (1.0 + ((u2 - 0.06) / 0.06) ** 2)
    return np.stack([reach * np.cos(angle), reach * np.sin(angle), third], axis=-1)


def sphere(column: dict[str, np.ndarray]) -> np.ndarray:
    """f whose mean and deviation over C are the first two, in `UNIT`, off their centre; the third is a formula."""
    clearance = column["joints.crank_rod.clearance"]
    slider, rod = column["mechanism.slider.mass"], column["mechanism.rod.mass"]
    place = on_sphere(rod, slider, column["mechanism.rod.mass_center"])
    off = (clearance - 0.5 * (LOW + HIGH)) / ((HIGH - LOW) / 12**0.5)
    return UNIT * (MEAN + place[..., 0] + (DEVIATION + place[..., 1]) * off)


STUDY = (
    "study.sensitivity.groups=[]", "study.sensitivity.sobol_samples=0", "study.samples=80", "study.test_samples=20",
    "study.surrogate.models=[]", 'study.surrogate.optimisation=["m2", "m3", "u2", "C"]', "study.surrogate.r2=0.9",
    "study.swarm.particles=50", "study.swarm.iterations=40", "study.swarm.runs=2", "study.swarm.archive=60",
    "study.accuracy={mean=0.005, deviation=0.01}",
    "study.verification={designs=12, infill_rounds=4, infill_samples=64, "
    "infill_designs=12, response_copies=2, response_windows=2, audit_samples=0, most_samples=1024}",
    f'study.cases={{three={{random=["C"], objectives=["mean", "deviation", {{formula="{THIRD}"}}]}}}}',
)  # fmt: skip


def scene_of(*overrides: str) -> Scene:
    return whole(*STUDY, *overrides)


@pytest.fixture(autouse=True)
def _dynamics(monkeypatch: pytest.MonkeyPatch) -> None:
    formula.replace_dynamics(monkeypatch.setattr)
    monkeypatch.setattr(formula, "objective", sphere)


@pytest.fixture(scope="module")
def study(carried_out) -> Path:
    return carried_out(scene_of(), objective=sphere)


def verified(place: Path) -> xr.Dataset:
    return opened.read(place / "verification.nc", "verification")


def chosen(found: xr.Dataset) -> xr.Dataset:
    """The ends and what lies between them."""
    names = [str(name) for name in found["design"].to_numpy()]
    ends = [f"three {end}" for end in ENDS]
    return found.isel(design=[k for k, n in enumerate(names) if n in ends or " front " in n])


def places(found: xr.Dataset) -> np.ndarray:
    """Where designs lie by the formula, not by the simulations that chose them."""
    return on_sphere(*(found[name].to_numpy() for name in ("m2", "m3", "u2")))


def test_what_is_told_of_designs_is_where_they_lie(study: Path) -> None:
    found = verified(study)
    true = places(found) * (UNIT, UNIT, 1.0) + (UNIT * MEAN, UNIT * DEVIATION, 0.0)
    for column, name in enumerate(("first", "second", "third")):
        lower, upper = found[f"{name}_lower"].to_numpy(), found[f"{name}_upper"].to_numpy()
        slack = 2.0 * (upper - lower) + 1e-12
        assert (lower - slack <= true[:, column]).all()
        assert (true[:, column] <= upper + slack).all()
    assert found["third_goal"].to_numpy().tolist() == [THIRD] * found.sizes["design"]
    assert (
        f"mean of f, standard deviation of f and {THIRD}" in found["dominated"].attrs["long_name"]
    )
    assert "fourth_goal" not in found


def test_each_end_has_the_least_of_its_own(study: Path) -> None:
    found = verified(study)
    for end, name in zip(ENDS, ("first", "second", "third"), strict=True):
        own = found.sel(design=f"three {end}")
        assert float(own[f"{name}_lower"]) <= float(found[f"{name}_upper"].min())
    least = places(found.sel(design=[f"three {end}" for end in ENDS]))
    assert least[0, 0] < 0.05
    assert least[1, 1] < 0.05
    assert least[2, 2] == 0.0


def test_the_front_is_the_octant_and_covers_it(study: Path) -> None:
    """No design is beaten by another, all are within 4 % of the sphere, and none of its places is far from all."""
    front = places(chosen(verified(study)))
    assert len(front) >= 10  # those that cannot be told apart are one
    beaten = (front[:, None] <= front).all(axis=2) & (front[:, None] < front - 0.01).any(axis=2)
    assert not beaten.any()
    radius = np.linalg.norm(front, axis=1)
    assert (radius > 0.999).all()
    assert (radius < 1.04).all()
    angle, third = np.meshgrid(np.linspace(0.0, np.pi / 2, 30), np.linspace(0.0, RIM, 30))
    flat = np.sqrt(1.0 - third**2)
    octant = np.stack([flat * np.cos(angle), flat * np.sin(angle), third], axis=-1).reshape(-1, 3)
    gaps = np.linalg.norm(octant[:, None] - front, axis=2).min(axis=1)
    assert gaps.max() < 0.6  # 1.41 is the way from end to end
    assert gaps.mean() < 0.33  # 0.24 to 0.30 with eight seeds


# -- cases beside each other ------------------------------------------------------------------------

MIXED = (
    'study.cases={plain={random=["C"]}, two={random=["C"], constraints=[{formula="m2", most=0.3}]}, '
    f'five={{random=["C"], objectives=["mean", "deviation", {{formula="{THIRD}"}}, '
    '{formula="m2"}, "quantile"], constraints=[{formula="m2", most=0.3}]}}',
    "study.verification.designs=3", "study.verification.infill_rounds=1", "study.verification.infill_designs=6",
)  # fmt: skip


@pytest.mark.nightly  # other goals side by side are in test_goals too
def test_cases_with_other_numbers_of_goals_stand_beside_each_other(tmp_path: Path) -> None:
    place = tmp_path / "mixed"
    run_study(scene_of(*MIXED), place, alone(), progress_style="quiet")
    found = verified(place)
    plain = found.isel(design=found["case"].to_numpy() == "plain")
    five = found.isel(design=found["case"].to_numpy() == "five")
    two = found.isel(design=found["case"].to_numpy() == "two")
    for few in (plain, two):
        assert set(few["fifth_goal"].to_numpy()) == {""}
        for name in ("third", "fourth", "fifth"):  # nor the constraint, which stands there
            assert np.isnan(few[f"{name}_true"]).all()
    np.testing.assert_array_equal(five["fourth_true"], five["m2"])
    np.testing.assert_array_equal(five["fifth_true"], five["percentile"])
    names = [str(name) for name in five["design"].to_numpy()]
    assert {f"five {end}" for end in (*ENDS, "delta", "epsilon")} <= set(names)
    assert "plain gamma" not in found["design"].to_numpy()
    for one, mass in zip(each(Results.of(five), "design"), five["m2"].to_numpy(), strict=True):
        assert [*map(str, constraints_of(one))] == [
            f"m2 = {mass:.4g}, at most 0.3: {'satisfied' if mass <= 0.3 else 'violated'}"
        ]
    broken = five["constraint_verdict"].to_numpy()[:, 0] == Verdict.FAILS
    np.testing.assert_array_equal(broken, five["m2"].to_numpy() > 0.3)
    kept = five.isel(design=five["m2"].to_numpy() <= 0.3)
    for end, name in (("alpha", "first"), ("delta", "fourth"), ("epsilon", "fifth")):
        best = five.sel(design=f"five {end}")
        assert float(best["m2"]) <= 0.3
        assert float(best[f"{name}_lower"]) <= float(kept[f"{name}_upper"].min())
    front = opened.read(place / "front.nc", "front")
    own = front.sel(case="five")
    assert float(own["m2"].max()) <= 0.3
    assert float(own["searched_third"].max()) > 0.8  # which no constraint is about
    assert np.isnan(front["searched_third"].sel(case=["plain", "two"])).all()
    np.testing.assert_array_equal(
        front["searched_first"].sel(case="plain"), front["mean"].sel(case="plain")
    )
    assert np.isfinite(front["hypervolume"].sel(case="plain")).all()
    shown = picture.front(read(place))
    assert shown["axes"][2:] == [THIRD, "m2", "95th percentile of f (mm)"]
    assert {len(point["at"]) for point in shown["points"]} == {5}
    assert all(p["at"][2] is None for p in shown["points"] if p["case"] == "plain")


def test_the_page_shows_any_two_of_the_three(study: Path) -> None:
    content = read(study)
    shown = picture.front(content)
    assert shown["axes"] == [shown["x"], shown["y"], THIRD]
    for point in shown["points"]:
        assert point["at"][:2] == [point["x"], point["y"]]
        assert 0.0 <= point["at"][2] <= RIM
    gamma = next(point for point in shown["points"] if point["name"] == "three gamma")
    assert [THIRD, "0"] in gamma["direct"]
    part = designs.designs(content.files["verification"], content)
    assert part is not None
    table = next(one for one in part if not isinstance(one, str))
    assert table.header[-4:] == ["objective 1", "objective 2", "objective 3", "constraints"]
    assert any(row[0] == f"lowest {THIRD} (gamma)" for row in table.rows)


def test_the_front_of_three_is_what_is_surely_traded() -> None:
    corners, middle = 1.0 - np.eye(3), [[0.5, 0.5, 0.5], [0.51, 0.49, 0.501], [2.0, 2.0, 2.0]]
    values = np.concatenate([corners, middle])
    shifts = np.random.default_rng(1).normal(0.0, 0.1, (*values.T.shape, 16))
    found = Compared(values, shifts, 0.95)
    assert [found.best(k) for k in range(3)] == [0, 1, 2]
    front = found.front(6)
    assert front[:3] == [0, 1, 2]
    assert len(front) == 4  # of those that cannot be told apart one
    assert front[3] in (3, 4)
    assert found.one[3, 4]
    np.testing.assert_array_equal(found.beaten, [False] * 5 + [True])


MANY = '["mean", "deviation", "quantile", {formula="m2"}, {formula="m3"}, {formula="u2"}]'
REFUSED = {  # what is asked for: the key within the case, and why
    "[]": ("objectives", "needs an objective"),
    '["mean", "deviation", "mean"]': ("objectives.2", "already"),
    '[{formula="m2+m3"}, "mean", {formula=" m2 + m3"}]': ("objectives.2", "already"),
    '["quantile", {statistic="quantile", level=0.95}]': ("objectives.1", "already"),
    MANY: ("objectives", "more than 5"),
}


@pytest.mark.parametrize("objectives", REFUSED)
def test_too_few_too_many_and_the_same_again(objectives: str) -> None:
    key, reason = REFUSED[objectives]
    with refused(f"study.cases.three.{key}", reason=reason):
        scene_of(f'study.cases={{three={{random=["C"], objectives={objectives}}}}}')


def test_two_levels_of_a_quantile_are_two_things() -> None:
    rows = '["quantile", {statistic="quantile", level=0.5}, {statistic="exceedance", limit=1e-4}]'
    scene = scene_of(f'study.cases={{three={{random=["C"], objectives={rows}}}}}')
    assert len(scene.required_study.case("three").goals) == 3


def test_an_archive_has_room_for_each_end() -> None:
    with refused("study.swarm.archive", remedy="3"):
        scene_of("study.swarm.archive=2")
