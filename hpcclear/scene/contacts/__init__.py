"""Geometries of contact in joints with clearance, one file a kind: its entries in a scene, its numbers, its contacts.

A new geometry is a file here, which `KINDS` finds; no other file changes. `declared` has what they share.
"""

from hpcclear.base.discovery import kinds_in
from hpcclear.scene.contacts.declared import ContactGeometry

KINDS: dict[str, type[ContactGeometry]] = kinds_in(__name__, __path__, ContactGeometry)
"""Tables of joints that may have clearance by their kinds."""
