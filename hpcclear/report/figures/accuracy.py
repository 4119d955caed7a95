"""Figures of what accuracy costs (kind ``accuracy``): one for each approximation of a study."""

import numpy as np

from hpcclear.report import targets
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results, texts_in

AIM = 0.01
"""Relative standard error whose cheapest tolerance is marked."""

_WORDS = {"peak_contact_force": "contact-force peak", "objective": "objective $f$"}
"""What quantities are called besides their names."""


def _foot(figure: "style.Figure", found: Results, sentence: str = "", *about: str) -> None:
    """Where the numbers come from, below a figure: a sentence, attributes of the file, and what made it."""
    said = "; ".join(str(found.attrs.get(name, "")) for name in about)
    lines = [sentence] * bool(sentence) + [f"{said}."] * bool(about)
    made = [str(found.attrs.get(name, "")) for name in ("processor", "versions")]
    figure.supxlabel(labels.literal("\n".join([*lines, *made])), x=0.02, ha="left", wrap=True)


def _mark(marker: str, size: float) -> "style.Look":
    """Marks alone, in the colour of text."""
    return {"ls": "none", "marker": marker, "ms": size, "color": style.colour("ink")}


def _decades(axis: "style.Axis") -> None:
    """Few decade ticks, so that labels do not meet in half a column."""
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(numticks=5))
    axis.set_minor_formatter(NullFormatter())


FEW_DECADES = 50.0
"""Ratio of the ends of a time axis above which only decades have a tick: more labels would meet."""


