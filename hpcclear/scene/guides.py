"""A guide with clearance: a rectangular slider in a channel that is a little wider, in the tables of a scene."""

from typing import ClassVar, Literal

from hpcclear.base.outcome import CORNERS
from hpcclear.scene.fields import Length, PositiveLength, Table, invalid
from hpcclear.scene.materials import Material
from hpcclear.scene.places import Angle

NOT_OF_GUIDES = {
    "wear": (
        "wear is modelled in pins only, not in guides",
        "Remove it; normal force and sliding speed of each corner are in the response",
    ),
    "film": ("oil films are modelled in pins only, not in guides", "Remove it"),
    "out_of_round": ("is of pins and bearings, and a guide is straight", "Remove it"),
    "bearing_radius": ("is of pins, and a slider has length, height, corner_radius", "Remove it"),
    "fit": (
        "is of pins and bearings",
        "Write clearance, half of the channel's height less the slider's",
    ),
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
            raise invalid(
                "belongs to a joint with clearance", 'Add clearance = "0.1 mm" or so, or remove it',
                key=given[0], value=None,
            )  # fmt: skip
        for name in own if self.clearance is not None else ():
            if name in (*self.needed, "materials") and name not in given:
                raise invalid(
                    "is missing, and a joint with clearance needs it",
                    "Add it, or remove clearance for a joint without", key=name, value=None,
                )  # fmt: skip


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
        super()._check()
        if self.clearance is None:
            return
        if getattr(self, "friction", None) is not None:
            raise invalid(
                "a slide with clearance rubs at its corners, by the friction of all contacts",
                "Remove it, and write effects.friction", key="friction", value=None,
            )  # fmt: skip
        for entry in ("length", "height"):
            size, radius = getattr(self, entry), self.corner_radius
            if radius is not None and 2.0 * radius >= size:
                raise invalid(
                    f"both corners of a side must fit into the slider's {entry} ({size:g} m)",
                    f"Write less than half of the {entry}, such as 1 mm",
                    key="corner_radius", value=radius,
                )  # fmt: skip


class SliderGuide(Guide):
    """The guide of a slider-crank, with clearance."""

    kind: Literal["slide"]
    clearance: PositiveLength
    """Gap on either side of a slider in the middle of its channel, m."""
    bearing: Material
    """Material of the channel."""
    journal: Material
    """Material of the slider."""
