"""Joints in the scene file: materials, friction of ideal joints, pins in bearings, guides and slots with clearance."""

from typing import Annotated, ClassVar, Literal

from pydantic import model_validator

from hpcclear.base.outcome import CORNERS, WALLS
from hpcclear.base.written import shown
from hpcclear.scene.fields import (
    NOWHERE,
    Angle,
    Length,
    Position,
    PositiveLength,
    Quantity,
    Speed,
    Table,
    invalid,
)
from hpcclear.scene.fits import with_clearance
from hpcclear.scene.surfaces import Film, OutOfRound, Wear, check_film, check_waves


class Material(Table):
    """Elastic constants of one contact partner."""

    youngs_modulus: Annotated[float, Quantity("Pa", above=0)]
    """Young's modulus, Pa."""
    poisson_ratio: Annotated[float, Quantity("", above=-1, most=0.5)]
    """Poisson's ratio."""


class Materials(Table):
    """Materials of both partners of a contact."""

    bearing: Material
    journal: Material


class JointFriction(Table):
    """Friction of a guide."""

    coefficient: Annotated[float, Quantity("", least=0)]
    """Coefficient of friction of Coulomb's law."""
    ramp_speed: Speed = 0.01
    """Sliding speed below which the force decreases linearly to zero, m/s."""


class IdealPinFriction(JointFriction):
    """Friction of a pin: a torque, equal to coefficient times radius times reaction force."""

    radius: PositiveLength
    """Radius of the pin, m."""


class PinInBearing(Table):
    """A pin with clearance: a journal that moves freely within a larger bearing."""

    geometry: ClassVar[str] = "pin_in_bearing"
    corners: ClassVar[tuple[str, ...]] = ()
    ordered: ClassVar = (
        ("clearance", "bearing_radius", 1.0, "the clearance as large as the bearing"),
    )
    """Entries of which the first, so many times, is less than the second; in samples, what is wrong where it is not."""

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
    start_eccentricity: Position = NOWHERE
    """Vector from the bearing centre to the journal centre at the start, m; default: centred."""
    wear: Wear | None = None
    """Wear of its surfaces. Without it they do not wear."""
    film: Film | None = None
    """Oil film between its surfaces. Without it the joint is dry."""
    out_of_round: OutOfRound | None = None
    """Waviness of its surfaces. Without it they are round."""

    _in_radii = model_validator(mode="before")(with_clearance)

    def _check(self) -> None:
        """A journal is left, and film and waves fit into the clearance."""
        if self.clearance >= self.bearing_radius:
            radius = shown(self.bearing_radius, "m")
            reason = f"must be smaller than the bearing radius ({radius}): no journal is left"
            raise invalid(reason, "Write the radial clearance R_B - R_J", "clearance")
        check_film(self.film, self.clearance, self.bearing_radius)
        check_waves(self.out_of_round, self.clearance, self.film)


def length_path(joint: "PinInBearing | OfContacts") -> str | None:
    """Where a joint with clearance has its length at right angles to the plane: its own entry, or that of its film or wear."""
    if isinstance(joint, OfContacts):
        return None if joint.width is None else "width"
    if joint.length is not None:
        return "length"
    parts = ("film", "wear")
    return next((f"{part}.length" for part in parts if getattr(joint, part) is not None), None)


NOT_OF_GUIDES = {
    "wear": (
        "wear is modelled in pins only",
        "Remove it; the response has forces and speeds of corners",
    ),
    "film": ("oil films are modelled in pins only, not in guides", "Remove it"),
    "out_of_round": ("is of pins and bearings, and a guide is straight", "Remove it"),
    "bearing_radius": ("is of pins, and a slider has length, height, corner_radius", "Remove it"),
    "fit": ("is of pins and bearings", "Write clearance: half of what the slider is lower"),
}
"""Entries of other joints that a user might write here."""


