"""The published work that the numbers of a scene are taken from: its result files cite it.

A scene is recognised by its content, not by its name or place: the lengths and materials of the paper's Tables 1 and 2.
No study of the paper varies them. Masses, clearances, drive, effects and
numerics may differ.
"""

import math
from collections.abc import Mapping

from hpcclear.scene.tables import SceneTables

TITLE = (
    "Robust Optimization of Planar Constrained Mechanical System with Varying Joint Clearance "
    "Size Based on Sensitivity Analysis"
)

BIBTEX = f"""@article{{ShockVibration6079249,
  title   = {{{TITLE}}},
  journal = {{Shock and Vibration}},
  volume  = {{2020}},
  pages   = {{6079249}},
  year    = {{2020}},
  url     = {{https://www.hindawi.com/journals/sv/2020/6079249/}},
  note    = {{Add the authors from the journal's page}},
}}"""
"""The same work for BibTeX; the text used for this program does not name its authors."""

_LENGTHS = {"crank.length": 0.05, "rod.length": 0.12}  # m
_JOINT = {
    "bearing_radius": 0.02,  # m
    "bearing.youngs_modulus": 0.5e9,  # Pa
    "bearing.poisson_ratio": 0.38,
    "journal.youngs_modulus": 206.8e9,  # Pa
    "journal.poisson_ratio": 0.29,
}


def cited_by(scene: SceneTables) -> str:
    """Title of the work the mechanism of a scene is taken from, "" for one of its user's own."""
    numbers = {path: scene.number(path) for path in scene.numeric_paths()}
    return TITLE if _holds(numbers, scene.clearance_joints()) else ""


def _holds(numbers: Mapping[str, float], joints: tuple[str, ...]) -> bool:
    expected = {f"mechanism.{name}": value for name, value in _LENGTHS.items()}
    for joint in joints:
        expected |= {f"joints.{joint}.{name}": value for name, value in _JOINT.items()}
    return bool(joints) and all(
        math.isclose(numbers.get(path, math.nan), value, rel_tol=1e-9)
        for path, value in expected.items()
    )
