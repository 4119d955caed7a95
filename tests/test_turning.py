"""Linkages that cannot turn, and change points: against Grashof's rule, determinants of other equations, and 50 digits."""

import math
from dataclasses import replace
from decimal import Decimal, getcontext
from pathlib import Path

import numpy as np
import pytest
from commands import overrides, run
from linkages import FOUR, bar, constant_speed, harmonic, pins, torque_drive
from planar_scenes import planar_scene, without_play
from test_linkage_scenes import ROCKER, rocker

from hpcclear import load_scene, simulate
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.evaluation import evaluate_records
from hpcclear.dynamics.layout.views import Outcome, Parameters, Start
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.planar.problem import refused_of
from hpcclear.dynamics.planar.turning import changes, passage, refused
from hpcclear.dynamics.setup.parameters import parameters
from hpcclear.dynamics.setup.problem import problem_of
from hpcclear.dynamics.setup.start import start_states
from hpcclear.scene.points import Points

JOBS = Path(__file__).parents[1] / "jobs" / "linkages"
MOTOR = constant_speed("motor", "crank", 2 * math.pi)
NOTHING = Points((), np.empty((1, 0)), ())
LOCKED = "mechanism.bodies.coupler.length=0.088"


def four_bar(a, b, c, g, start, elbow, open_pins=(), drive=MOTOR):
    """A four-bar whose pose at the start is worked out here; `elbow`: 1 or -1."""
    pin = complex(a * math.cos(start), a * math.sin(start))
    across = complex(g, 0.0) - pin
    d = abs(across)
    turn = elbow * math.acos((b * b + d * d - c * c) / (2 * b * d))
    joint = pin + b * across / d * complex(math.cos(turn), math.sin(turn))
    angles = [math.atan2((z := joint - pin).imag, z.real), math.atan2(joint.imag, joint.real - g)]
    bodies = (
        bar("crank", a, 0.2, start), bar("coupler", b, 0.3, angles[0]),
        bar("rocker", c, 0.25, angles[1]),
    )  # fmt: skip
    ground = {"o": (0.0, 0.0), "p": (g, 0.0)}
    return Mechanism(bodies, pins(open_pins, *FOUR), (drive,), ground)


def where(error):
    """Angle of the drive's body that a message names, rad."""
    return math.radians(float(error.reason.split(" at ")[1].split(" deg")[0]))


# ---- cranks that cannot turn -------------------------------------------------------------------------


def random_four_bars(count):
    """Lengths a, b, c, g, start and elbow of four-bars that close, none nearer than 1 % to where they just turn."""
    rng = np.random.default_rng(7)
    while count:
        a, b, c, g = rng.uniform(0.3, 1.0, 4)
        start, elbow = rng.uniform(0.0, 2 * math.pi), rng.choice([-1, 1])
        d = abs(g - a * complex(math.cos(start), math.sin(start)))
        rooms = (b + c - (g + a), abs(g - a) - abs(b - c))
        if abs(b - c) + 0.02 < d < b + c - 0.02 and min(map(abs, rooms)) > 0.01:
            count -= 1
            yield (a, b, c, g, start, elbow), min(rooms) > 0.0


def lock_of(a, b, c, g, start):
    """Angle at which a crank that turns forward locks, rad, by the law of cosines."""
    ends = []
    for reach in (b + c, abs(b - c)):
        cosine = (a * a + g * g - reach * reach) / (2 * a * g)
        ends += [s * math.acos(cosine) for s in (-1, 1)] if abs(cosine) <= 1 else []
    return min(ends, key=lambda angle: (angle - start) % (2 * math.pi))


def test_four_bars_turn_where_grashof_says_so():
    """With and without clearance; where they lock is that of the law of cosines."""
    sides = []
    for numbers, turns in random_four_bars(30):
        for open_pins in ((), ("o2", "o3")):
            told = refused(passage(four_bar(*numbers, open_pins), 0.0, 2))
            assert (told is None) == turns
            if told is not None:
                assert told[0] is Status.CANNOT_TURN
                apart = where(told[1]) - lock_of(*numbers[:5])
                assert abs(math.remainder(apart, 2 * math.pi)) < math.radians(0.06)  # as printed
                assert "coupler and rocker in line (joints " in told[1].reason
        sides.append(turns)
    assert 5 < sum(sides) < 25