class OfContacts(Table):
    """A joint along a line that may have clearance, with several contacts: what the tables of guides and slots share."""

    geometry: ClassVar[str]
    """Of contact, by its name in `dynamics.contacts`."""
    corners: ClassVar[tuple[str, ...]]
    """Words of a joint's contacts; none where it has one, which has the joint's name."""
    needed: ClassVar[tuple[str, ...]]
    """Entries that it has to have with clearance."""
    ordered: ClassVar[tuple[tuple[str, str, float, str], ...]] = ()
    """As of `bearings.Bearing`."""
    wear: ClassVar[None] = None
    film: ClassVar[None] = None
    out_of_round: ClassVar[None] = None

    clearance: PositiveLength | None = None
    """Gap on either side of a slider or pin in the middle, m. Without it the joint is ideal."""
    width: PositiveLength | None = None
    """Width of slider, or of the slot's walls, at right angles to the plane, m. Line contact requires it."""
    start_offset: Length | None = None
    """Distance of the middle from the line at the start, positive to the left, m; default 0."""

    def _check(self) -> None:
        """It is one without clearance, or has all that clearance needs."""
        entries = (*self.needed, "width", "materials", "start_offset", "start_tilt")
        own = [name for name in entries if name in type(self).model_fields]
        given = [name for name in own if getattr(self, name) is not None]
        if self.clearance is None and given:
            reason = "belongs to a joint with clearance"
            raise invalid(reason, 'Add clearance = "0.1 mm" or so, or remove it', given[0])
        for name in own if self.clearance is not None else ():
            if name in (*self.needed, "materials") and name not in given:
                reason = "is missing, and a joint with clearance needs it"
                raise invalid(reason, "Add it, or remove clearance for a joint without", name)


class Guide(OfContacts):
    """A guide that may have clearance: a rectangular slider in a channel that is a little higher."""

    geometry: ClassVar[str] = "guide"
    corners: ClassVar[tuple[str, ...]] = tuple(CORNERS)
    needed: ClassVar[tuple[str, ...]] = ("length", "height", "corner_radius")
    ordered: ClassVar[tuple[tuple[str, str, float, str], ...]] = tuple(
        ("corner_radius", size, 2.0, "corners rounder than half of the slider")
        for size in ("length", "height")
    )

    length: PositiveLength | None = None
    """Length of a slider with clearance along the guide, m. Its point, of a slider-crank its pin, is in the middle."""
    height: PositiveLength | None = None
    """Height of a slider with clearance across the guide, m. The channel is higher by twice the clearance."""
    corner_radius: PositiveLength | None = None
    """Radius of the slider's rounded corners, m. It determines the contact stiffness."""
    start_tilt: Angle | None = None
    """Angle between the slider and the line at the start, rad; default 0."""

    elsewhere: ClassVar = NOT_OF_GUIDES

    def _check(self) -> None:
        if self.clearance is None:
            return
        if getattr(self, "friction", None) is not None:
            reason = "a slide with clearance rubs at its corners, by the friction of all contacts"
            raise invalid(reason, "Remove it, and write effects.friction", "friction")
        for entry in ("length", "height"):
            size, radius = getattr(self, entry), self.corner_radius
            if radius is not None and 2.0 * radius >= size:
                reason = f"both corners of a side must fit into its {entry} ({shown(size, 'm')})"
                remedy = f"Write less than half of the {entry}, such as 1 mm"
                raise invalid(reason, remedy, "corner_radius")


class SliderGuide(Guide):
    """The guide of a slider-crank, with clearance."""

    kind: Literal["slide"]
    clearance: PositiveLength
    """Gap on either side of a slider in the middle of its channel, m."""
    bearing: Material
    """Material of the channel."""
    journal: Material
    """Material of the slider."""


class PlanarSlot(OfContacts):
    """A pin in a straight slot of a body or of the ground; with clearance, it touches either wall."""

    geometry: ClassVar[str] = "pin_in_slot"
    corners: ClassVar[tuple[str, ...]] = tuple(WALLS)
    needed: ClassVar[tuple[str, ...]] = ("pin_radius",)

    name: str
    kind: Literal["slot"]
    point: str
    """``body.point`` at the centre of the pin."""
    line: str
    """``body.point``, or ``ground.point``, on the line midway between the walls."""
    angle: Angle = 0.0
    """Direction of the line in the axes of the body that carries it, rad."""
    pin_radius: PositiveLength | None = None
    """Radius of the pin, m. It determines the contact stiffness."""
    materials: Materials | None = None
    """Materials of slot (bearing) and pin (journal), with clearance."""
