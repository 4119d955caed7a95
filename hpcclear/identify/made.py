"""A made measurement: a simulated response, sampled and with noise, as a table that `identify` reads."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import make_interp_spline

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.response import simulated
from hpcclear.identify.signals import revolutions_of
from hpcclear.identify.training import prepared_scene
from hpcclear.results.content import Results
from hpcclear.results.signals import signal
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of

if TYPE_CHECKING:
    import xarray as xr


def write_made(
    scene: Scene, path: str | Path, names: Sequence[str], *, noise: float, revolutions: int = 30,
    samples: int = 512, seed: int = 0, response: xr.Dataset | Results | None = None,
) -> None:  # fmt: skip
    """Simulate a scene and write what a sensor would record over the crank angle, after the transient, as a CSV table.

    `noise`: standard deviation of white noise in each sample, over the RMS of the signal about its mean; counts have none.
    `samples`: of each revolution. `response`: of the scene, with one revolution more than is written, in place of a
    simulation. Raises InputError: the simulation fails.
    """
    if response is None:
        longer = {"numerics.averaged_revolutions": revolutions + 1}
        found = simulated(prepared_scene(scene).with_(longer), checked=False)
    else:
        found = Results.of(response)
    status = Status(int(found["status"]))
    if not status.valid:
        raise InputError("scene", status.name.lower(), status.message, status.remedy)
    cycle = turns_of(scene.linkage)
    turns = revolutions_of(scene, found)
    first = np.ceil(turns[0] + float(found.attrs["transient_turns"]) / cycle - 1e-6)
    places = first + np.arange(revolutions * samples + 1) / samples
    rng = np.random.default_rng([seed, 0x6D6164])
    sense = -1.0 if found["crank_angle"][-1] < found["crank_angle"][0] else 1.0
    columns = [sense * 360.0 * cycle * places]
    headings = ["crank_angle [deg]"]
    for name in names:
        one = signal(found, name, "signal")
        if one.counted:  # whole events since the sample before, which have no noise
            count = np.round(np.interp(places, turns, np.cumsum(one.values)))
            columns.append(np.diff(count, prepend=count[0]))
        else:
            sampled = make_interp_spline(turns, one.values, k=3)(places)
            columns.append(sampled + noise * sampled.std() * rng.standard_normal(len(places)))
        headings.append(name if one.unit == "1" else f"{name} [{one.unit}]")
    np.savetxt(
        path, np.column_stack(columns), "%.9g", ",", header=",".join(headings), comments="", encoding="utf-8"
    )  # fmt: skip
