"""Identify the clearance of a machine from a measured torque; the measurement is made here, so that the truth is known.

python examples/clearance_from_a_signal.py
"""

import tempfile
from pathlib import Path

import hpcclear
from hpcclear.identify.made import write_made

JOBS = Path(__file__).resolve().parent.parent / "jobs"
TRUTH = 42e-6  # m


def main() -> None:
    scene = hpcclear.load_scene(JOBS / "identify.toml")
    # The machine: another clearance, a heavier slider, more friction, and a sensor with 10 % noise.
    machine = scene.with_(
        {
            "joints.crank_rod.clearance": TRUTH,
            "mechanism.slider.mass": 0.1405,
            "effects.friction.coefficient": 0.06,
        }
    )
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "measured.csv"
        write_made(machine, table, ["crank_moment"], noise=0.1)
        found = hpcclear.identify(
            scene, "joints.crank_rod.clearance=10um:150um", table,
            members=64,  # four times as many by default
            progress="quiet",
        )  # fmt: skip
    low, middle, high = 1e6 * found["interval"].values[0, 0]
    print(f"made with {1e6 * TRUTH:.0f} um")
    print(f"identified: {middle:.0f} um, 95 % interval {low:.0f} to {high:.0f} um")
    print(f"the model explains the signal: {bool(found['explained'][0])}")


if __name__ == "__main__":
    main()
