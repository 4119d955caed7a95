"""Lives of worn joints: jumps against closed forms, what ends a life, statistics over lives; kills are in `test_kills`."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import opened
import pytest
from commands import overrides, run
from refusals import refused
from running import scene_with
from scipy.integrate import solve_ivp
from scipy.stats import binom
from test_wear import ROTOR, WORN, widening, worn

from hpcclear.base.asking import answered
from hpcclear.base.outcome import Flag, Status
from hpcclear.dynamics.wear.curves import curves, lifetime
from hpcclear.dynamics.wear.law import Joints, joints_of
from hpcclear.dynamics.wear.life import LifePlan, WearOutcome, _drift, life
from hpcclear.ensemble.wear import check_worn
from hpcclear.report import fan_figure, survival_figure
from hpcclear.scene import load_scene
from hpcclear.statistics.random.survival import share_interval

SCENE = Path(__file__).parent.parent / "jobs" / "wear.toml"
PLAN = LifePlan(cycles=1e6, tolerance=0.01, shortest=5.0, copies=4, most_copies=16)
ONE = Joints(*(np.array([x]) for x in (3e-4, 0.02, 2e-12, 1e-12, 0.0, 1.0)))


def followed(joints, plan, rate, objective=None, noise=0.0, status=Status.OK, settling=0.0):
    """A life whose dynamics are functions of the clearances (joints,): rates (joints,), f; noise is relative.

    `settling`: by how much, relative, copies that wait longer wear faster.
    """
    rng = np.random.default_rng(3)
    f = objective or (lambda c: float(c[0]))

    def seen(asked):
        c, _ = joints.worn(asked.work)
        n = len(asked.copies)
        scatter = 1.0 + noise * rng.standard_normal((n, 1))
        scatter[np.array(asked.copies) % 2 == 1] += settling
        return WearOutcome(
            scatter * rate(c), np.full(n, f(c)) * scatter[:, 0], np.ones((n, len(c))),
            np.full(n, int(status)),
        )  # fmt: skip

    return answered(life(joints, plan), seen)


def test_running_in_is_an_exponential_of_the_work():
    """At a constant rate W = 50 n: c = c0 + slope (W + (a - 1) W0 (1 - exp(-W / W0))), also between the ends of jumps."""
    factor, fading = 6.0, 3e6
    joints = replace(ONE, excess=np.array([factor - 1.0]), fading=np.array([fading]))
    found = followed(joints, PLAN, lambda c: np.array([50.0]))
    assert found.status is Status.OK
    cycles = np.linspace(0.0, 1e6, 11)
    seen, work = curves(found, joints, cycles), 50.0 * cycles
    counted = work + (factor - 1.0) * fading * (1.0 - np.exp(-work / fading))
    np.testing.assert_allclose(seen.clearance[:, 0], 3e-4 + 3e-12 * counted, rtol=1e-12)
    np.testing.assert_allclose(seen.bearing[:, 0], 2e-12 * counted, atol=1e-18)
    more = np.array([1e3])
    grown = joints.worn(np.array([1e6]) + more)[0] - joints.worn(np.array([1e6]))[0]
    np.testing.assert_allclose(joints.grown(np.array([1e6]), more), grown, rtol=1e-6)
    np.testing.assert_allclose(joints.speed(np.array([1e6])), grown / more, rtol=1e-3)


def test_jumps_follow_a_joint_that_runs_in():
    """A rate that grows with the clearance, against a fine integration of the law itself."""
    factor, fading = 8.0, 2e6
    joints = replace(ONE, excess=np.array([factor - 1.0]), fading=np.array([fading]))
    found = followed(joints, PLAN, lambda c: 50.0 * (c / 3e-4) ** 1.5)

    def speed(_, y):
        rate = 50.0 * (y[0] / 3e-4) ** 1.5
        return [3e-12 * (1.0 + (factor - 1.0) * np.exp(-y[1] / fading)) * rate, rate]

    ends = solve_ivp(speed, (0.0, 1e6), [3e-4, 0.0], method="DOP853", rtol=1e-12, atol=1e-18).y
    end = joints.worn(found.nodes[-1].work)[0][0]
    assert end == pytest.approx(ends[0, -1], rel=PLAN.tolerance)
    assert abs(end - ends[0, -1]) <= found.error[0]
    assert end > 1.5 * 3e-4


def exact(joints, power, coefficient, cycles):
    """Clearances of joints whose rate is ``coefficient * (mean clearance / 0.3 mm)^power``, by a fine integration."""

    def speed(_, c):
        return joints.slope * coefficient * (c.mean() / 3e-4) ** power

    return solve_ivp(
        speed, (0.0, cycles), joints.clearance, method="DOP853", rtol=1e-12, atol=1e-18
    ).y[:, -1]


def test_errors_of_jumps_stay_within_their_tolerance():
    """Of 40 lives with rates that grow or fall with wear, 95 % end within their own stated error of the truth."""
    rng = np.random.default_rng(5)
    within, off = 0, []
    for _ in range(40):
        joints = Joints(
            rng.uniform(1e-4, 5e-4, 2), np.full(2, 0.02), rng.uniform(0.5e-12, 4e-12, 2), np.zeros(2),
            np.zeros(2), np.ones(2),
        )  # fmt: skip
        power, coefficient = rng.uniform(-0.5, 1.5), rng.uniform(20.0, 80.0, 2)
        found = followed(joints, PLAN, lambda c, p=power, k=coefficient: k * (c.mean() / 3e-4) ** p)
        assert found.status is Status.OK
        end = joints.worn(found.nodes[-1].work)[0]
        truth = exact(joints, power, coefficient, 1e6)
        off.append(float(np.abs(end / truth - 1.0).max()))
        within += (np.abs(end - truth) <= found.error).all()
        assert off[-1] <= PLAN.tolerance
    assert within >= 38
    assert max(off) > 1e-6  # there are errors to hold


def test_a_leap_of_f_does_not_end_a_life():
    found = followed(
        ONE, PLAN, lambda c: np.array([100.0]), lambda c: 1e-4 if c[0] < 4.321e-4 else 2e-4
    )
    assert found.status is Status.OK
    at = np.linspace(0.0, 1e6, 20001)
    seen = curves(found, ONE, at)
    place = seen.clearance[np.argmax(seen.objective > 1.5e-4), 0]
    assert place == pytest.approx(4.321e-4, rel=0.01)


def test_what_ends_a_life_is_a_status():
    def rate(c):
        return np.array([3e4])

    through = followed(ONE, PLAN, rate)
    assert through.status is Status.WORN_THROUGH
    assert through.ended < 1e6
    assert lifetime(through, ONE, {}) == through.ended
    assert np.isnan(curves(through, ONE, np.array([1e6])).clearance).all()
    fast = followed(ONE, PLAN, lambda c: np.array([1e9]))
    assert fast.status is Status.JUMP_TOO_SHORT
    assert math.isnan(lifetime(fast, ONE, {"clearance": 1e-3}))
    failed = followed(ONE, PLAN, rate, status=Status.STEP_CAP)
    assert failed.status is Status.STEP_CAP
    assert np.isnan(curves(failed, ONE, np.linspace(0, 1, 3)).objective).all()


def test_a_rate_that_scatters_asks_for_more_copies_and_says_what_it_does_not_know():
    calm = followed(ONE, PLAN, lambda c: np.array([50.0]), noise=1e-4)
    wild = followed(ONE, PLAN, lambda c: np.array([50.0]), noise=0.2)
    assert calm.certain
    assert not wild.certain
    assert wild.simulations >= 4 * calm.simulations / len(calm.nodes)
    end = ONE.worn(wild.nodes[-1].work)[0][0]
    assert abs(end - (3e-4 + 3e-12 * 50.0 * 1e6)) < 2.0 * wild.limit[0]
    assert wild.limit[0] > 10.0 * calm.limit[0]


def test_a_transient_that_is_not_over_is_told_and_widens_the_limit():
    settled = followed(ONE, PLAN, lambda c: np.array([50.0]), noise=1e-3)
    moving = followed(ONE, PLAN, lambda c: np.array([50.0]), noise=1e-3, settling=0.1)
    assert settled.drift < 1e-3
    assert settled.certain
    assert moving.drift == pytest.approx(0.1, rel=0.1)
    assert not moving.certain
    grown = ONE.worn(moving.nodes[-1].work)[0][0] - 3e-4
    assert moving.limit[0] > 0.04 * grown  # half of the jumps' differences, added as squares
    assert moving.simulations / len(moving.nodes) < 3 * PLAN.copies  # copies do not help


def test_chaos_is_not_taken_for_a_transient():
    """Of 200 states whose copies scatter by 20 %, some 5 % differ by chance, and by little."""
    seen = [
        np.random.default_rng(k).normal(1.0, 0.2, (8, 1)) for k in range(200)
    ]  # fmt: skip
    drifts = np.array([_drift(one)[0] for one in seen])
    assert (drifts > 0.0).sum() <= binom.ppf(1.0 - 1e-6, 200, 0.05)
    assert (drifts > 0.0).any()
    assert _drift(np.array([[1.0], [2.0]]))[0] == 0.0  # scatter of one each is not known


def test_worn_volume_is_spread_over_the_surface():
    """V = k W over 2 pi R L, of bearing and journal."""
    joints = joints_of(scene_with(WORN), None)[0]
    around = 2.0 * math.pi * 0.02
    np.testing.assert_allclose(joints.bearing, [1e-15 / (around * 0.02), 0.0], rtol=1e-14)
    journal = 1e-6 / 2e9 / (around * (0.02 - 0.3e-3))
    np.testing.assert_allclose(joints.journal, [0.0, journal], rtol=1e-14)
    assert (joints.excess == 0.0).all()
    new = {"factor": 4.0, "work": "2 MJ"}
    running_in = joints_of(scene_with({**WORN, "joints.rod_slider.wear.running_in": new}), None)[0]
    np.testing.assert_array_equal(running_in.excess, [0.0, 3.0])
    np.testing.assert_array_equal(running_in.fading, [1.0, 2e6])
    clearance, radius = joints.worn(np.array([1e6, 1e6]))
    np.testing.assert_allclose(radius - clearance, 0.0197 - joints.journal * 1e6, rtol=1e-12)


def test_a_life_ends_where_a_limit_is_passed_first():
    found = followed(ONE, PLAN, lambda c: np.array([50.0]), lambda c: 2.0 * float(c[0]))
    assert lifetime(found, ONE, {"clearance": 3.75e-4}) == pytest.approx(5e5, rel=1e-6)
    assert lifetime(found, ONE, {"clearance": 3.75e-4, "objective": 6.6e-4}) == pytest.approx(
        2e5, rel=1e-3
    )
    assert lifetime(found, ONE, {"clearance": 1e-3}) == math.inf
    assert lifetime(found, ONE, {"peak_contact_force": 0.5}) == 0.0


def test_limits_of_shares_are_clopper_and_pearsons():
    lower, upper = share_interval(np.array([0, 3, 20]), 20)
    assert lower[0] == 0.0
    assert upper[2] == 1.0
    assert binom.sf(2, 20, lower[1]) == pytest.approx(0.025, rel=1e-9)
    assert binom.cdf(3, 20, upper[1]) == pytest.approx(0.025, rel=1e-9)
    assert binom.cdf(0, 20, upper[0]) == pytest.approx(0.025, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "key"),
    [
        ({"wear": None}, "wear"),
        ({"joints.crank_rod.wear": None, "joints.rod_slider.wear": None, "study": None, "wear.lives": 1}, "joints"),
        ({"study": None}, "wear.lives"),
        ({"numerics.target_error": 1e-3}, "numerics.target_error"),
    ],
)  # fmt: skip
def test_what_has_no_lives_is_refused(changes, key):
    scene = load_scene(SCENE).with_(changes)
    with refused(key):
        check_worn(scene)


# ---- the command -----------------------------------------------------------------------------------


def words(output: Path, *settings: str) -> list[str]:
    """A `wear` command of few, short lives."""
    quick = ("wear.lives=6", "wear.points=5", "wear.copies=2", *settings)
    return ["wear", str(SCENE), "-o", str(output), *overrides(*quick)]


def test_a_linkage_wears_as_the_closed_form_says(tmp_path):
    """A journal that turns under a constant load; its rate falls with the clearance, as Hertz's law has it."""
    wear = {"wear": {"cycles": 2e6, "tolerance": 1e-4, "points": 3}, "numerics.rtol": 1e-9}
    found, _ = worn(tmp_path, load_scene(ROTOR).with_(wear))
    truth = solve_ivp(widening(1e-15), (0.0, 2e6), [1e-4], rtol=1e-11, atol=1e-16).y[0, -1]
    assert truth > 1.3e-4
    assert float(found.clearance[0, -1, 0]) == pytest.approx(truth, rel=1e-6)
    grown = found.bearing_depth[0, -1, 0] + found.journal_depth[0, -1, 0]
    assert float(grown) == pytest.approx(truth - 1e-4, rel=1e-5)


