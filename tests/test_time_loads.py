"""Loads against the time and against another body's angle, and run-ups: closed forms, own integration, files, refusals."""

import numpy as np
import pytest
from planar_scenes import without_play
from refusals import refused
from scipy.integrate import solve_ivp
from test_linkage_scenes import rocker
from test_loads import INERTIA, START, angle_of, machine

from hpcclear import load_scene, simulate
from hpcclear.dynamics.evaluation import evaluator_of
from hpcclear.ensemble.api import as_points

TURN = 2 * np.pi


def smooth(s):
    """What a monotone cubic is between two rows with level ends."""
    s = np.clip(s, 0.0, 1.0)
    return s * s * (3.0 - 2.0 * s)


def integrated(torque, start, time):
    """Angle of the pendulum, whose mass centre is its pin."""
    return solve_ivp(
        lambda t, y: [y[1], torque(t, y[0]) / INERTIA], (0, time[-1]), [start, 0.0], t_eval=time,
        method="DOP853", rtol=1e-12, atol=1e-13, max_step=0.01,
    ).y[0]  # fmt: skip


def test_a_force_grows_with_the_time_and_stays():
    """x'' = F(t)/m, F a cubic over 1.75 s, through the ends of revolutions of 1 s: x = F T^2/m (s^4/4 - s^5/10), then on."""
    mass, force, rise = 0.3, 2.0, 1.75
    bodies = {"block": {"mass": mass, "points": {"o": [0.0, 0.0]}}}
    joints = {"rail": {"kind": "slide", "point": "block.o", "line": "ground.o"}}
    push = {
        "kind": "force", "place": "block.o", "direction": 0.0,
        "size_by_time": [["0 s", "0 N"], ["1750 ms", "2 N"]],
    }  # fmt: skip
    found = simulate(machine({"push": push}, bodies, joints))
    time = found["time"].to_numpy()
    s, late = np.minimum(time / rise, 1.0), np.maximum(time - rise, 0.0)
    moved = rise**2 * (s**4 / 4 - s**5 / 10) + 0.5 * rise * late + 0.5 * late**2
    x = found["body_x"].sel(body="block").to_numpy()
    np.testing.assert_allclose(x, force / mass * moved, atol=1e-8)
    speed = found["body_vx"].sel(body="block").to_numpy()
    np.testing.assert_allclose(found["load_work"].to_numpy(), 0.5 * mass * speed**2, atol=1e-7)


def test_a_torque_repeats_with_its_own_time():
    """Up and down within 0.6 s, beside revolutions of 1 s."""
    top, half = 0.02, 0.3
    rows = [[0.0, 0.0], [half, top], [2 * half, 0.0]]
    kick = {"kind": "torque", "body": "pendulum", "torque_by_time": rows, "repeats": True}
    found = simulate(machine({"kick": kick}))

    def torque(t, _):
        s = np.mod(t, 2 * half) / half
        return top * smooth(s if s < 1.0 else 2.0 - s)

    time = found["time"].to_numpy()
    expected = integrated(torque, START, time)
    np.testing.assert_allclose(angle_of(found, "pendulum"), expected, atol=1e-8 * expected.max())


def test_a_torque_goes_by_the_angle_of_the_body_itself():
    """Between -90 and 90 degrees a cubic from T to -T, which holds the pendulum like a spring."""
    top = 0.05
    rows = [["-90 deg", f"{top} N m"], ["90 deg", f"{-top} N m"]]
    hold = {"kind": "torque", "body": "pendulum", "angle_of": "pendulum", "torque": rows}
    found = simulate(machine({"hold": hold}))
    time = found["time"].to_numpy()
    expected = integrated(lambda _, x: top * (1 - 2 * smooth(x / np.pi + 0.5)), START, time)
    np.testing.assert_allclose(angle_of(found, "pendulum"), expected, atol=1e-8)
    swing = np.abs(expected).max()
    assert swing < START * 1.001


def test_a_driven_wheel_needs_the_torque_that_the_time_has():
    """Nothing to integrate: the drive's torque is the load's, reversed."""
    rows = [[0.0, 0.0], [1.5, 4.0]]
    load = {"kind": "torque", "body": "wheel", "torque_by_time": rows}
    found = simulate(machine({"load": load}, {}, {}))
    expected = -4.0 * smooth(found["time"].to_numpy() / 1.5)
    np.testing.assert_allclose(found["crank_moment"].to_numpy(), expected, atol=1e-9)


