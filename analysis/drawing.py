"""What several of these programs draw, or ask, alike."""

import argparse
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hpcclear import report
from hpcclear.base.errors import InputError
from hpcclear.results.rows import Columns


def figure_options(words: str, name: str, what: str) -> argparse.Namespace:
    """What is drawn, named `name` and described by `what`, and where figures go in which format."""
    parser = argparse.ArgumentParser(description=words.splitlines()[0])
    parser.add_argument(name, type=Path, help=what)
    parser.add_argument("-o", "--output", type=Path, default=Path("figures"), help="directory")
    parser.add_argument("--format", choices=["png", "svg", "pdf"], default="png")
    return parser.parse_args()


def save_figures(figures: Mapping[str, Callable[[], Figure]], options: argparse.Namespace) -> None:
    """Draw and write each; one whose data are not there is said."""
    options.output.mkdir(parents=True, exist_ok=True)
    for name, draw in figures.items():
        try:
            print(report.save(draw(), options.output / f"{name}.{options.format}"))
        except InputError as error:
            print(f"no {name}: {error}")


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


def described(values: Mapping[str, np.ndarray], rows: Columns) -> dict[str, xr.Variable]:
    """Variables with the dimensions, units and long names of `rows`; each value has the shape that these ask for."""
    return {
        name: xr.Variable(
            rows[name].dims, array, {"long_name": rows[name].long_name, "units": rows[name].units}
        )
        for name, array in values.items()
    }