def test_samples_get_their_statuses_by_grashof():
    """All lengths vary about the shipped scene, on both sides of the rule; what cannot be put together has the status too."""
    scene = rocker()
    rng = np.random.default_rng(1)
    values = rng.uniform((0.03, 0.06, 0.05), (0.07, 0.16, 0.11), (30, 3))
    names = ("crank", "coupler", "rocker")
    paths = tuple((f"mechanism.bodies.{name}.length",) for name in names)
    points = Points(names, values, paths)
    status = start_states(scene, parameters(scene, points), points).failed
    (a, b, c), g = values.T, math.hypot(0.13, 0.01)
    room = np.minimum(b + c - (g + a), abs(g - a) - abs(b - c))
    sure = np.abs(room) > 1e-4
    np.testing.assert_array_equal(status[sure] == Status.OK, room[sure] > 0.0)
    assert set(status[sure]) == {Status.OK, Status.CANNOT_TURN}


def six_bar(rng):
    """A Stephenson linkage, a dyad between its coupler and the ground, with its numbers as complex ones."""
    b, c, e, f = rng.uniform(0.7, 1.2), rng.uniform(0.6, 1.1), *rng.uniform(0.5, 1.1, 2)
    a, g, tip = 0.4, 1.0, complex(rng.uniform(0.2, 0.6), rng.uniform(0.2, 0.6))
    q = complex(rng.uniform(-0.3, 0.6), rng.uniform(0.9, 1.4))
    return a, b, c, e, f, g, tip, q


def closure(numbers, angles, crank):
    """Loop-closure errors (4,) of a six-bar and their Jacobian (4, 4) by the angles of coupler, rocker, link and arm."""
    a, b, c, e, f, g, tip, q = numbers
    u, w, x, y = np.exp(1j * angles)
    pin = a * np.exp(1j * crank)
    errors = (pin + b * u - g - c * w, pin + tip * u + e * x - q - f * y)
    rows = ((1j * b * u, -1j * c * w, 0j, 0j), (1j * tip * u, 0j, 1j * e * x, -1j * f * y))
    both = [part for z in errors for part in (z.real, z.imag)]
    return np.array(both), np.array([[getattr(z, p) for z in row] for row in rows for p in ("real", "imag")])  # fmt: skip


def dead_centre(numbers, angles):
    """Where the determinant first vanishes within a turn from 0, rad, by fine steps; None if it does not."""
    steps = 900
    h, seen, speed = 2 * math.pi / steps, [], np.zeros(4)
    for k in range(steps + 1):
        new = angles + h * speed
        for _ in range(4):
            error, jacobian = closure(numbers, new, k * h)
            new = new - np.linalg.solve(jacobian, error)
        error, jacobian = closure(numbers, new, k * h)
        square = np.linalg.det(jacobian) ** 2
        if np.abs(error).max() > 1e-9 or (k and np.abs(new - angles).max() > 0.2):
            # the square falls linearly where it vanishes
            (one, two) = seen[-2:]
            return (k - 1) * h + h * two / (one - two)
        speed = (new - angles) / h if k else speed
        angles = new
        seen.append(square)
    return None


