"""From tables of a planar linkage, or a scene's slider-crank, to the mechanism as data."""

from collections.abc import Mapping
from typing import Any

from hpcclear.dynamics.linkage import parts
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.physics.contact import contact_stiffness, reduced_compliance
from hpcclear.scene import Scene
from hpcclear.scene.mechanism import ClearanceJoint, ConstantSpeed, Material
from hpcclear.scene.planar import (
    ForceLoad,
    Planar,
    PlanarClearance,
    PlanarHarmonic,
    PlanarRevolute,
    PlanarSlide,
    PlanarSpeed,
    PlanarTorque,
    SpringLoad,
)
from hpcclear.scene.validation import validated


def planar_mechanism(content: Mapping[str, Any]) -> Mechanism:
    """The mechanism of the tables ``bodies``, ``ground``, ``joints``, ``drives`` and ``loads``.

    Raises
    ------
    InputError
        If an entry is wrong, or they make no mechanism; it names the entry, the joint, the body or the drive.
    """
    tables = validated(Planar, content)
    return Mechanism(
        tuple(
            parts.Body(
                body.name, body.mass, body.inertia, body.center, dict(body.points), body.start_angle
            )
            for body in tables.bodies
        ),
        tuple(_joint(joint) for joint in tables.joints),
        tuple(_drive(drive) for drive in tables.drives),
        dict(tables.ground.points),
        tuple(_load(load) for load in tables.loads),
    )


def _stiffness(bearing: Material, journal: Material, radius: float, clearance: float) -> float:
    h_bearing, h_journal = (
        reduced_compliance(m.youngs_modulus, m.poisson_ratio) for m in (bearing, journal)
    )
    return contact_stiffness(h_bearing, h_journal, radius, clearance)


def _joint(joint: Any) -> parts.Joint:
    if isinstance(joint, PlanarRevolute):
        return parts.Revolute(joint.name, joint.journal, joint.bearing)
    if isinstance(joint, PlanarClearance):
        both = joint.materials
        stiffness = _stiffness(both.bearing, both.journal, joint.bearing_radius, joint.clearance)
        return parts.Clearance(
            joint.name, joint.journal, joint.bearing, joint.clearance, joint.bearing_radius,
            stiffness, joint.start_eccentricity,
        )  # fmt: skip
    if isinstance(joint, PlanarSlide):
        rubs = joint.friction
        friction = None if rubs is None else parts.GuideFriction(rubs.coefficient, rubs.ramp_speed)
        return parts.Slide(joint.name, joint.point, joint.line, joint.angle, friction)
    return parts.Fixed(joint.name, joint.point, joint.line, joint.angle)


def _drive(drive: Any) -> parts.Drive:
    if isinstance(drive, PlanarSpeed):
        return parts.ConstantSpeed(drive.name, drive.body, drive.speed, drive.period)
    if isinstance(drive, PlanarHarmonic):
        return parts.Harmonic(
            drive.name, drive.body, drive.amplitude, drive.frequency, drive.mean, drive.phase,
            drive.period,
        )  # fmt: skip
    assert isinstance(drive, PlanarTorque)
    table = not isinstance(drive.torque, float)
    return parts.TorqueDrive(
        drive.name, drive.body, 1.0 if table else float(drive.torque),  # type: ignore[arg-type]
        drive.initial_speed, drive.flywheel_inertia, table, drive.period,
    )  # fmt: skip


def _load(load: Any) -> parts.Load:
    if isinstance(load, ForceLoad):
        return parts.Force(load.name, load.place, load.force)
    if isinstance(load, SpringLoad):
        return parts.Spring(
            load.name, load.first, load.second, load.stiffness, load.length, load.damping
        )
    return parts.Torque(load.name, load.body, load.torque)


def slider_crank_mechanism(scene: Scene) -> Mechanism:
    """A scene's slider-crank written out as bodies, joints, drive and loads; a table stands for a factor of 1."""
    m, effects = scene.mechanism, scene.effects
    bodies = [
        parts.Body(
            name, link.mass, link.inertia, (link.mass_center, 0.0),
            {"a": (0.0, 0.0), "b": (link.length, 0.0)},
        )
        for name, link in (("crank", m.crank), ("rod", m.rod))
    ]  # fmt: skip
    rubs = effects.guide_friction
    friction = None if rubs is None else parts.GuideFriction(rubs.coefficient, rubs.ramp_speed)
    joints: list[parts.Joint] = [
        parts.Revolute("crank_frame", "crank.a", "ground.o"),
        parts.Slide("guide", "slider.pin", "ground.o", friction=friction),
    ]
    for name, journal, bearing in (
        ("crank_rod", "crank.b", "rod.a"),
        ("rod_slider", "slider.pin", "rod.b"),
    ):
        joint = getattr(scene.joints, name)
        if isinstance(joint, ClearanceJoint):
            radius, clearance = joint.bearing_radius, joint.clearance
            stiffness = _stiffness(joint.bearing, joint.journal, radius, clearance)
            joints.append(
                parts.Clearance(
                    name, journal, bearing, clearance, radius, stiffness, joint.start_eccentricity
                )
            )
        else:
            joints.append(parts.Revolute(name, journal, bearing))
    loads: tuple[parts.Load, ...] = ()
    if effects.slider_load:
        table = isinstance(effects.slider_load, tuple)
        force = 1.0 if table else float(effects.slider_load)  # type: ignore[arg-type]
        loads = (parts.Force("load", "slider.pin", (force, 0.0), table),)
    slider = parts.Body("slider", m.slider.mass, points={"pin": (0.0, 0.0)})
    return Mechanism(
        (*bodies, slider), tuple(joints), (_slider_crank_drive(scene.drive),), loads=loads
    )


def _slider_crank_drive(drive: Any) -> parts.Drive:
    if isinstance(drive, ConstantSpeed):
        return parts.ConstantSpeed("drive", "crank", drive.speed, True)
    table = isinstance(drive.torque, tuple)
    return parts.TorqueDrive(
        "drive", "crank", 1.0 if table else drive.torque, drive.initial_speed,
        drive.flywheel_inertia, table, True,
    )  # fmt: skip
