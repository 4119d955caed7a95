"""Springs, stops, cylinders, drag and motors by their curves, in closed form; `test_generated` has them on linkages against the
dense model."""

from typing import ClassVar

import numpy as np
import pytest
from planar_scenes import planar_scene

from hpcclear import simulate
from hpcclear.scene.joints import PlanarRevolute
from hpcclear.scene.loads.declared import JointEffect

INERTIA, STIFFNESS, START = 2e-3, 0.8, 0.4
PIN = {"kind": "revolute", "bearing": "ground.o"}


def machine(loads, bodies=None, joints=None, drive=None, turns=3, **numerics):
    """A wheel that turns once a second, and beside it a pendulum whose mass centre is its pin."""
    wheel = {"mass": 1.0, "inertia": 1e-2, "points": {"o": [0.0, 0.0]}}
    pendulum = {"mass": 0.5, "inertia": INERTIA, "points": {"o": [0.0, 0.0]}, "start_angle": START}
    clock = {"kind": "constant-speed", "body": "wheel", "speed": 2 * np.pi}
    return planar_scene(
        {"wheel": wheel, **({"pendulum": pendulum} if bodies is None else bodies)},
        {
            "wheel_pin": {**PIN, "journal": "wheel.o"},
            **({"pivot": {**PIN, "journal": "pendulum.o"}} if joints is None else joints),
        },
        {"clock": clock if drive is None else drive},
        loads=loads,
        effects={"gravity": 0.0},
        numerics={
            "rtol": 1e-11, "transient_revolutions": 0, "averaged_revolutions": turns, **numerics,
        },
        output={"instants_per_revolution": 200},
    )  # fmt: skip


def angle_of(found, body):
    return found["body_angle"].sel(body=body).to_numpy()


def damped(time, inertia, damping):
    """Angle of what is let go at `START`, on a spring of `STIFFNESS`."""
    decay = damping / (2 * inertia)
    w = np.sqrt(STIFFNESS / inertia - decay**2)
    return START * np.exp(-decay * time) * (np.cos(w * time) + decay / w * np.sin(w * time))


class Coil(JointEffect):
    """A spring and a damper in a pin."""

    words: ClassVar[str] = "coil"
    stiffness: float
    damping: float

    def act(self, on, joint):
        one, two = (place.partition(".")[0] for place in (joint.journal, joint.bearing))
        turned, rate = on.angle(one) - on.angle(two), on.spin(one) - on.spin(two)
        torque = -(on.parameter("stiffness") * turned + on.parameter("damping") * rate)
        on.twist(one, torque)
        on.twist(two, -torque)
        return torque * rate


class Sprung(PlanarRevolute):
    coil: Coil | None = None


def test_an_effect_of_a_joint_acts_between_its_bodies():
    """Two equal wheels about one axis with a coil between them, against the closed form and against the same as a load."""
    wheel = {"mass": 0.5, "inertia": INERTIA, "points": {"o": [0.0, 0.0]}}
    bodies = {"one": {**wheel, "start_angle": START}, "two": wheel}
    joints = {
        "pivot": {**PIN, "journal": "two.o"},
        "elbow": {"kind": "revolute", "journal": "one.o", "bearing": "two.o"},
    }
    own = {"stiffness": STIFFNESS, "damping": 4e-3}
    load = {"kind": "torsion-spring", "body": "one", "other": "two", **own}
    bare = machine({}, bodies, joints)
    *others, elbow = bare.mechanism.joints
    sprung = Sprung.model_construct(**{**dict(elbow), "coil": Coil(**own)})
    planar = bare.mechanism.model_copy(update={"joints": (*others, sprung)})
    scene = type(bare).model_construct(**{**dict(bare), "mechanism": planar})
    assert scene.joint_effects() == {"mechanism.joints.elbow.coil": "coil in elbow"}
    found, same = simulate(scene), simulate(machine({"elbow_coil": load}, bodies, joints))
    apart = angle_of(found, "one") - angle_of(found, "two")
    expected = damped(found["time"].to_numpy(), INERTIA / 2, own["damping"])
    np.testing.assert_allclose(apart, expected, atol=1e-8 * START)
    for name in ("body_angle", "body_spin", "load_work", "kinetic_energy"):
        np.testing.assert_allclose(found[name], same[name], rtol=1e-12, atol=1e-14)


def test_a_torsion_spring_swings_with_its_period():
    spring = {"kind": "torsion-spring", "body": "pendulum", "stiffness": STIFFNESS, "angle": 0.1}
    found = simulate(machine({"coil": spring}))
    time = found["time"].to_numpy()
    expected = 0.1 + (START - 0.1) * np.cos(np.sqrt(STIFFNESS / INERTIA) * time)
    np.testing.assert_allclose(angle_of(found, "pendulum"), expected, atol=1e-8 * START)


def test_a_damped_torsion_spring_loses_what_its_damper_takes():
    damping = 4e-3
    spring = {
        "kind": "torsion-spring", "body": "pendulum", "stiffness": STIFFNESS, "damping": damping,
    }  # fmt: skip
    found = simulate(machine({"coil": spring}))
    expected = damped(found["time"].to_numpy(), INERTIA, damping)
    np.testing.assert_allclose(angle_of(found, "pendulum"), expected, atol=1e-8 * START)
    stored = 0.5 * STIFFNESS * (START**2 - angle_of(found, "pendulum") ** 2)
    kinetic = found["kinetic_energy"].to_numpy() - found["kinetic_energy"].to_numpy()[0]
    spin = found["body_spin"].sel(body="pendulum").to_numpy()
    np.testing.assert_allclose(kinetic, 0.5 * INERTIA * spin**2, atol=1e-10)
    assert (found["load_work"].to_numpy() <= stored + 1e-10).all()


