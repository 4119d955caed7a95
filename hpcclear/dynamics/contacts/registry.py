"""The registry of geometries of contact: a new one is a file here, and its name in this list."""

from hpcclear.dynamics.contacts import guide, pin_in_bearing, pin_in_slot
from hpcclear.dynamics.contacts.declared import ContactGeometry

GEOMETRIES: dict[str, ContactGeometry] = {
    one.name: one for one in (pin_in_bearing.GEOMETRY, guide.GEOMETRY, pin_in_slot.GEOMETRY)
}
