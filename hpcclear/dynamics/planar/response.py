"""Time series of a linkage: drive, bodies, points, joints and energies, from the coordinates that were integrated.

Of a followed point also how far clearance takes it off its path.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.layout.views import Parameters, Rates
from hpcclear.dynamics.linkage.assembly import assemble, placed
from hpcclear.dynamics.linkage.linkage import Linkage
from hpcclear.dynamics.linkage.mechanism import Mechanism, freedom
from hpcclear.dynamics.linkage.parts import GROUND, Number, as_complex, places_of, split
from hpcclear.dynamics.linkage.poses import Pose
from hpcclear.dynamics.linkage.prescribed import passed_through
from hpcclear.dynamics.planar.energy import stored_energy
from hpcclear.dynamics.planar.problem import linkage_of
from hpcclear.dynamics.planar.turning import without_clearance
from hpcclear.scene import Scene
from hpcclear.scene.contacts.declared import AlongLine
from hpcclear.scene.planar import PlanarRevolute, turns_of


class ResponseStates(NamedTuple):
    """States at the instants of a response: coordinates and velocities (t, n), time in the revolution, its number, contacts
    (t, 2 MAX_JOINTS), rates, works (t, 4), forces of ideal pins (t, 2, MAX_PINS)."""

    q: Array
    v: Array
    turn_time: Array
    revolution: Array
    contacts: Array
    rates: Rates
    works: Array
    pins: Array


def series(scene: Scene, par: Array, seen: ResponseStates) -> dict[str, Array]:
    """Every time series of the response, names as in the response dataset; parameters (PARAMETERS,)."""
    linkage = linkage_of(scene)
    mechanism = linkage.mechanism
    pose, eccentricity = linkage.poses.at(par, seen.q.T, seen.v.T, seen.turn_time)
    gravity = scene.effects.gravity
    kinetic, potential, _ = linkage.energies(par, seen.q.T, seen.v.T, seen.turn_time, gravity)
    joints = list(scene.open_places)
    latched = scene.effects.contact is not None and scene.effects.contact.latched
    active = seen.contacts[:, joints] if latched else np.ones((len(seen.contacts), len(joints)))
    gaps = seen.rates.gap[:, joints]
    elastic = stored_energy(scene, par, gaps, active, joints)
    bent = linkage.bent(par, seen.q.T, seen.v.T, pose)
    strain = sum((one.strain for one in bent.values()), np.zeros(len(seen.turn_time)))
    unbent = potential - strain
    driving, _, dissipated, load = seen.works.T
    balance = {
        "kinetic_energy": kinetic,
        "elastic_energy": elastic,
        "potential_energy": unbent,
        "driving_work": driving,
        "load_work": load,
        "dissipated_energy": dissipated,
        # its value at the start has to be taken off
        "energy_residual": kinetic + elastic + unbent + strain - driving - load + dissipated,
    }
    phase = _phase(scene, linkage, par, seen)
    places = bodies_and_points(mechanism, pose, {k: one.shorter for k, one in bent.items()})
    gained = np.array([linkage.gained(body.name, mechanism) for body in mechanism.bodies])
    places["body_angle"] = places["body_angle"] + gained * seen.revolution[:, None]
    acceleration = seen.rates.followed_x + 1j * seen.rates.followed_y
    of_joints = {
        "eccentricity_x": eccentricity[:, 0].T,
        "eccentricity_y": eccentricity[:, 1].T,
        "penetration": np.maximum(gaps, 0.0) * active,
        "contact_force": seen.rates.force[:, joints],
        "friction_force": seen.rates.friction[:, joints],
    }
    frame = {"frame_force_x": seen.rates.frame_x, "frame_force_y": seen.rates.frame_y}
    frame = frame if joints and not scene.modes else {}
    modal, pins = {}, {}
    if modes := scene.modes:
        modal = {"mode_amplitude": seen.q[:, :modes], "mode_velocity": seen.v[:, :modes]}
        modal["strain_energy"] = strain
    elif count := len(pins_of(mechanism)):  # where a bar bends they are not known
        pins = {f"pin_force_{axis}": seen.pins[:, k, :count] for k, axis in enumerate("xy")}
    held = {}
    if linkage.cartesian:
        held["constraint_violation"] = violation(linkage, seen.q.T, seen.v.T, seen.turn_time)
    return {
        **moved(scene, mechanism, places, phase, acceleration),
        **{name: at_places(scene, columns) for name, columns in of_joints.items()},
        "crank_moment": seen.rates.drive_moment,
        **frame,
        **balance,
        **modal,
        **guide_series(mechanism, pose),
        **held,
        **pins,
    }


def pins_of(mechanism: Mechanism) -> tuple[str, ...]:
    """Names of the pins without clearance."""
    return tuple(joint.name for joint in mechanism.joints if isinstance(joint, PlanarRevolute))


def wound_up(mechanism: Mechanism, series: Mapping[str, Array]) -> Iterator[str]:
    """A sentence for each load that goes by an angle and was turned by more than a revolution."""
    names = [body.name for body in mechanism.bodies]
    for load in mechanism.loads:
        if load.by_angle and "body_angle" in series:
            body, other = (getattr(load, entry, None) for entry in ("body", "other"))
            angle = series["body_angle"][:, names.index(str(body))]
            if other is not None:
                angle = angle - series["body_angle"][:, names.index(other)]
            turns = float(np.ptp(angle)) / at.TURN
            if turns > 1.0:
                yield (
                    f"the load {load.name} is wound up by {turns:.3g} turns: its torque goes by the whole angle of "
                    f"{body}. Couple bodies that go round together if it is not meant to"
                )


def at_places(scene: Scene, columns: Array) -> Array:
    """Columns (t, open joints) at their places (t, joints), 0 at those of ideal ones."""
    found = np.zeros((len(columns), len(scene.joint_labels)))
    found[:, list(scene.open_places)] = columns
    return found


def moved(
    scene: Scene, mechanism: Mechanism, places: Mapping[str, Array], phase: Array, acceleration: Array,
    clearance: bool = True,
) -> dict[str, Array]:  # fmt: skip
    """Series of the drive, the bodies and the followed point; of a template's parts by the names that it has for them.

    `places` as `bodies_and_points` has them, the others as `followed` takes them; the acceleration (m/s2) of a guided
    body is that along its guide.
    """
    names = [body.name for body in mechanism.bodies]
    k = names.index(mechanism.period.body)
    angle, speed = (places[f"body_{name}"][:, k] for name in ("angle", "spin"))
    found = {"crank_angle": angle, "crank_speed": speed}
    if scene.template is None:
        path = followed(scene, phase, places, acceleration, clearance)
        return {**found, "drive_phase": phase, **places, **path}
    for name, (kind, body) in scene.template.SERIES.items():
        along = kind == "acceleration"
        found[name] = acceleration.real if along else places[kind][:, names.index(body)]
    return found


def violation(linkage: Linkage, q: Array, v: Array, time: Array) -> Array:
    """What the constraints of Cartesian coordinates (n, t) are off by at most (t,), m: angles by the arc that they make at the
    linkage's typical length; those of the drives are a matter of angles and left out."""
    loops = linkage.loops
    joints = [owner.startswith("joints.") for owner in loops.owners]
    error = loops.at(q, v, time).error * (loops.length / loops.row_scales)[:, None]
    return np.abs(error[joints]).max(axis=0, initial=0.0)


