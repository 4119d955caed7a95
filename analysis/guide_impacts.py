"""How the first impacts of a loose slider converge to those of rigid bodies: the table and the figure of the page on guides.

    python analysis/guide_impacts.py

Ten separate impacts of `jobs/loose_slider.toml` with the inertia of a solid block, a restitution of 0.7 and a tilt of 10 mrad,
at four stiffnesses, against the rigid slider of the tests. Writes `analysis/results/guide_impacts.csv` and
`docs/images/guide_impacts.png`; ten seconds of processor time.
"""

import math
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from recorded import record
from scipy.optimize import brentq

from hpcclear import load_scene, simulate
from hpcclear.report.figures import guides

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))
import rigid_slider as rigid  # noqa: E402

FIGURE = ROOT / "docs" / "images" / "guide_impacts.png"
FACTORS = (1.0, 10.0, 100.0, 1000.0)
INERTIA = rigid.SLIDER * (4 * rigid.HALF_LENGTH**2 + 4 * rigid.HALF_HEIGHT**2) / 12
TILT, NOMINAL, COUNT = 1e-2, 0.7, 10


def restitution():
    """What Gonthier's damping of the nominal one gives exactly."""
    a = (1 - NOMINAL**2) / NOMINAL
    return brentq(lambda e: a * (1 + e) - math.log((1 + a) / (1 - a * e)), 1e-3, (1 - 1e-12) / a)


def errors():
    """Errors of crank angles, rad, (factors, impacts), and the corners."""
    rigid.RESTITUTION, rigid.TURNING = restitution(), INERTIA
    expected = rigid.impacts(COUNT, 1e-4, tilt=TILT)
    scene = load_scene(ROOT / "jobs" / "loose_slider.toml").with_(
        {
            "numerics.averaged_revolutions": 1, "numerics.rtol": 1e-10,
            "effects.contact.restitution": NOMINAL, "mechanism.slider.inertia": INERTIA,
            "joints.guide.start_tilt": TILT,
        }
    )  # fmt: skip
    found = []
    for factor in FACTORS:
        seen = guides.touches(simulate(scene.with_({"effects.contact.force_at": factor * 20e3})))
        assert [one.contact.removeprefix("guide.") for one in seen[:COUNT]] == [
            one.corner for one in expected
        ]
        angles = [one.turn * 2 * math.pi for one in seen[:COUNT]]
        found.append(np.abs(np.array(angles) - [one.crank for one in expected]))
    return np.array(found), expected


def main():
    """Write the table and the figure."""
    late, expected = errors()
    heading = [f"error at {factor:g} times the stiffness (rad)" for factor in FACTORS]
    rows = [["impact", "corner", "crank angle of rigid bodies (rad)", *heading]]
    for k, one in enumerate(expected):
        shown = [f"{error:.1e}" if error > 1e-9 else "below 1e-9" for error in late[:, k]]
        rows.append([f"{k + 1}", one.corner, f"{one.crank:.6f}", *shown])
    record("guide_impacts", rows)
    figure, axes = plt.subplots(figsize=(6, 4))
    for k in range(1, COUNT):
        axes.loglog(
            FACTORS, late[:, k], "o-", markersize=3, linewidth=0.8, color=plt.cm.viridis(k / COUNT)
        )
    first = late[0, 1:].max()
    axes.loglog(FACTORS, 2.0 * first * np.array(FACTORS) ** -0.4, "k--", label="slope -0.4")
    axes.set_xlabel("stiffness over that of the example")
    axes.set_ylabel("error of the crank angle of impacts 2 to 10 (rad)")
    axes.legend()
    figure.tight_layout()
    figure.savefig(FIGURE, dpi=120)


if __name__ == "__main__":
    main()
