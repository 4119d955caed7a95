"""What a script or notebook calls to identify a machine, in this process."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from hpcclear.ensemble.functions import in_process
from hpcclear.scene import Scene

if TYPE_CHECKING:
    from hpcclear.identify.signals import Sensor


def identify(
    scene: Scene,
    unknown: str | Sequence[str],
    signal: str | Path | Sequence[str | Path] = (),
    *,
    of: str | Sequence[str] = "crank_moment",
    dates: Sequence[str] = (),
    limit: float | None = None,
    sensor: "Sensor | None" = None,
    noise: float | None = None,
    pressure: str = "",
    advise: bool = False,
    members: int | None = None,
    output: str | Path | None = None,
    progress: str = "auto",
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
    of : str or sequence of str
        Columns that are used together: series of a response, ``frame_force_x``, ``acceleration_x BODY.POINT`` or
        ``impacts JOINT``.
    dates : sequence of str
        ISO dates of the tables, for the rate of growth.
    limit : float, optional
        Of the unknowns, SI: the time until it is reached.
    sensor : Sensor, optional
        Band, mounting resonance and calibration errors; by default a perfect one.
    noise : float, optional
        Standard deviation of the sensor's noise in a sample over the RMS of the signal. With it, the scatter between
        revolutions is a feature.
    pressure : str
        ``"COLUMN=AREA"``: a measured pressure in the first table as a known load on the slider of a slider-crank.
    advise : bool
        Whether other signals are compared: expected half-widths by signal and number of revolutions.
    members : int, optional
        Simulations, a power of two; 256 for one unknown by default.
    output : path, optional
        NetCDF file to keep; the same call finds it finished, or resumes.
    progress : {"auto", "bar", "log", "quiet"}

    Returns
    -------
    xarray.Dataset
        Kind ``identify``: ``interval`` (calibrated 95 % interval and median), ``posterior``, ``explained``, features.

    Raises
    ------
    InputError
        An unknown, signal or table is not what it should be.
    """
    from hpcclear.identify.answer import Wanted, run_identify
    from hpcclear.identify.signals import Sensor

    def several(one: "str | Path | Sequence[str | Path]") -> list[str]:
        return [str(one)] if isinstance(one, str | Path) else [str(each) for each in one]

    wanted = Wanted(
        tuple(several(unknown)), tuple(map(Path, several(signal))), tuple(dict.fromkeys(several(of))), tuple(dates), limit,
        sensor or Sensor(), noise, pressure, advise, members,
    )  # fmt: skip
    return in_process(
        lambda place, ranks, options: run_identify(scene, place, ranks, wanted, options),
        output,
        progress,
    )
