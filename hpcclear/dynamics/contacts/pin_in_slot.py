"""A pin against a wall of a slot that is a little wider: a circle against a line, on either side of the pin.

A joint has two such contacts. The slot's line runs midway between its walls. Contact and friction are those of a guide's corner
whose circle is the whole pin: see `guide.corner_force`. The pin turns freely in the slot.
"""

from typing import Any

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import WALLS
from hpcclear.dynamics.contacts import guide
from hpcclear.dynamics.contacts.declared import ContactGeometry, Get, Shape


def shape(get: Get) -> Shape:
    """Numbers of both contacts: the pin is a sphere on a plane, as far as stiffness goes."""
    clearance, radius = get("clearance"), get("pin_radius")
    return Shape(clearance, radius + clearance, radius, (radius, radius, radius), radius)


def gap_of(joint: Any, which: str, offset: float) -> Array | float:
    """Gap at a wall, m, below 0 in flight, of a pin `offset` to the left of the slot's line."""
    return WALLS[which] * offset - joint.clearance


GEOMETRY = ContactGeometry(
    name="pin_in_slot",
    words="pin against a wall of its slot",
    force=guide.corner_force,
    shape=shape,
    reach=guide.reach,
    along_a_line=True,
)
