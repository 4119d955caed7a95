"""Where lives of worn joints end: at their limits, in closed form, whatever the law, the limit and the revolutions allowed."""

import math
from pathlib import Path

import numpy as np
import opened
import pytest
from commands import run
from refusals import refused
from scipy.integrate import solve_ivp
from test_wear import QUICK, ROTOR, widening

from hpcclear.base.asking import answered
from hpcclear.base.outcome import Status
from hpcclear.cli.check import describe_scene
from hpcclear.dynamics.wear.curves import DEEPEST, curves, lifetime
from hpcclear.dynamics.wear.law import Joints
from hpcclear.dynamics.wear.life import LifePlan, WearOutcome, life
from hpcclear.scene import load_scene

JOBS = Path(__file__).parent.parent / "jobs"
NEW, SLOPE = 1e-4, 3e-12


def joint(factor: float = 1.0, fading: float = 1.0) -> Joints:
    """One that may run in; 20 mm of radius."""
    return Joints(*(np.array([x]) for x in (NEW, 0.02, 2e-12, 1e-12, factor - 1.0, fading)))


def followed(joints, plan, rate, objective=lambda c: 1.0, peak=lambda c: 1.0):
    """A life whose dynamics are functions of the clearances."""
    asked = []

    def seen(what):
        c, n = joints.worn(what.work)[0], len(what.copies)
        asked.append(what)
        return WearOutcome(
            np.repeat(rate(c)[None], n, axis=0), np.full(n, objective(c)), np.full((n, 1), peak(c)), np.zeros(n, int)
        )  # fmt: skip

    return answered(life(joints, plan), seen), asked


def plan(limits, cycles=1e12, beyond=False, tolerance=0.01):
    return LifePlan(cycles, tolerance, 5.0, 4, 16, limits, beyond)


def power_law(power, coefficient, clearance):
    """Revolutions to a clearance of a joint whose work in one is coefficient (c / c0)^power: an integral by hand."""
    speed, growth = SLOPE * coefficient, clearance / NEW
    if power == 1.0:
        return NEW / speed * math.log(growth)
    return NEW / speed * (growth ** (1.0 - power) - 1.0) / (1.0 - power)


LAWS = [
    (power, coefficient, growth)
    for power in (-0.5, 0.0, 1.0, 1.4)
    for coefficient, growth in ((5.0, 1.02), (80.0, 1.6), (20.0, 6.0), (5.0, 40.0))
]


@pytest.mark.parametrize(("power", "coefficient", "growth"), LAWS)
def test_a_life_ends_at_its_limit(power, coefficient, growth):
    """Slow and fast, a hair and forty times beyond new: the end is that of the law, and no cycle allowed changes it."""
    limit = growth * NEW
    joints, expected = joint(), power_law(power, coefficient, limit)

    def rate(c):
        return coefficient * (c / NEW) ** power

    found, asked = followed(joints, plan({"clearance": limit}), rate)
    assert (found.status, found.reason) == (Status.OK, "clearance")
    # each jump is off by at most 1 % of the clearance that it reaches, in revolutions at the speed there
    reached = np.array([float(joints.worn(node.work)[0][0]) for node in found.nodes])
    allowed = (0.01 * reached / (SLOPE * rate(reached))).sum()
    assert abs(found.ended - expected) <= allowed
    assert found.ended == pytest.approx(expected, rel=0.05)
    at_end = curves(found, joints, np.array([found.ended])).clearance[0, 0]
    assert at_end == pytest.approx(limit, rel=1e-6)  # straight between a thousand parts of a jump
    seen = curves(found, joints, np.linspace(0.0, 1.5 * found.ended, 3001)).clearance
    assert np.nanmax(seen) <= limit * (1.0 + 1e-6)
    assert np.isnan(seen[2001:]).all()
    assert lifetime(found, joints, {"clearance": limit}) == found.ended
    simulated = max(float(joints.worn(one.work)[0][0]) for one in asked)
    assert simulated <= NEW + 1.25 * (limit - NEW)  # nothing is spent beyond the end
    assert [one.done for one in asked] == sorted(one.done for one in asked)
    again, _ = followed(joints, plan({"clearance": limit}, cycles=3.0 * expected), rate)
    assert again.ended == found.ended
    assert again.simulations == found.simulations


