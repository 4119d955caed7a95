"""What a scene is made of: mechanism, drive and joints, as in the scene file."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from hpcclear.scene.bending import Bending
from hpcclear.scene.driving import Turns, check_start, check_torque
from hpcclear.scene.fields import (
    Curve,
    CurveOf,
    Inertia,
    Length,
    Mass,
    PositiveLength,
    Quantity,
    Table,
    invalid,
)
from hpcclear.scene.film import Film, check_film
from hpcclear.scene.fits import with_clearance
from hpcclear.scene.guides import SliderGuide
from hpcclear.scene.loads import Law
from hpcclear.scene.materials import Material
from hpcclear.scene.roundness import OutOfRound, check_waves
from hpcclear.scene.rubbing import RubbingPin
from hpcclear.scene.wear import Wear


def slender_inertia(mass: Any, length: Any) -> Any:
    """Inertia m L^2/12 of a uniform thin rod about its middle, kg m2: the least a bar of that mass
    would have."""
    return mass * length**2 / 12


class Link(Table):
    """A bar between two joints, rigid unless it bends."""

    length: PositiveLength
    """Distance between its joints, m."""
    mass: Mass
    """kg."""
    inertia: Inertia
    """Moment of inertia about its mass centre, kg m2."""
    mass_center: Length
    """Distance of the mass centre from its first joint along the link, m; may lie beyond either
    pin."""
    bending: Bending | None = None
    """Of the rod: how it bends; left out, it is rigid."""


class Slider(Table):
    """The guided body."""

    mass: Mass
    """kg."""
    inertia: Inertia | None = None
    """Moment of inertia about its pin, where its mass centre is, kg m2; needed where its guide has clearance."""


class Mechanism(Table):
    """Planar slider-crank: crank, connecting rod, slider (Tables 1 and 2 of the paper)."""

    kind: Literal["slider-crank"] = "slider-crank"
    crank: Link
    rod: Link
    slider: Slider
    offset: Length | None = None
    """Of the slider's line from the crank's axis along +y, m; left out, the line goes through the axis."""

    @model_validator(mode="after")
    def _assembles(self) -> "Mechanism":
        if self.crank.bending is not None:
            raise invalid(
                "the drive clamps the crank, but the modes are those of pinned ends",
                "Leave it out, or let the rod bend",
                key="crank.bending",
                value=None,
            )
        offset = abs(self.offset or 0.0)
        if self.rod.length <= self.crank.length + offset:
            beside = f" and the offset ({offset:g} m)" if offset else ""
            raise invalid(
                f"the rod must be longer than the crank ({self.crank.length:g} m){beside}, "
                "or the crank cannot rotate",
                "Lengthen the rod or shorten the crank" + " or the offset" * bool(offset),
                key="rod.length",
                value=self.rod.length,
            )
        return self


class ConstantSpeed(Table):
    """The crank angle is prescribed: it turns at a constant speed, whatever moment that takes."""

    kind: Literal["constant-speed"]
    speed: Annotated[float, Quantity("rad/s", nonzero=True, why="there would be no motion")]
    """Crank speed, rad/s, counter-clockwise; negative: clockwise. "600 min^-1" means 600 revolutions a minute."""
    turns: Turns = 1
    """Of a revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after as many turns."""

    elsewhere: ClassVar = dict.fromkeys(
        ("torque", "flywheel_inertia", "initial_speed", "expected_speed", "no_load_speed"),
        (
            "contradicts a prescribed crank speed",
            'Remove it, or set drive.kind = "torque" and give initial_speed instead of speed',
        ),
    )


class TorqueDrive(Table):
    """A torque acts on the free crank; its speed is part of the motion."""

    kind: Literal["torque"]
    torque: Annotated[Curve, CurveOf("N*m", cycles=True)] | None = None
    """N m, constant or ``[[crank angle, torque], ...]`` over the turns of a revolution."""
    torque_by_speed: Annotated[Any, Law("rad/s", "N*m")] | None = None
    """In place of `torque`: ``[[speed, torque], ...]`` as of a motor with its pull-out torque, rad/s and N m, straight from row
    to row and level beyond."""
    no_load_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """Speed at which the torque has fallen to 0, in proportion, as that of a motor does, rad/s; left out, it does not fall."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Inertia that turns with the crank, kg m2."""
    initial_speed: Annotated[float, Quantity("rad/s", least=0)]
    """Crank speed at the start, rad/s; 0 starts from rest."""
    expected_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """About how fast it will turn, rad/s, from rest needed: tolerances and the first step go by it; else by `initial_speed`."""
    turns: Turns = 1
    """Of a revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after as many turns."""

    elsewhere: ClassVar = {
        "speed": (
            "a torque-driven crank has no prescribed speed",
            'Remove it and give initial_speed, or set drive.kind = "constant-speed"',
        )
    }

    @model_validator(mode="after")
    def _started(self) -> "TorqueDrive":
        check_start(self)
        check_torque(self)
        return self