def _plain(axis: "style.Axes") -> None:
    """A logarithmic time axis above a panel, with plain numbers at its ticks."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_xlim()
    subs = (1.0, 2.0, 5.0) if high < FEW_DECADES * low else (1.0,)
    axis.xaxis.set_major_locator(LogLocator(subs=subs, numticks=12))
    axis.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axis.xaxis.set_minor_formatter(NullFormatter())


@style.figure(
    "Error of one revolution against run time and force evaluations, by integrator.", 2, name="accuracy-integration",
)  # fmt: skip
def integration_figure(accuracy: Results) -> "style.Figure":
    """Work and precision: error of each quantity against wall time (left) and force evaluations (right)."""
    quantities = texts_in(accuracy, "quantity")
    figure, axes = style.grid(len(quantities), 2, 215.0, sharey="row", sharex="col")
    for row, quantity in enumerate(quantities):
        here = accuracy.sel(quantity=quantity)
        for column, work in enumerate(("seconds", "evaluations")):
            _ladder(axes[row, column], here, work)
        words = _WORDS.get(quantity, quantity.replace("_", " "))
        axes[row, 0].set_ylabel(f"{words} relative error (–)")
    axes[-1, 0].set_xlabel("wall time (ms)")
    axes[-1, 1].set_xlabel("force evaluations (–)")
    style.legend(figure, axes[0, 0], "upper")
    grey = "Errors of the grey region, with hollow marks, are below 100 times the reference's own error."
    _foot(figure, accuracy, grey, "designs", "repeats")
    return figure


def _ladder(axes: "style.Axes", here: Results, work: str) -> None:
    """One line a method; what the reference cannot resolve is hollow."""
    factor = 1e3 if work == "seconds" else 1.0
    floor = targets.MARGIN * float(here["reference_error"])
    for k, method in enumerate(here["integrator"].values):
        x, y = here[work].values[k] * factor, here["error"].values[k]
        look, unresolved = {**style.look(k), "ms": 2.8, "mew": 0.6}, y < floor
        axes.loglog(x, y, lw=0.8, label=labels.literal(str(method)), **look)
        axes.plot(x[unresolved], y[unresolved], mfc=style.colour("paper"), **{**look, "ls": "none"})
    if np.isfinite(floor):
        axes.axhspan(axes.get_ylim()[0], floor, color=style.colour("faint"), alpha=0.5, zorder=0)
    for axis in (axes.xaxis, axes.yaxis):
        _decades(axis)


@style.figure(
    "Error of f against averaged revolutions, by transient.", 3, name="accuracy-averaging"
)
def averaging_figure(accuracy: Results) -> "style.Figure":
    """Error of the objective against revolutions averaged, for several transients, and its lower bound."""
    figure, axes = style.grid(1, 1, 100.0)
    panel, error = axes[0, 0], accuracy["averaging_error"]
    for k, transient in enumerate(accuracy["transient"].values):
        y = error.sel(transient=transient).values
        panel.loglog(accuracy["averaged"], y, label=str(transient), **style.look(k))
    floor = float(accuracy["averaging_floor"])
    if floor > 0.0:
        panel.axhline(floor, color=style.colour("ink"), lw=0.6, ls=(0, (6, 2)))
        place: style.Look = {"xycoords": ("axes fraction", "data"), "ha": "right", "va": "bottom"}
        panel.annotate(f"scatter of replicas {floor:.0e}", (0.99, floor), **place)
    style.legend(figure, panel, "upper", title="transient revolutions")
    panel.set(xlabel="averaged revolutions (–)", ylabel="relative error of $f$ (–)")
    turn = 1e3 * float(accuracy["turn_seconds"])
    above = panel.secondary_xaxis("top", functions=(lambda x: x * turn, lambda t: t / turn))
    above.set_xlabel("core time of the averaged revolutions (ms)")
    _plain(above)
    text = "perturbed by 1e-10, half of them at a ten times tighter tolerance."
    _foot(figure, accuracy, f"{accuracy.attrs.get('copies', '')}, {text}")
    return figure


@style.figure("Accuracy of the surrogates against training samples.", 4, name="accuracy-surrogate")
def surrogate_figure(accuracy: Results) -> "style.Figure":
    """Accuracy of response surface and Kriging against sample size, with the simulation time above."""
    figure, axes = style.grid(3, 1, 145.0, sharex=True)
    size, each = accuracy["training"].values, float(accuracy["sample_seconds"])
    rows = (
        ("unexplained share $1 - R^2$ (–)", 1.0 - accuracy["r2"].values),
        ("RMAE (–)", accuracy["rmae"].values),
        ("leave-one-out error over std. dev. (–)", accuracy["leave_one_out"].values),
    )
    for panel, (words, values) in zip(axes[:, 0], rows, strict=True):
        for k, surrogate in enumerate(accuracy["surrogate"].values):
            panel.loglog(size, values[k], label=surrogate, **style.look(k))
        panel.set_ylabel(words)
    style.key(axes[0, 0])
    axes[-1, 0].set_xlabel("training samples (–)")
    axes[-1, 0].set_xticks(size, [str(n) for n in size])
    axes[-1, 0].minorticks_off()
    above = axes[0, 0].secondary_xaxis("top", functions=(lambda x: x * each, lambda t: t / each))
    above.set_xlabel("simulation time (core-seconds)")
    _plain(above)
    _foot(figure, accuracy, f"{accuracy.attrs.get('study', '')}; fresh test points.")
    return figure


@style.figure(
    "Error of mean and standard deviation against Monte Carlo samples.", 5, name="accuracy-random-inputs",
)  # fmt: skip
def random_inputs_figure(accuracy: Results) -> "style.Figure":
    """Error of mean and standard deviation against Monte Carlo size and time, with 95 % CI; the surrogate's bias."""
    figure, axes = style.grid(2, 2, 130.0, sharey="row", sharex="col")
    for row, moment in enumerate(accuracy["moment"].values):
        here = accuracy.sel(moment=moment)
        for k, estimate in enumerate(accuracy["estimate"].values):
            one = here.sel(estimate=estimate)
            y = one["moment_error"].values
            bars = [y - one["moment_lower"].values, one["moment_upper"].values - y]
            look = {"elinewidth": 0.6, "label": str(estimate), **style.look(k)}
            for column, x in enumerate((accuracy["draws"], one["moment_seconds"])):
                axes[row, column].errorbar(x.values, y, bars, **look)
        line: style.Look = {"color": style.colour("ink"), "lw": 0.6, "ls": (0, (6, 2))}
        for panel in axes[row]:
            panel.set(xscale="log", yscale="log")
            panel.axhline(abs(float(here["moment_bias"])), **line, label="surrogate's bias")
        dots: style.Look = {"color": style.colour("green"), "lw": 0.8, "ls": ":"}
        axes[row, 1].axvline(float(accuracy["quadrature_seconds"]), **dots, label="quadrature")
        axes[row, 0].set_ylabel(f"relative error of the {moment} (–)")
    axes[-1, 0].set_xlabel("Monte Carlo size (–)")
    axes[-1, 1].set_xlabel("core time (s)")
    for panel in axes.flat:
        _decades(panel.xaxis)
    style.legend(figure, axes[0, 1], "upper")
    text = "Bars: 95 % confidence; the bias is the surrogate's, by quadrature, against all simulations."
    _foot(figure, accuracy, text, "study")
    return figure


@style.figure("Speed-up on the available ranks, and time lost.", 6, name="accuracy-parallel")
def parallel_figure(accuracy: Results) -> "style.Figure":
    """Speed-up and efficiency on the available ranks, and the core-seconds lost."""
    figure, axes = style.grid(1, 2, 80.0)
    number = accuracy["ranks"].values
    strong, weak = accuracy["strong_seconds"].values, accuracy["weak_seconds"].values
    left, right = axes[0]
    left.plot(number, strong[0] / strong, "o-", color=style.colour(0), label="same batch")
    left.plot(number, number * weak[0] / weak, "s--", color=style.colour(1), label="batch a rank")
    left.plot(number, number, color=style.colour("grey"), lw=0.6, label="ideal")
    left.set_xticks(number, [str(n) for n in number])
    left.set(xlabel="ranks (–)", ylabel="speed-up (–)")
    style.key(left)
    lost = accuracy["lost_seconds"].values
    right.barh(np.arange(len(lost)), np.nan_to_num(lost), color=style.colour("sky"))
    right.set_yticks(np.arange(len(lost)), texts_in(accuracy, "loss"))
    right.set(xlabel="lost (core-seconds)", ylabel="time lost to (what)")
    _foot(figure, accuracy, "", "batch")
    return figure


