"""From the tables of a linkage to the mechanism as data."""

from dataclasses import replace
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.pieces import Pieces, level, periodic
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage import parts
from hpcclear.dynamics.linkage.loads import KINDS
from hpcclear.dynamics.linkage.mechanism import Mechanism, with_numbers
from hpcclear.dynamics.planar.curves import angle_pieces, speed_pieces
from hpcclear.laws.hertz_contact import (
    contact_stiffness,
    reduced_compliance,
    sphere_stiffness,
)
from hpcclear.scene import Scene
from hpcclear.scene.driving import (
    ForceLoad,
    PlanarFree,
    PlanarHarmonic,
    PlanarRunUp,
    PlanarSpeed,
    PlanarTable,
    PlanarTorque,
    SpringLoad,
)
from hpcclear.scene.materials import Materials
from hpcclear.scene.planar import (
    Planar,
    PlanarBody,
    PlanarClearance,
    PlanarRevolute,
    PlanarSlide,
    turns_of,
)
from hpcclear.scene.points import Points
from hpcclear.scene.slots import PlanarSlot


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


def _tables(planar: Any) -> dict[str, Any]:
    joints = tuple(_joint(joint) for joint in planar.joints)
    return {
        "bodies": tuple(_with_corners(_body(body), joints) for body in planar.bodies),
        "joints": joints,
        "drives": tuple(_drive(drive) for drive in planar.drives),
        "ground": {point.name: (point.x, point.y) for point in planar.ground.points},
        "loads": tuple(_load(load) for load in planar.loads),
    }