@pytest.mark.parametrize(("factor", "fading"), [(6.0, 3e6), (20.0, 1e7), (1.0, 1.0)])
@pytest.mark.parametrize("growth", [1.2, 3.0])
def test_a_life_that_runs_in_ends_at_its_limit(factor, fading, growth):
    """At a constant rate: c = c0 + slope (W + (a - 1) W0 (1 - exp(-W / W0))), of which the root is looked for."""
    from scipy.optimize import brentq

    joints, limit = joint(factor, fading), growth * NEW
    found, _ = followed(joints, plan({"clearance": limit}), lambda c: np.array([50.0]))

    def left(n):
        work = 50.0 * n
        return NEW + SLOPE * (work - (factor - 1.0) * fading * math.expm1(-work / fading)) - limit

    assert found.ended == pytest.approx(brentq(left, 0.0, 1e8, xtol=1e-9, rtol=1e-12), rel=1e-6)


def test_the_first_of_several_joints_and_limits_ends_a_life():
    """Two joints under a common law, three limits each at its own place: whatever comes first in a fine integration."""
    rng = np.random.default_rng(8)
    reasons = set()
    for _ in range(15):
        joints = Joints(
            rng.uniform(0.8e-4, 1.2e-4, 2), np.full(2, 0.02), rng.uniform(1e-12, 4e-12, 2), np.zeros(2), np.zeros(2), np.ones(2)
        )  # fmt: skip
        k, power = rng.uniform(20.0, 80.0, 2), rng.uniform(-0.3, 1.0)
        limits = {
            "clearance": rng.uniform(1.5e-4, 6e-4), "objective": rng.uniform(1.5e-4, 6e-4),
            "peak_contact_force": rng.uniform(1.5e3, 6e3),
        }  # fmt: skip
        rate = lambda c, k=k, p=power: k * (c.mean() / NEW) ** p  # noqa: E731
        found, _ = followed(
            joints, plan(limits, tolerance=0.002), rate,
            lambda c: float(c.mean()), lambda c: 1e7 * float(c[0]),
        )  # fmt: skip
        heights = {
            "clearance": lambda _, c, m=limits: c.max() - m["clearance"],
            "objective": lambda _, c, m=limits: c.mean() - m["objective"],
            "peak_contact_force": lambda _, c, m=limits: 1e7 * c[0] - m["peak_contact_force"],
        }
        speed = lambda _, c, j=joints, r=rate: j.slope * r(c)  # noqa: E731
        times = solve_ivp(
            speed, (0.0, 1e8), joints.clearance, method="DOP853", rtol=1e-10, atol=1e-14,
            events=list(heights.values()), dense_output=False, max_step=1e6,
        ).t_events  # fmt: skip
        first = {name: float(at[0]) for name, at in zip(heights, times, strict=True) if len(at)}
        assert found.ended == pytest.approx(min(first.values()), rel=0.01)
        near = [name for name, at in first.items() if at <= 1.02 * min(first.values())]
        assert found.reason in near
        reasons.add(found.reason)
    assert reasons == set(limits)


@pytest.mark.parametrize(
    ("beyond", "limits"),
    [(False, {}), (True, {"clearance": 2.0 * NEW}), (False, {"objective": 9.0})],
)
@pytest.mark.parametrize("power", [0.0, 1.4])
def test_no_wear_goes_beyond_a_quarter_of_the_radius(beyond, limits, power):
    joints = joint()
    found, asked = followed(
        joints, plan(limits, beyond=beyond), lambda c: 50.0 * (c / NEW) ** power
    )
    assert found.status is Status.WORN_THROUGH
    assert found.ended == pytest.approx(power_law(power, 50.0, DEEPEST * 0.02), rel=0.02)
    last = curves(found, joints, np.array([found.ended])).clearance[0, 0]
    assert last == pytest.approx(DEEPEST * 0.02, rel=1e-6)
    assert max(float(joints.worn(one.work)[0][0]) for one in asked) < 1.3 * DEEPEST * 0.02
    passed = limits.get("clearance")
    expected = found.ended if passed is None else power_law(power, 50.0, passed)
    assert lifetime(found, joints, limits) == pytest.approx(expected, rel=0.02)


