"""What an oil film carries by each model, and how a rotor in it settles or whirls: the picture in docs/how-to/oil-film.md.

    python analysis/oil_film.py                      # writes docs/images/oil_film.png

Left: load over mu omega R L^3/c^2 against eccentricity, of a bearing as long as its diameter whose journal turns steadily.
Right: the place of a rigid rotor's journal, from the middle on, below and beyond the limit of its short bearing.
"""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from hpcclear import load_scene, simulate
from hpcclear.laws.film import finite, long, short

IMAGE = Path(__file__).parent.parent / "docs" / "images" / "oil_film.png"
RATIO = 1.0  # length over diameter
MASS, LOAD, CLEARANCE = 5.0, 120.0, 1e-4
SPEEDS = {"900 rad/s": 900.0, "1500 rad/s": 1500.0}  # the limit is 1276
STEEL = {"youngs_modulus": 2.06e11, "poisson_ratio": 0.3}


def loads(eccentricity: float) -> dict[str, float]:
    """Load by each model, of a journal that turns at 1 rad/s: w across the eccentricity."""
    place, w = (eccentricity, 0.0), (0.0, -0.5 * eccentricity)
    s2 = 1.0 - eccentricity**2
    solved = finite.forces(eccentricity, RATIO, np.array([-0.5 * np.pi]))[0] * 0.5 * eccentricity
    return {
        "short": float(np.hypot(*short.force((), 0, 1.0, place, w, s2, 0, 1))),
        "long": float(np.hypot(*long.force((), 0, 3.0 / RATIO**2, place, w, s2, 0, 1))),
        "finite": float(np.hypot(*solved)),
    }


def orbit(speed: float) -> np.ndarray:
    """Places of the journal over the clearance, shape (2, instants), over 30 turns from the middle of the bearing."""
    bearing = {
        "kind": "clearance",
        "journal": "rotor.middle",
        "bearing": "ground.o",
        "clearance": CLEARANCE,
        "bearing_radius": "20 mm",
        "materials": {"bearing": STEEL, "journal": STEEL},
        "film": {"viscosity": "20 mPa*s", "length": "20 mm", "model": "short"},
    }
    mechanism = {
        "kind": "planar",
        "bodies": {"rotor": {"mass": MASS, "inertia": 1e-3, "points": {"middle": [0.0, 0.0]}}},
        "joints": {"bearing": bearing},
        "drives": {"motor": {"kind": "constant-speed", "body": "rotor", "speed": speed}},
    }
    effects = {"gravity": LOAD / MASS, "contact": {"law": "hunt-crossley", "damping": 0.4}}
    scene = load_scene(
        {
            "format_version": 1,
            "mechanism": mechanism,
            "effects": effects,
            "numerics": {"transient_revolutions": 0, "averaged_revolutions": 30},
            "output": {"instants_per_revolution": 60},
        }
    )
    response = simulate(scene)
    return (
        np.array([response[f"eccentricity_{axis}"].to_numpy()[:, 0] for axis in "xy"]) / CLEARANCE
    )


def draw(output: Path) -> None:
    """Both panels."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0))
    eccentricities = np.linspace(0.02, 0.95, 60)
    found = [loads(float(e)) for e in eccentricities]
    for model in ("short", "finite", "long"):
        left.semilogy(eccentricities, [row[model] for row in found], label=model)
    left.set(xlabel="eccentricity / clearance", ylabel="load / (mu omega R L$^3$/c$^2$)")
    left.legend(title="length = diameter")
    around = np.linspace(0.0, 2.0 * np.pi, 200)
    right.plot(np.cos(around), np.sin(around), color="0.6", lw=0.8)
    for name, speed in SPEEDS.items():
        right.plot(*orbit(speed), lw=0.8, label=name)
    right.set(xlabel="x / clearance", ylabel="y / clearance", aspect="equal")
    right.legend(title="limit: 1276 rad/s", loc="upper right", fontsize="small")
    figure.tight_layout()
    figure.savefig(output, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=IMAGE)
    draw(parser.parse_args().output)
