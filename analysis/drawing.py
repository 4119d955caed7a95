"""What several of these programs draw, or ask, alike."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hpcclear import report
from hpcclear.base.errors import InputError


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


def error_panels(titles: Sequence[str], width: float, height: float) -> tuple[Figure, list[Axes]]:
    """Panels side by side for time against the error of the slider's position, both logarithmic."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(titles), figsize=(width * len(titles), height), sharey=True)
    panels = list(np.atleast_1d(axes))
    for panel, title in zip(panels, titles, strict=True):
        panel.set(xscale="log", yscale="log", xlabel="error of the slider position, m")
        panel.set_title(title, fontsize=9)
    return figure, panels
