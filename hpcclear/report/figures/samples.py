"""Figures of a design that went through the dynamics (kind ``samples``)."""

from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results, Variable


@style.figure(
    "Objective against each design variable, its cycle-to-cycle standard deviation and histogram."
)
def samples_figure(samples: Results) -> "style.Figure":
    """Objective against each design variable, coloured by clearance; its spread and histogram. InputError without any."""
    variables = labels.design_variables(samples)
    if not variables:
        reason = "there is no design variable to draw the objective against"
        remedy = "Vary at least one entry of the scene"
        raise InputError("samples", list(samples.data_vars), reason, remedy)
    main = labels.clearance(samples)
    main = variables[0] if main is None else main
    others = [v for v in variables if v.name != main.name]
    rows = (len(others) + 1) // 2
    height = 82.0 + (34.0 * rows + 6.0 if others else 0.0)
    places = [*(v.name for v in others), *["."] * (len(others) % 2)]
    pairs = [[a, a, b, b] for a, b in zip(places[::2], places[1::2], strict=True)]
    cells = [["f", "f", "f", "histogram"], ["spread", "spread", "spread", "."], *pairs]
    figure, axes = style.mosaic(cells, height, height_ratios=[1.5, 0.7, *[1.0] * rows])
    if figure.get_layout_engine() is not None:
        failed = int(np.count_nonzero(samples["status"]))
        latched = int(samples["latched"].values.any(axis=1).sum()) if "latched" in samples else 0
        text = f"{samples.sizes['sample']} simulations: {failed} failed, {latched} with a joint always in contact"
        figure.suptitle(text, x=0.02, ha="left", wrap=True)
    first, unit = axes["f"], labels.of(samples["objective"])
    drawn = _cloud(first, main, samples["objective"], main)
    first.set_ylabel(unit.label("objective $f$"))
    first.set_xlabel(labels.of(main).label(labels.axis(main)))
    f = unit(samples["objective"])
    look: style.Look = {"color": style.colour("blue"), "alpha": 0.75}
    axes["histogram"].hist(f[np.isfinite(f)], bins=24, orientation="horizontal", **look)
    axes["histogram"].set_xlabel("samples (–)")
    _spread(axes["spread"], samples, main)
    for number, variable in enumerate(others):
        panel = axes[variable.name]
        _cloud(panel, variable, samples["objective"], main)
        panel.set_xlabel(labels.of(variable).label(labels.axis(variable)))
        panel.set_ylabel(unit.label("$f$") if number % 2 == 0 else "")
    for number, name in enumerate(("histogram", *(v.name for v in others))):
        axes[name].sharey(first)
        axes[name].tick_params(labelleft=number % 2 == 1)
    style.legend(figure, first, "lower")
    if others:
        bar = figure.colorbar(drawn, ax=list(axes.values()), location="bottom", aspect=50, pad=0.02)
        bar.set_label(labels.of(main).label(labels.axis(main)))
        if names := labels.options(main):
            bar.set_ticks(range(len(names)), labels=names)
    return figure


def _spread(below: "style.Axes", samples: Results, main: Variable) -> None:
    """How f scatters between revolutions, where that is known."""
    spread = samples["objective_spread"]
    below.set_xlabel(labels.of(main).label(labels.axis(main)))
    values = spread.values
    if np.isnan(values).all() and not np.isnan(samples["objective"]).all():
        below.set_yticks([])
        words = "cycle-to-cycle variation\nnot available for this objective"
        middle: style.Look = {"ha": "center", "va": "center", "xycoords": "axes fraction"}
        below.annotate(words, (0.5, 0.5), **middle)
        return
    _cloud(below, main, spread, main)
    below.set_ylabel(labels.of(spread).label("std. dev. in time"))
    positive = values[values > 0.0]
    if positive.size and positive.max() > 30.0 * positive.min():
        below.set_yscale("log")


def _cloud(axes: "style.Axes", variable: Variable, result: Variable, shade: Variable) -> Any:
    """Points in the colours of a variable, their median in bins, and crosses at the foot where the simulation failed."""
    x, y, colour = (labels.of(one)(one) for one in (variable, result, shade))
    good = np.isfinite(y)
    size = float(np.clip(2000.0 / max(len(x), 1), 0.5, 6.0))
    look: style.Look = {"s": size, "linewidths": 0, "zorder": 2, "label": "sample"}
    if names := labels.options(shade):
        look |= style.categories(len(names))
    drawn = axes.scatter(x[good], y[good], c=colour[good], rasterized=len(x) > 2000, **look)
    if np.isfinite(colour).any() and not names:
        drawn.set_clim(np.nanmin(colour), np.nanmax(colour))
    centre, middle = binned(x[good], y[good])
    axes.plot(centre, middle, color=style.colour("paper"), lw=2.4, zorder=3)
    if len(centre):
        axes.plot(centre, middle, color=style.colour("vermilion"), lw=1.2, zorder=4, label="median")
    foot, ink = np.full(int((~good).sum()), 0.04), style.colour("ink")
    if len(foot):
        mark: style.Look = {"ls": "none", "marker": "x", "color": ink, "ms": 4, "label": "failed"}
        axes.plot(x[~good], foot, transform=axes.get_xaxis_transform(), zorder=5, **mark)
    if names := labels.options(variable):
        axes.set_xticks(range(len(names)), names)
    return drawn


def binned(x: Array, y: Array) -> tuple[Array, Array]:
    """Middles of bins of equal width with five points or more, and the median of y in them; x, y: (n,)."""
    if len(x) < 10 or not np.ptp(x) > 0.0:
        return np.zeros(0), np.zeros(0)
    edges = np.linspace(x.min(), x.max(), min(12, len(x) // 5) + 1)
    place = np.clip(np.digitize(x, edges) - 1, 0, len(edges) - 2)
    full = [k for k in range(len(edges) - 1) if (place == k).sum() >= 5]
    middle = 0.5 * (edges[1:] + edges[:-1])
    return middle[full], np.array([np.median(y[place == k]) for k in full])
