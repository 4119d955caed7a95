"""A pin in a slot of another body, which it slides along and turns in."""

from typing import ClassVar, Literal

from pydantic import model_validator

from hpcclear.base.outcome import WALLS
from hpcclear.scene.fields import Length, PositiveLength, Table, invalid
from hpcclear.scene.guides import OfContacts
from hpcclear.scene.materials import Materials
from hpcclear.scene.places import Angle

NEEDED = ("pin_radius", "materials")


class PlanarSlot(OfContacts, Table):
    """A pin in a straight slot of a body or of the ground; with clearance, it touches either wall."""

    geometry: ClassVar[str] = "pin_in_slot"
    corners: ClassVar[tuple[str, ...]] = tuple(WALLS)

    name: str
    kind: Literal["slot"]
    point: str
    """``body.point`` that is the pin's centre."""
    line: str
    """``body.point``, or ``ground.point``, on the line midway between the walls."""
    angle: Angle = 0.0
    """Direction of the line in its carrier's axes, rad."""
    clearance: PositiveLength | None = None
    """Gap on either side of a pin in the middle of the slot, m; left out, there is none."""
    pin_radius: PositiveLength | None = None
    """Of the pin, m; with clearance, stiffness follows from it."""
    width: PositiveLength | None = None
    """Of the slot's walls, at right angles to the plane, m; line contact needs it."""
    materials: Materials | None = None
    """Of slot (bearing) and pin (journal), with clearance."""
    start_offset: Length | None = None
    """How far the pin's centre is to the left of the line at the start, m; in the middle unless said otherwise."""

    @model_validator(mode="after")
    def _with_all(self) -> "PlanarSlot":
        if self.clearance is not None:
            for name in NEEDED:
                if getattr(self, name) is None:
                    raise invalid(
                        "is missing, and a slot with clearance needs it",
                        "Add it, or remove clearance", key=name, value=None,
                    )  # fmt: skip
        return self
