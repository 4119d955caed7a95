"""Linkages without clearance whose drives prescribe everything: time series and outcomes, nothing integrated."""

from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.curves import curve_at
from hpcclear.dynamics.linkage.numbers import values
from hpcclear.dynamics.linkage.parts import Revolute, split
from hpcclear.dynamics.linkage.poses import Poses
from hpcclear.dynamics.linkage.prescribed import prescribed_motion
from hpcclear.dynamics.planar.path import followed, rigid_acceleration
from hpcclear.dynamics.planar.problem import linkage_of, period_of, tables_of
from hpcclear.dynamics.planar.response import bodies_and_points, driven
from hpcclear.dynamics.planar.tables import curves_of
from hpcclear.dynamics.planar.turning import passage
from hpcclear.dynamics.problem import Problem, problem_of
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of


def outcomes(problem: Problem, par: Array) -> Array:
    """Rows of outcomes (m, OUT) of parameters (m, PARAMETERS): no gap, no contact; what only a motion tells is NaN."""
    rows = np.zeros((len(par), at.OUT))
    revolutions = problem.transient + problem.averaged
    rows[:, at.OUT_SPREAD] = 0.0 if problem.averaged > 1 else np.nan
    rows[:, at.OUT_REVOLUTIONS] = revolutions
    rows[:, at.OUT_TIME] = revolutions * par[:, at.PERIOD]
    rows[:, [at.OUT_MOMENT, at.OUT_ACCELERATION]] = np.nan
    return rows


def prescribed_series(scene: Scene) -> tuple[Array, dict[str, Array]]:
    """Instants (t,) and the time series of a response; 720 a revolution where every step is asked for.

    ``pin_force_x`` and ``pin_force_y`` (t, pins) are the forces of the ideal pins on their journals' bodies. Works are
    sums over the instants.

    They end before a dead centre, and before a change point at which the motion or the forces are not determined.
    """
    mechanism, tables = linkage_of(scene).mechanism, tables_of(scene)
    problem = problem_of(scene)
    revolutions = problem.transient + problem.averaged
    count = scene.output.instants_per_revolution or 720
    from scipy.integrate import (
        cumulative_simpson,
    )  # a third of a second, for linkages without play only

    period, cycle = float(period_of(mechanism)), at.TURN * turns_of(tables)
    times = np.linspace(0.0, revolutions * period, revolutions * count + 1)
    walk = passage(mechanism, scene.effects.gravity, revolutions)
    times = times if walk is None else walk[1].passed(times)
    phase = cycle * times / period
    gravity = scene.effects.gravity
    turns, interpolation = turns_of(tables), scene.numerics.interpolation
    curves = {
        name: partial(curve_at, curve, turns=turns, interpolation=interpolation)
        for name, curve in curves_of(tables).items()
    }
    found = prescribed_motion(mechanism, times, gravity, curves)
    forest = found.assembly.loops.forest
    poses = Poses(forest, {}, 0)
    base = values(mechanism, cartesian=True, gravity=gravity)
    par = np.zeros(max(poses.rows.values(), default=0) + 1)
    for name, row in poses.rows.items():
        par[row] = base[name]
    pose, _ = poses.at(par, found.q.T, found.v.T, times)
    mass, inertia = (
        np.array([getattr(body, part) for body in mechanism.bodies])[:, None]
        for part in ("mass", "inertia")
    )
    kinetic = 0.5 * (mass * (pose.vx**2 + pose.vy**2) + inertia * pose.spin**2).sum(axis=0)
    potential = gravity * (mass * pose.y).sum(axis=0)
    driving, lost, load = (
        cumulative_simpson(power, x=times, initial=0.0)
        for power in (found.power, found.loss, found.load_power)
    )
    total = kinetic + potential
    pins, places = pins_of(scene), bodies_and_points(mechanism, pose)
    acceleration = np.zeros(len(times), complex)
    if tables.followed is not None:
        k = [body.name for body in mechanism.bodies].index(split(tables.followed)[0])
        columns = [forest.index(kind, mechanism.bodies[k].name) for kind in ("x", "y", "angle")]
        still = np.zeros(len(times))
        rows = np.array([still if column is None else found.a[:, column] for column in columns])
        acceleration = rigid_acceleration(
            mechanism, tables.followed, rows, pose.angle[k], pose.spin[k]
        )
    return times, {
        **driven(mechanism, places, phase),
        **places,
        **followed(scene, phase, places, acceleration, play=False),
        "pin_force_x": np.array([found.holds[f"{pin}_x"] for pin in pins]).T,
        "pin_force_y": np.array([found.holds[f"{pin}_y"] for pin in pins]).T,
        "crank_moment": found.holds[f"{mechanism.period.name}_angle"],
        "kinetic_energy": kinetic,
        "elastic_energy": np.zeros_like(times),
        "potential_energy": potential,
        "driving_work": driving,
        "load_work": load,
        "dissipated_energy": lost,
        "energy_residual": total - total[0] - driving - load + lost,
    }


def pins_of(scene: Scene) -> tuple[str, ...]:
    """Names of the pins without play."""
    joints = linkage_of(scene).mechanism.joints
    return tuple(joint.name for joint in joints if type(joint) is Revolute)