def run_up(**entries):
    drive = {
        "kind": "run-up", "body": "wheel", "speed_by_time": [["0 s", "0 rpm"], ["2 s", "1200 rpm"]], **entries,
    }  # fmt: skip
    return machine({}, {}, {}, drive, turns=30)


def test_a_run_up_has_its_speed_and_takes_its_torque():
    scene = run_up(flywheel_inertia=5e-3)
    found = simulate(scene)
    time, top = found["time"].to_numpy(), 40 * np.pi
    s = time / 2.0
    np.testing.assert_allclose(found["crank_speed"].to_numpy(), top * smooth(s), atol=1e-8 * top)
    angle = 2.0 * top * (
        np.minimum(s, 1.0) ** 3 - 0.5 * np.minimum(s, 1.0) ** 4
    ) + top * np.maximum(time - 2.0, 0.0)
    np.testing.assert_allclose(found["crank_angle"].to_numpy(), angle, atol=1e-7)
    torque = 1.5e-2 * top / 2.0 * np.where(s < 1.0, 6 * s * (1 - s), 0.0)
    np.testing.assert_allclose(found["crank_moment"].to_numpy(), torque, atol=1e-6)
    work = 0.5 * 1.5e-2 * found["crank_speed"].to_numpy() ** 2
    np.testing.assert_allclose(found["driving_work"].to_numpy(), work, atol=1e-7 * work.max())
    assert time[-1] > 2.0


def test_a_linkage_that_ran_up_moves_as_one_at_that_speed():
    scene = load_scene("jobs/linkages/crank_rocker.toml").with_(
        {"numerics.transient_revolutions": 0}
    )
    speed = abs(scene.mechanism.drives[0].speed)
    body = scene.mechanism.drives[0].body
    motor = {"kind": "run-up", "body": body, "speed_by_time": [[0.0, 0.0], [0.2, speed]]}
    ideal = without_play(scene).with_({"numerics.rtol": 1e-10})
    steady = simulate(ideal)
    run_up = {"mechanism.drives": {"motor": motor}, "numerics.averaged_revolutions": 4}
    run = simulate(ideal.with_(run_up))
    late = run["time"].to_numpy() > 0.21
    assert late.sum() > 100
    turn = np.mod(run["crank_angle"].to_numpy()[late], TURN)
    known = np.mod(steady["crank_angle"].to_numpy(), TURN)
    order = np.argsort(known)
    moment = np.interp(turn, known[order], steady["crank_moment"].to_numpy()[order], period=TURN)
    scale = np.abs(moment).max()
    np.testing.assert_allclose(run["crank_moment"].to_numpy()[late], moment, atol=2e-3 * scale)
    work = np.abs(np.diff(run["driving_work"].to_numpy())).sum()
    assert float(np.abs(run["energy_residual"]).max()) < 1e-8 * work


def test_tables_against_the_time_come_from_files(tmp_path):
    (tmp_path / "load.csv").write_text("Zeit [ms];Moment [Nmm]\n0;0\n500;30\n1500;10\n")
    (tmp_path / "run.csv").write_text("t [s],speed [rpm]\n-0.5,60\n0.5,120\n")
    text = """
        format_version = 2
        [mechanism]
        kind = "planar"
        bodies.wheel = { mass = 1.0, inertia = 1e-2, points = { o = [0.0, 0.0] } }
        joints.pin = { kind = "revolute", journal = "wheel.o", bearing = "ground.o" }
        drives.motor = { kind = "run-up", body = "wheel", speed_by_time = { file = "run.csv" } }
        loads.load = { kind = "torque", body = "wheel", torque_by_time = { file = "load.csv" } }
    """
    (tmp_path / "scene.toml").write_text(text)
    scene = load_scene(tmp_path / "scene.toml")
    assert ["-0.5 s counts as 0 s" in str(one) for one in scene.readings] == [True, False]
    rows = scene.mechanism.loads[0].torque_by_time
    np.testing.assert_allclose(rows, [[0.0, 0.0], [0.5, 0.03], [1.5, 0.01]])
    np.testing.assert_allclose(
        scene.mechanism.drives[0].speed_by_time, [[0.0, TURN], [1.0, 2 * TURN]]
    )


