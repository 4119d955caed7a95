"""An engine that is nobody's but its user's: plays of 30 and 15 um, own names, no number of a publication."""

from hpcclear.scene import Scene, load_scene

JOINT = {
    "kind": "clearance",
    "bearing": {"youngs_modulus": "110 GPa", "poisson_ratio": 0.34},
    "journal": {"youngs_modulus": "210 GPa", "poisson_ratio": 0.3},
}
CONTENT = {
    "mechanism": {
        "kind": "slider-crank",
        "crank": {"length": 0.04, "mass": 1.1, "inertia": 1.2e-3, "mass_center": 0.01},
        "rod": {"length": 0.14, "mass": 0.45, "inertia": 1.1e-3, "mass_center": 0.045},
        "slider": {"mass": 0.4},
    },
    "drive": {"kind": "constant-speed", "speed": "3000 rpm"},
    "joints": {
        "crank_rod": {**JOINT, "clearance": "30 um", "bearing_radius": "24 mm"},
        "rod_slider": {**JOINT, "clearance": "15 um", "bearing_radius": "11 mm"},
    },
    "effects": {
        "contact": {"law": "lankarani-nikravesh", "restitution": 0.8},
        "slider_load": [["0 deg", -9000.0], ["40 deg", -3000.0], ["180 deg", -200.0]],
    },
    "numerics": {"transient_revolutions": 1, "averaged_revolutions": 1},
}
STUDY = {
    "seed": 4,
    "samples": 30,
    "test_samples": 12,
    "variables": {
        "piston": {"path": "mechanism.slider.mass", "range": [0.3, 0.6]},
        "shank": {"path": "mechanism.rod.mass", "range": [0.35, 0.6]},
        "m1": {"path": "mechanism.rod.mass_center", "range": [0.02, 0.09]},
        "play": {"path": "joints.crank_rod.clearance", "range": ["20 um", "60 um"]},
    },
    "random": {
        "play": {"distribution": "uniform", "range": ["20 um", "60 um"]},
        "piston": {"distribution": "uniform", "half_width": 0.01},
    },
    "cases": {"worn": ["play"], "made": ["play", "piston"]},
    "sensitivity": {"groups": []},
    "surrogate": {"r2": 0.5, "restarts": 0, "cuts": 0},
    "swarm": {"particles": 16, "iterations": 10, "runs": 2, "archive": 12},
    "verification": {
        "samples": 100,
        "designs": 2,
        "infill_rounds": 0,
        "response_windows": 2,
        "response_revolutions": 1,
    },
}


def engine(*overrides: str, study: bool = True) -> Scene:
    """The engine, with a study of four variables by names of its own; one, m1, means something else than the paper's."""
    return load_scene({**CONTENT, **({"study": STUDY} if study else {})}, overrides)