def guide_series(mechanism: Mechanism, pose: Pose) -> dict[str, Array]:
    """Series (t, guides) of the guides with clearance: how far the slider is to the left of the line, and its tilt."""
    guides = [joint for joint in mechanism.clearances if isinstance(joint, AlongLine)]
    if not guides:
        return {}
    found = []
    for joint in guides:
        (middle, angle), (line, turned) = (_place(mechanism, pose, one) for one in places_of(joint))
        along = np.exp(1j * (turned + joint.angle))
        tilt = np.angle(np.exp(1j * angle) / along)
        found.append((((middle - line) * along.conjugate()).imag, tilt))
    offsets, tilts = (np.array(part).T for part in zip(*found, strict=True))
    return {"guide_offset": offsets, "guide_tilt": tilts}


def _place(mechanism: Mechanism, pose: Pose, place: str) -> tuple[Any, Number]:
    """Where a place is (t,), x + iy, and the angle of its body."""
    name = split(place)[0]
    if name == GROUND:
        return as_complex(mechanism.at(place)), 0.0
    k = [body.name for body in mechanism.bodies].index(name)
    arm = as_complex(mechanism.at(place)) - as_complex(mechanism.bodies[k].center)
    return pose.x[k] + 1j * pose.y[k] + arm * np.exp(1j * pose.angle[k]), pose.angle[k]


