"""Rows of parallelograms (IFToMM's benchmark A02): twice a turn all loops fold flat, where multipliers are not determined.

A free linkage does not get through with certainty: what comes out is a status, or a motion that keeps its energy within the
benchmark's 0.1 J; never a motion that does not, under status ok.
"""

import numpy as np
import pytest

from hpcclear import simulate
from hpcclear.base.outcome import Status
from hpcclear.scene import Scene
from hpcclear.scene.validation import validated

KEPT = 0.1
"""J, what the benchmark allows energy to drift by."""


def windows(count, rtol, feedback):
    """Bars of 1 m and 1 kg, standing, pushed at 1 m/s; a torque drive of nought."""
    bar = {"length": 1.0, "mass": 1.0, "inertia": 1 / 12}
    bodies = {f"up{k}": {**bar, "start_angle": np.pi / 2} for k in range(count + 1)}
    bodies |= {f"top{k}": bar for k in range(count)}
    pins = {f"foot{k}": (f"up{k}.a", f"ground.g{k}") for k in range(count + 1)}
    pins |= {f"left{k}": (f"top{k}.a", f"up{k}.b") for k in range(count)}
    pins |= {f"right{k}": (f"top{k}.b", f"up{k + 1}.b") for k in range(count)}
    free = {"kind": "torque", "body": "up0", "torque": 0.0, "initial_speed": 1.0}
    mechanism = {
        "kind": "planar",
        "bodies": bodies,
        "joints": {
            name: {"kind": "revolute", "journal": journal, "bearing": bearing}
            for name, (journal, bearing) in pins.items()
        },
        "ground": {"points": {f"g{k}": [float(k), 0.0] for k in range(count + 1)}},
        "drives": {"free": free},
    }
    numerics = {
        "rtol": rtol,
        "alpha": feedback,
        "beta": feedback,
        "transient_revolutions": 0,
        "averaged_revolutions": 8,
    }
    content = {"format_version": 2, "mechanism": mechanism, "numerics": numerics}
    return validated(Scene, {**content, "effects": {"gravity": 9.81}})


@pytest.mark.parametrize("count", [1, pytest.param(2, marks=pytest.mark.full)])
def test_flat_loops_are_passed_with_their_energy_or_told(count):
    for rtol in (1e-6, 1e-8, 1e-10):
        for feedback in (0.0, 250.0):
            response = simulate(windows(count, rtol, feedback))
            status = Status(int(response["status"]))
            drift = float(np.nanmax(np.abs(response["energy_residual"].to_numpy())))
            assert drift < KEPT or status is not Status.OK
    # before the loops fold for the first time, half a second in, nothing is in doubt
    short = windows(count, 1e-10, 0.0).with_({"output.instants_per_revolution": 1000})
    response = simulate(short)
    early = response["time"].to_numpy() < 0.5
    assert np.abs(response["energy_residual"].to_numpy()[early]).max() < 1e-6
