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
    """Distance between the joints of the bar, m."""
    mass: Mass
    """Mass, kg."""
    inertia: Inertia
    """Moment of inertia about its mass centre, kg m2."""
    mass_center: Length
    """Distance of the mass centre from its first joint along the link, m; may lie beyond either
    pin."""
    bending: Bending | None = None
    """Bending of the rod. Without it the rod is rigid."""


class Slider(Table):
    """The guided body."""

    mass: Mass
    """Mass, kg."""
    inertia: Inertia | None = None
    """Moment of inertia about its pin, which is its mass centre, kg m2. Required if its guide has clearance."""


class Mechanism(Table):
    """Planar slider-crank: crank, connecting rod, slider (Tables 1 and 2 of the paper)."""

    kind: Literal["slider-crank"] = "slider-crank"
    crank: Link
    rod: Link
    slider: Slider
    offset: Length | None = None
    """Distance of the slider's line from the crank's axis along +y, m. Without it the line passes through the axis."""

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
    """The crank turns at a constant prescribed speed, independent of the torque that this requires."""

    kind: Literal["constant-speed"]
    speed: Annotated[float, Quantity("rad/s", nonzero=True, why="there would be no motion")]
    """Crank speed, rad/s, counter-clockwise; negative: clockwise. "600 min^-1" means 600 revolutions per minute."""
    turns: Turns = 1
    """Turns per revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after this number of turns."""

    elsewhere: ClassVar = dict.fromkeys(
        ("torque", "flywheel_inertia", "initial_speed", "expected_speed", "no_load_speed"),
        (
            "contradicts a prescribed crank speed",
            'Remove it, or set drive.kind = "torque" and give initial_speed instead of speed',
        ),
    )


class TorqueDrive(Table):
    """A torque acts on the free crank; its speed is a result of the simulation."""

    kind: Literal["torque"]
    torque: Annotated[Curve, CurveOf("N*m", cycles=True)] | None = None
    """N m, constant or ``[[crank angle, torque], ...]`` over the turns of a revolution."""
    torque_by_speed: Annotated[Any, Law("rad/s", "N*m")] | None = None
    """Instead of `torque`: ``[[speed, torque], ...]`` as of a motor with its pull-out torque, rad/s and N m; linear
    between the rows, constant outside them."""
    no_load_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """Speed at which the torque is 0, rad/s. The torque decreases linearly with the speed, as that of a motor. Without
    it the torque does not depend on the speed."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Moment of inertia of a flywheel on the crank, kg m2."""
    initial_speed: Annotated[float, Quantity("rad/s", least=0)]
    """Crank speed at the start, rad/s; 0: from rest."""
    expected_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """Approximate speed to expect, rad/s. Tolerances and the first step are scaled by it, or by `initial_speed` if it
    is missing. Required for a start from rest."""
    turns: Turns = 1
    """Turns per revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after this number of turns."""

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
    """A pin with clearance: the journal moves freely within the bearing."""

    geometry: ClassVar[str] = "pin_in_bearing"
    corners: ClassVar[tuple[str, ...]] = ()

    kind: Literal["clearance"]
    clearance: PositiveLength
    """Radial clearance c = R_B - R_J, m."""
    bearing_radius: PositiveLength
    """Radius of the bearing, m. It stays constant when the clearance varies."""
    length: PositiveLength | None = None
    """Length of the bearing along its axis, m. Line contact and pressures require it."""
    fit: str | None = None
    """Instead of `clearance` and `bearing_radius`: an ISO 286 fit such as "20 H7/f7". Both are then at the middle of
    their tolerances."""
    diametral_clearance: Annotated[float, Quantity("m", above=0)] | None = None
    """Instead of `clearance`: difference of the diameters of bearing and journal, m. It is twice the radial clearance."""
    bearing: Material
    journal: Material
    start_eccentricity: tuple[Length, Length] = (0.0, 0.0)
    """Vector (x, y) from the bearing centre to the journal centre at the start, m; default: centred."""
    wear: Wear | None = None
    """Wear of its surfaces. Without it they do not wear."""
    film: Film | None = None
    """Oil film between its surfaces. Without it the joint is dry."""
    out_of_round: OutOfRound | None = None
    """Waviness of its surfaces. Without it they are round."""

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
    """Friction torque, proportional to the reaction force of the pin. Without it the pin is frictionless."""

    @model_validator(mode="before")
    @classmethod
    def _no_dimensions(cls, data: object) -> Any:
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
    """Joint of crank and rod (O12 in the paper)."""
    rod_slider: Joint
    """Joint of rod and slider (O23 in the paper)."""
    crank_frame: IdealJoint | None = None
    """Joint of crank and frame (O14 in the paper). Required if it has friction."""
    guide: SliderGuide | None = None
    """Clearance of the slider's guide. Without it the guide is ideal."""
