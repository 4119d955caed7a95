"""What a planar mechanism is made of: bodies and joints, each a frozen record in SI units; `drives` has the rest.

A place is ``"body.point"``; the ground is the body ``ground``. Points and centres are given in the body's own axes,
angles count counter-clockwise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import CORNERS, WALLS
from hpcclear.dynamics.contacts import pin_in_slot
from hpcclear.dynamics.contacts.declared import ContactGeometry
from hpcclear.dynamics.contacts.guide import corner, gap_of
from hpcclear.dynamics.contacts.registry import GEOMETRIES

GROUND = "ground"
Pair = tuple[float, float]
Number = float | Array
"""One number, or those of samples (m,)."""


@dataclass(frozen=True)
class Bending:
    """Of a bar from its point a to b: how many modes, stiffness EI in N m2, damping ratio of each mode."""

    modes: int
    stiffness: float
    damping: float = 0.0


@dataclass(frozen=True)
class Body:
    """A body: mass in kg, inertia about its mass centre in kg m2, centre and points in its own axes in m.

    `start_angle` (rad) is a rough one: the assembly starts from it. A body that cannot turn needs no inertia. It is rigid
    unless it is a bar that bends.
    """

    name: str
    mass: float
    inertia: float = 0.0
    center: Pair = (0.0, 0.0)
    points: Mapping[str, Pair] = field(default_factory=dict)
    start_angle: float = 0.0
    bending: Bending | None = None


class Contact(NamedTuple):
    """Where two bodies may touch: a place of the journal's body against one of the bearing's, by a geometry of contact.

    `name` is the joint's, followed by a dot and a word where the joint has several; `side`: of a contact at a guide's line,
    1 on its left, -1 on its right.
    """

    name: str
    joint: "Joint"
    journal: str
    bearing: str
    geometry: ContactGeometry
    side: float = 0.0

    @property
    def word(self) -> str:
        """Its name in texts."""
        return self.name.replace(".", "_")


@dataclass(frozen=True)
class IdealFriction:
    """Friction of a guide or pin over its reaction, sliding speed (m/s) below which it falls linearly to 0, and radius of the
    pin (m), which makes torques of forces: 1 of a guide."""

    coefficient: float
    ramp_speed: float
    radius: float = 1.0


@dataclass(frozen=True)
class Revolute:
    """A pin without clearance between two places."""

    name: str
    journal: str
    bearing: str
    friction: IdealFriction | None = field(default=None, kw_only=True)

    @property
    def places(self) -> tuple[str, str]:
        """Both places: journal, bearing."""
        return self.journal, self.bearing


@dataclass(frozen=True)
class Clearance(Revolute):
    """A journal that moves freely in a bearing larger than itself by the clearance, m."""

    ideal: ClassVar[type] = Revolute

    clearance: float = 0.0
    bearing_radius: float = 0.0
    stiffness: float = 0.0
    start_eccentricity: Pair = (0.0, 0.0)

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """The one of its journal."""
        pin = GEOMETRIES["pin_in_bearing"]
        return (Contact(self.name, self, self.journal, self.bearing, pin),)

    @property
    def gaps(self) -> tuple[Number, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        return (np.hypot(*self.start_eccentricity) - self.clearance,)


@dataclass(frozen=True)
class Aligned:
    """A body whose x axis keeps the direction of a line through a place of another body or of the ground.

    `line` is that place, on the carrier; `angle` the line's direction in the carrier's axes, rad.
    """

    name: str
    point: str
    line: str
    angle: float = 0.0

    @property
    def places(self) -> tuple[str, str]:
        """Both places: of the body, of the one that carries the line."""
        return self.point, self.line


@dataclass(frozen=True)
class Slide(Aligned):
    """A guide: the point moves along the line."""

    friction: IdealFriction | None = None


@dataclass(frozen=True)
class LooseSlide(Slide):
    """A rectangular slider, its middle at the point, in a channel that is higher by twice the clearance; all in m.

    Its x axis goes along the line but for tilt. At the start it is offset to the left of the line and tilted (rad).
    """

    ideal: ClassVar[type] = Slide

    clearance: float = 0.0
    length: float = 0.0
    height: float = 0.0
    corner_radius: float = 0.0
    stiffness: float = 0.0
    start_offset: float = 0.0
    start_tilt: float = 0.0

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """One a corner, in the order of `CORNERS`."""
        body, guide = split(self.point)[0], GEOMETRIES["guide"]
        return tuple(
            Contact(
                f"{self.name}.{word}", self, f"{body}.{self.name}_{word}", self.line, guide, side
            )
            for word, (_, side) in CORNERS.items()
        )

    @property
    def gaps(self) -> tuple[Number, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        return tuple(gap_of(self, word, self.start_offset, self.start_tilt) for word in CORNERS)

    @property
    def start_eccentricity(self) -> Pair:
        """What the constraints of a guide without clearance are at the start: offset, sine of the tilt."""
        return self.start_offset, np.sin(self.start_tilt)

    def corners(self, middle: Pair) -> dict[str, Pair]:
        """Points of the slider that are centres of its corners, `middle` its place in the slider's axes."""
        size = self.length, self.height
        return {
            f"{self.name}_{word}": corner(middle, size, self.corner_radius, word)
            for word in CORNERS
        }


@dataclass(frozen=True)
class Slot(Aligned):
    """A pin in a slot: the point moves along the line, and its body turns freely."""


@dataclass(frozen=True)
class LooseSlot(Slot):
    """A pin, its centre at the point, in a slot that is wider by twice the clearance; all in m.

    At the start it is offset to the left of the line.
    """

    ideal: ClassVar[type] = Slot

    clearance: float = 0.0
    pin_radius: float = 0.0
    stiffness: float = 0.0
    start_offset: float = 0.0

    @property
    def contacts(self) -> tuple[Contact, ...]:
        """One a wall, in the order of `WALLS`."""
        slot = GEOMETRIES["pin_in_slot"]
        return tuple(
            Contact(f"{self.name}.{word}", self, self.point, self.line, slot, side)
            for word, side in WALLS.items()
        )

    @property
    def gaps(self) -> tuple[Number, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        return tuple(pin_in_slot.gap_of(self, word, self.start_offset) for word in WALLS)

    @property
    def start_eccentricity(self) -> tuple[float]:
        """What the constraint of a slot without clearance is at the start: the offset."""
        return (self.start_offset,)


@dataclass(frozen=True)
class Fixed(Aligned):
    """A body held on the ground: the point stays where the line begins."""


Joint = Revolute | Clearance | Slide | LooseSlide | Slot | LooseSlot | Fixed
Loose = Clearance | LooseSlide | LooseSlot


def split(place: str) -> tuple[str, str]:
    """Body and point of a place."""
    body, _, point = place.partition(".")
    return body, point


def as_complex(pair: Any) -> Any:
    """x + iy of a pair, of numbers or of arrays of samples."""
    x, y = pair
    return x + 1j * y
