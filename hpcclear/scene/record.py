"""The record of a sample as a scene requests it: the one place that decides its type.

Workers, ranks, checkpoints and statistics take it from here, so that a sample costs the memory of what was requested.
"""

from typing import Any

import numpy as np

from hpcclear.base.outcome import record_type
from hpcclear.scene.scene import Scene


def record_of(scene: Scene, mapped: bool = False) -> np.dtype:
    """Type of the record of a sample of a scene: its contacts and bands, and fields of what it requests.

    Parameters
    ----------
    mapped : bool
        Whether the motion of each sample is judged, as in a map; by default only with a target error.
    """
    judged = mapped or (scene.numerics.target_error is not None and scene.clearance_joints())
    asked = {
        "response": scene.responses_asked(),
        "impact": scene.impacts_asked(),
        "level": scene.bands(),
        "pressure": has_pressure(scene),
        "rate": scene.objective.rate is not None,
        "wear": scene.worn_joints(),
        "energy": scene.numerics.energy,
        "steady": judged,
        "map": mapped,
    }
    names = [name for name, there in asked.items() if there]
    return record_type(len(scene.joint_labels), len(scene.bands()), names)


def has_pressure(scene: Scene) -> bool:
    """Whether the geometry of a scene's contacts has a pressure."""
    law: Any = None if scene.effects.contact is None else scene.effects.contact.declared
    return law is not None and law.geometry is not None and law.geometry.pressure is not None
