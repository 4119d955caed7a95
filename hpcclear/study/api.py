"""What a script or notebook calls for effect screening, in this process."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hpcclear.ensemble.functions import in_process
from hpcclear.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


def effects(
    scene: Scene,
    tolerance: float = 0.01,
    *,
    samples: int | None = None,
    forces: bool = False,
    output: str | Path | None = None,
    progress: str = "auto",
) -> xr.Dataset:
    """Find effects that can be neglected: switch each off, and compare results and run time.

    Parameters
    ----------
    scene : Scene
    tolerance : float
        Largest relative change of the results that counts as negligible.
    samples : int, optional
        Largest number of samples of a variant. By default a twentieth of the study's simulations is spent.
    forces : bool
        Whether the tolerance applies to peak contact forces too.
    output : path, optional
        NetCDF file to keep; the same call finds it finished, or resumes.
    progress : {"auto", "bar", "log", "quiet"}

    Returns
    -------
    xarray.Dataset
        Kind ``effects``: change of each variant with its half-width, decision, and work. The attribute ``reduced_scene`` is the
        recommended scene as TOML.

    Raises
    ------
    InputError
        The scene has nothing that could be switched off.
    """
    from hpcclear.ensemble.effects import run_effects
    from hpcclear.ensemble.trial import Wanted
    from hpcclear.study.stages import certificate_extent

    wanted = Wanted(tolerance, *certificate_extent(scene, samples), forces)
    run = partial(run_effects, scene, wanted=wanted)
    return in_process(run, output, progress)
