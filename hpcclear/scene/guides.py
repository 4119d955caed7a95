"""A guide with clearance: a rectangular slider in a channel that is a little wider, in the tables of a scene."""

from typing import Any, ClassVar, Literal, Self

from pydantic import model_validator

from hpcclear.base.outcome import CORNERS
from hpcclear.scene.fields import Length, PositiveLength, Table, invalid
from hpcclear.scene.materials import Material
from hpcclear.scene.places import Angle

NEEDED = ("length", "height", "corner_radius")
"""Entries that a slide with clearance has to have."""

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


class OfContacts:
    """What the tables of all guides with clearance have in common with those of pins."""

    geometry: ClassVar[str] = "guide"
    """Of contact, by its name in `dynamics.contacts`."""
    corners: ClassVar[tuple[str, ...]] = tuple(CORNERS)
    """Words of a joint's contacts; none where it has one, which has the joint's name."""
    wear: ClassVar[None] = None
    film: ClassVar[None] = None
    out_of_round: ClassVar[None] = None


class Guide(OfContacts, Table):
    """A guide that may have clearance: a rectangular slider in a channel that is a little higher."""

    clearance: PositiveLength | None = None
    """Gap on either side of a slider in the middle of its channel, m. Without it the guide is ideal."""
    length: PositiveLength | None = None
    """Length of a slider with clearance along the guide, m. Its point, of a slider-crank its pin, is in the middle."""
    height: PositiveLength | None = None
    """Height of a slider with clearance across the guide, m. The channel is higher by twice the clearance."""
    corner_radius: PositiveLength | None = None
    """Radius of the slider's rounded corners, m. It determines the contact stiffness."""
    width: PositiveLength | None = None
    """Width of the slider at right angles to the plane, m. Line contact requires it."""
    start_offset: Length | None = None
    """Distance of the slider's middle from the guide's line at the start, positive to the left, m; default 0."""
    start_tilt: Angle | None = None
    """Angle between the slider and the line at the start, rad; default 0."""

    elsewhere: ClassVar = NOT_OF_GUIDES

    @model_validator(mode="after")
    def _slider_fits(self) -> Self:
        check_slide(self)
        return self


class SliderGuide(Guide):
    """The guide of a slider-crank, with clearance."""

    kind: Literal["slide"]
    clearance: PositiveLength
    """Gap on either side of a slider in the middle of its channel, m."""
    bearing: Material
    """Material of the channel."""
    journal: Material
    """Material of the slider."""


def check_slide(guide: Any) -> None:
    """An error for validators unless a slide is one without clearance, or one with all that this needs."""
    own = [
        name
        for name in (*NEEDED, "width", "materials", "start_offset", "start_tilt")
        if name in type(guide).model_fields
    ]
    given = [name for name in own if getattr(guide, name) is not None]
    if guide.clearance is None:
        if given:
            raise invalid(
                "belongs to a slide with clearance", 'Add clearance = "0.1 mm" or so, or remove it',
                key=given[0], value=None,
            )  # fmt: skip
        return
    for name in (*NEEDED, "materials"):
        if name in own and name not in given:
            raise invalid(
                "is missing, and a slide with clearance needs it",
                "Add it, or remove clearance for a guide without", key=name, value=None,
            )  # fmt: skip
    if getattr(guide, "friction", None) is not None:
        raise invalid(
            "a slide with clearance rubs at its corners, by the friction of all contacts",
            "Remove it, and write effects.friction", key="friction", value=None,
        )  # fmt: skip
    for entry in ("length", "height"):
        size = getattr(guide, entry)
        if 2.0 * guide.corner_radius >= size:
            raise invalid(
                f"both corners of a side must fit into the slider's {entry} ({size:g} m)",
                f"Write less than half of the {entry}, such as 1 mm",
                key="corner_radius", value=guide.corner_radius,
            )  # fmt: skip
