"""A pin against a wall of a slot that is a little wider: a circle against a line, on either side of the pin.

A joint has two such contacts. The slot's line runs midway between its walls. Contact and friction are those of a guide's corner
whose circle is the whole pin. The pin turns freely in the slot.
"""

from typing import ClassVar, Literal

from hpcclear.scene.contacts.declared import AlongLine, Get, Number, Shape
from hpcclear.scene.fields import Angle, PositiveLength
from hpcclear.scene.joints import Materials

WALLS = {"left": 1.0, "right": -1.0}
"""Contacts of a pin in a slot with clearance, the slot's walls on either side of its line."""


class PlanarSlot(AlongLine):
    """A pin in a straight slot of a body or of the ground; with clearance, it touches either wall."""

    noun: ClassVar[str] = "slot"
    holds: ClassVar[int] = 1
    corners: ClassVar[tuple[str, ...]] = tuple(WALLS)
    sides: ClassVar[dict[str, float]] = WALLS
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

    def contacts(self) -> dict[str, tuple[str, str]]:
        """The pin at either wall."""
        return dict.fromkeys(WALLS, (self.point, self.line))

    def gaps(self) -> tuple[Number, ...]:
        """At either wall."""
        (offset,), (clearance,) = self.start(), self.own("clearance")
        return tuple(side * offset - clearance for side in WALLS.values())

    @staticmethod
    def shape(get: Get) -> Shape:
        """The pin is a sphere on a plane, as far as stiffness goes."""
        clearance, radius = get("clearance"), get("pin_radius")
        return Shape(clearance, radius + clearance, radius, (radius, radius, radius), radius)
