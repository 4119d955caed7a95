"""What a scene is made of: mechanism, drive and joints, as in the scene file."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hpcclear.scene.bearings import Bearing
from hpcclear.scene.bending import Bending
from hpcclear.scene.driving import ConstantSpeed, TorqueDrive
from hpcclear.scene.fields import Inertia, Length, Mass, PositiveLength, Table, invalid
from hpcclear.scene.guides import SliderGuide
from hpcclear.scene.materials import Material
from hpcclear.scene.rubbing import RubbingPin


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

    def _check(self) -> None:
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


Drive = Annotated[ConstantSpeed | TorqueDrive, Field(discriminator="kind")]


class ClearanceJoint(Bearing):
    """A pin with clearance: the journal moves freely within the bearing."""

    bearing: Material
    journal: Material


class IdealJoint(Table):
    """A pin without clearance."""

    kind: Literal["ideal"]
    friction: RubbingPin | None = None
    """Friction torque, proportional to the reaction force of the pin. Without it the pin is frictionless."""

    @model_validator(mode="before")
    @classmethod
    def _no_dimensions(cls, data: object) -> object:
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
