"""Figures of sensitivities and surrogates (kinds ``sensitivity`` and ``kriging``)."""

from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.figures import fits, labels, style
from hpcclear.results.content import Results, texts_in

if TYPE_CHECKING:
    from hpcclear.statistics.surrogate.piecewise import Piecewise


@style.figure(
    "First-order sensitivities against clearance, with two standard errors. Lines: from the full ranges. Marks: "
    "from the ranges at which they converged.",
    name="sensitivities",
)
def sensitivity_figure(sensitivity: Results) -> "style.Figure":
    """Sensitivities (kind ``sensitivity``) against clearance, a panel for each response surface (the paper's Fig. 5, curves).

    Lines and bands: the global interval with two standard errors. Marks with bars: where the sensitivity stopped
    changing and is determined, with its uncertainty.
    """
    surfaces = texts_in(sensitivity, "surface")
    rows = (len(surfaces) + 1) // 2
    figure, axes = style.grid(rows, 2, 14.0 + 48.0 * rows, sharex=True, sharey=True)
    unit = labels.of(sensitivity["sensitivity"])
    across = labels.of(sensitivity["clearance"])
    known = fits.of_surfaces(sensitivity)
    for panel, surface in zip(axes.flat, surfaces, strict=False):
        fits.mark(panel, known[surface], 0.12)
        _sensitivity_panel(panel, sensitivity.sel(surface=surface), across, unit)
        panel.set_title(f"surface in {_surface(surface)}")
    words = across.label(_held(sensitivity)), unit.label("slope × range")
    _finish_grid(axes, len(surfaces), *words)
    return figure


def _sensitivity_panel(
    axes: "style.Axes", surface: Results, across: labels.Scale, unit: labels.Scale
) -> None:
    widest = surface.isel(interval=int(np.argmax(surface["interval"].values)))
    clearance, row = across(surface["clearance"]), 0
    for parameter in surface["parameter"].values:
        one = widest.sel(parameter=parameter)
        slope, error = unit(one["sensitivity"]), 2.0 * unit(one["standard_error"])
        if not np.isfinite(slope).any():
            continue  # no input of this surface
        look, band = style.look(row), (slope - error, slope + error)
        axes.fill_between(clearance, *band, color=look["color"], alpha=0.18, lw=0.0)
        axes.plot(clearance, slope, label=symbol(str(parameter)), **{**look, "marker": ""})
        if "best_sensitivity" in surface:
            best = surface.sel(parameter=parameter)
            where = best["converged"].values != 0
            y, bar = (unit(best[name])[where] for name in ("best_sensitivity", "uncertainty"))
            marks = {**look, "ls": "none", "ms": 2.6, "elinewidth": 0.7}
            axes.errorbar(clearance[where], y, yerr=2.0 * bar, **marks)
        row += 1
    axes.axhline(0.0, color=style.colour("ink"), lw=0.5)
    axes.margins(y=0.25)
    style.key(axes, "upper left", handlelength=1.2, columnspacing=0.6, borderaxespad=0.0)


@style.figure(
    fits.captioned("Fit of the response surfaces on test points, against clearance and length of the ranges."), 2,
    name="surface-fit",
)  # fmt: skip
def fit_figure(sensitivity: Results) -> "style.Figure":
    """Fit of the response surfaces (kind ``sensitivity``) against clearance, a curve for each interval (the paper's Fig. 7)."""
    surfaces = texts_in(sensitivity, "surface")
    figure, axes = style.grid(len(surfaces), 2, 24.0 + 36.0 * len(surfaces), sharex=True)
    across = labels.of(sensitivity["clearance"])
    clearance = across(sensitivity["clearance"])
    intervals = sensitivity["interval"].values
    shades = style.matplotlib().colormaps[style.matplotlib().rcParams["image.cmap"]]
    colours = shades(np.linspace(0.0, 0.9, len(intervals)))
    for line, surface in zip(axes, surfaces, strict=True):
        for panel, name, label in zip(line, ("r2", "rmae"), ("$R^2$ (–)", "RMAE (–)"), strict=True):
            for k, interval in enumerate(intervals):
                values = sensitivity[name].sel(surface=surface).isel(interval=k).values
                look = {**style.look(k), "color": colours[k], "ls": "-", "ms": 2.2, "lw": 0.7}
                panel.plot(clearance, values, label=f"{100 * interval:.0f} %", **look)
            panel.set_ylabel(label)
        line[0].set_title(f"surface in {_surface(surface)}")
        lowest = float(np.nanmin(sensitivity["r2"].sel(surface=surface)))
        bottom = max(-0.25, min(lowest, 0.75)) - 0.02
        line[0].set_ylim(bottom, 1.03)
        if lowest < 0.0:
            line[0].axhspan(bottom, 0.0, color=style.colour("vermilion"), alpha=0.15, lw=0.0)
            fits.mark(line[0], lowest, 0.3)
        line[1].set_ylim(0.0, min(2.0, line[1].get_ylim()[1]))
    for panel in axes[-1]:
        panel.set_xlabel(across.label(_held(sensitivity)))
    title = "length of the interval, share of the whole"
    style.legend(figure, axes[0, 0], "lower", title=title, columnspacing=1.0)
    return figure