@pytest.mark.nightly
def test_numbers_of_six_lives_hang_together(tmp_path):
    code, output = run(words(tmp_path / "wear.nc"), 0)
    assert code == 0, output
    found = opened.read(tmp_path / "wear.nc", "wear")
    assert fan_figure(found) is not None
    assert survival_figure(found) is not None
    assert (found.ending == Status.OK).all()
    assert not (found.flags & Flag.TARGET_MISSED).any()
    followed = (found.ended >= found.cycle).transpose("life", "cycle")
    assert (found.clearance.notnull().all("joint") == followed).all()
    assert (np.diff(found.clearance, axis=1)[followed.values[:, 1:]] > 0.0).all()
    assert (found.end_clearance <= found.attrs["limit_clearance"] * (1.0 + 1e-6)).all()
    depths = found.bearing_depth + found.journal_depth
    grown = found.clearance - found.clearance.isel(cycle=0)
    np.testing.assert_allclose(grown, depths, atol=1e-15)  # NaN at the same places
    assert (found.survival_lower <= found.survival).all()
    assert (found.survival <= found.survival_upper).all()
    over = (found.lifetime <= float(found.cycle[-1])).mean()
    assert float(found.survival[-1]) == pytest.approx(1.0 - float(over))
    pace = (found.end_clearance - found.clearance.isel(cycle=0)).isel(joint=0) / found.ended
    assert np.corrcoef(found.k12, pace)[0, 1] > 0.9


def test_a_motion_that_has_not_settled_is_told(tmp_path):
    hasty = ("numerics.transient_revolutions=0", "numerics.averaged_revolutions=1")
    short = words(tmp_path / "wear.nc", *hasty, "wear.copies=4")
    code, output = run(short, 0)
    assert code == 0, output
    assert "raise numerics.transient_revolutions" in " ".join(output.split())
    found = opened.read(tmp_path / "wear.nc", "wear")
    assert (found.drift > 0.01).any()
    code, output = run([*short, "--fresh", "--set", "numerics.transient_revolutions=5"], 0)
    assert code == 0, output
    assert "raise numerics.transient_revolutions" not in output
    assert (opened.read(tmp_path / "wear-2.nc", "wear").drift < 0.01).all()


def test_lives_that_fail_are_told_and_end_the_command(tmp_path):
    out = tmp_path / "wear.nc"
    code, output = run(words(out, "numerics.max_steps=50"), 0)
    assert code == 1
    assert "step_cap" in output
    found = opened.read(out, "wear")
    assert (found.ending == Status.STEP_CAP).all()
    assert np.isnan(found.clearance).all()
    assert np.isnan(found.lifetime).all()