def test_a_stop_shortens_the_swing_behind_it():
    """A stop at rest: half a period with the spring alone, half with both, amplitudes by the energy."""
    stop = 3.0
    spring = {
        "kind": "torsion-spring", "body": "pendulum", "stiffness": STIFFNESS, "lower": 0.0,
        "stop_stiffness": stop,
    }  # fmt: skip
    found = simulate(machine({"coil": spring}))
    time = found["time"].to_numpy()
    free, stopped = np.sqrt(STIFFNESS / INERTIA), np.sqrt((STIFFNESS + stop) / INERTIA)
    period = np.pi / free + np.pi / stopped
    phase = (time + np.pi / (2 * free)) % period  # 0 where it leaves the stop
    deep = START * free / stopped
    expected = np.where(
        phase < np.pi / free,
        START * np.sin(free * phase),
        -deep * np.sin(stopped * (phase - np.pi / free)),
    )
    np.testing.assert_allclose(angle_of(found, "pendulum"), expected, atol=1e-8)


def on_a_rail(load, mass, start):
    """A block on a line, which a load moves towards a wall on that line, or away from it."""
    bodies = {"block": {"mass": mass, "points": {"o": [0.0, 0.0]}}}
    ground = {"points": {"o": [0.0, 0.0], "wall": [0.0, 0.2], "start": [start, 0.2]}}
    joints = {"rail": {"kind": "slide", "point": "block.o", "line": "ground.start"}}
    between = {"first": "block.o", "second": "ground.wall"}
    scene = machine({"load": load | between}, bodies, joints)
    return scene.with_({"mechanism.ground": ground})


@pytest.mark.parametrize("acts", ["pulling", "pushing"])
def test_a_one_sided_spring_lets_go(acts):
    """A mass on a line, thrown by a spring that only pulls (or pushes), goes on at a constant speed."""
    mass, stiffness, length, start = 0.3, 500.0, 0.1, 0.12 if acts == "pulling" else 0.08
    spring = {"kind": "spring", "stiffness": stiffness, "length": length, "acts": acts}
    found = simulate(on_a_rail(spring, mass, start))
    time, w = found["time"].to_numpy(), np.sqrt(stiffness / mass)
    quarter = np.pi / (2 * w)
    swung = (start - length) * np.cos(w * time)
    expected = np.where(time < quarter, swung, -(start - length) * w * (time - quarter))
    there = np.abs(expected) < 0.05  # before it is on the other side of the wall
    moved = found["body_x"].sel(body="block").to_numpy() - length
    np.testing.assert_allclose(moved[there], expected[there], atol=1e-8)


@pytest.mark.parametrize(
    "force", [6.0, [[0.05, 6.0], [5.0, 6.0]], [["100 mm", "8 N"], ["300 mm", "4 N"]]]
)
@pytest.mark.shortened(2)
def test_a_cylinder_pushes_by_its_stroke(force):
    """Constant: x = x0 + F t^2/(2 m); falling with the stroke: a swing about where it would be nought."""
    mass, start = 0.3, 0.1
    found = simulate(on_a_rail({"kind": "cylinder", "force": force}, mass, start))
    time = found["time"].to_numpy()
    moved = found["body_x"].sel(body="block").to_numpy()
    if isinstance(force, list) and force[0][0] == "100 mm":
        w = np.sqrt(20.0 / mass)  # 4 N over 0.2 m
        expected = 0.5 - 0.4 * np.cos(w * time)  # nought at 0.5 m
        inside = expected < 0.3
        inside &= time < 2.0 / w
    else:
        expected = start + 6.0 * time**2 / (2 * mass)
        inside = expected < 5.0
        done = 6.0 * (moved - start)
        work = found["load_work"].to_numpy()
        np.testing.assert_allclose(work[inside], done[inside], rtol=1e-8, atol=1e-9)
    assert inside.sum() > 10
    np.testing.assert_allclose(moved[inside], expected[inside], rtol=1e-8)


def test_a_fan_settles_where_the_motor_and_its_drag_meet():
    """T (1 - w/w0) = a w + b w^2, of a motor given as a table; with a pull-out behind which it is not."""
    top, pull_out, fastest, linear, quadratic = 4.0, 100.0, 150.0, 2e-3, 1.5e-4
    motor = {
        "kind": "torque", "body": "wheel", "initial_speed": 10.0, "turns": 4,
        "torque_by_speed": [[0.0, 2.0], [pull_out, top], [fastest, 0.0]],
    }  # fmt: skip
    fan = {"kind": "drag", "body": "wheel", "linear": linear, "quadratic": quadratic}
    found = simulate(machine({"fan": fan}, {}, {}, motor, turns=60))
    slope = top / (fastest - pull_out)
    roots = np.roots([-quadratic, -linear - slope, slope * fastest])
    expected = float(roots[roots > 0.0][0])
    assert pull_out < expected < fastest
    assert float(found["crank_speed"][-1]) == pytest.approx(expected, rel=1e-8)


def test_a_run_up_by_a_table_takes_its_time():
    """J dw/dt = T0 + s w between two rows: w = (T0/s) (exp(s t/J) - 1) + w0 exp(s t/J)."""
    motor = {
        "kind": "torque", "body": "wheel", "initial_speed": 5.0,
        "torque_by_speed": [["0 rpm", "2 N m"], ["100 rad/s", "0 N m"]],
    }  # fmt: skip
    found = simulate(machine({}, {}, {}, motor, turns=20))
    time, grown = found["time"].to_numpy(), None
    grown = np.exp(-0.02 * time / 1e-2)
    expected = 100.0 * (1.0 - grown) + 5.0 * grown
    np.testing.assert_allclose(found["crank_speed"].to_numpy(), expected, rtol=1e-8)