@style.figure(
    "Global sensitivities with two standard errors: first-order Sobol indices (each variable alone) and total "
    "indices (with interactions; their sum may exceed 1).", 1
)  # fmt: skip
def sobol_figure(sensitivity: Results) -> "style.Figure":
    """First-order and total Sobol indices with two standard errors. Raises InputError where the file has none."""
    if "sobol_total" not in sensitivity:
        reason = "the study did not compute Sobol indices"
        remedy = "Set it to a power of two and run again"
        raise InputError("sensitivity.sobol_samples", 0, reason, remedy)
    names = texts_in(sensitivity, "parameter")
    figure, axes = style.grid(1, 1, 22.0 + 7.0 * len(names))
    panel = axes[0, 0]
    order = np.argsort(np.nan_to_num(sensitivity["sobol_total"].values), kind="stable")
    rows = np.arange(len(names))
    kinds = (("first", "first order", "blue", 0.2), ("total", "total", "orange", -0.2))
    for kind, label, colour, shift in kinds:
        index, name = sensitivity[f"sobol_{kind}"].values[order], f"sobol_{kind}_error"
        error = 2.0 * sensitivity[name].values[order] if name in sensitivity else None
        look: style.Look = {"color": style.colour(colour), "label": label, "error_kw": {"lw": 0.7}}
        panel.barh(rows + shift, index, 0.36, xerr=error, **look)
    panel.set_yticks(rows, [symbol(names[k]) for k in order])
    panel.set(xlabel="share of the variance of $f$ (–)", ylabel="design variable (name)")
    style.key(panel, "lower right")
    panel.grid(axis="y", visible=False)
    return figure


LEVELS = 24
"""Steps of the colour scale of predictions."""


@style.figure(
    fits.captioned("Objective by Kriging over pairs of design variables, at the smallest and the largest clearance."),
    name="surrogates",
)  # fmt: skip
def surfaces_figure(kriging: Results) -> "style.Figure":
    """Objective over pairs of design variables at the least and the largest clearance (the paper's Fig. 5, surfaces), of the
    models of two variables and the clearance (kind ``kriging``). Raises InputError where there is none."""
    from hpcclear.statistics.surrogate.stored import models_in  # loads the compiler

    main = labels.clearance(kriging)
    name = "" if main is None else str(main.attrs["scene_path"])
    found = models_in(kriging.variables)
    shown = {k: m for k, m in found.items() if len(m.names) == 3 and name in m.names}
    if not shown:
        reason = "no model has two design variables and the clearance as inputs"
        raise InputError("study.surrogate.models", list(found), reason, "Fit one, [x, y, C]")
    figure, axes = style.grid(len(shown), 2, 24.0 + 40.0 * len(shown))
    fields = [_fields(model, model.names.index(name)) for model in shown.values()]
    unit = labels.scale("m", np.concatenate([np.ravel(z) for _, _, z, _ in fields]))
    finite = [unit(z[np.isfinite(z)]) for _, _, z, _ in fields]
    edges = np.linspace(min(map(np.min, finite)), max(map(np.max, finite)), LEVELS + 1)
    by_path = {str(v.attrs["scene_path"]): v for v in labels.design_variables(kriging)}
    across = labels.of(by_path[name])
    known = fits.of_models(kriging)
    rows = zip(axes, shown.items(), fields, strict=True)
    for line, (family, model), (x, y, z, clearances) in rows:
        first, second = (by_path[i] for i in model.names if i != name)
        scales = [labels.scale(str(v.attrs["units"]), e) for v, e in ((first, x), (second, y))]
        for k, panel in enumerate(line):
            grid = (scales[0](x), scales[1](y), unit(z[k].T))
            drawn = panel.contourf(*grid, levels=edges)
            lines = panel.contour(*grid, levels=4, colors="white", linewidths=0.5)
            panel.clabel(lines, fmt="%.3g")
            panel.set_xlabel(scales[0].label(labels.axis(first)))
            panel.tick_params(labelleft=k == 0)
            panel.set_title(f"$C$ = {clearances[k] * across.factor:.3g} {across.unit}")
            fits.mark(panel, known[family])
        line[0].set_ylabel(scales[1].label(labels.axis(second)))
        line[0].set_title(f"{line[0].get_title(loc='left')}, $R^2$ = {known[family]:.2g}")
    bar = figure.colorbar(drawn, ax=axes.ravel().tolist(), location="bottom", aspect=45, pad=0.01)
    bar.set_label(unit.label("objective $f$"))
    bar.ax.xaxis.set_major_locator(style.matplotlib().ticker.MaxNLocator(6))
    return figure