@style.figure(
    "Error of a steady mean against run time by tolerance, and the bias of each.", 1, name="accuracy-spending",
)  # fmt: skip
def spending_figure(accuracy: Results) -> "style.Figure":
    """Error of a steady mean against core time, a line a tolerance; below, what each tolerance is off by."""
    figure, axes = style.grid(2, 1, 150.0, height_ratios=(2.2, 1.0))
    top, bottom = axes[:, 0]
    tolerance, seconds = accuracy["tolerance"].values, accuracy["spent_seconds"].values
    model = accuracy["spent_model"].values
    model = np.where(model > 0.0, model, np.nan)
    best = float(accuracy["cheapest_tolerance"][np.abs(accuracy["aim"].values - AIM).argmin()])
    for k, rtol in enumerate(tolerance):
        if rtol == best:
            wide: style.Look = {"lw": 5.0, "solid_capstyle": "round"}
            top.loglog(seconds[k], model[k], color=style.colour("faint"), **wide)
        look = {**style.look(k), "ms": 2.8}
        top.loglog(seconds[k], model[k], lw=0.8, **{**look, "marker": ""})
        top.plot(seconds[k], accuracy["spent_error"].values[k], **{**look, "ls": "none"})
        top.plot([], [], label=f"{rtol:.0e}" + (" (cheapest)" if rtol == best else ""), **look)
    stars = {**_mark("*", 6.0), "mfc": style.colour("paper"), "label": "cheapest to an error"}
    top.plot(accuracy["cheapest_seconds"], accuracy["aim"], **stars)
    top.set(xlabel="core time, spin-up included (s)", ylabel="relative error of $f$ (–)")
    bias, doubt = (accuracy[name].values for name in ("tolerance_bias", "tolerance_bias_error"))
    bars = {**_mark("o", 2.8), "elinewidth": 0.6, "color": style.colour(0)}
    bottom.errorbar(tolerance, np.abs(bias), 2.0 * doubt, **bars)
    bottom.set(xscale="log", yscale="log")
    bottom.set(xlabel="relative tolerance (–)", ylabel="bias of $f$ (–)")
    bottom.invert_xaxis()
    style.legend(figure, top, "upper", title="relative tolerance")
    text = "Marks: measured; lines: bias and variance over revolutions"
    _foot(figure, accuracy, f"{text}; grey: cheapest to {100 * AIM:.0f} %.", "motion")
    return figure


@style.figure(
    lambda found: f"Total error of f of one design against core time. {targets.caption(found)}", name="accuracy-total",
)  # fmt: skip
def total_figure(accuracy: Results) -> "style.Figure":
    """Total error of f of one design against run time: the cheapest settings, three targets, and the scene's own settings."""
    figure, axes = style.grid(1, 1, 90.0)
    panel, best = axes[0, 0], targets.front(accuracy)
    beyond = sum(way.error > 0.1 * targets.TARGETS[-1] for way in best)
    best = best[: beyond + 1]  # what is far more accurate than all targets is of no interest
    seconds, errors = [1e3 * way.seconds for way in best], [way.error for way in best]
    steps: style.Look = {"color": style.colour(0), "drawstyle": "steps-post"}
    panel.loglog(seconds, errors, **steps, label="cheapest settings")
    if (own := targets.settings(accuracy)) is not None:
        square = {**_mark("s", 9.0), "color": style.colour("vermilion"), "mfc": "none", "zorder": 4}
        panel.plot(1e3 * own.seconds, own.error, **square, label="your settings")
    # wide enough for a tick: 1, 2 or 5 of the time, a power of ten of the error
    box = panel.dataLim
    if np.isfinite(box.get_points()).all():  # none where everything failed
        panel.set(xlim=(0.7 * box.x0, 1.8 * box.x1), ylim=(0.3 * box.y0, 3.4 * box.y1))
    best_for: dict[targets.Way, list[str]] = {}
    for aim in targets.TARGETS:
        if (way := targets.cheapest(accuracy, aim)) is not None:
            best_for.setdefault(way, []).append(f"{aim * 100:g}")
    for (way, aims), mark in zip(best_for.items(), "*Dp", strict=False):
        look = {**_mark(mark, 6.0), "mfc": style.colour("paper"), "zorder": 5}
        panel.plot(1e3 * way.seconds, way.error, **look, label=f"for {', '.join(aims)} %")
    panel.set(xlabel="core time of one design (ms)", ylabel="relative error of $f$ (–)")
    _decades(panel.yaxis)
    _plain(panel)
    style.legend(figure, panel, "upper")
    _foot(figure, accuracy, targets.caption(accuracy))
    return figure


SHOWN = {
    total_figure: ("spent_error", "averaging_error"),
    spending_figure: ("spent_error",),
    integration_figure: ("error",),
    averaging_figure: ("averaging_error",),
    surrogate_figure: ("r2",),
    random_inputs_figure: ("moment_error",),
    parallel_figure: ("strong_seconds",),
}
"""The variables that each figure shows: it can be drawn as soon as the first is there, and again with each other one."""
