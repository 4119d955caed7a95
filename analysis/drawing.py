"""What several of these programs draw, or ask, alike."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hpcclear.results.rows import FileVariables


def by_code(runs: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Each code of a comparison, and what was measured of it."""
    for code in runs["code"].values:
        yield str(code), runs.sel(code=code)


def error_panels(
    runs: Mapping[str, xr.Dataset],
    width: float,
    height: float,
    curve: Callable[[Axes, int, str, xr.Dataset], object],
) -> tuple[Figure, list[Axes]]:
    """A panel for each title: time against the error of the slider's position, both logarithmic; `curve` draws a code's."""
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    size = (width * len(runs), height)
    figure, axes = plt.subplots(1, len(runs), figsize=size, sharey=True, squeeze=False)
    panels = list(axes[0])
    for panel, (title, data) in zip(panels, runs.items(), strict=True):
        panel.set(xscale="log", yscale="log", xlabel="error of the slider position, m")
        panel.set_title(title, fontsize=9)
        for k, (code, row) in enumerate(by_code(data)):
            curve(panel, k, code, row)
    return figure, panels


def described(values: Mapping[str, np.ndarray], rows: FileVariables) -> dict[str, xr.Variable]:
    """Variables with the dimensions, units and long names of `rows`; each value has the shape that these ask for."""
    return {
        name: xr.Variable(
            rows[name].dims, array, {"long_name": rows[name].long_name, "units": rows[name].units}
        )
        for name, array in values.items()
    }
