"""Figures of a design that went through the dynamics (kind ``samples``)."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.report.parts import FigureOf
from hpcclear.results.content import Results, Variable


@style.drawn
def samples_figure(samples: Results) -> "style.Figure":
    """Objective of samples (kind ``samples``) against every design variable, coloured by clearance; its spread, histogram and
    failures.

    Raises
    ------
    InputError
        There is no design variable to draw against.
    """
    variables = labels.design_variables(samples)
    if not variables:
        reason = "there is no design variable to draw the objective against"
        remedy = "Vary at least one entry of the scene"
        raise InputError("samples", list(samples.data_vars), reason, remedy)
    main = labels.clearance(samples)
    main = variables[0] if main is None else main
    others = [v for v in variables if v.name != main.name]
    rows = (len(others) + 1) // 2
    figure = style.page(70.0 + (34.0 * rows + 12.0 if others else 0.0))
    figure.suptitle(_title(samples), x=0.02, ha="left")
    heights = [2.2] + [1.0] * rows + [0.07] * bool(others)
    cells = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    unit = labels.of(samples["objective"])
    top = cells[0].subgridspec(2, 2, width_ratios=[3, 1], height_ratios=[2, 1])
    first = _first_rows(figure, top, samples, main)
    for i, variable in enumerate(others):
        if i % 2 == 0:
            row = cells[1 + i // 2].subgridspec(1, 2)
        panel = figure.add_subplot(row[i % 2], sharey=first)
        drawn = _cloud(panel, variable, samples["objective"], _values(main))
        panel.tick_params(labelleft=i % 2 == 0)
        panel.set(
            xlabel=labels.of(variable).label(labels.axis(variable)),
            ylabel=unit.label("$f$") if i % 2 == 0 else "",
        )
    if others:
        bar = figure.colorbar(drawn, cax=figure.add_subplot(cells[-1]), orientation="horizontal")
        bar.set_label("colour of the points: " + labels.of(main).label(labels.axis(main)))
    return figure


def _first_rows(
    figure: "style.Figure", cells: Any, samples: Results, main: Variable
) -> "style.Axes":
    """Objective against clearance and its histogram, the spread below, and what the marks mean; the first axes."""
    first = figure.add_subplot(cells[0, 0])
    _cloud(first, main, samples["objective"], _values(main))
    first.set_ylabel(labels.of(samples["objective"]).label("objective $f$"))
    first.tick_params(labelbottom=False)
    side = figure.add_subplot(cells[0, 1], sharey=first)
    f = _values(samples["objective"])
    look: style.Look = {"color": style.PALETTE["blue"], "alpha": 0.75}
    side.hist(f[np.isfinite(f)], bins=24, orientation="horizontal", **look)
    side.set_xlabel("samples (–)")
    side.tick_params(labelleft=False)
    below = figure.add_subplot(cells[1, 0], sharex=first)
    _spread(below, samples, main)
    corner = figure.add_subplot(cells[1, 1])
    corner.set_axis_off()
    corner.legend(handles=_marks(samples), loc="lower center", handletextpad=0.4, borderpad=0.0)
    return first


def _spread(below: "style.Axes", samples: Results, main: Variable) -> None:
    """How f scatters between revolutions, where that is known."""
    spread = samples["objective_spread"]
    below.set_xlabel(labels.of(main).label(labels.axis(main)))
    values = spread.to_numpy()
    if np.isnan(values).all() and not np.isnan(samples["objective"]).all():
        below.set_yticks([])
        words = "cycle-to-cycle variation\nnot available for this objective"
        middle: style.Look = {"ha": "center", "va": "center", "xycoords": "axes fraction"}
        below.annotate(words, (0.5, 0.5), fontsize=style.SMALL, **middle)
        return
    _cloud(below, main, spread, _values(main))
    below.set_ylabel(labels.of(spread).label("std. dev. in time"))
    positive = values[values > 0.0]
    if positive.size and positive.max() > 30.0 * positive.min():
        below.set_yscale("log")


def _values(variable: Variable) -> Array:
    return labels.of(variable)(variable)


def _cloud(axes: "style.Axes", variable: Variable, result: Variable, colour: Array) -> Any:
    """Points, their median in bins, and crosses at the foot where the simulation failed."""
    x, y = _values(variable), _values(result)
    good = np.isfinite(y)
    size = float(np.clip(2000.0 / max(len(x), 1), 0.5, 6.0))
    look: style.Look = {"s": size, "cmap": style.COLOURS, "linewidths": 0, "zorder": 2}
    drawn = axes.scatter(x[good], y[good], c=colour[good], rasterized=len(x) > 2000, **look)
    if np.isfinite(colour).any():
        drawn.set_clim(np.nanmin(colour), np.nanmax(colour))
    centre, middle = binned(x[good], y[good])
    axes.plot(centre, middle, color="white", lw=2.4, zorder=3)
    axes.plot(centre, middle, color=style.PALETTE["vermilion"], lw=1.2, zorder=4)
    foot = np.full(int((~good).sum()), 0.04)
    axes.plot(x[~good], foot, "kx", ms=4, transform=axes.get_xaxis_transform(), zorder=5)
    return drawn


def binned(x: Array, y: Array) -> tuple[Array, Array]:
    """Middles of bins of equal width and the median of y in them, from x and y of shape (n,).

    Bins of fewer than five points are left out.
    """
    if len(x) < 10 or not np.ptp(x) > 0.0:
        return np.zeros(0), np.zeros(0)
    edges = np.linspace(x.min(), x.max(), min(12, len(x) // 5) + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, len(edges) - 2)
    full = [k for k in range(len(edges) - 1) if (place == k).sum() >= 5]
    middle = 0.5 * (edges[1:] + edges[:-1])
    return middle[full], np.array([np.median(y[place == k]) for k in full])


def _title(samples: Results) -> str:
    count = samples.sizes["sample"]
    failed = int(np.count_nonzero(samples["status"]))
    latched = int(samples["latched"].to_numpy().any(axis=1).sum()) if "latched" in samples else 0
    return f"{count} simulations: {failed} failed, {latched} with a joint always in contact"


def _marks(samples: Results) -> list[Any]:
    """Legend entries of what `_cloud` draws."""
    from matplotlib.lines import Line2D

    marks = [
        Line2D([], [], color=style.PALETTE["green"], marker="o", ms=2.5, ls="none", label="sample"),
        Line2D([], [], color=style.PALETTE["vermilion"], lw=1.2, label="median"),
    ]
    if samples["status"].to_numpy().any():
        marks.append(Line2D([], [], color="black", marker="x", ms=4, ls="none", label="failed"))
    return marks


PARTS = (
    FigureOf(
        "samples", "samples", samples_figure,
        "Objective against each design variable, its cycle-to-cycle standard deviation and histogram.",
    ),
)  # fmt: skip