Drive = Annotated[ConstantSpeed | TorqueDrive, Field(discriminator="kind")]


def length_path(joint: Any) -> str | None:
    """Where a joint with clearance has its length at right angles to the plane: its own entry, or that of its film or wear."""
    if joint.corners:
        return None if joint.width is None else "width"
    if joint.length is not None:
        return "length"
    parts = ("film", "wear")
    return next((f"{part}.length" for part in parts if getattr(joint, part) is not None), None)


def check_journal(joint: Any) -> None:
    """Refuse a joint whose clearance leaves no journal, or whose film or waves exceed the clearance."""
    clearance, radius = joint.clearance, joint.bearing_radius
    if clearance >= radius:
        raise invalid(
            f"the clearance must be smaller than the bearing radius ({radius:g} m), or no journal is left",
            "Write the radial clearance R_B - R_J",
            key="clearance",
            value=clearance,
        )
    check_film(joint.film, clearance, radius)
    check_waves(joint.out_of_round, clearance, joint.film)


class ClearanceJoint(Table):
    """A journal that moves freely in a bearing larger than itself by the clearance."""

    geometry: ClassVar[str] = "pin_in_bearing"
    corners: ClassVar[tuple[str, ...]] = ()

    kind: Literal["clearance"]
    clearance: PositiveLength
    """Radial clearance c = R_B - R_J, m."""
    bearing_radius: PositiveLength
    """R_B, m; it stays as it is when the clearance varies."""
    length: PositiveLength | None = None
    """Of the bearing, at right angles to the plane, m; line contact and pressures need it."""
    fit: str | None = None
    """In place of `clearance` and `bearing_radius`: a fit by ISO 286 such as "20 H7/f7", in the middle of both tolerances."""
    diametral_clearance: Annotated[float, Quantity("m", above=0)] | None = None
    """In place of `clearance`: twice that, the difference of both diameters, m."""
    bearing: Material
    journal: Material
    start_eccentricity: tuple[Length, Length] = (0.0, 0.0)
    """Journal centre minus bearing centre (x, y) at the start, m; centred unless said otherwise."""
    wear: Wear | None = None
    """How its surfaces wear; left out, they do not."""
    film: Film | None = None
    """Oil between its surfaces; left out, the joint is dry."""
    out_of_round: OutOfRound | None = None
    """Waves around its surfaces; left out, they are round."""

    @property
    def journal_radius(self) -> float:
        """R_J = R_B - c, m."""
        return self.bearing_radius - self.clearance

    _in_radii = model_validator(mode="before")(with_clearance)

    @model_validator(mode="after")
    def _journal_fits(self) -> "ClearanceJoint":
        check_journal(self)
        return self


class IdealJoint(Table):
    """A pin without clearance."""

    kind: Literal["ideal"]
    friction: RubbingPin | None = None
    """Torque in proportion to the pin's reaction; left out, it turns freely."""

    @model_validator(mode="before")
    @classmethod
    def _no_dimensions(cls, data: Any) -> Any:
        # What a clearance joint needs may stay in the file, so that `--set
        # joints.crank_rod.kind=ideal` is enough to switch one off; it is dropped here, so that it
        # cannot make two equal scenes look different.
        if isinstance(data, Mapping):
            return {
                key: value
                for key, value in data.items()
                if key not in ClearanceJoint.model_fields or key == "kind"
            }
        return data


Joint = Annotated[ClearanceJoint | IdealJoint, Field(discriminator="kind")]


class Joints(Table):
    """The joints that may have clearance; the joint of crank and frame is ideal."""

    crank_rod: Joint
    """O12."""
    rod_slider: Joint
    """O23."""
    crank_frame: IdealJoint | None = None
    """O14; needed where it has friction."""
    guide: SliderGuide | None = None
    """The slider's guide; left out, it has no clearance."""
