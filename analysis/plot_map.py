"""Draw a map: where the motion is regular and where chaotic; along a line also f of every revolution and a Poincare section.

python analysis/plot_map.py results/map.nc -o results/map.png
"""

import argparse
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

from hpcclear import grid
from hpcclear.dynamics.lanes import Lanes
from hpcclear.dynamics.parameters import parameters
from hpcclear.dynamics.problem import problem_of
from hpcclear.dynamics.revolutions import objective
from hpcclear.dynamics.start import start_states
from hpcclear.dynamics.steady.mapping import RTOL
from hpcclear.ensemble.api import as_points
from hpcclear.report.figures import labels
from hpcclear.scene import Scene
from hpcclear.scene.loading import scene_of_text

TRANSIENT, SHOWN = 60, 60
"""Revolutions left out and drawn, of each cell of a line."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("map", type=Path)
    parser.add_argument("-o", "--output", type=Path, default=Path("map.png"))
    options = parser.parse_args()
    with xr.open_dataset(options.map) as content:
        cells = grid(content.load())
    names = list(cells["objective"].dims)
    figure = plane(cells, names) if len(names) == 2 else line(cells, names[0])
    figure.savefig(options.output, dpi=150)
    print(options.output)


def plane(cells: xr.Dataset, names: list[str]) -> plt.Figure:
    """Exponent and period over two entries."""
    figure, axes = plt.subplots(1, 2, figsize=(12, 5), layout="constrained", sharey=True)
    most = float(np.nanquantile(np.abs(cells["kick_growth"]), 0.98))
    style = {"x": names[0], "y": names[1]}
    cells = cells.assign_coords({name: labelled(cells[name]) for name in names})
    cells["kick_growth"].plot(ax=axes[0], cmap="RdBu_r", vmin=-most, vmax=most, **style)
    axes[0].set_title("largest Lyapunov exponent per revolution")
    cells["period"].plot(ax=axes[1], levels=[0.5, 1.5, 2.5, 4.5, 8.5, 20.5], **style)
    axes[1].set_title("period (white: none found)")
    return figure


def labelled(one: xr.DataArray) -> xr.DataArray:
    """An entry's values in a readable unit, named by its path."""
    unit = labels.of(one)
    return (one * unit.factor).assign_attrs(long_name=labels.words(one), units=unit.unit)


def line(cells: xr.Dataset, name: str) -> plt.Figure:
    """Exponent and f along one entry, and f of every revolution of one motion at each cell."""
    figure, axes = plt.subplots(3, 1, figsize=(9, 11), layout="constrained", sharex=True)
    across = labelled(cells[name])
    x = across.to_numpy()
    growth, doubt = (cells[key].to_numpy() for key in ("kick_growth", "kick_growth_limit"))
    axes[0].errorbar(x, growth, doubt, fmt="o", markersize=3, linewidth=1)
    axes[0].axhline(0.0, color="grey", linewidth=0.8)
    axes[0].set_ylabel("largest Lyapunov exponent\nper revolution")
    f, limit = (cells[key].to_numpy() for key in ("objective", "objective_limit"))
    axes[1].errorbar(x, f, limit, fmt="o", markersize=3, linewidth=1)
    axes[1].set_ylabel("f with 95 % limits, m")
    scene = scene_of_text(str(cells.attrs["scene"]), "map")
    every = revolutions(scene, labels.words(cells[name]), cells[name].to_numpy())
    axes[2].plot(np.repeat(x, SHOWN), every.T.ravel(), "k.", markersize=1)
    axes[2].set_ylabel("f of each revolution, m")
    axes[2].set_xlabel(f"{across.attrs['long_name']} ({across.attrs['units']})")
    return figure


def revolutions(scene: Scene, path: str, values: np.ndarray) -> np.ndarray:
    """f of every revolution drawn, shape (SHOWN, cells), over an entry of the scene: a dotted path or a short name."""
    numerics = {
        "rtol": RTOL,
        "atol": None,
        "target_error": None,
        "transient_revolutions": 0,
        "averaged_revolutions": 1,
    }
    scene = scene.with_({f"numerics.{key}": value for key, value in numerics.items()})
    points = as_points(scene, {path: values})
    par = parameters(scene, points)
    start = start_states(scene, par, points)
    lanes = Lanes(problem_of(scene), 16)
    shown = []
    for revolution in range(TRANSIENT + SHOWN):
        outcome = lanes.run(par, start)
        start = outcome.end()
        if revolution >= TRANSIENT:
            shown.append(np.where(outcome.status == 0, objective(outcome.mean_gap), np.nan))
    return np.array(shown)


if __name__ == "__main__":
    main()
