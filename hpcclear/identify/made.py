"""A made measurement: a simulated response, sampled and with noise, as a table that `identify` reads."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.interpolate import make_interp_spline

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.dynamics.response import simulate
from hpcclear.identify.signals import IMPACTS, revolutions_of, series_of, unit_of
from hpcclear.identify.training import prepared_scene
from hpcclear.scene import Scene
from hpcclear.scene.planar import turns_of


def write_made(
    scene: Scene, path: str | Path, names: Sequence[str], *, noise: float, revolutions: int = 30,
    samples: int = 512, seed: int = 0, response: xr.Dataset | None = None,
) -> None:  # fmt: skip
    """Simulate a scene and write what a sensor would record over the crank angle, after the transient.

    Parameters
    ----------
    scene : Scene
        The machine.
    path : path
        CSV table to write.
    names : sequence of str
        Signals.
    noise : float
        Standard deviation of white noise in each sample, over the RMS of the signal about its mean; counts have none.
    revolutions, samples : int
        Revolutions of the drive, and samples of each.
    seed : int
    response : xarray.Dataset, optional
        Of the scene, with one revolution more than is written; by default it is simulated here.

    Raises
    ------
    InputError
        The simulation fails.
    """
    if response is None:
        longer = {"numerics.averaged_revolutions": revolutions + 1}
        response = simulate(prepared_scene(scene).with_(longer), checked=False)
    status = Status(int(response["status"]))
    if not status.valid:
        raise InputError("scene", status.name.lower(), status.message, status.remedy)
    cycle = turns_of(scene.linkage)
    turns = revolutions_of(scene, response)
    first = np.ceil(turns[0] + float(response.attrs["transient_turns"]) / cycle - 1e-6)
    places = first + np.arange(revolutions * samples + 1) / samples
    rng = np.random.default_rng([seed, 0x6D6164])
    columns = [360.0 * cycle * places]
    headings = ["crank_angle [deg]"]
    clockwise = response["crank_angle"][-1] < response["crank_angle"][0]
    columns[0] = -columns[0] if clockwise else columns[0]
    for name in names:
        values = series_of(response, name)
        if name.startswith(IMPACTS):  # whole events since the sample before, which have no noise
            count = np.round(np.interp(places, turns, np.cumsum(values)))
            columns.append(np.diff(count, prepend=count[0]))
        else:
            sampled = make_interp_spline(turns, values, k=3)(places)
            columns.append(sampled + noise * sampled.std() * rng.standard_normal(len(places)))
        unit = unit_of(response, name)
        headings.append(name if unit == "1" else f"{name} [{unit}]")
    _write(Path(path), headings, columns)


def _write(path: Path, headings: Sequence[str], columns: Sequence[Array]) -> None:
    rows = "\n".join(
        ",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)
    )
    path.write_text(f"{','.join(headings)}\n{rows}\n", encoding="utf-8")
