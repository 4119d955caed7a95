"""The slider-crank as in the scene file, and as a template of a linkage: its tables as bodies, joints, drive and load.

Nothing below the scene depends on which template wrote a linkage; `SERIES` and `HOLDS` say what its own names stand for.
"""

import math
from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import Field

from hpcclear.base.written import shown
from hpcclear.scene import fields
from hpcclear.scene.contacts.guide import Guide, PlanarSlide
from hpcclear.scene.contacts.pin_in_bearing import PinInBearing, PlanarClearance
from hpcclear.scene.driving import CrankSpeed, CrankTorque, PlanarDrive, PlanarSpeed, PlanarTorque
from hpcclear.scene.effects import EffectTables
from hpcclear.scene.fields import Content, Entries, Table, invalid
from hpcclear.scene.joints import IdealPinFriction, Material, Materials, PlanarRevolute
from hpcclear.scene.loads.force import ForceLoad
from hpcclear.scene.planar import BarBending, Ground, Planar, PlanarBody, PlanarJoint


class Link(Table):
    """A bar between two joints, rigid unless it bends."""

    length: fields.PositiveLength
    """Distance between the joints of the bar, m."""
    mass: fields.Mass
    """Mass, kg."""
    inertia: fields.Inertia
    """Moment of inertia about its mass centre, kg m2."""
    mass_center: fields.Length
    """Distance of the mass centre from its first joint along the link, m; may lie beyond either pin."""
    bending: BarBending | None = None
    """Bending of the rod. Without it the rod is rigid."""


class Slider(Table):
    """The guided body."""

    mass: fields.Mass
    """Mass, kg."""
    inertia: fields.Inertia | None = None
    """Moment of inertia about its pin, which is its mass centre, kg m2. Required if its guide has clearance."""


class SliderCrank(Table):
    """Planar slider-crank: crank, connecting rod, slider (Tables 1 and 2 of the paper)."""

    kind: Literal["slider-crank"] = "slider-crank"
    crank: Link
    rod: Link
    slider: Slider
    offset: fields.Length | None = None
    """Distance of the slider's line from the crank's axis along +y, m. Without it the line passes through the axis."""

    def _check(self) -> None:
        offset = abs(self.offset or 0.0)
        if self.rod.length <= self.crank.length + offset:
            beside = f" and the offset ({shown(offset, 'm')})" if offset else ""
            least = f"({shown(self.crank.length, 'm')}){beside}, or the crank cannot rotate"
            remedy = "Lengthen the rod or shorten the crank" + " or the offset" * bool(offset)
            raise invalid(f"the rod must be longer than the crank {least}", remedy, "rod.length")


Drive = Annotated[CrankSpeed | CrankTorque, Field(discriminator="kind")]


class ClearanceJoint(PinInBearing):
    """A pin with clearance: the journal moves freely within the bearing."""

    bearing: Material
    journal: Material


class IdealJoint(Table):
    """A pin without clearance."""

    kind: Literal["ideal"]
    friction: IdealPinFriction | None = None
    """Friction torque, proportional to the reaction force of the pin. Without it the pin is frictionless."""

    @classmethod
    def _of_file(cls, row: Entries) -> Entries:
        # What a clearance joint needs may stay in the file, so that `--set
        # joints.crank_rod.kind=ideal` is enough to switch one off; it is dropped here, so that it
        # cannot make two equal scenes look different.
        dimensions = ClearanceJoint.model_fields.keys() - {"kind"}
        return {key: value for key, value in row.items() if key not in dimensions}


class SliderGuide(Guide):
    """The guide of a slider-crank, with clearance."""

    kind: Literal["slide"]
    clearance: fields.PositiveLength
    """Gap on either side of a slider in the middle of its channel, m."""
    bearing: Material
    """Material of the channel."""
    journal: Material
    """Material of the slider."""


Joint = Annotated[ClearanceJoint | IdealJoint, Field(discriminator="kind")]


class CrankJoints(Table):
    """The joints that may have clearance; the joint of crank and frame is ideal."""

    crank_rod: Joint
    """Joint of crank and rod (O12 in the paper)."""
    rod_slider: Joint
    """Joint of rod and slider (O23 in the paper)."""
    crank_frame: IdealJoint | None = None
    """Joint of crank and frame (O14 in the paper). Required if it has friction."""
    guide: SliderGuide | None = None
    """Clearance of the slider's guide. Without it the guide is ideal."""


JOINTS = {"crank_rod": ("crank.b", "rod.a"), "rod_slider": ("slider.pin", "rod.b")}
"""Journal and bearing of the joints that may have clearance: O12, O23."""

SERIES: Mapping[str, tuple[str, str]] = {
    "slider_position": ("body_x", "slider"),
    "slider_velocity": ("body_vx", "slider"),
    "slider_acceleration": ("acceleration", "slider"),
    "rod_x": ("body_x", "rod"),
    "rod_y": ("body_y", "rod"),
    "rod_angle": ("body_angle", "rod"),
}
"""What the time series of a slider-crank are of the linkage's: a quantity and its body."""

