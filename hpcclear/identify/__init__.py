"""Unknown clearances of a machine from a measured signal: posterior distribution, model check, what to measure."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from hpcclear.ensemble.functions import in_process
from hpcclear.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["identify"]


def identify(
    scene: Scene,
    unknown: str | Sequence[str],
    signal: str | Path | Sequence[str | Path] = (),
    *,
    output: str | Path | None = None,
    progress: str = "auto",
    **settings: Any,
) -> xr.Dataset:
    """Identify unknown clearances, or other entries of a scene, from measured signals.

    Parameters
    ----------
    scene : Scene
        The random inputs of its study are what else is not known: masses, friction, restitution, load.
    unknown : str or sequence of str
        ``"PATH=LO:HI"``, such as ``"joints.crank_rod.clearance=10um:150um"``; uniform within the bounds beforehand.
    signal : path or sequence of path
        A table for each date, with time or crank angle first.
    output : path, optional
        NetCDF file to keep; the same call finds it finished, or resumes.
    progress : {"auto", "bar", "log", "quiet"}
    **settings
        `of`, `noise`, `band`, `advise` and others: see `hpcclear.identify.settings.Settings`.

    Returns
    -------
    xarray.Dataset
        Kind ``identify``: ``interval`` (calibrated 95 % interval and median), ``posterior``, ``explained``, features.

    Raises
    ------
    InputError
        An unknown, signal or table is not what it should be.
    """
    from hpcclear.identify.answer import run_identify
    from hpcclear.identify.settings import Settings

    made = Settings(unknown, signal, **settings)
    return in_process(
        lambda place, ranks, options: run_identify(scene, place, ranks, made, options), output, progress
    )  # fmt: skip


class _Identify(ModuleType):
    """This package, which can be called: ``hpcclear.identify(scene, unknown, signal)`` stands beside ``hpcclear.map``."""

    __call__ = staticmethod(identify)
    # Python before 3.13 would leave out the first parameter
    __signature__ = signature(identify)


sys.modules[__name__].__class__ = _Identify
