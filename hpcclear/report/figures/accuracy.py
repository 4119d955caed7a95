"""Figures of what accuracy costs (kind ``accuracy``): one for each approximation of a study."""

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcclear.report import targets
from hpcclear.report.figures import labels, style
from hpcclear.report.parts import FigureOf
from hpcclear.results.content import Results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

MARGIN = 100.0
"""Errors count as resolved from this many times the reference's own error on."""

AIM = 0.01
"""Relative standard error whose cheapest tolerance is marked."""

_WORDS = {
    "slider_position": "slider position",
    "slider_velocity": "slider velocity",
    "body_position": "body position",
    "body_velocity": "body velocity",
    "peak_contact_force": "contact-force peak",
    "objective": "objective $f$",
}


def _legend_above(figure: "Figure", axes: "Axes") -> None:
    """One legend for all panels: that of the panel given."""
    handles, names = axes.get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper center", ncols=2)


def _foot(figure: "Figure", found: Results, *sentences: str) -> None:
    """Where the numbers come from, below a figure."""
    versions = str(found.attrs.get("versions", ""))
    lines = [*sentences, str(found.attrs.get("processor", "")), versions]
    text = "\n".join(textwrap.fill(line, 58) for line in lines)
    figure.supxlabel(labels.literal(text), x=0.02, ha="left", fontsize=style.SMALL)


def _decades(axis: "Axis") -> None:
    """Few decade ticks, so that labels do not meet in half a column."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(numticks=5))
    axis.set_minor_formatter(NullFormatter())


FEW_DECADES = 50.0
"""Ratio of the ends of a time axis above which only decades have a tick: more labels would meet."""


def _plain(axis: "Axes") -> None:
    """A logarithmic time axis above a panel, with plain numbers at its ticks."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_xlim()
    subs = (1.0, 2.0, 5.0) if high < FEW_DECADES * low else (1.0,)
    axis.xaxis.set_major_locator(LogLocator(subs=subs, numticks=12))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.tick_params(labelsize=style.SMALL, length=2.0, pad=1.0)


def _small(axes: Any) -> None:
    """Minor labels of short logarithmic axes of the same size as the others."""
    for panel in np.ravel(axes):
        panel.tick_params(axis="both", which="minor", labelsize=style.SMALL)


@style.drawn
def integration_figure(found: Results) -> "Figure":
    """Work and precision: error of each quantity against wall time (left) and force evaluations (right)."""
    quantities = [str(q) for q in found["quantity"].to_numpy()]
    figure, axes = style.grid(len(quantities), 2, 215.0, sharey="row", sharex="col")
    for row, quantity in enumerate(quantities):
        here = found.sel(quantity=quantity)
        for column, work in enumerate(("seconds", "evaluations")):
            _ladder(axes[row, column], here, work)
        axes[row, 0].set_ylabel(f"{_WORDS.get(quantity, quantity)}\nrelative error (–)")
    axes[-1, 0].set_xlabel("wall time (ms)")
    axes[-1, 1].set_xlabel("force evaluations (–)")
    style.settle(axes)
    _legend_above(figure, axes[0, 0])
    _foot(
        figure,
        found,
        "Errors of the grey region, with hollow marks, are below 100 times the reference's own error.",
        f"{found.attrs.get('designs', '')}; {found.attrs.get('repeats', '')}.",
    )
    return figure