HOLDS: Mapping[str, tuple[tuple[str, float], ...]] = {
    "reaction_x": (("crank_rod_x", -1.0), ("rod_slider_x", -1.0)),
    "reaction_y": (("crank_rod_y", -1.0), ("rod_slider_y", -1.0)),
    "bearing_x": (("crank_frame_x", 1.0),),
    "bearing_y": (("crank_frame_y", 1.0),),
    "guide_force": (("guide_across", 1.0),),
}
"""Its reactions without clearance: those of constraints, each with its sign; a column each where there are several."""

DRAWN_AT = math.radians(50.0)
"""Crank angle of its drawing, rad; at the start, crank and rod lie on one line."""

_TABLES = {
    "mechanism.crank": "mechanism.bodies.crank",
    "mechanism.rod": "mechanism.bodies.rod",
    "mechanism.slider": "mechanism.bodies.slider",
    "mechanism.offset": "mechanism.ground.points.guide.y",
    "drive": "mechanism.drives.drive",
    "effects.guide_friction": "mechanism.joints.guide.friction",
    "effects.slider_load": "mechanism.loads.load.size",
    **{f"joints.{name}": f"mechanism.joints.{name}" for name in ("crank_frame", *JOINTS, "guide")},
}


def path_in_linkage(path: str) -> str:
    """The entry of the linkage's tables that an entry of a slider-crank's scene stands for, itself if none does."""
    for own, table in _TABLES.items():
        if path == own or path.startswith(f"{own}."):
            rest = path.removeprefix(own)
            part = rest.split(".")[1] if rest else ""
            return f"{table}.materials{rest}" if part in Materials.model_fields else table + rest
    return path


def path_in_scene(path: str) -> str:
    """The entry of a slider-crank's scene that stands for one of the linkage's tables, itself if none does."""
    for own, table in _TABLES.items():
        if path == table or path.startswith(f"{table}."):
            return own + path.removeprefix(table).replace(".materials", "")
    return path


def linkage_of(
    mechanism: SliderCrank, drive: Drive, joints: CrankJoints, effects: EffectTables
) -> Planar:
    """The tables of the linkage that a slider-crank is; they are valid since its own are."""
    links = {"crank": mechanism.crank, "rod": mechanism.rod}
    bars = [PlanarBody.model_construct(name=n, **_entries(link, Link)) for n, link in links.items()]
    pin = fields.NamedPlace.model_construct(name="pin", x=0.0, y=0.0)
    own = mechanism.slider
    turning: Content = {} if own.inertia is None else {"inertia": own.inertia}
    slider = PlanarBody.model_construct(name="slider", mass=own.mass, points=(pin,), **turning)
    ground, line = Ground(), "ground.o"
    if mechanism.offset is not None:
        beside = fields.NamedPlace.model_construct(name="guide", x=0.0, y=mechanism.offset)
        ground, line = Ground(points=(*ground.points, beside)), "ground.guide"
    guide = PlanarSlide.model_construct(
        name="guide", kind="slide", point="slider.pin", line=line,
        friction=effects.guide_friction,
        **({} if joints.guide is None else _entries(joints.guide, Guide) | _materials(joints.guide)),
    )  # fmt: skip
    frame = PlanarRevolute.model_construct(
        name="crank_frame", kind="revolute", journal="crank.a", bearing="ground.o",
        friction=getattr(joints.crank_frame, "friction", None),
    )  # fmt: skip
    size = effects.slider_load
    load = ForceLoad.model_construct(name="load", kind="force", place="slider.pin", size=size)
    return Planar.model_construct(
        bodies=(*bars, slider),
        ground=ground,
        joints=(frame, guide, *(_joint(name, getattr(joints, name)) for name in JOINTS)),
        drives=(_drive(drive),),
        loads=() if size is None else (load,),
    )


def _entries(table: Table, of: type[Table]) -> Content:
    """Entries of a table that it has in common with the linkage's."""
    return {name: getattr(table, name) for name in of.model_fields}


def _materials(joint: ClearanceJoint | SliderGuide) -> Content:
    return {"materials": Materials.model_construct(bearing=joint.bearing, journal=joint.journal)}


def _joint(name: str, joint: ClearanceJoint | IdealJoint) -> PlanarJoint:
    journal, bearing = JOINTS[name]
    places: Content = {"name": name, "journal": journal, "bearing": bearing}
    if not isinstance(joint, ClearanceJoint):
        return PlanarRevolute.model_construct(kind="revolute", friction=joint.friction, **places)
    entries = _entries(joint, PinInBearing) | _materials(joint)
    return PlanarClearance.model_construct(**places, **entries)


def _drive(drive: Drive) -> PlanarDrive:
    model = PlanarSpeed if isinstance(drive, CrankSpeed) else PlanarTorque
    entries = _entries(drive, type(drive))
    return model.model_construct(name="drive", body="crank", period=True, **entries)