def _fields(model: "Piecewise", main: int) -> tuple[Array, Array, Array, Array]:
    """Predictions over the two inputs that are not the clearance: grids (n,), values (2, n, n), clearances (2,)."""
    lower, upper = model.lower, model.upper
    x, y = (np.linspace(lower[i], upper[i], 41) for i in range(3) if i != main)
    clearances = np.array([lower[main], upper[main]])
    mesh = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    values = np.array([model.predict(np.insert(mesh, main, one, axis=1)) for one in clearances])
    return x, y, values.reshape(-1, len(x), len(y)), clearances


@style.figure(
    fits.captioned("Surrogate against simulation: leave-one-out predictions; R² on test points."), 1
)
def parity_figure(kriging: Results) -> "style.Figure":
    """Surrogate against dynamics, every model of a file of kind ``kriging`` (the paper's Figs. 6 and 8).

    Each point is predicted by the model without that point, so that no point is judged by itself; R2 on the test
    points of the study stands in the titles.
    """
    from hpcclear.statistics.surrogate.stored import models_in  # loads the compiler

    found = models_in(kriging.variables)
    rows = (len(found) + 1) // 2
    figure, axes = style.grid(rows, 2, 14.0 + 46.0 * rows, sharex=True, sharey=True)
    unit = labels.of(kriging["training_output"])
    known = fits.of_models(kriging)
    for panel, (name, model) in zip(axes.flat, found.items(), strict=False):
        for k, leaf in enumerate(model.leaves):
            marks = {**style.look(k), "ls": "none", "ms": 2.0, "mew": 0.0, "alpha": 0.7}
            panel.plot(unit(leaf.values), unit(leaf.leave_one_out()), **marks)
        fits.mark(panel, known[name], 0.12)
        note = "".join(f", {one}" for one in sorted({leaf.label for leaf in model.leaves} - {""}))
        panel.set_title(f"{', '.join(map(symbol, model.names))}\n$R^2$ = {known[name]:.3f}{note}")
    ranges = [axes[0, 0].get_xlim(), axes[0, 0].get_ylim()]  # the same for all
    ends = (min(ranges)[0], max(high for _, high in ranges))
    for panel in axes.flat:
        panel.plot(ends, ends, color=style.colour("ink"), lw=0.5, zorder=0)
        panel.set(xlim=ends, ylim=ends, aspect="equal")
    words = unit.label("$f$ by the dynamics"), unit.label("$f$ by the surrogate")
    _finish_grid(axes, len(found), *words)
    return figure


def _held(sensitivity: Results) -> str:
    """What is held fixed for each surface: the clearance, unless a study says otherwise."""
    words = labels.words(sensitivity["clearance"])
    return "clearance $C$" if words == "radial clearance" else labels.literal(words)


def _surface(name: str) -> str:
    """What a response surface is in."""
    inputs = name.split()
    return ", ".join(map(symbol, inputs)) if len(inputs) < 4 else f"{len(inputs)} variables"


def symbol(name: str) -> str:
    """A design variable in a formula's letters, or in words."""
    if name.endswith("_ratio"):
        return f"{symbol(name.removesuffix('_ratio'))} ratio"
    if len(name) == 2 and name[1].isdigit():
        return labels.noted(name, f"${name[0]}_{name[1]}$")
    return labels.noted(name, "$C$") if name == "C" else labels.entry(name)


def _finish_grid(axes: np.ndarray, used: int, across: str, up: str) -> None:
    """Label the lowest panel of each column and the first of each row, and take the unused ones away."""
    for panel in axes[:, 0]:
        panel.set_ylabel(up)
    for panel in axes.flat[used:]:
        panel.remove()
    for k in range(max(used - axes.shape[1], 0), used):
        axes.flat[k].set_xlabel(across)
        axes.flat[k].tick_params(labelbottom=True)
