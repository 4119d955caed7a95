"""Figures of identified unknowns (kind ``identify``): posterior, fit of the features, growth."""

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results, texts_in

BINS = 60
DAY = 86400.0


def _check(identify: Results) -> None:
    """Raise InputError where nothing was measured."""
    if "interval" not in identify:
        reason = "no signal was measured"
        raise InputError("identify", 0, reason, "Give hpcclear identify a --signal")


def _entry(identify: Results, unknown: int, scale: labels.Scale) -> str:
    """The label of an axis of an unknown."""
    return scale.label(labels.entry(texts_in(identify, "unknown")[unknown]))


@style.figure("Posterior of each unknown with its calibrated 95 % interval.")
def posterior_figure(identify: Results) -> "style.Figure":
    """Posterior of each unknown, a line a record, with its 95 % interval below. Raises InputError if no signal was measured."""
    _check(identify)
    count = identify.sizes["unknown"]
    figure, axes = style.grid(count, 1, 10.0 + 45.0 * count)
    for u, panel in enumerate(axes[:, 0]):
        low, high = (float(identify[f"prior_{end}"][u]) for end in ("lower", "upper"))
        scale = labels.scale(str(identify["unit"].values[u]), [low, high])
        edges = np.linspace(low, high, BINS + 1)
        for k, record in enumerate(identify["record"].values):
            colour = style.colour(k)
            values = identify["posterior"].values[k, :, u]
            density = np.histogram(values, edges)[0] / (len(values) * np.diff(edges) * scale.factor)
            panel.stairs(density, scale(edges), color=colour, label=labels.literal(str(record)))
            ends = scale(identify["interval"].values[k, u])
            level = -0.04 * (k + 1) * max(density.max(), 1e-300)
            panel.plot(ends[[0, 2]], [level, level], color=colour, lw=2.0)
        panel.set(xlabel=_entry(identify, u, scale), ylabel=f"density (1/{scale.unit})")
        style.key(panel, "upper right")
    return figure


@style.figure(
    "Measured less predicted features of the last record, in standard deviations of the prediction.", 1
)  # fmt: skip
def features_figure(identify: Results) -> "style.Figure":
    """Measured less predicted features of the last record over their predictive standard deviation. Raises InputError where no
    signal was measured."""
    _check(identify)
    last = identify.isel(record=-1)
    measured, predicted = last["measured"].values, last["predicted"].values
    score = (measured - predicted) / last["predicted_deviation"].values
    figure, axes = style.grid(1, 1, 60.0)
    panel = axes[0, 0]
    words = "two standard deviations"
    panel.axhspan(-2.0, 2.0, color=style.colour("sky"), alpha=0.3, lw=0, label=words)
    panel.plot(np.arange(len(score)), score, "o", color=style.colour("blue"))
    worst = int(last["worst_feature"])
    name = str(last["feature"].values[worst])
    panel.plot(worst, score[worst], "s", color=style.colour("vermilion"), label=name)
    panel.set(xlabel="number of the feature (–)", ylabel="standard score (–)")
    style.key(panel)
    return figure


@style.figure("Unknowns over the dates of the records, with 95 % intervals and the median rate.", 2)
def growth_figure(identify: Results) -> "style.Figure":
    """Median and 95 % interval at each record, rate of growth, and limit. Raises InputError without two records with dates."""
    _check(identify)
    if "rate" not in identify:
        reason = "growth needs two records with dates"
        raise InputError("identify", 1, reason, "Give a --signal and a --date for each")
    count, days = identify.sizes["unknown"], identify["elapsed"].values / DAY
    figure, axes = style.grid(count, 1, 10.0 + 45.0 * count)
    for u, panel in enumerate(axes[:, 0]):
        unit = str(identify["unit"].values[u])
        good = identify["explained"].values != 0
        low, middle, high = (identify["interval"].values[:, u, k] for k in range(3))
        scale = labels.scale(unit, high)
        panel.errorbar(
            days, scale(middle), scale([middle - low, high - middle]), fmt="o",
            color=style.colour("blue"), capsize=2.0, label="median, 95 % interval",
        )  # fmt: skip
        rate = float(identify["rate"][1, u]) * DAY
        line = np.mean(middle[good]) + rate * (days - np.mean(days[good]))
        panel.plot(days, scale(line), color=style.colour("grey"), label="median rate")
        if "limit" in identify.attrs:
            limit = scale.factor * float(identify.attrs["limit"])
            panel.axhline(limit, color=style.colour("orange"), ls="--", label="limit")
        panel.set(xlabel="time since the first record (days)", ylabel=_entry(identify, u, scale))
        style.key(panel)
    return figure
