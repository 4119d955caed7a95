"""A rigid rotor in one bearing: scenes, where it stands, and when it whirls by the coefficients that books print."""

import math

import numpy as np
from planar_scenes import planar_scene
from scipy.optimize import brentq

from hpcclear.scene import Scene

MASS, RADIUS, LENGTH, CLEARANCE, VISCOSITY = 5.0, 0.02, 0.02, 1e-4, 0.02
STEEL = {"youngs_modulus": 2.06e11, "poisson_ratio": 0.3}


def rotor(
    speed: float, load: float, turns: int, *, model="short", start=(0.0, 0.0), **film
) -> Scene:
    """The scene: a rotor that turns at `speed`, pulled down by `load`, N."""
    bearing = {
        "kind": "clearance",
        "journal": "rotor.center_of_journal",
        "bearing": "ground.o",
        "clearance": CLEARANCE,
        "bearing_radius": RADIUS,
        "materials": {"bearing": STEEL, "journal": STEEL},
        "start_eccentricity": [part * CLEARANCE for part in start],
        "film": {"viscosity": VISCOSITY, "length": LENGTH, "model": model, **film},
    }
    body = {"mass": MASS, "inertia": 1e-3, "points": {"center_of_journal": [0.0, 0.0]}}
    motor = {"kind": "constant-speed", "body": "rotor", "speed": speed}
    numerics = {"rtol": 1e-8, "transient_revolutions": 0, "averaged_revolutions": turns}
    return planar_scene(
        {"rotor": body}, {"bearing": bearing}, {"motor": motor},
        effects={"gravity": load / MASS, "contact": {"law": "hunt-crossley", "damping": 0.4}},
        numerics={**numerics, "energy": True},
        output={"instants_per_revolution": 32},
    )  # fmt: skip


def loads(model: str, e: float) -> tuple[float, float]:
    """Towards the thinnest film and across, N over speed: as books have them, of half a film."""
    if model == "short":
        scale = VISCOSITY * RADIUS * LENGTH**3 / CLEARANCE**2
        return scale * e**2 / (1 - e**2) ** 2, scale * math.pi * e / (4 * (1 - e**2) ** 1.5)
    scale = 6 * VISCOSITY * LENGTH * RADIUS**3 / CLEARANCE**2 / (2 + e**2)
    return scale * 2 * e**2 / (1 - e**2), scale * math.pi * e / math.sqrt(1 - e**2)


def equilibrium(model: str, speed: float, load: float) -> np.ndarray:
    """Place of the journal over the clearance under a load in -y, turning counter-clockwise."""
    e = brentq(lambda e: math.hypot(*loads(model, e)) * speed - load, 1e-9, 0.99, xtol=1e-14)
    radial, across = loads(model, e)
    attitude = math.atan2(across, radial)
    return e * np.array([math.sin(attitude), -math.cos(attitude)])


def printed_coefficients(e: float) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness c K/f and damping c omega C/f of a short bearing (Friswell et al. 2010, Dynamics of Rotating Machines, 5.5).

    Axes: across a load in -y, and along y, of a journal that turns counter-clockwise.
    """
    p = math.pi**2
    root = math.sqrt(1 - e**2)
    h = (p * (1 - e**2) + 16 * e**2) ** -1.5
    uu = 4 * (p * (2 - e**2) + 16 * e**2)
    uv = math.pi * (p * (1 - e**2) ** 2 - 16 * e**4) / (e * root)
    vu = -math.pi * (p * (1 - e**2) * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2)) / (e * root)
    vv = 4 * (p * (1 + 2 * e**2) + 32 * e**2 * (1 + e**2) / (1 - e**2))
    c_uu = 2 * math.pi * root * (p * (1 + 2 * e**2) - 16 * e**2) / e
    c_uv = -8 * (p * (1 + 2 * e**2) - 16 * e**2)
    c_vv = 2 * math.pi * (p * (1 - e**2) ** 2 + 48 * e**2) / (e * root)
    return h * np.array([[uu, uv], [vu, vv]]), h * np.array([[c_uu, c_uv], [c_uv, c_vv]])


def growth(speed: float, load: float) -> float:
    """Largest real part of the eigenvalues of small motions of the rotor in a short bearing, 1/s."""
    e = float(np.hypot(*equilibrium("short", speed, load)))
    k, c = printed_coefficients(e)
    k, c = load / CLEARANCE * k, load / CLEARANCE / speed * c
    matrix = np.block([[np.zeros((2, 2)), np.eye(2)], [-k / MASS, -c / MASS]])
    return float(np.linalg.eigvals(matrix).real.max())


def whirl_speed(load: float) -> float:
    """Speed beyond which it whirls, rad/s."""
    return brentq(lambda speed: growth(speed, load), 50.0, 5000.0, xtol=1e-9)