@pytest.mark.parametrize(
    ("load", "key"),
    [
        ({"torque": 1.0, "torque_by_time": [[0, 1], [1, 2]]}, "loads.x.torque"),
        ({"torque_by_time": [[0, 1], [1, 2]], "repeats": True}, "loads.x.torque_by_time"),
        ({"torque_by_time": [[-1, 1], [1, 2]]}, "loads.x.torque_by_time"),
        ({"torque": 1.0, "angle_of": "pendulum"}, "loads.x.angle_of"),
        ({"torque": [[0, 1], [1, 2]], "angle_of": "nobody"}, "loads.x.angle_of"),
        ({"torque": 1.0, "repeats": True}, "loads.x.repeats"),
        ({}, "loads.x.torque"),
    ],
)
def test_loads_at_fault_are_named(load, key):
    with refused(f"mechanism.{key}"):
        simulate(machine({"x": {"kind": "torque", "body": "pendulum", **load}}))


def test_a_run_up_does_not_stop():
    with refused("mechanism.drives.clock.speed_by_time"):
        run_up(speed_by_time=[[0, 1], [1, 0]])


def test_a_motion_by_the_time_has_no_steady_mean():
    scene = load_scene("jobs/linkages/crank_rocker.toml").with_({"study": None})
    kick = {
        "kick": {"kind": "torque", "body": "rocker", "torque_by_time": [[0.0, 0.0], [1.0, 1.0]]}
    }
    timed = scene.with_({"mechanism.loads": kick, "numerics.target_error": 0.05})
    with refused("numerics.target_error"):
        evaluator_of(timed, as_points(timed, {"mechanism.joints.o2.clearance": [1e-4]}))


def mirrored(side):
    """A crank-rocker with clearance that a table turns, counter-clockwise (side 1) or, all of it mirrored, clockwise (-1)."""
    times = np.linspace(0.0, 0.1, 41)
    angle = 0.4 + TURN * times / 0.1 + 0.2 * np.sin(TURN * times / 0.1)
    brake = [[a * side, t * side] for a, t in ((1.0, -0.5), (2.5, 0.3), (4.0, -0.1))]
    rows = [[t, a * side] for t, a in zip(times, angle, strict=True)]
    starts = {"crank": 0.4, "coupler": 0.5, "rocker": 1.6}
    soft = {"youngs_modulus": "2 GPa", "poisson_ratio": 0.4}
    return rocker().with_({
        **{f"mechanism.bodies.{name}.start_angle": start * side for name, start in starts.items()},
        "mechanism.ground.points.p": [0.13, 0.01 * side],
        "mechanism.joints.o2": {"kind": "revolute", "journal": "crank.b", "bearing": "coupler.a"},
        "mechanism.joints.o3.materials": {"bearing": soft, "journal": soft},
        "mechanism.drives": {"cam": {"kind": "table", "body": "crank", "angle": rows}},
        "mechanism.loads": {"brake": {"kind": "torque", "body": "rocker", "torque": sorted(brake)}},
        "effects.gravity": 0.0,
        "effects.friction": {"law": "coulomb", "coefficient": 0.1, "ramp_speed": 0.05},
        "numerics.rtol": 1e-9,
    })  # fmt: skip


def test_a_clockwise_table_drive_is_the_mirror_image():
    ours, image = (simulate(mirrored(side)) for side in (1, -1))
    assert float(image["crank_angle"][-1]) == pytest.approx(-0.4 - TURN, abs=1e-6)
    early = ours["time"].to_numpy() < 0.012  # contacts drive roundings apart
    for name, sign in (("body_x", 1), ("body_y", -1), ("body_angle", -1)):
        a, b = (one[name].to_numpy()[early] for one in (ours, image))
        np.testing.assert_allclose(sign * b, a, rtol=0, atol=1e-6)
    a, b = (one["crank_moment"].to_numpy()[early] for one in (ours, image))
    np.testing.assert_allclose(-b, a, rtol=0, atol=5e-3 * np.abs(a).max())
    assert float(ours["contact_force"][early].max()) > 1.0
