"""Write a mechanism in Python instead of a file: a four-bar whose coupler has clearance, for three coupler lengths.

python examples/scene_from_python.py
"""

import hpcclear

STEEL = {"youngs_modulus": "206 GPa", "poisson_ratio": 0.3}
BRONZE = {"youngs_modulus": "110 GPa", "poisson_ratio": 0.34}


def four_bar(coupler: float) -> dict:
    """Return the scene as nested tables, as a TOML file would have them; `coupler`: length in mm."""
    pin = {
        "kind": "clearance",
        "clearance": "0.1 mm",
        "bearing_radius": "10 mm",
        "materials": {"bearing": BRONZE, "journal": STEEL},
    }
    bar = {"mass": "250 g", "inertia": 2e-4}
    return {
        "format_version": 1,
        "mechanism": {
            "kind": "planar",
            "ground": {"points": {"o": [0.0, 0.0], "p": ["130 mm", 0.0]}},
            "bodies": {
                "crank": {"length": "40 mm", **bar, "start_angle": "25 deg"},
                "coupler": {"length": f"{coupler} mm", **bar, "start_angle": "40 deg"},
                "rocker": {"length": "80 mm", **bar, "start_angle": "90 deg"},
            },
            "joints": {
                "o1": {"kind": "revolute", "journal": "crank.a", "bearing": "ground.o"},
                "o2": {**pin, "journal": "crank.b", "bearing": "coupler.a"},
                "o3": {**pin, "journal": "coupler.b", "bearing": "rocker.b"},
                "o4": {"kind": "revolute", "journal": "rocker.a", "bearing": "ground.p"},
            },
            "drives": {"motor": {"kind": "constant-speed", "body": "crank", "speed": "600 rpm"}},
        },
        "effects": {
            "gravity": 9.81,
            "contact": {"law": "hunt-crossley", "damping": 0.4},
            "friction": {"law": "coulomb", "coefficient": 0.05, "ramp_speed": "10 mm/s"},
        },
        "numerics": {"transient_revolutions": 3, "averaged_revolutions": 2},
    }


def main() -> None:
    for coupler in (115, 120, 125):
        scene = hpcclear.load_scene(four_bar(coupler))
        response = hpcclear.simulate(scene)
        forces = ", ".join(
            f"{joint} {float(force):.0f} N"
            for joint, force in zip(
                response.joint.values, response.peak_contact_force.values, strict=True
            )
        )
        print(f"coupler {coupler} mm: peak forces {forces}")


if __name__ == "__main__":
    main()
