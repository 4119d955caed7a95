"""Simulate many designs at once: peak force over clearance and speed.

    python examples/clearance_and_speed.py

All designs are integrated together in the lanes of the processor, so that a hundred cost far less than a hundred times one.
"""

from pathlib import Path

import numpy as np

import hpcclear

JOBS = Path(__file__).resolve().parent.parent / "jobs"


def main() -> None:
    scene = hpcclear.load_scene(JOBS / "slider_crank.toml")
    clearance = np.linspace(0.1e-3, 0.5e-3, 5)  # m
    speed = np.array([1000.0, 2000.0, 3000.0]) * 2.0 * np.pi / 60.0  # rad/s

    # "C" drives the clearance of both joints; any entry of the scene can be named by its path.
    grid = {
        "C": np.repeat(clearance, len(speed)),
        "drive.speed": np.tile(speed, len(clearance)),
    }
    designs = hpcclear.evaluate(scene, grid)

    force = designs.peak_contact_force.max("joint").values.reshape(len(clearance), len(speed))
    print("peak force of both joints, N")
    print("clearance, mm " + "".join(f"{v * 60 / (2 * np.pi):>8.0f} rpm" for v in speed))
    for c, row in zip(clearance, force, strict=True):
        print(f"{c * 1e3:13.1f} " + "".join(f"{f:12.0f}" for f in row))
    failed = int((designs.status != 0).sum())
    print(f"{designs.sizes['sample']} designs, {failed} failed")


if __name__ == "__main__":
    main()
