"""Whether a scene is the paper's, and what the paper calls its variables.

Nothing in a scene file says so. A scene is the paper's when it holds what the paper studies: the
mechanism of its Tables 1 and 2 (`hpcclear.scene.describing`) with both clearances, at 5000 rpm, and
a study of the mean and the standard deviation of f, the mean gap, over its design variables and the
clearance. Names, sizes and further variables are free.
"""

import math

from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import JOINTS
from hpcclear.scene import Scene
from hpcclear.scene.describing import TITLE
from hpcclear.scene.named import SHORT_NAMES

SYMBOLS = ("m1", "u1", "I1", "m2", "u2", "I2", "m3", "C")
"""Of its Table 3; what each is of the mechanism: `hpcclear.scene.variables.SHORT_NAMES`."""

_SPEED = 5000.0 * 2.0 * math.pi / 60.0  # rad/s


def own_names(scene: Scene) -> dict[str, str]:
    """The study's own name of each of the paper's variables that it varies."""
    symbol_of = {SHORT_NAMES[symbol]: symbol for symbol in SYMBOLS}
    return {
        symbol_of[variable.paths]: variable.name
        for variable in scene.required_study.variables
        if variable.paths in symbol_of
    }


def is_the_papers(scene: Scene) -> bool:
    """Whether what the paper prints and claims says something of this scene and its study."""
    return (
        scene.references == TITLE
        and scene.clearance_joints() == JOINTS
        and scene.drive.kind == "constant-speed"
        and math.isclose(scene.number("drive.speed"), _SPEED, rel_tol=1e-9)
        and scene.objective.words == MEAN_GAP.words
        and all(case.plain for case in scene.required_study.cases)
        and {"m2", "m3", "u2", "I2", "C"} <= own_names(scene).keys()
    )
