"""Simulate one mechanism: peak force of each bearing, and where in the revolution it occurs.

python examples/one_response.py
"""

from pathlib import Path

import numpy as np

import hpcclear

JOBS = Path(__file__).resolve().parent.parent / "jobs"


def main() -> None:
    # A scene is a TOML file; overrides are written as on the command line.
    scene = hpcclear.load_scene(JOBS / "slider_crank.toml", ["numerics.averaged_revolutions=2"])
    response = hpcclear.simulate(scene)  # an xarray.Dataset

    period = 60.0 / 5000.0  # s; the transient takes five revolutions
    averaged = response.sel(time=slice(5 * period, None))
    for joint in response.joint.values:
        force = averaged.contact_force.sel(joint=joint)
        largest = force.isel(time=int(force.values.argmax()))
        angle = np.degrees(float(averaged.crank_angle.sel(time=largest.time))) % 360.0
        # the series has 720 instants a revolution; the peak between them is recorded too
        exact = float(response.peak_contact_force.sel(joint=joint))
        print(
            f"{joint}: peak {exact:.0f} N, largest stored {float(largest):.0f} N at {angle:.1f} deg"
        )

    print(f"f = {float(response.objective) * 1e6:.3f} um")


if __name__ == "__main__":
    main()
