"""Random linkages under random loads, drives and friction of pins: the compiled motion against the dense model, to 1e-8."""

import numpy as np
import pytest
from dense_linkage import Dense, comes_as, start_of
from planar_scenes import planar_scene
from scipy.interpolate import PchipInterpolator

from hpcclear import simulate
from hpcclear.dynamics.planar.problem import linkage_of, poses_at_start

GRAVITY = 9.81
SORTS = ("spring", "stop", "cylinder", "drag", "follows", "time", "time force", "angle")
DRIVES = ("constant-speed", "torque", "run-up")


def level(rows, before=1.0):
    """A monotone cubic that is level beyond its rows."""
    x, y = np.transpose(rows)
    beside = before * np.arange(1, 4)
    x = np.concatenate([x[0] - beside[::-1], x, x[-1] + beside])
    return PchipInterpolator(x, np.concatenate([y[:1].repeat(3), y, y[-1:].repeat(3)]))


def periodic(rows):
    """One that repeats with every turn."""
    x, y = np.transpose(rows)
    turns = 2 * np.pi * np.arange(-3, 4)
    return PchipInterpolator((x + turns[:, None]).ravel(), np.tile(y, 7))


def load_of(sort, rng):
    """A load of a sort, and the function that its table is."""
    u = rng.uniform
    if sort == "spring":
        return {
            "kind": "torsion-spring", "body": "rocker", "other": "coupler", "stiffness": u(0.5, 2), "angle": u(0, 2),
            "damping": u(0, 0.05),
        }, None  # fmt: skip
    if sort == "stop":
        return {
            "kind": "torsion-spring", "body": "rocker", "upper": u(1.4, 1.8), "lower": u(0.8, 1.2),
            "stop_stiffness": u(5, 20),
        }, None  # fmt: skip
    if sort == "cylinder":
        force = [[u(0.03, 0.05), u(10, 20)], [u(0.07, 0.09), u(2, 8)], [u(0.11, 0.13), u(-9, 0)]]
        return {
            "kind": "cylinder", "first": "coupler.tip", "second": "ground.p", "force": force, "damping": u(0, 2),
        }, None  # fmt: skip
    if sort == "drag":
        return {
            "kind": "drag",
            "body": "pendulum",
            "linear": u(0, 1e-4),
            "quadratic": u(0, 1e-5),
        }, None
    if sort == "follows":
        force = [u(-5, 5), u(-5, 5)]
        return {"kind": "force", "place": "coupler.tip", "force": force, "follows": True}, None
    if sort == "angle":
        rows = [[0.0, u(-1, 1)], [1.0, u(-1, 1)], [2.0, u(-1, 1)], [4.0, u(-1, 1)]]
        return {"kind": "torque", "body": "rocker", "torque": rows, "angle_of": "rocker"}, periodic(
            rows
        )
    rows = [[0.0, 0.0], [u(0.01, 0.02), u(-1, 1)], [u(0.03, 0.05), u(-1, 1)], [0.06, u(-1, 1)]]
    if sort == "time":
        return {"kind": "torque", "body": "rocker", "torque_by_time": rows}, level(rows)
    rows = [[t, 10 * y] for t, y in rows]
    push = {"kind": "force", "place": "coupler.tip", "direction": u(0, 6), "size_by_time": rows}
    return push, level(rows)


def random_scene(seed):
    """A four-bar with a pendulum on its coupler, and what tables say, by name."""
    rng = np.random.default_rng(seed)
    u = rng.uniform
    bodies = {
        "crank": {"length": u(0.03, 0.045), "mass": 0.2, "inertia": 3e-5, "start_angle": u(0.2, 1.0)},
        "coupler": {
            "length": u(0.11, 0.13), "mass": 0.3, "inertia": 4e-4, "start_angle": 0.5,
            "points": {"tip": [u(0.04, 0.08), u(0, 0.05)]},
        },
        "rocker": {"length": u(0.075, 0.09), "mass": 0.25, "inertia": 2e-4, "start_angle": 1.6},
        "pendulum": {
            "length": 0.05, "mass": u(0.05, 0.1), "inertia": 3e-5, "mass_center": u(0.01, 0.04), "start_angle": u(-2, -1),
        },
    }  # fmt: skip
    pins = {
        "o1": ("crank.a", "ground.o"), "o2": ("crank.b", "coupler.a"), "o3": ("coupler.b", "rocker.b"),
        "o4": ("rocker.a", "ground.p"), "o5": ("pendulum.a", "coupler.tip"),
    }  # fmt: skip
    joints = {
        name: {"kind": "revolute", "journal": journal, "bearing": bearing}
        for name, (journal, bearing) in pins.items()
    }
    for name in rng.choice(list(pins), 3, replace=False):
        joints[str(name)]["friction"] = {
            "coefficient": u(0.05, 0.3), "radius": u(0.003, 0.01), "ramp_speed": u(0.05, 0.3),
        }  # fmt: skip
    kind, speed, curves = DRIVES[seed % 3], u(60.0, 90.0), {}
    drive = {"kind": kind, "body": "crank"}
    if kind == "constant-speed":
        drive["speed"] = speed
    elif kind == "torque":
        drive |= {
            "initial_speed": speed, "flywheel_inertia": 0.01,
            "torque_by_speed": [[0.0, u(0, 2)], [40.0, u(1, 4)], [100.0, u(-2, 1)]],
        }  # fmt: skip
    else:
        drive["speed_by_time"] = [[0.0, 0.5 * speed], [u(0.02, 0.05), 0.8 * speed], [0.1, speed]]
        curves["motor"] = level(drive["speed_by_time"])
    loads = {}
    for k, sort in enumerate(rng.choice(SORTS, 4, replace=False)):
        loads[f"load{k}"], curve = load_of(str(sort), rng)
        curves |= {} if curve is None else {f"load{k}": curve}
    scene = planar_scene(
        bodies, joints, {"motor": drive}, loads=loads,
        ground={"o": [0.0, 0.0], "p": [0.125, u(-0.01, 0.01)]},
        effects={"gravity": GRAVITY},
        numerics={
            "rtol": 1e-12, "method": "dormand-prince", "transient_revolutions": 0, "averaged_revolutions": 1,
        },
        output={"instants_per_revolution": 100},
    )  # fmt: skip
    return scene, curves


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=[] if k < 3 else pytest.mark.full) for k in range(20)]
)
@pytest.mark.shortened(1)
def test_random_loads_move_linkages_as_in_the_dense_model(seed):
    """Positions of all bodies over a quarter of a revolution, to 1e-8 m and 1e-8 rad; and energies close."""
    scene, curves = random_scene(seed)
    mechanism = linkage_of(scene).mechanism
    dense = Dense(mechanism, [], GRAVITY, curves=curves)
    start = start_of(dense)
    response = simulate(scene)
    for body, pose in poses_at_start(scene).items():  # what `hpcclear check` and sketches say
        now = response.sel(body=body).isel(time=0)
        seen = [float(now[name]) for name in ("body_x", "body_y", "body_angle")]
        assert seen == pytest.approx(pose, abs=1e-12)
    comes_as(response, dense, start, 0.25 * float(response["time"][-1]), rtol=1e-12)
    work = float(np.abs(np.diff(response["driving_work"].to_numpy())).sum())
    assert float(np.abs(response["energy_residual"]).max()) < 1e-7 * work
    assert float(response["dissipated_energy"][-1]) > 1e-4 * work
