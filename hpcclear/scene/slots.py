"""A pin in a slot of another body, which it slides along and turns in."""

from typing import ClassVar, Literal

from hpcclear.base.outcome import WALLS
from hpcclear.scene.fields import PositiveLength
from hpcclear.scene.guides import OfContacts
from hpcclear.scene.materials import Materials
from hpcclear.scene.places import Angle


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
