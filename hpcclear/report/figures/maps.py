"""Maps of periodic and chaotic motion (kind ``samples``), and bifurcation figures."""

import itertools

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Regime, Status
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results, Variable
from hpcclear.results.grids import cells_of

_RPM = labels.Scale(30.0 / np.pi, "rpm")
_PERIODS = (0.5, 1.5, 2.5, 4.5, 8.5, 20.5)
_REGIMES = [regime for regime in Regime if regime is not Regime.UNJUDGED]
_PERIOD = "period, blank where none was found (revolutions)"
_EXPONENT = "largest Lyapunov exponent (1/revolution)"


@style.figure(
    "Largest Lyapunov exponent, period and regime of each cell of the map; along a line also f with its 95 % CI.",
    kind="map",
)
def map_figure(samples: Results) -> "style.Figure":
    """Exponent, period and regime of each cell of a map; along a line also f with its confidence interval. Raises InputError of
    another kind."""
    cells = cells_of(samples)
    names = [str(name) for name in cells["objective"].dims]
    return _plane(cells, names) if len(names) == 2 else _line(cells, names[0])


def entry(variable: Variable) -> tuple[Array, str]:
    """Values (n,) of an entry of the scene in a readable unit, and the label of its axis; angular speeds in rpm."""
    unit = _RPM if variable.attrs.get("units") == "rad/s" else labels.of(variable)
    words = labels.axis(variable)
    label = unit.label(words) if unit.unit != "–" else words
    return unit(variable), label


def _plane(cells: Results, names: list[str]) -> "style.Figure":
    attractors = cells["attractors"].values.T if "attractors" in cells else np.zeros(1)
    most = int(np.nanmax(np.nan_to_num(attractors)))
    count = 3 + (most > 1)
    figure, axes = style.side_by_side(count, 10.0 / count + 55.0, sharex=True)
    (x, across), (y, up) = (entry(cells[name]) for name in names)
    exponent = cells["lyapunov_exponent"].values.T
    finite = np.abs(exponent[np.isfinite(exponent)])
    reach = float(np.quantile(finite, 0.98)) if finite.size else 1.0
    regime = np.where(cells["status"].values == Status.OK, cells["regime"].values, np.nan).T
    spans = [(int(low + 0.5), int(high - 0.5)) for low, high in itertools.pairwise(_PERIODS)]
    orders = [f"{a}" if a == b else f"{a} to {b}" for a, b in spans]
    steps = style.matplotlib().colors.BoundaryNorm(_PERIODS, 256)
    middles = [0.5 * sum(pair) for pair in itertools.pairwise(_PERIODS)]
    kinds = [one.name.lower() for one in _REGIMES]
    numbers = [str(k + 1) for k in range(most)]
    panels: list[tuple[str, Array, style.Look, list[float], list[str]]] = [
        (_EXPONENT, exponent, {"cmap": "RdBu_r", "vmin": -reach, "vmax": reach}, [], []),
        (_PERIOD, cells["period"].values.T, {"norm": steps}, middles, orders),
        ("regime", regime - 1.0, style.categories(len(kinds)), [*map(float, range(len(kinds)))], kinds),
        ("motions reached", attractors - 1.0, style.categories(most), [*map(float, range(most))], numbers),
    ]  # fmt: skip
    for panel, (words, values, options, ticks, texts) in zip(axes[:, 0], panels, strict=False):
        drawn = panel.pcolormesh(x, y, values, shading="nearest", rasterized=True, **options)
        bar = figure.colorbar(drawn, ax=panel, label=words)
        if ticks:
            bar.set_ticks(ticks, labels=texts)
            bar.ax.minorticks_off()
        panel.set_ylabel(up)
        panel.grid(False)
        for axis, name in zip((panel.xaxis, panel.yaxis), names, strict=True):
            if rows := labels.options(cells[name]):
                axis.set_ticks(range(len(rows)), labels=rows)
    style.below(axes, across)
    return figure


def _line(cells: Results, name: str) -> "style.Figure":
    figure, axes = style.grid(4, 1, 150.0, sharex=True)
    x, across = entry(cells[name])
    unit = labels.of(cells["objective"])
    for panel, key, reach, factor, words in (
        (axes[0, 0], "lyapunov_exponent", "lyapunov_exponent_limit", 1.0, _EXPONENT),
        (axes[3, 0], "objective", "objective_limit", unit.factor, unit.label("$f$, 95 % CI")),
    ):
        values, width = (cells[one].values * factor for one in (key, reach))
        panel.errorbar(x, values, width, fmt="o", ms=2.0, lw=0.7, color=style.colour("blue"))
        panel.set_ylabel(words)
    axes[0, 0].axhline(0.0, color=style.colour("grey"), lw=0.6)
    axes[1, 0].plot(x, cells["period"].values, "s", ms=2.0, color=style.colour("vermilion"))
    axes[1, 0].set_ylabel("period (revolutions)")
    regime = cells["regime"].values.astype(float)
    regime[(cells["status"].values != Status.OK) | (regime == Regime.UNJUDGED)] = np.nan
    axes[2, 0].plot(x, regime, "D", ms=2.0, color=style.colour("green"))
    axes[2, 0].set_yticks([int(one) for one in _REGIMES], [one.name.lower() for one in _REGIMES])
    axes[2, 0].set_ylim(0.5, len(_REGIMES) + 0.5)
    axes[-1, 0].set_xlabel(across)
    return figure


@style.figure(
    "One value for each revolution against the varied entry: n dots where the motion repeats every n revolutions."
)
def bifurcation_figure(bifurcation: Results) -> "style.Figure":
    """Values once a revolution against the varied entry; n dots where the motion repeats every n. InputError of others."""
    variables = labels.design_variables(bifurcation)
    if not variables or bifurcation.attrs.get("hpcclear_kind") != "bifurcation":
        reason = "the dataset is no bifurcation"
        remedy = "Make one with hpcclear map --bifurcation"
        raise InputError("kind", bifurcation.attrs.get("hpcclear_kind"), reason, remedy)
    figure, axes = style.grid(1, 1, 70.0)
    varied, across = entry(variables[0])
    x = np.repeat(varied, bifurcation.sizes["crossing"])
    unit, panel = labels.of(bifurcation["observed"]), axes[0, 0]
    size = float(np.clip(3000.0 / max(len(x), 1), 1.2, 3.0))
    look: style.Look = {"ms": size, "mew": 0.0, "color": style.colour("blue")}
    panel.plot(x, unit(bifurcation["observed"]).ravel(), ".", rasterized=len(x) > 5000, **look)
    words = unit.label(str(bifurcation["observed"].attrs["long_name"]))
    panel.set(xlabel=across, ylabel=words)
    return figure
