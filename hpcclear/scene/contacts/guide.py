"""A guide with clearance: the corners of a slider against the faces of a channel, circles of a small radius against a line.

A slider has four such contacts. The line of the guide runs in the middle of the channel; of the joint's rows, the bearing's
radius is the distance of a face from that line, the journal's that of the corner, so that the gap is, as of a pin, the
distance of the corner's centre less the difference of both. The contact point lies half-way through the overlap.
"""

from typing import ClassVar, Literal

import numpy as np

from hpcclear.base.written import shown
from hpcclear.scene.contacts.declared import AlongLine, Get, Number, Shape
from hpcclear.scene.fields import Angle, PositiveLength, invalid
from hpcclear.scene.joints import JointFriction, Materials

CORNERS = {
    "front_left": (1.0, 1.0), "front_right": (1.0, -1.0),
    "back_right": (-1.0, -1.0), "back_left": (-1.0, 1.0),
}  # fmt: skip
"""Contacts of a guide with clearance, the corners of its slider: before or behind its middle along the line, left or right."""

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


class Guide(AlongLine):
    """A guide that may have clearance: a rectangular slider in a channel that is a little higher."""

    noun: ClassVar[str] = "guide"
    corners: ClassVar[tuple[str, ...]] = tuple(CORNERS)
    sides: ClassVar[dict[str, float]] = {word: side for word, (_, side) in CORNERS.items()}
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
                raise invalid(reason, "Write less than half of it, say 1 mm", "corner_radius")

    def contacts(self) -> dict[str, tuple[str, str]]:
        """The centres of its corners, and the line."""
        name, point, line = self.own("name", "point", "line")
        body = point.partition(".")[0]
        return {word: (f"{body}.{name}_{word}", line) for word in CORNERS}

    def further_points(self, middle: tuple[float, float]) -> dict[str, tuple[float, float]]:
        """The centres of its corners."""
        (name,) = self.own("name")
        return {f"{name}_{word}": self._corner(middle, word) for word in CORNERS}

    def _corner(self, middle: tuple[float, float], word: str) -> tuple[float, float]:
        """Centre of a corner's arc in the slider's axes, m."""
        (x, y), (ahead, aside) = middle, CORNERS[word]
        length, height, radius = self.own("length", "height", "corner_radius")
        return x + ahead * (0.5 * length - radius), y + aside * (0.5 * height - radius)

    def _tilt(self) -> Number:
        return 0.0 if self.start_tilt is None else self.start_tilt

    def start(self) -> tuple[Number, ...]:
        """How far it is from the line, and how much it is turned."""
        return *super().start(), np.sin(self._tilt())

    def gaps(self) -> tuple[Number, ...]:
        """Of its corners."""
        (offset, _), tilt = self.start(), self._tilt()
        height, radius, clearance = self.own("height", "corner_radius", "clearance")
        found = []
        for word, side in self.sides.items():
            x, y = self._corner((0.0, 0.0), word)
            away = side * (offset + x * np.sin(tilt) + y * np.cos(tilt))
            found.append(away + radius - 0.5 * height - clearance)
        return tuple(found)

    @staticmethod
    def shape(get: Get) -> Shape:
        """Laws of contact get a journal of the corner's radius on a plane, in which a bearing's R_B R_J/c is that radius."""
        clearance, radius = get("clearance"), get("corner_radius")
        half = 0.5 * get("height") + clearance
        return Shape(clearance, half, radius, (radius, radius, radius), radius)


class PlanarSlide(Guide):
    """A guide on the ground or on a body; with clearance, a rectangular slider in a channel that is a little higher."""

    name: str
    kind: Literal["slide"]
    point: str
    """``body.point`` that moves along the line; with clearance, the middle of the slider."""
    line: str
    """``body.point``, or ``ground.point``, on the line."""
    angle: Angle = 0.0
    """Direction of the line in the axes of the body that carries it, rad."""
    friction: JointFriction | None = None
    """Friction of a guide without clearance. Without it the guide is frictionless."""
    materials: Materials | None = None
    """Materials of channel (bearing) and slider (journal) of a guide with clearance."""