def _phase(scene: Scene, linkage: Linkage, par: Array, seen: ResponseStates) -> Array:
    """Progress of the drive since the start (t,), 2 pi a turn, rad: by time, or by the angle of a body that a torque drives."""
    named = Parameters(par)
    cycle = at.TURN * turns_of(scene.linkage)
    if linkage.mechanism.period.prescribed or not linkage.mechanism.period.advance:
        return cycle * (seen.revolution + seen.turn_time / named.period)
    return seen.q[:, -1] - (named.turn_end - cycle) + cycle * seen.revolution


def bodies_and_points(
    mechanism: Mechanism, pose: Pose, shorter: Mapping[int, Array] = MappingProxyType({})
) -> dict[str, Array]:
    """Mass centres and angles of the bodies (t, body), and all their points (t, point).

    `shorter`: by how much the ends b of bars that bend come nearer, m, (t,), by the bodies' numbers.
    """
    found: dict[str, Array] = {f"body_{name}": one.T for name, one in pose._asdict().items()}
    arms = []
    for k, body in enumerate(mechanism.bodies):
        cosine, sine = np.cos(pose.angle[k]), np.sin(pose.angle[k])
        for point, (x, y) in body.points.items():
            less = shorter[k] if k in shorter and point == "b" else 0.0
            dx, dy = x - less - body.center[0], y - body.center[1]
            arms.append((pose.x[k] + cosine * dx - sine * dy, pose.y[k] + sine * dx + cosine * dy))
    found["point_x"], found["point_y"] = (np.array(part).T for part in zip(*arms, strict=True))
    return found


def labels(scene: Scene, mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Labels along the dimensions ``body`` and ``point``; none where a template names the series."""
    if scene.template is not None:
        return {}
    bodies = tuple(body.name for body in mechanism.bodies)
    points = tuple(f"{body.name}.{point}" for body in mechanism.bodies for point in body.points)
    return {"body": bodies, "point": points}


INSTANTS = 720
"""Of a turn at which the linkage without clearance is put together; cubic between them, which is off by 1e-11 of its size."""


def followed(
    scene: Scene, phase: Array, points: Mapping[str, Array], acceleration: Array, clearance: bool = True
) -> dict[str, Array]:  # fmt: skip
    """Series of the followed point, none where none is followed: place, acceleration (t,) and `path_error`.

    `phase` (t,): progress of the drive since the start, 2 pi a turn of its body, rad; `points`: ``point_x`` and ``point_y``
    (t, points); `acceleration` (t,): of the point, x + iy. Without `clearance` no path is off.
    """
    place, mechanism = scene.linkage.followed, linkage_of(scene).mechanism
    if place is None:
        return {}
    names = [f"{body.name}.{point}" for body in mechanism.bodies for point in body.points]
    x, y = (points[f"point_{axis}"][:, names.index(place)] for axis in "xy")
    found = {"followed_x": x, "followed_y": y}
    found["followed_acceleration_x"] = acceleration.real
    found["followed_acceleration_y"] = acceleration.imag
    path = _ideal_path(scene, place) if clearance else None
    if path is not None:
        cycle = at.TURN * turns_of(scene.linkage)
        ideal = path(np.mod(phase, cycle) / cycle)
        found["path_error"] = np.abs(x + 1j * y - ideal)
    return found


@lru_cache(maxsize=16)
def _ideal_path(scene: Scene, place: str) -> Callable[[Array], Array] | None:
    """Where a place of the linkage is without clearance: complex m of the share of a revolution (t,); None where its drives
    leave something free then or do not repeat, or it cannot pass a dead centre."""
    try:
        ideal = without_clearance(linkage_of(scene).mechanism)
        if freedom(ideal):
            return None
        drive, assembly = ideal.period, assemble(ideal)
        share = np.linspace(0.0, 1.0, INSTANTS * drive.turns + 1)
        passed = passed_through(assembly, share * drive.seconds)
    except InputError:
        return None
    from scipy.interpolate import CubicHermiteSpline  # a third of a second, for these alone

    q, v = np.moveaxis(passed, 0, -1)
    where, speed, *_ = placed(replace(assembly, q=q, v=v), place)
    return CubicHermiteSpline(share, where, speed * drive.seconds)