def test_dead_centres_of_six_bars_are_where_determinants_vanish():
    rng = np.random.default_rng(5)
    locks = turns = 0
    while locks < 4 or turns < 2:
        numbers = six_bar(rng)
        a, b, c, e, f, g, tip, q = numbers
        angles = rng.uniform(-3.0, 3.0, 4)
        for _ in range(60):
            error, jacobian = closure(numbers, angles, 0.0)
            angles = angles - np.linalg.lstsq(jacobian, error, rcond=1e-6)[0]
        if np.abs(closure(numbers, angles, 0.0)[0]).max() > 1e-12 or abs(np.linalg.det(jacobian)) < 0.02:  # fmt: skip
            continue
        expected = dead_centre(numbers, angles)
        locks, turns = locks + (expected is not None), turns + (expected is None)
        coupler = bar("coupler", b, 0.3, angles[0], tip=(tip.real, tip.imag))
        bodies = (
            bar("crank", a, 0.2), coupler, bar("rocker", c, 0.2, angles[1]),
            bar("link", e, 0.2, angles[2]), bar("arm", f, 0.2, angles[3]),
        )  # fmt: skip
        more = "o5 coupler.tip link.a", "o6 link.b arm.b", "o7 arm.a ground.q"
        ground = {"o": (0.0, 0.0), "p": (g, 0.0), "q": (q.real, q.imag)}
        made = Mechanism(bodies, pins(("o2", "o6"), *FOUR, *more), (MOTOR,), ground)
        told = refused(passage(made, 0.0, 1))
        assert (told is None) == (expected is None)
        if told is not None:
            assert abs(where(told[1]) - expected) < math.radians(0.2)  # of steps of 0.4 degrees


def test_what_swings_is_walked_as_far_as_its_drive_swings_it():
    numbers = (0.5, 0.4, 0.6, 0.9, 1.0, 1)  # outside Grashof's rule
    lock = lock_of(*numbers[:5])
    for share, locks in ((0.95, False), (1.05, True)):
        drive = harmonic("servo", "crank", share * (lock - 1.0), 2.0, mean=1.0)
        told = refused(passage(four_bar(*numbers, ("o3",), drive), 0.0, 1))
        assert (told is not None) == locks
    torque = torque_drive("engine", "crank", 3.0, 5.0)
    assert refused(passage(four_bar(*numbers, ("o3",), torque), 0.0, 1)) is None  # it may swing


def test_a_locked_design_is_a_status_and_none_of_the_others_is_touched():
    scene = rocker()
    points = Points(("b",), np.array([[0.12], [0.088]]), (("mechanism.bodies.coupler.length",),))
    records = evaluate_records(scene, points)
    assert records["status"].tolist() == [Status.OK, Status.CANNOT_TURN]
    assert np.isfinite(records["objective"]).tolist() == [True, False]
    (alone,) = evaluate_records(scene, Points(points.names, points.values[:1], points.paths))
    assert alone["objective"] == records["objective"][0]
    response = simulate(rocker(LOCKED))
    assert int(response["status"]) == Status.CANNOT_TURN
    assert response.attrs["ended"].startswith("cannot turn: locks at 161.7 deg of the crank")
    assert response.sizes["time"] == 1
    assert np.isnan(float(response["objective"]))


def test_check_names_where_the_design_locks(tmp_path):
    """Refused where nothing of its geometry varies; where a study varies it, told, and the command fails."""
    own = tmp_path / "own.toml"
    own.write_text((JOBS / "crank_rocker.toml").read_text().partition("[study]")[0])
    said = "cannot turn: locks at 161.7 deg of the crank"
    for options in (["--no-cost"], []):
        code, told = run(["check", str(own), *overrides(LOCKED), *options], 0)
        assert code == 2
        assert said in " ".join(told.split())
        assert "clearance" not in told  # which would be torn through
        assert "np.float64(" not in told
    study = JOBS / "crank_rocker.toml"
    code, told = run(["check", str(study), *overrides(LOCKED), "--no-cost"], 0)
    assert code == 1
    assert said in " ".join(told.split())


@pytest.mark.parametrize("ask", [refused_of, simulate])
def test_what_cannot_be_put_together_is_refused_by_its_key_in_the_scene(ask):
    with pytest.raises(InputError, match=r"^mechanism\.joints\."):
        ask(without_play(rocker("mechanism.bodies.coupler.length=1")))


def test_a_linkage_without_a_drive_is_refused():
    content = {**ROCKER, "mechanism": {k: v for k, v in ROCKER["mechanism"].items() if k != "drives"}}  # fmt: skip
    with pytest.raises(InputError, match=r"nothing drives .* Add \[mechanism\.drives"):
        problem_of(load_scene({key: value for key, value in content.items() if key != "study"}))


