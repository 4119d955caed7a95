"""Commands as functions of a script or notebook: in this process, a dataset for what they would write."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, cast

from hpcclear.ensemble.bifurcation import Observation, run_bifurcation
from hpcclear.ensemble.maps import number_of, run_map
from hpcclear.ensemble.session import Finished, Options
from hpcclear.ensemble.wear import run_wear
from hpcclear.ranks.boundary import alone
from hpcclear.ranks.team import Ranks
from hpcclear.ranks.terminal import Style
from hpcclear.results.grids import grid
from hpcclear.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


def in_process(
    run: Callable[[Path, Ranks, Options], Finished], output: str | Path | None, progress: str
) -> xr.Dataset:
    """What a command writes, carried out in this process: `run` gets the place, this process, and options. Where the file is
    not wanted, its place is a folder that is removed."""
    options = Options(style=cast(Style, progress))
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "result.nc" if output is None else Path(output)
        return run(place, alone(), options).content.to_xarray()


def map(
    scene: Scene, x: str, y: str | None = None, *, output: str | Path | None = None, progress: str = "auto"
) -> xr.Dataset:  # fmt: skip
    """Map periodic and chaotic motion over one or two entries of a scene.

    Parameters
    ----------
    scene : Scene
    x, y : str
        ``"PATH=LO:HI:N"``, such as ``"C=0.1mm:1mm:40"``; bounds in SI or with a unit.
    output : path, optional
        NetCDF file to keep; the same call finds it finished, or resumes.
    progress : {"auto", "bar", "log", "quiet"}

    Returns
    -------
    xarray.Dataset
        With the entries as coordinates: ``lyapunov_exponent`` (largest, per revolution), ``period``, ``regime``,
        and f with the half-width of its 95 % confidence interval.

    Raises
    ------
    InputError
        An axis is none, or a cell makes no mechanism.
    """
    axes = (x,) if y is None else (x, y)
    return grid(in_process(lambda *how: run_map(scene, axes, *how), output, progress))


def bifurcation(
    scene: Scene,
    x: str,
    *,
    observe: str = "objective",
    section: float | str = 0.0,
    transient: int = 60,
    revolutions: int = 60,
    output: str | Path | None = None,
    progress: str = "auto",
) -> xr.Dataset:
    """Observe one value of each revolution over a range of an entry of a scene.

    Parameters
    ----------
    scene : Scene
    x : str
        ``"PATH=LO:HI:N"``.
    observe : str
        ``"objective"`` (the mean gap of each revolution), or a series of a response such as ``"slider_velocity"``, taken at
        `section`; with ``"max "``, ``"min "`` or ``"mean "`` before it, of each revolution.
    section : float or str
        Crank angle, rad or with a unit.
    transient, revolutions : int
        How many revolutions are left out and observed.
    output, progress
        As in `map`.

    Returns
    -------
    xarray.Dataset
        ``observed`` over the values of the entry and the revolutions, NaN where a simulation failed.

    Raises
    ------
    InputError
        The axis is none, a value makes no mechanism, or responses have no such series.
    """
    angle = number_of("section", str(section), "rad")
    seen = Observation(observe, angle, transient, revolutions)
    run = partial(run_bifurcation, scene, x, observation=seen)
    return in_process(lambda place, ranks, how: run(place, ranks, options=how), output, progress)


def wear(scene: Scene, *, output: str | Path | None = None, progress: str = "auto") -> xr.Dataset:
    """Simulate wear over the service life of many mechanisms with random inputs.

    Parameters
    ----------
    scene : Scene
        With ``[wear]`` and a worn joint.
    output, progress
        As in `map`.

    Returns
    -------
    xarray.Dataset
        Kind ``wear``: clearance, f and peak force against revolutions of each service life, and the survival fraction.

    Raises
    ------
    InputError
        Nothing wears in the scene.
    """
    return in_process(lambda *how: run_wear(scene, *how), output, progress)