def _body(body: PlanarBody) -> parts.Body:
    points = {point.name: (point.x, point.y) for point in body.points}
    center = (body.center.x, body.center.y)
    if body.length is not None:
        points = {"a": (0.0, 0.0), "b": (body.length, 0.0), **points}
        center = (0.5 * body.length if body.mass_center is None else body.mass_center, 0.0)
    return parts.Body(
        body.name,
        body.mass,
        body.own_inertia,
        center,
        points,
        body.start_angle,
        _bending(body.bending),
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


def _bending(table: Any) -> parts.Bending | None:
    return None if table is None else parts.Bending(table.modes, table.stiffness, table.damping)


def _compliances(both: Materials) -> tuple[float, float]:
    found = (
        reduced_compliance(m.youngs_modulus, m.poisson_ratio) for m in (both.bearing, both.journal)
    )
    return tuple(found)  # type: ignore[return-value]


def _joint(joint: Any) -> parts.Joint:
    if isinstance(joint, PlanarRevolute):
        return parts.Revolute(
            joint.name, joint.journal, joint.bearing, friction=_rubbing(joint.friction)
        )
    if isinstance(joint, PlanarClearance):
        both, start = joint.materials, joint.start_eccentricity
        stiffness = contact_stiffness(*_compliances(both), joint.bearing_radius, joint.clearance)
        return parts.Clearance(
            joint.name, joint.journal, joint.bearing, joint.clearance, joint.bearing_radius,
            stiffness, (start.x, start.y),
        )  # fmt: skip
    if isinstance(joint, PlanarSlide) and joint.clearance is not None:
        return _loose_slide(joint)
    if isinstance(joint, PlanarSlot):
        return _slot(joint)
    if isinstance(joint, PlanarSlide):
        friction = _rubbing(joint.friction)
        return parts.Slide(joint.name, joint.point, joint.line, joint.angle, friction)
    return parts.Fixed(joint.name, joint.point, joint.line, joint.angle)


def _rubbing(table: Any) -> Any:
    """Friction of a guide, or of a pin, which has a radius."""
    if table is None:
        return None
    if (radius := getattr(table, "radius", None)) is None:
        return parts.GuideFriction(table.coefficient, table.ramp_speed)
    return parts.PinFriction(table.coefficient, radius, table.ramp_speed)


def _loose_slide(joint: Any) -> parts.LooseSlide:
    stiffness = sphere_stiffness(*_compliances(joint.materials), joint.corner_radius)
    offset, tilt = (
        0.0 if start is None else start for start in (joint.start_offset, joint.start_tilt)
    )
    return parts.LooseSlide(
        joint.name, joint.point, joint.line, joint.angle, None, joint.clearance,
        joint.length, joint.height, joint.corner_radius, stiffness, offset, tilt,
    )  # fmt: skip


def _slot(joint: Any) -> parts.Slot:
    places = (joint.name, joint.point, joint.line, joint.angle)
    if joint.clearance is None:
        return parts.Slot(*places)
    stiffness = sphere_stiffness(*_compliances(joint.materials), joint.pin_radius)
    offset = 0.0 if joint.start_offset is None else joint.start_offset
    return parts.LooseSlot(*places, joint.clearance, joint.pin_radius, stiffness, offset)


def _drive(drive: object) -> parts.Drive:
    if isinstance(drive, PlanarSpeed):
        return parts.ConstantSpeed(drive.name, drive.body, drive.speed, drive.period, drive.turns)
    if isinstance(drive, PlanarHarmonic):
        return parts.Harmonic(
            drive.name, drive.body, drive.amplitude, drive.frequency, drive.mean, drive.phase,
            drive.period,
        )  # fmt: skip
    if isinstance(drive, PlanarTable):
        return parts.TableDrive(
            drive.name, drive.body, drive.angle, angle_pieces(drive.angle), drive.period
        )
    if isinstance(drive, PlanarRunUp):
        rows = drive.speed_by_time
        top = max(speed for _, speed in rows)
        return parts.RunUp(
            drive.name, drive.body, 0.0, rows[0][1], drive.flywheel_inertia, False, drive.period,
            drive.turns, top, rows=rows, pieces=speed_pieces(rows),
        )  # fmt: skip
    if isinstance(drive, PlanarFree):
        return parts.Release(
            drive.name, drive.body, 0.0, drive.initial_speed, period=drive.period, interval=drive.interval
        )  # fmt: skip
    assert isinstance(drive, PlanarTorque)
    table = isinstance(drive.torque, tuple)
    torque = 1.0 if table or drive.torque is None else drive.torque
    return parts.TorqueDrive(
        drive.name, drive.body, torque,  # type: ignore[arg-type]
        drive.initial_speed, drive.flywheel_inertia, table, drive.period, drive.turns,
        drive.expected_speed, drive.no_load_speed, drive.torque_by_speed, interval=drive.interval,
    )  # fmt: skip


def _load(load: Any) -> parts.Load:
    if isinstance(load, ForceLoad):
        if load.force is not None:
            pair = (load.force.x, load.force.y)
            return parts.Force(load.name, load.place, pair, follows=load.follows)
        table = isinstance(load.size, tuple) or load.size is None
        size: Any = 1.0 if table else load.size
        # a quarter turn is one, to the last bit
        cosine, sine = (
            np.where(np.abs(part) < 1e-15, 0.0, part)[()]
            for part in (np.cos(load.direction), np.sin(load.direction))
        )
        pair = (size * cosine, size * sine)
        return parts.Force(load.name, load.place, pair, table, load.follows, _by(load))
    if isinstance(load, SpringLoad):
        return parts.Spring(
            load.name, load.first, load.second, load.stiffness, load.length, load.damping,
            {"both": 0, "pushing": -1, "pulling": 1}[load.acts],
        )  # fmt: skip
    if load.kind in KINDS:
        return KINDS[load.kind].of(load)
    table = isinstance(load.torque, tuple) or load.torque is None
    return parts.Torque(load.name, load.body, 1.0 if table else load.torque, table, _by(load))


def _by(load: Any) -> parts.By | None:
    rows = load.size_by_time if isinstance(load, ForceLoad) else load.torque_by_time
    if rows is not None:
        return parts.By(seconds=rows[-1][0], repeats=load.repeats)
    return None if load.angle_of is None else parts.By(load.angle_of)


def curves_of(planar: Planar, interpolation: str = "smooth") -> dict[str, Pieces]:
    """Tables of drives and loads by name, over the angle (rad) or time (s) that each goes by."""
    found, turns = {}, turns_of(planar)
    for row in (*planar.drives, *planar.loads):
        for entry in ("torque", "size"):
            if isinstance(curve := getattr(row, entry, None), tuple):
                by_another = getattr(row, "angle_of", None) is not None
                length = at.TURN * (1 if by_another else turns)
                found[row.name] = periodic(curve, length, interpolation)
            if (curve := getattr(row, f"{entry}_by_time", None)) is not None:
                again = row.repeats  # type: ignore[union-attr]
                found[row.name] = (
                    periodic(curve, curve[-1][0], interpolation)
                    if again
                    else level(curve, interpolation)
                )
    return found