def test_a_crank_that_falls_back_at_once_has_a_response():
    """From another angle than 0, by a torque against its speed: it stalls before its first step."""
    motor = {
        "kind": "torque", "body": "crank", "torque": -50.0, "initial_speed": 0.1,
        "expected_speed": 90.0,
    }  # fmt: skip
    response = simulate(rocker().with_({"mechanism.drives.motor": motor}))
    assert int(response["status"]) == Status.STALLED
    assert np.isfinite(response["crank_speed"].to_numpy()).all()
    assert float(response["crank_speed"][0]) == pytest.approx(0.1)


@pytest.mark.parametrize(("depth", "status"), [(0.035, Status.OK), (0.3, Status.TORN_THROUGH)])
def test_a_journal_deep_in_its_bearing_is_no_result(depth, status):
    """The paper's softest bearing comes to 0.035 of its radius."""
    scene = rocker()
    par = parameters(scene)
    rows = Outcome(np.zeros((1, Outcome.size)))
    rows.deepest[:, 1] = depth * Parameters(par).bearing_radius[:, 1]
    marked = problem_of(scene).marked(rows, par, Start.at_rest(1))
    assert marked.status.tolist() == [status]


# ---- change points -----------------------------------------------------------------------------------


def ideal(bodies, joints, drives, ground, **numerics):
    """A scene of bars and pins alone: bodies (length, start in rad), joints (journal, bearing), drives (body, rad/s)."""
    return planar_scene(
        {
            name: {"length": size, "mass": 0.2, "inertia_ratio": 1.0, "start_angle": angle}
            for name, (size, angle) in bodies.items()
        },
        {
            f"j{k}": {"kind": "revolute", "journal": one, "bearing": two}
            for k, (one, two) in enumerate(joints)
        },
        {
            f"d{k}": {"kind": "constant-speed", "body": body, "speed": speed, "period": k == 0}
            for k, (body, speed) in enumerate(drives)
        },
        ground=ground,
        **{"numerics": {"transient_revolutions": 0, "averaged_revolutions": 2}, **numerics},
    )


def parallelogram(start, speed, **more):
    joints = [(one, two) for _, one, two in map(str.split, FOUR)]
    bodies = {"crank": (0.1, start), "coupler": (0.2, 0.0), "rocker": (0.1, start)}
    return ideal(bodies, joints, [("crank", speed)], {"o": [0.0, 0.0], "p": [0.2, 0.0]}, **more)


STARTS = (30.0, 45.0, 60.0, 61.3, 75.0, 77.7, 90.0, 100.1, 120.0, 180.5, -0.2, 250.0)


@pytest.mark.parametrize(
    "path", ["bodies.coupler.mass_center", "bodies.rocker.mass_center", "bodies.coupler.mass"]
)
@pytest.mark.parametrize("locked", [False, True])
@pytest.mark.shortened(2)
def test_designs_that_differ_in_mass_alone_all_turn_or_none(path, locked):
    """Turning is judged by the scene's own geometry then; each has the bits of its own scene."""
    path = f"mechanism.{path}"
    apart = [f"mechanism.bodies.{one}.mass_center=0.03" for one in ("coupler", "rocker")]
    scene = rocker(*apart, *([LOCKED] if locked else []))
    values = np.array([[0.9], [1.1]]) * scene.number(path)
    records = evaluate_records(scene, Points(("x",), values, ((path,),)))
    assert records["status"].tolist() == [Status.CANNOT_TURN if locked else Status.OK] * 2
    for value, record in zip(values[:, 0], records, strict=True):
        (alone,) = evaluate_records(scene.with_({path: float(value)}), NOTHING)
        assert alone["status"] == record["status"]
        np.testing.assert_allclose(alone["objective"], record["objective"], rtol=1e-6)


