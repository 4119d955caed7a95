"""Linkages without clearance whose drives prescribe everything: time series and extremes, nothing integrated."""

from dataclasses import replace

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.pieces import breaks
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.assembly import placed
from hpcclear.dynamics.linkage.generator import guide_of
from hpcclear.dynamics.linkage.kinematics import CENTER
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.numbers import values
from hpcclear.dynamics.linkage.parts import split
from hpcclear.dynamics.linkage.passage import cubic
from hpcclear.dynamics.linkage.poses import Poses
from hpcclear.dynamics.linkage.prescribed import Prescribed, prescribed_motion
from hpcclear.dynamics.planar.problem import linkage_of, scene_of
from hpcclear.dynamics.planar.response import at_places, bodies_and_points, moved, pins_of
from hpcclear.dynamics.planar.tables import curves_of, mechanism_of
from hpcclear.dynamics.planar.turning import passage
from hpcclear.scene import Scene
from hpcclear.scene.driving import PlanarTable
from hpcclear.scene.planar import turns_of
from hpcclear.scene.points import Points

BEND = 1e-6  # part of a table's range from which on a sum is cut where no cubic follows it
PER_REVOLUTION = 720  # instants of a revolution, if no number is requested

_FIVE, _OF_FIVE = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = 0.5 * (_FIVE + 1.0), 0.5 * _OF_FIVE  # on [0, 1]

OF_CONTACTS = (
    "eccentricity_x", "eccentricity_y", "penetration", "contact_force", "friction_force"
)  # fmt: skip
"""Series of joints with clearance."""


def held_extremes(scene: Scene, points: Points | None, count: int) -> Array:
    """Samples (m, 3): largest torque of the drive (N m), standard deviation and largest size of followed acceleration (m/s2).

    NaN of those that do not turn, and where nothing is followed.
    """
    found = np.full((count, 3), np.nan)
    for row in range(count):
        one = scene if points is None else scene_of(scene, points, row)
        try:
            mechanism = mechanism_of(one.linkage)
            times = np.linspace(0.0, mechanism.period.seconds, PER_REVOLUTION, endpoint=False)
            held = prescribed_motion(mechanism, times, one.effects.gravity, curves_of(one))
            rows = passings(one, mechanism, np.append(times, mechanism.period.seconds))
            largest = 0.0
            if len(rows):
                peaks = prescribed_motion(mechanism, rows, one.effects.gravity, curves_of(one))
                largest = float(np.abs(peaks.holds[f"{mechanism.period.name}_angle"]).max())
        except InputError:
            continue
        moment = np.append(held.holds[f"{mechanism.period.name}_angle"], largest)
        acceleration = _followed_acceleration(linkage_of(one), held)
        deviation = float(np.std(acceleration))
        found[row] = np.abs(moment).max(), deviation, np.abs(acceleration).max()
    return found


def passings(scene: Scene, mechanism: Mechanism, times: Array) -> Array:
    """When, from the first to the last of the instants (t,), a table is at a row around which it bends, s, ascending."""
    found = [np.zeros(0)]
    for drive in mechanism.drives:
        if isinstance(drive, PlanarTable):
            stops = breaks(drive.pieces[-1], BEND)
            found.append(_levels(stops, True, times / drive.seconds) * drive.seconds)
    curves = curves_of(scene)
    tabled = [load for load in mechanism.loads if load.name in curves]
    by_time = {load.name for load in tabled if load.seconds}
    straight = [(load, rows) for load in mechanism.loads for rows in load.straight.values()]
    by_place = straight or len(tabled) > len(by_time)
    coarse = prescribed_motion(mechanism, times) if by_place else None
    for load, rows in straight:
        assert coarse is not None
        distance = _distance(coarse, load.first, load.second)  # type: ignore[attr-defined]
        found.append(_crossed(np.array(rows)[:, 0], *distance, times))
    for load in tabled:
        curve = curves[load.name]
        stops = breaks(curve, BEND)
        if coarse is None or load.name in by_time:
            found.append(_levels(stops, curve.repeats, times / curve.length) * curve.length)
            continue
        body = getattr(load, "angle_of", None) or mechanism.period.body
        turned = coarse.assembly.loops.forest.index("angle", body)
        angle = coarse.q[:, turned]
        levels = np.sort(_levels(stops, True, angle / curve.length)) * curve.length
        found.append(_crossed(levels, angle, coarse.v[:, turned], times))
    every = np.unique(np.concatenate(found))
    return every[(every > times[0]) & (every < times[-1])]


def _levels(stops: Array, repeats: bool, shares: Array) -> Array:
    """Shares of a table's length at which it is at its rows (n,), between the least and the largest of some."""
    if not repeats:
        return stops
    lengths = np.arange(np.floor(shares.min()), np.ceil(shares.max()) + 1.0)
    return (lengths[:, None] + stops).ravel()


def _crossed(levels: Array, place: Array, rate: Array, times: Array) -> Array:
    """When a place (t,), between instants (t,) the cubic through its values and rates, is at ascending levels."""
    a, b = place[:-1], place[1:]
    first = np.searchsorted(levels, np.minimum(a, b))
    count = np.searchsorted(levels, np.maximum(a, b), side="right") - first
    k = np.repeat(np.arange(len(a)), count)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    level = levels[first[k] + within]
    h = np.diff(times)[k]
    low, high = np.zeros(len(k)), np.ones(len(k))
    rising = b[k] > a[k]
    for _ in range(50):
        s = 0.5 * (low + high)
        there = cubic(a[k], h * rate[k], b[k], h * rate[k + 1], s)
        beyond = (there > level) == rising
        low, high = np.where(beyond, low, s), np.where(beyond, s, high)
    return np.asarray(times[k] + h * s) if len(k) else np.zeros(0)


