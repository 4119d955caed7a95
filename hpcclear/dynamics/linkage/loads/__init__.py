"""Loads that act on a linkage, one file a kind: its numbers, and the terms that it adds to the motion's text.

A new one is a file here, its row in `KINDS`, and its table in `hpcclear.scene.loads`.
"""

from hpcclear.dynamics.linkage.loads.cylinder import Cylinder
from hpcclear.dynamics.linkage.loads.drag import Drag
from hpcclear.dynamics.linkage.loads.torsion_spring import TorsionSpring
from hpcclear.dynamics.linkage.parts import Acting

KINDS: dict[str, type[Acting]] = {
    "torsion-spring": TorsionSpring,
    "cylinder": Cylinder,
    "drag": Drag,
}
"""By the kind that the scene names."""