@pytest.mark.parametrize("speed", [6.0, -6.0])
def test_a_parallelogram_stays_one_from_every_start(speed):
    """Instants of the output meet both change points or pass beside them."""
    for start in np.radians(STARTS):
        response = simulate(parallelogram(start, speed))
        assert int(response["status"]) == Status.OK
        time, angle = response["time"].to_numpy(), response["body_angle"].to_numpy()
        assert time[-1] == pytest.approx(4 * math.pi / abs(speed))
        np.testing.assert_allclose(angle[:, 0], start + speed * time, atol=1e-9)
        np.testing.assert_allclose(angle[:, 2], angle[:, 0], atol=1e-9)
        np.testing.assert_allclose(angle[:, 1], 0.0, atol=1e-9)
        # the coupler goes round on a circle, pulled by both its pins: 0.2 kg, 0.1 m
        np.testing.assert_allclose(response["body_spin"].to_numpy()[:, 2], speed, atol=1e-6)
        force = np.hypot(response["pin_force_x"], response["pin_force_y"]).to_numpy()[:, 1]
        np.testing.assert_allclose(force, 0.1 * 0.1 * speed**2, rtol=1e-4)


def test_forces_without_bound_end_a_parallelogram_from_every_start():
    """Its weight has no hold where it is in line: near_singular, in responses and in samples."""
    for start in np.radians((STARTS[2], STARTS[3], STARTS[-1])):
        scene = parallelogram(start, 6.0, effects={"gravity": 9.81})
        response = simulate(scene)
        assert int(response["status"]) == Status.NEAR_SINGULAR
        first = -start % math.pi
        assert response["time"].to_numpy()[-1] * 6.0 < first
        assert first - response["time"].to_numpy()[-1] * 6.0 < 0.02
        (record,) = evaluate_records(scene, Points((), np.empty((1, 0)), ()))
        assert record["status"] == Status.NEAR_SINGULAR
        assert np.isnan(record["objective"])


PI = Decimal("3.14159265358979323846264338327950288419716939937510582097494")


def sine(x):
    """Of a number, to 50 digits."""
    x = x % (2 * PI)
    term = total = x
    for k in range(1, 60):
        term *= -x * x / ((2 * k) * (2 * k + 1))
        total += term
    return total


def continued(count):
    """Where the two legs of the geared five-bar meet, m, (count, 2) instants of two turns: continuation with 50 digits."""
    getcontext().prec = 50
    size, leg, ground = Decimal(4) / 100, Decimal(10) / 100, Decimal(12) / 100
    seen, tip = [], [Decimal("0.1"), Decimal("0.0979795897113271")]
    fine = 2  # steps between instants, shifted so that none meets the stretch
    step, shift = 4 * PI / ((count - 1) * fine), Decimal("1e-4")
    for k in range((count - 1) * fine + 1):
        t = k * step + (shift if k else 0)
        base = [size * sum(sine(n * t + turn) for n in (1, 3)) for turn in (PI / 2, Decimal(0))]
        if len(seen) > 3:
            tip = [4 * a - 6 * b + 4 * c - d for a, b, c, d in zip(*(s[1] for s in seen[:-5:-1]), strict=True)]  # fmt: skip
        for _ in range(9):
            x, y = tip[0] - base[0], tip[1] - base[1]
            u, w = tip[0] - ground, tip[1]
            e, f = (x * x + y * y - leg * leg) / 2, (u * u + w * w - leg * leg) / 2
            det = x * w - y * u
            tip = [tip[0] - (e * w - f * y) / det, tip[1] - (x * f - u * e) / det]
        seen.append((t, tip))
    return seen