def _distance(held: Prescribed, first: str, second: str) -> tuple[Array, Array]:
    """Distance of two places (t,), m, and its rate."""
    pose = replace(held.assembly, q=held.q.T, v=held.v.T)
    (one, fast, *_), (two, slow, *_) = (placed(pose, place) for place in (first, second))
    apart, moving = one - two, fast - slow
    return np.abs(apart), (apart.conj() * moving).real / np.maximum(np.abs(apart), 1e-300)


def _followed_acceleration(linkage: Linkage, held: Prescribed) -> Array:
    """Acceleration of the followed point, x + iy, or of the guided body along its guide, (t,); NaN where none is followed."""
    follow, mechanism = linkage.follow, held.assembly.loops.mechanism
    if not follow:
        return np.full(len(held.times), np.nan)
    guide = None if "." in follow else guide_of(mechanism, follow)
    place = follow if guide is None else guide.point
    pose = replace(held.assembly, q=held.q.T, v=held.v.T)
    here, _, _, spin = placed(pose, place)
    name = split(place)[0]
    centre = placed(pose, f"{name}.{CENTER}", mechanism.body(name).center)[0]
    # as velocities follow from velocities, but for what the turning needs
    found = placed(replace(pose, v=held.a.T), place)[1] - spin**2 * (here - centre)
    return found if guide is None else (found * np.exp(-1j * guide.angle)).real


def prescribed_series(scene: Scene, revolutions: int) -> tuple[Array, dict[str, Array]]:
    """Instants (t,) and the time series of a response; 720 a revolution where every step is requested.

    ``pin_force_x`` and ``pin_force_y`` (t, pins) are the forces of the ideal pins on their journals' bodies. Works are
    sums by Gauss's rule between the instants: with links nearly in line the powers peak sharply.

    They end before a dead centre, and before a change point at which the motion or the forces are not determined.
    """
    mechanism, tables = mechanism_of(scene.linkage), scene.linkage
    count = scene.output.instants_per_revolution or PER_REVOLUTION
    period, cycle = mechanism.period.seconds, at.TURN * turns_of(tables)
    times = np.linspace(0.0, revolutions * period, revolutions * count + 1)
    gravity = scene.effects.gravity
    walk = passage(mechanism, gravity, revolutions)
    times = times if walk is None else walk[1].passed(times)
    phase = cycle * times / period
    edges = np.union1d(times, passings(scene, mechanism, times))
    inside = (edges[:-1, None] + np.diff(edges)[:, None] * _NODES).ravel()
    every = np.sort(np.concatenate([edges, inside]))
    dense = prescribed_motion(mechanism, every, gravity, curves_of(scene))
    shown = np.searchsorted(edges, times)
    found = dense.at(times, lambda values: values[shown * (1 + len(_NODES))])
    poses = Poses(found.assembly.loops.forest, {}, 0)
    par = poses.par_of(values(mechanism, cartesian=True, gravity=gravity))
    pose, _ = poses.at(par, found.q.T, found.v.T, times)
    mass = np.array([body.mass for body in mechanism.bodies])[:, None]
    inertia = np.array([body.inertia for body in mechanism.bodies])[:, None]
    kinetic = 0.5 * (mass * (pose.vx**2 + pose.vy**2) + inertia * pose.spin**2).sum(axis=0)
    potential = gravity * (mass * pose.y).sum(axis=0)
    powers = dense.power, dense.loss, dense.load_power
    driving, lost, load = (_work(power, edges)[shown] for power in powers)
    total = kinetic + potential
    places = bodies_and_points(mechanism, pose)
    acceleration = np.nan_to_num(_followed_acceleration(linkage_of(scene), found))
    return times, {
        **moved(scene, mechanism, places, phase, acceleration, clearance=False),
        **_reactions(scene, found),
        "crank_moment": found.holds[f"{mechanism.period.name}_angle"],
        "kinetic_energy": kinetic,
        "elastic_energy": np.zeros_like(times),
        "potential_energy": potential,
        "driving_work": driving,
        "load_work": load,
        "dissipated_energy": lost,
        "energy_residual": total - total[0] - driving - load + lost,
    }


def _work(power: Array, times: Array) -> Array:
    """Work (t,) since the first of instants (t,), of a power at these and at the nodes between them."""
    between = np.append(power, np.zeros(len(_NODES))).reshape(len(times), -1)[:-1, 1:]
    return np.concatenate([[0.0], np.cumsum(between @ _WEIGHTS * np.diff(times))])


def _reactions(scene: Scene, found: Prescribed) -> dict[str, Array]:
    """Forces of the pins (t, pins), and by the names of a template, which has columns of joints with clearance besides."""
    holds = found.holds
    pins = pins_of(linkage_of(scene).mechanism)
    along = {axis: np.array([holds[f"{pin}_{axis}"] for pin in pins]).T for axis in "xy"}
    forces = {f"pin_force_{axis}": one for axis, one in along.items()}
    if scene.template is None:
        return forces
    held = scene.template.HOLDS.items()
    parts = {name: np.array([sign * holds[k] for k, sign in ones]).T for name, ones in held}
    none = at_places(scene, np.zeros((len(found.times), 0)))
    single = {name: part[:, 0] if part.shape[1] == 1 else part for name, part in parts.items()}
    return dict.fromkeys(OF_CONTACTS, none) | single | forces
