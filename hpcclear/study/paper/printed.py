"""What the paper prints, its Table 4 and the claims that are tested (its sections 5 and 6), and whether a scene is the paper's.

Nothing in a scene file says so. A scene is the paper's when it holds what the paper studies: the mechanism of its Tables 1
and 2 (`hpcclear.scene.describing`) with both clearances, at 5000 rpm, and a study of the mean and the standard deviation of f,
the mean gap, over its design variables and the clearance. Names, sizes and further variables are free.
"""

import math
from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.objectives import MEAN_GAP
from hpcclear.base.outcome import JOINTS
from hpcclear.scene import Scene
from hpcclear.scene.describing import TITLE
from hpcclear.scene.named import SHORT_NAMES
from hpcclear.study.optimisation import Choice

SYMBOLS = ("m1", "u1", "I1", "m2", "u2", "I2", "m3", "C")
"""Of its Table 3; what each is of the mechanism: `hpcclear.scene.named.SHORT_NAMES`."""

_SPEED = 5000.0 * 2.0 * math.pi / 60.0  # rad/s


def own_names(scene: Scene) -> dict[str, str]:
    """The study's own name of each of the paper's variables that it varies."""
    symbol_of = {SHORT_NAMES[symbol]: symbol for symbol in SYMBOLS}
    known = [row for row in scene.required_study.variables if row.paths in symbol_of]
    return {symbol_of[row.paths]: row.name for row in known}


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


TABLE_4 = {
    ("case 1", "alpha"): ((0.105, 0.0715, 0.0451, 1.2432e-4), (1.7787e-4, 3.6658e-8)),
    ("case 1", "beta"): ((0.1811, 0.2232, 0.0382, 2.9562e-4), (3.4977e-4, 3.1934e-8)),
    ("case 2", "alpha"): ((0.1053, 0.07, 0.0118, 1.4054e-4), (1.8544e-4, 9.6491e-7)),
    ("case 2", "beta"): ((0.2128, 0.0734, 0.0031, 6.3581e-4), (2.6217e-4, 8.3406e-8)),
}
"""Values of `DESIGN`, and their printed mean and standard deviation of f (m)."""

DESIGN = ("m2", "m3", "u2", "I2")  # kg, kg, m, kg m2

CLAIMS = (
    "f grows with the clearance",
    "f grows with m2 and with m3",
    "f hardly moves with m1, u1 and I1",
    "f falls with u2 and grows with I2",
    "the order of the sensitivities does not change with the clearance",
    "the optimised designs cut the peaks of both contact forces and of the crank moment",
    "alpha has the lower average, beta the lower fluctuation of the responses",
    "the fit is global for m1, m2, m3, but for u1, u2, I1, I2 holds in shortened intervals only",
    "case 2 cuts peaks more than case 1: alpha but for the slider acceleration, beta including it",
    "case-2 beta has the larger mean and the smaller fluctuation of contact force 1 than alpha",
    "Kriging reaches R2 near 1 and an error near 0",
    "the size of the sensitivities varies with the clearance",
)


def case_names(scene: Scene) -> tuple[str | None, str | None]:
    """The study's cases that are the paper's case 1 (C alone is random) and case 2; None if none.

    Both have the paper's four design variables.
    """
    study, own = scene.required_study, own_names(scene)
    found: list[str | None] = [None, None]
    for case in study.cases:
        if set(study.design_variables(case.name)) != {own.get(symbol) for symbol in DESIGN}:
            continue
        absolute = all(study.random_input(name).absolute for name in case.random)
        found[0 if absolute else 1] = case.name
    return found[0], found[1]


def _table_4(scene: Scene) -> list[tuple[Choice, tuple[float, float]]]:
    """Designs and printed moments of Table 4, each in its case, as far as the study has the cases."""
    if not is_the_papers(scene):
        return []
    own = own_names(scene)
    cases = dict(zip(("case 1", "case 2"), case_names(scene), strict=True))
    found = []
    for (case, letter), (values, printed) in TABLE_4.items():
        name = cases[case]
        if name is not None:
            design = {own[symbol]: value for symbol, value in zip(DESIGN, values, strict=True)}
            chosen = Choice(f"{name} paper {letter}", name, design, origin="given")
            found.append((chosen, printed))
    return found


def printed_designs(scene: Scene) -> list[Choice]:
    """The designs of Table 4, each in its case; none if the scene is not the paper's."""
    return [choice for choice, _ in _table_4(scene)]


def printed_moments(scene: Scene, choices: Sequence[Choice]) -> dict[str, Array]:
    """``mean`` and ``deviation`` (m) of each design as printed, NaN for those that are not.

    Empty when none is printed.
    """
    known = {choice.name: printed for choice, printed in _table_4(scene)}
    if not known:
        return {}
    none = (np.nan, np.nan)
    table = np.array([known.get(choice.name, none) for choice in choices])
    return {"mean": table[:, 0], "deviation": table[:, 1]}