def test_a_five_bar_goes_through_its_full_stretch():
    """Geared 3 to 1, it is stretched at 180 degrees: continued with 50 digits, whatever the instants of the output."""
    bodies = {
        "a": (0.04, 0.0), "b": (0.04, 0.0), "c": (0.1, math.radians(78.463041)),
        "d": (0.1, math.radians(101.53696)),
    }  # fmt: skip
    joints = [("a.a", "ground.o"), ("a.b", "b.a"), ("b.b", "c.a"), ("c.b", "d.b"), ("d.a", "ground.p")]  # fmt: skip
    drives = [("a", 2 * math.pi), ("b", 6 * math.pi)]
    scene = ideal(bodies, joints, drives, {"o": [0.0, 0.0], "p": [0.12, 0.0]})
    exact = continued(721)
    times = np.array([float(t / (2 * PI)) for t, _ in exact])
    from scipy.interpolate import CubicSpline

    peaks = []
    for count in (720, 719, 501):
        response = simulate(scene.with_({"output.instants_per_revolution": count}))
        assert int(response["status"]) == Status.OK
        found = response[["point_x", "point_y"]].sel(point="c.b")
        for k, name in enumerate(("point_x", "point_y")):
            expected = CubicSpline(times, [float(tip[k]) for _, tip in exact])
            np.testing.assert_allclose(found[name], expected(response["time"]), atol=1e-7)
        peaks.append(float(np.hypot(response["pin_force_x"], response["pin_force_y"]).max()))
    assert max(peaks) < 1.01 * min(peaks)  # a smooth peak, seen at other instants
    assert max(peaks) < 1e3


@pytest.mark.parametrize("start", [0.4, 1.0, 2.0])
def test_a_rhombus_with_two_drives_passes_where_it_folds(start):
    """Two sides turn at -1 and 1, so that it folds flat four times; its far corner stays the sum of both."""
    bodies = {"p": (0.1, start), "q": (0.1, -start), "r": (0.1, -start), "s": (0.1, start)}
    joints = [("p.a", "ground.o"), ("q.a", "ground.o"), ("p.b", "r.a"), ("q.b", "s.a"), ("r.b", "s.b")]  # fmt: skip
    scene = ideal(bodies, joints, [("p", 5.0), ("q", -5.0)], {"o": [0.0, 0.0]})
    response = simulate(scene)
    turn = start + 5.0 * response["time"].to_numpy()
    corner = response[["point_x", "point_y"]].sel(point="r.b")
    np.testing.assert_allclose(corner["point_x"], 0.2 * np.cos(turn), atol=1e-9)
    np.testing.assert_allclose(corner["point_y"], 0.0, atol=1e-9)
    assert int(response["status"]) in (Status.OK, Status.NEAR_SINGULAR)


def test_change_points_that_clearance_decides_are_named_at_their_angles():
    """A parallelogram folds where its crank lies along the ground, a rocker whose links differ nowhere."""
    for pin in ("o2", "o3", "o4"):
        for a, g in ((0.1, 0.2), (0.07, 0.11), (0.2, 0.13)):
            base = four_bar(a, g, a, g, 1.0, 1)
            opened = replace(base, joints=pins((pin,), *FOUR))
            angles = np.array(changes(opened, passage(opened, 0.0, 1)))
            off = np.minimum(angles % 180.0, -angles % 180.0)
            assert len(angles) == 2
            np.testing.assert_allclose(off, 0.0, atol=0.1)
            assert abs(angles[1] - angles[0]) == pytest.approx(180.0, abs=0.1)
            assert changes(base, passage(base, 0.0, 1)) == ()  # passed, and judged
        rocking = four_bar(0.04, 0.12, 0.08, 0.13, 1.0, 1)
        rocks = replace(rocking, joints=pins((pin,), *FOUR))
        assert changes(rocks, passage(rocks, 0.0, 1)) == ()


def test_clearance_decides_at_a_change_point_unless_ideal_joints_alone_depend():
    base = four_bar(0.1, 0.2, 0.1, 0.2, 1.0, 1)
    opened = replace(base, joints=pins(("o3",), *FOUR))
    assert refused(passage(opened, 0.0, 1)) is None
    bodies = (*base.bodies, bar("link", 0.3, 0.2, 0.1), bar("arm", 0.25, 0.2, 1.5))
    more = "o5 rocker.b link.a", "o6 link.b arm.b", "o7 arm.a ground.q"
    ground = {"o": (0.0, 0.0), "p": (0.2, 0.0), "q": (0.5, -0.05)}
    carried = Mechanism(bodies, pins(("o5", "o6"), *FOUR, *more), (MOTOR,), ground)
    told = refused(passage(carried, 0.0, 1))
    assert told is not None
    assert told[0] is Status.NEAR_SINGULAR
    assert where(told[1]) == pytest.approx(math.pi, abs=1e-3)