def test_a_life_may_go_on_and_one_that_reaches_its_cycles_is_censored():
    joints, rate = joint(), lambda c: np.array([50.0])
    beyond, _ = followed(joints, plan({"clearance": 1.5 * NEW}, cycles=1e6, beyond=True), rate)
    assert (beyond.status, beyond.reason, beyond.ended) == (Status.OK, "", 1e6)
    at = lifetime(beyond, joints, {"clearance": 1.5 * NEW})
    assert at == pytest.approx(0.5 * NEW / (50.0 * SLOPE), rel=1e-6)
    kept, _ = followed(joints, plan({"clearance": 4.0 * NEW}, cycles=1e6), rate)
    assert (kept.reason, kept.ended) == ("", 1e6)
    assert lifetime(kept, joints, {"clearance": 4.0 * NEW}) == math.inf
    over, _ = followed(joints, plan({"peak_contact_force": 0.5}), rate)
    assert (over.reason, over.ended) == ("peak_contact_force", 0.0)


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("wear.limit.clearance", "5.1 mm", "0.25 of "),
        ("wear.limit.clearance", "0.28 mm", "or more when new"),
        ("joints.crank_rod.clearance", "6 mm", "0.25 of "),
    ],
)
def test_limits_and_clearances_that_end_no_life_or_all_are_refused(key, value, reason):
    with refused(key, match=reason):
        describe_scene(load_scene(JOBS / "wear.toml").with_({key: value}), cost=False)


# ---- the command -----------------------------------------------------------------------------------

LIMIT, CYCLES = 1.2e-4, 1e9


def scene(lives: int, **wear: object) -> str:
    """The rotor of `test_wear`, whose coefficient scatters, with a limit that it passes long before its cycles."""
    followed = {"cycles": CYCLES, "lives": lives, "tolerance": 1e-3, "points": 9, "copies": 2,
                "limit": {"clearance": LIMIT}, **wear}  # fmt: skip
    k = {
        "path": "mechanism.joints.main.wear.bearing.coefficient",
        "distribution": "uniform",
        "half_width": 5e-16,
    }
    variable = {"path": "mechanism.bodies.shaft.mass", "range": [0.5, 2.0]}
    study = {"variables": {"m": variable}, "random": {"k": k}}
    return load_scene(ROTOR).with_({"wear": followed, "study": study, **QUICK}).to_toml()


def revolutions(k: float) -> float:
    """To the limit, from Hertz' law by a fine integration."""

    def over(_, c):
        return c[0] - LIMIT

    over.terminal = True
    fine = {"rtol": 1e-10, "atol": 1e-16, "max_step": 1e5}
    return float(solve_ivp(widening(k), (0.0, CYCLES), [NEW], events=over, **fine).t[-1])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Directory and printed words of a run whose lives all end at their limit."""
    folder = tmp_path_factory.mktemp("ends")
    (folder / "scene.toml").write_text(scene(4), encoding="utf-8")
    (folder / "results").mkdir()
    words = [
        "wear",
        str(folder / "scene.toml"),
        "-o",
        str(folder / "results" / "wear.nc"),
        "--progress",
        "log",
    ]
    code, output = run(words, 0)
    assert code == 0, output
    return folder, output


def test_the_command_ends_lives_at_their_limit(written):
    folder, _ = written
    found = opened.read(folder / "results" / "wear.nc", "wear")
    expected = np.array([revolutions(k) for k in found.k.values])
    np.testing.assert_allclose(found.ended, expected, rtol=2e-3)
    np.testing.assert_array_equal(found.lifetime, found.ended)
    np.testing.assert_allclose(found.end_clearance, LIMIT, rtol=1e-6)
    assert (found.end_reason == "clearance").all()
    assert float(found.clearance.max()) <= LIMIT * (1.0 + 1e-6)
    assert float(found.cycle[-1]) == float(found.ended.max())  # curves end with the longest life
    np.testing.assert_allclose(
        found.lifetime_hours, expected * math.tau / 100.0 / 3600.0, rtol=2e-3
    )
    alive = (found.ended.values[:, None] > found.cycle.values).mean(axis=0)
    np.testing.assert_allclose(found.survival, alive)
    np.testing.assert_allclose(found.exceedance[:, 0], 1.0 - alive)
    # the coefficient decides, over or not
    assert float(found.rank_correlation[0, 0]) == pytest.approx(1.0)