def _ladder(axes: "Axes", here: Results, work: str) -> None:
    """One line a method; what the reference cannot resolve is hollow."""
    factor = 1e3 if work == "seconds" else 1.0
    floor = MARGIN * float(here["reference_error"])
    for k, method in enumerate(here["integrator"].to_numpy()):
        x, y = here[work].to_numpy()[k] * factor, here["error"].to_numpy()[k]
        look = k % len(style.CYCLE)
        colour, dashes = style.CYCLE[look], style.DASHES[(look + k // len(style.CYCLE)) % 7]
        label = labels.literal(str(method))
        axes.loglog(x, y, ls=dashes, color=colour, lw=0.8)
        for hollow in (False, True):
            chosen = (y < floor) == hollow
            axes.plot(
                x[chosen], y[chosen], ls="none", marker=style.MARKERS[look], ms=2.8, color=colour,
                mfc="white" if hollow else colour, mew=0.6,
            )  # fmt: skip
        axes.plot([], [], ls=dashes, marker=style.MARKERS[look], ms=2.8, color=colour, label=label)
    if np.isfinite(floor):
        axes.axhspan(axes.get_ylim()[0], floor, color="#eeeeee", zorder=0)
    for axis in (axes.xaxis, axes.yaxis):
        _decades(axis)


@style.drawn
def averaging_figure(found: Results) -> "Figure":
    """Error of the objective against revolutions averaged, for several transients, and its lower bound."""
    figure, axes = style.grid(1, 1, 100.0)
    panel, error = axes[0, 0], found["averaging_error"]
    for k, transient in enumerate(found["transient"].to_numpy()):
        y = error.sel(transient=transient).to_numpy()
        again, look = divmod(k, len(style.CYCLE))  # the second round has hollow marks
        panel.loglog(
            found["averaged"], y, color=style.CYCLE[look], ls=style.DASHES[look],
            marker=style.MARKERS[look], label=str(transient),
            **({"mfc": "white"} if again else {}),
        )  # fmt: skip
    floor = float(found["averaging_floor"])
    if floor > 0.0:
        panel.axhline(floor, color="black", lw=0.6, ls=(0, (6, 2)))
        panel.annotate(
            f"scatter of replicas {floor:.0e}", (0.99, floor), xycoords=("axes fraction", "data"),
            ha="right", va="bottom", fontsize=style.SMALL,
        )  # fmt: skip
    handles, names = panel.get_legend_handles_labels()
    figure.legend(
        handles, names, title="transient revolutions", loc="outside upper center", ncols=5
    )
    panel.set_xlabel("averaged revolutions (–)")
    panel.set_ylabel("relative error of $f$ (–)")
    turn = 1e3 * float(found["turn_seconds"])
    above = panel.secondary_xaxis("top", functions=(lambda x: x * turn, lambda t: t / turn))
    above.set_xlabel("core time of the averaged revolutions (ms)")
    style.settle([panel])
    _plain(above)
    _foot(
        figure,
        found,
        f"{found.attrs.get('copies', '')}, perturbed by 1e-10, half of them at a ten times tighter tolerance.",
    )
    return figure


@style.drawn
def surrogate_figure(found: Results) -> "Figure":
    """Accuracy of response surface and Kriging against sample size, with the simulation time above."""
    figure, axes = style.grid(3, 1, 145.0, sharex=True)
    size, each = found["training"].to_numpy(), float(found["sample_seconds"])
    rows = (
        ("unexplained share\n$1 - R^2$ (–)", 1.0 - found["r2"].to_numpy()),
        ("RMAE (–)", found["rmae"].to_numpy()),
        ("leave-one-out error\nover std. dev. (–)", found["leave_one_out"].to_numpy()),
    )
    for panel, (words, values) in zip(axes[:, 0], rows, strict=True):
        for k, surrogate in enumerate(found["surrogate"].to_numpy()):
            y = values[k]
            panel.loglog(
                size,
                y,
                color=style.CYCLE[k],
                ls=style.DASHES[k],
                marker=style.MARKERS[k],
                label=surrogate,
            )
        panel.set_ylabel(words)
    axes[0, 0].legend()
    axes[-1, 0].set_xlabel("training samples (–)")
    axes[-1, 0].set_xticks(size, [str(n) for n in size])
    axes[-1, 0].minorticks_off()
    above = axes[0, 0].secondary_xaxis("top", functions=(lambda x: x * each, lambda t: t / each))
    above.set_xlabel("simulation time (core-seconds)")
    style.settle(axes)
    _small(axes)
    _plain(above)
    _foot(figure, found, f"{found.attrs.get('study', '')}; fresh test points.")
    return figure


@style.drawn
def random_inputs_figure(found: Results) -> "Figure":
    """Error of mean and standard deviation against Monte Carlo size and time, with 95 % confidence intervals; the surrogate's
    bias."""
    figure, axes = style.grid(2, 2, 130.0, sharey="row", sharex="col")
    for row, moment in enumerate(found["moment"].to_numpy()):
        here = found.sel(moment=moment)
        for k, estimate in enumerate(found["estimate"].to_numpy()):
            one = here.sel(estimate=estimate)
            y = one["moment_error"].to_numpy()
            bars = [y - one["moment_lower"].to_numpy(), one["moment_upper"].to_numpy() - y]
            for column, x in enumerate((found["draws"], one["moment_seconds"])):
                axes[row, column].errorbar(
                    x.to_numpy(), y, bars, color=style.CYCLE[k], ls=style.DASHES[k],
                    marker=style.MARKERS[k], elinewidth=0.6, label=str(estimate),
                )  # fmt: skip
        for column in (0, 1):
            panel = axes[row, column]
            panel.set_xscale("log")
            panel.set_yscale("log")
            panel.axhline(
                abs(float(here["moment_bias"])), color="black", lw=0.6, ls=(0, (6, 2)),
                label="surrogate's bias",
            )  # fmt: skip
        axes[row, 1].axvline(
            float(found["quadrature_seconds"]), color=style.PALETTE["green"], lw=0.8, ls=":",
            label="quadrature",
        )  # fmt: skip
        axes[row, 0].set_ylabel(f"relative error of the {moment} (–)")
    axes[-1, 0].set_xlabel("Monte Carlo size (–)")
    axes[-1, 1].set_xlabel("core time (s)")
    for panel in axes.flat:
        _decades(panel.xaxis)
    style.settle(axes)
    _small(axes)
    _legend_above(figure, axes[0, 1])
    _foot(
        figure,
        found,
        "Bars: 95 % confidence; the bias is the surrogate's, by quadrature, against all simulations.",
        f"{found.attrs.get('study', '')}.",
    )
    return figure


@style.drawn
def parallel_figure(found: Results) -> "Figure":
    """Speed-up and efficiency on the available ranks, and the core-seconds lost."""
    figure, axes = style.grid(1, 2, 80.0)
    number = found["ranks"].to_numpy()
    strong, weak = found["strong_seconds"].to_numpy(), found["weak_seconds"].to_numpy()
    left, right = axes[0]
    left.plot(number, strong[0] / strong, "o-", color=style.CYCLE[0], label="same batch")
    left.plot(number, number * weak[0] / weak, "s--", color=style.CYCLE[1], label="batch a rank")
    left.plot(number, number, color=style.PALETTE["grey"], lw=0.6, label="ideal")
    left.set_xticks(number, [str(n) for n in number])
    left.set_xlabel("ranks (–)")
    left.set_ylabel("speed-up (–)")
    left.legend()
    lost = found["lost_seconds"].to_numpy()
    right.barh(np.arange(len(lost)), np.nan_to_num(lost), color=style.PALETTE["sky"])
    right.set_yticks(np.arange(len(lost)), [str(x) for x in found["loss"].to_numpy()])
    right.set_xlabel("lost (core-seconds)")
    right.set_ylabel("time lost to (what)")
    style.settle(axes)
    _foot(figure, found, f"{found.attrs.get('batch', '')}.")
    return figure


@style.drawn
def spending_figure(found: Results) -> "Figure":
    """Error of a steady mean against core time, a line a tolerance; below, what each tolerance is off by."""
    figure, axes = style.grid(2, 1, 150.0, height_ratios=(2.2, 1.0))
    top, bottom = axes[:, 0]
    tolerance, seconds = found["tolerance"].to_numpy(), found["spent_seconds"].to_numpy()
    model = found["spent_model"].to_numpy()
    model = np.where(model > 0.0, model, np.nan)
    best = float(found["cheapest_tolerance"][np.abs(found["aim"].to_numpy() - AIM).argmin()])
    for k, rtol in enumerate(tolerance):
        look = k % len(style.CYCLE)
        if rtol == best:
            top.loglog(seconds[k], model[k], color="#cccccc", lw=5.0, solid_capstyle="round")
        top.loglog(seconds[k], model[k], color=style.CYCLE[look], ls=style.DASHES[look], lw=0.8)
        top.plot(
            seconds[k], found["spent_error"].to_numpy()[k], ls="none", marker=style.MARKERS[look],
            ms=2.8, color=style.CYCLE[look],
        )  # fmt: skip
        top.plot(
            [], [], color=style.CYCLE[look], ls=style.DASHES[look], marker=style.MARKERS[look],
            ms=2.8, label=f"{rtol:.0e}" + (" (cheapest)" if rtol == best else ""),
        )  # fmt: skip
    top.plot(
        found["cheapest_seconds"], found["aim"], ls="none", marker="*", ms=6.0, color="black",
        mfc="white", label="cheapest to an error",
    )  # fmt: skip
    top.set_xlabel("core time, spin-up included (s)")
    top.set_ylabel("relative error of $f$ (–)")
    bias, doubt = (found[name].to_numpy() for name in ("tolerance_bias", "tolerance_bias_error"))
    bottom.errorbar(
        tolerance, np.abs(bias), 2.0 * doubt, ls="none", marker="o", ms=2.8, elinewidth=0.6,
        color=style.CYCLE[0],
    )  # fmt: skip
    bottom.set_xscale("log")
    bottom.set_yscale("log")
    bottom.invert_xaxis()
    bottom.set_xlabel("relative tolerance (–)")
    bottom.set_ylabel("bias of $f$ (–)")
    style.settle(axes)
    handles, names = top.get_legend_handles_labels()
    figure.legend(handles, names, title="relative tolerance", loc="outside upper center", ncols=2)
    _foot(
        figure,
        found,
        f"Marks: measured; lines: bias and variance over revolutions; grey: cheapest to {AIM:.0%}.",
        f"{found.attrs.get('motion', '')}.",
    )
    return figure


@style.drawn
def total_figure(found: Results) -> "Figure":
    """Total error of f of one design against run time: the cheapest settings, three targets, and the scene's own settings."""
    figure, axes = style.grid(1, 1, 90.0)
    panel, best = axes[0, 0], targets.front(found)
    beyond = sum(way.error > 0.1 * targets.TARGETS[-1] for way in best)
    best = best[: beyond + 1]  # what is far more accurate than all targets is of no interest
    panel.loglog(
        [1e3 * way.seconds for way in best], [way.error for way in best], color=style.CYCLE[0],
        drawstyle="steps-post", label="cheapest settings",
    )  # fmt: skip
    if (own := targets.settings(found)) is not None:
        panel.plot(
            1e3 * own.seconds, own.error, ls="none", marker="s", ms=9.0, color=style.PALETTE["vermilion"],
            mfc="none", label="your settings", zorder=4,
        )  # fmt: skip
    _with_room(panel)
    for way, aims, mark in zip(*_recommended(panel, found), _TARGET_MARKS, strict=False):
        panel.plot(
            1e3 * way.seconds, way.error, ls="none", marker=mark, ms=_MARK, color="black", mfc="white",
            label="for " + ", ".join(f"{aim * 100:g}" for aim in aims) + " %", zorder=5,
        )  # fmt: skip
    panel.set_xlabel("core time of one design (ms)")
    panel.set_ylabel("relative error of $f$ (–)")
    style.settle([panel])
    _decades(panel.yaxis)
    _plain(panel)
    _legend_above(figure, panel)
    _foot(figure, found, targets.caption(found))
    return figure


def _with_room(panel: "Axes") -> None:
    """Set ranges of logarithmic axes wide enough for a tick, 1, 2 or 5 of the time and a power of ten of the error."""
    box = panel.dataLim
    panel.set_xlim(0.7 * box.x0, 1.8 * box.x1)
    panel.set_ylim(0.3 * box.y0, 3.4 * box.y1)


_TARGET_MARKS, _MARK = "*Dp", 6.0
"""Marks of recommended settings, and their size in points."""


def _recommended(panel: "Axes", found: Results) -> tuple[list[targets.Way], list[list[float]]]:
    """Recommended settings and the targets of each; settings whose marks would cover each other are one, the more accurate."""
    kept: list[targets.Way] = []
    aims: list[list[float]] = []
    for target in reversed(targets.TARGETS):
        way = targets.cheapest(found, target)
        if way is None:
            continue
        if kept:
            places = panel.transData.transform([(1e3 * w.seconds, w.error) for w in (way, kept[0])])
            apart = np.hypot(*(places[1] - places[0])) * 72.0 / panel.figure.dpi
            if apart < 1.5 * _MARK:
                aims[0].insert(0, target)
                continue
        kept.insert(0, way)
        aims.insert(0, [target])
    return kept, aims


FIGURES: "dict[str, Callable[[Results], Figure]]" = {
    "total": total_figure,
    "spending": spending_figure,
    "integration": integration_figure,
    "averaging": averaging_figure,
    "surrogate": surrogate_figure,
    "random_inputs": random_inputs_figure,
    "parallel": parallel_figure,
}
"""The figures of a dataset, by the name of their file."""

_CAPTIONS = {
    "spending": "Error of a steady mean against run time, by tolerance, and the bias of each tolerance.",
    "integration": "Error of one revolution against run time and force evaluations, by integrator.",
    "averaging": "Error of f against averaged revolutions, by transient.",
    "surrogate": "Accuracy of the surrogates against training samples.",
    "random_inputs": "Error of mean and standard deviation against Monte Carlo samples.",
    "parallel": "Speed-up on the available ranks, and time lost.",
}


def _total_caption(found: Results) -> str:
    return f"Total error of f of one design against core time. {targets.caption(found)}"


PARTS = tuple(
    FigureOf(
        "accuracy", f"accuracy-{name.replace('_', '-')}", draw, _CAPTIONS.get(name, _total_caption), k, apart=True
    )
    for k, (name, draw) in enumerate(FIGURES.items())
)  # fmt: skip

MAIN = {
    "total": ("spent_error", "averaging_error"),
    "spending": ("spent_error",),
    "integration": ("error",),
    "averaging": ("averaging_error",),
    "surrogate": ("r2",),
    "random_inputs": ("moment_error",),
    "parallel": ("strong_seconds",),
}
"""The variables that each of them shows: it can be drawn as soon as the first is there, and again with each other one."""
