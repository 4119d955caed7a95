"""From the tables of a linkage to the mechanism as data."""

from dataclasses import fields, replace
from typing import Any, TypeVar

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.pieces import Pieces, periodic
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage import drives, parts
from hpcclear.dynamics.linkage.mechanism import Mechanism, with_numbers
from hpcclear.dynamics.planar.curves import angle_pieces, speed_pieces
from hpcclear.laws.hertz_contact import (
    contact_stiffness,
    reduced_compliance,
    sphere_stiffness,
)
from hpcclear.scene import Scene
from hpcclear.scene.driving import (
    PlanarFree,
    PlanarHarmonic,
    PlanarRunUp,
    PlanarSpeed,
    PlanarTable,
)
from hpcclear.scene.joints import Materials
from hpcclear.scene.planar import (
    Planar,
    PlanarBody,
    PlanarClearance,
    PlanarFixed,
    PlanarRevolute,
    PlanarSlide,
    turns_of,
)
from hpcclear.scene.points import Points

Made = TypeVar("Made")


def mechanism_of(planar: Planar) -> Mechanism:
    """The mechanism of a scene's tables; InputError names the entry below ``mechanism``."""
    try:
        return Mechanism(**_tables(planar))
    except InputError as error:
        raise InputError(
            f"mechanism.{error.key}", error.value, error.reason, error.remedy
        ) from None


def with_columns(scene: Scene, structure: Mechanism, points: Points) -> Mechanism:
    """The mechanisms of samples: numbers that columns of the points drive are arrays (m,)."""
    tables: Any = scene.linkage
    for k, paths in enumerate(points.paths):
        for path in map(scene.path_in_linkage, paths):
            if path.startswith("mechanism.") and ".out_of_round." not in path:
                tables = _put(tables, path.split(".")[1:], points.values[:, k])
    return with_numbers(structure, **_tables(tables))


def _put(table: Any, keys: list[str], value: Array) -> Any:
    """A copy of nested tables with another entry, unchecked; rows are found by their names."""
    if not keys:
        return value
    head, *rest = keys
    if isinstance(table, tuple):
        return tuple(_put(row, rest, value) if row.name == head else row for row in table)
    return table.model_copy(update={head: _put(getattr(table, head), rest, value)})


def _tables(planar: Planar) -> dict[str, Any]:
    joints = tuple(_joint(joint) for joint in planar.joints)
    return {
        "bodies": tuple(_with_corners(_body(body), joints) for body in planar.bodies),
        "joints": joints,
        "drives": tuple(_drive(drive) for drive in planar.drives),
        "ground": {point.name: (point.x, point.y) for point in planar.ground.points},
        "loads": planar.loads,
    }


def _body(body: PlanarBody) -> parts.Body:
    points = {point.name: (point.x, point.y) for point in body.points}
    center = (body.center.x, body.center.y)
    if body.length is not None:
        points = {"a": (0.0, 0.0), "b": (body.length, 0.0), **points}
        center = (0.5 * body.length if body.mass_center is None else body.mass_center, 0.0)
    bending = None if body.bending is None else _part(parts.Bending, body.bending)
    return _part(
        parts.Body, body, inertia=body.own_inertia, center=center, points=points, bending=bending
    )


def _with_corners(body: parts.Body, joints: tuple[parts.Joint, ...]) -> parts.Body:
    """A body that slides in channels wider than itself, with the centres of its corners as points."""
    points = dict(body.points)
    for joint in joints:
        if isinstance(joint, parts.LooseSlide):
            own, point = parts.split(joint.point)
            if own == body.name and point in points:
                points |= joint.corners(points[point])
    return replace(body, points=points)


def _part(kind: type[Made], table: object, /, **more: Any) -> Made:
    """A part with the entries of a table that have the names of its fields; what is not given has its default there."""
    entries = {one.name: getattr(table, one.name, None) for one in fields(kind)}  # type: ignore[arg-type]
    given = {name: value for name, value in entries.items() if value is not None}
    return kind(**given | more)


def _compliances(both: Materials) -> tuple[float, float]:
    found = (
        reduced_compliance(m.youngs_modulus, m.poisson_ratio) for m in (both.bearing, both.journal)
    )
    return tuple(found)  # type: ignore[return-value]


def _joint(joint: Any) -> parts.Joint:
    if isinstance(joint, PlanarRevolute):
        return _part(parts.Revolute, joint, friction=_rubbing(joint))
    if isinstance(joint, PlanarClearance):
        both, start = _compliances(joint.materials), joint.start_eccentricity
        stiffness = contact_stiffness(*both, joint.bearing_radius, joint.clearance)
        return _part(
            parts.Clearance, joint, stiffness=stiffness, start_eccentricity=(start.x, start.y)
        )
    if isinstance(joint, PlanarFixed):
        return _part(parts.Fixed, joint)
    slide = isinstance(joint, PlanarSlide)
    if joint.clearance is None and slide:
        return _part(parts.Slide, joint, friction=_rubbing(joint))
    if joint.clearance is None:
        return _part(parts.Slot, joint)
    radius = joint.corner_radius if slide else joint.pin_radius
    stiffness = sphere_stiffness(*_compliances(joint.materials), radius)
    kind: Any = parts.LooseSlide if slide else parts.LooseSlot
    loose: parts.Loose = _part(kind, joint, stiffness=stiffness)
    return loose


def _rubbing(joint: Any) -> parts.IdealFriction | None:
    return None if joint.friction is None else _part(parts.IdealFriction, joint.friction)


def _drive(drive: Any) -> drives.Drive:
    match drive:
        case PlanarSpeed():
            return _part(drives.ConstantSpeed, drive)
        case PlanarHarmonic():
            return _part(drives.Harmonic, drive)
        case PlanarTable():
            pieces = angle_pieces(drive.angle)
            return _part(drives.TableDrive, drive, rows=drive.angle, pieces=pieces)
        case PlanarFree():
            return _part(drives.Release, drive, torque=0.0)
        case PlanarRunUp():
            rows = drive.speed_by_time
            return _part(
                drives.RunUp, drive, torque=0.0, inertia=drive.flywheel_inertia, rows=rows, pieces=speed_pieces(rows),
                initial_speed=rows[0][1], expected_speed=max(speed for _, speed in rows),
            )  # fmt: skip
    table = isinstance(drive.torque, tuple)
    torque = 1.0 if table or drive.torque is None else drive.torque
    return _part(
        drives.TorqueDrive, drive, torque=torque, table=table, inertia=drive.flywheel_inertia,
        by_speed=drive.torque_by_speed,
    )  # fmt: skip


def curves_of(planar: Planar, interpolation: str = "smooth") -> dict[str, Pieces]:
    """Tables of drives and loads by name, over the angle (rad) or time (s) that each goes by."""
    turns = turns_of(planar)
    found = {load.name: load.curve(turns, interpolation) for load in planar.loads if load.table}
    for drive in planar.drives:
        if isinstance(curve := getattr(drive, "torque", None), tuple):
            found[drive.name] = periodic(curve, at.TURN * turns, interpolation)
    return found
