"""Figures of identified unknowns (kind ``identify``): posterior, fit of the features, growth."""

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.report.parts import FigureOf
from hpcclear.results.content import Results

BINS = 60
DAY = 86400.0


def _check(content: Results) -> None:
    """Raise InputError where nothing was measured."""
    if "interval" not in content:
        reason = "no signal was measured"
        raise InputError("identify", 0, reason, "Give hpcclear identify a --signal")


@style.drawn
def posterior_figure(content: Results) -> "style.Figure":
    """Posterior of each unknown, a line for each record, with the calibrated 95 % interval below; of kind ``identify``.

    Raises
    ------
    InputError
        No signal was measured.
    """
    _check(content)
    count = content.sizes["unknown"]
    figure, axes = style.grid(count, 1, 10.0 + 45.0 * count)
    for u, panel in enumerate(axes[:, 0]):
        low, high = (float(content[f"prior_{end}"][u]) for end in ("lower", "upper"))
        scale = labels.scale(str(content["unit"].to_numpy()[u]), [low, high])
        edges = np.linspace(low, high, BINS + 1)
        for k, record in enumerate(content["record"].to_numpy()):
            colour = style.CYCLE[k % len(style.CYCLE)]
            values = content["posterior"].to_numpy()[k, :, u]
            density = np.histogram(values, edges)[0] / (len(values) * np.diff(edges) * scale.factor)
            panel.stairs(density, scale(edges), color=colour, label=labels.literal(str(record)))
            ends = scale(content["interval"].to_numpy()[k, u])
            level = -0.04 * (k + 1) * max(density.max(), 1e-300)
            panel.plot(ends[[0, 2]], [level, level], color=colour, lw=2.0)
        panel.set(
            xlabel=scale.label(labels.entry(str(content["unknown"].to_numpy()[u]))),
            ylabel=f"density (1/{scale.unit})",
        )
        panel.legend(loc="upper right")
    return figure


@style.drawn
def features_figure(content: Results) -> "style.Figure":
    """Measured less predicted features over their predictive standard deviation, of the last record; of kind ``identify``.

    Raises
    ------
    InputError
        No signal was measured.
    """
    _check(content)
    last = content.isel(record=-1)
    measured, predicted = last["measured"].to_numpy(), last["predicted"].to_numpy()
    score = (measured - predicted) / last["predicted_deviation"].to_numpy()
    figure, axes = style.grid(1, 1, 60.0)
    panel = axes[0, 0]
    look = {
        "color": style.PALETTE["sky"],
        "alpha": 0.3,
        "lw": 0,
        "label": "two standard deviations",
    }
    panel.axhspan(-2.0, 2.0, **look)
    panel.plot(np.arange(len(score)), score, "o", color=style.PALETTE["blue"])
    worst = int(last["worst_feature"])
    name = str(last["feature"].to_numpy()[worst])
    panel.plot(worst, score[worst], "s", color=style.PALETTE["vermilion"], label=name)
    panel.set(xlabel="number of the feature (–)", ylabel="standard score (–)")
    panel.legend(loc="best")
    return figure


@style.drawn
def growth_figure(content: Results) -> "style.Figure":
    """Unknowns over time: median and 95 % interval at each record, the rate of growth, and the limit; of kind ``identify``.

    Raises
    ------
    InputError
        There is one record only.
    """
    _check(content)
    if "rate" not in content:
        raise InputError("identify", 1, "one record has no growth", "Give a --signal for each date")
    count, days = content.sizes["unknown"], content["elapsed"].to_numpy() / DAY
    figure, axes = style.grid(count, 1, 10.0 + 45.0 * count)
    for u, panel in enumerate(axes[:, 0]):
        unit = str(content["unit"].to_numpy()[u])
        good = content["explained"].to_numpy() != 0
        low, middle, high = (content["interval"].to_numpy()[:, u, k] for k in range(3))
        scale = labels.scale(unit, high)
        panel.errorbar(
            days, scale(middle), scale([middle - low, high - middle]), fmt="o",
            color=style.PALETTE["blue"], capsize=2.0, label="median, 95 % interval",
        )  # fmt: skip
        rate = float(content["rate"][1, u]) * DAY
        line = np.mean(middle[good]) + rate * (days - np.mean(days[good]))
        panel.plot(days, scale(line), color=style.PALETTE["grey"], label="median rate")
        if "limit" in content.attrs:
            limit = scale.factor * float(content.attrs["limit"])
            panel.axhline(limit, color=style.PALETTE["orange"], ls="--", label="limit")
        panel.set(
            xlabel="time since the first record (days)",
            ylabel=scale.label(labels.entry(str(content["unknown"].to_numpy()[u]))),
        )
        panel.legend(loc="best")
    return figure


PARTS = (
    FigureOf(
        "identify", "posterior", posterior_figure, "Posterior of each unknown with its calibrated 95 % interval."
    ),
    FigureOf(
        "identify", "features", features_figure,
        "Measured less predicted features of the last record, in standard deviations of the prediction.", 1,
    ),
    FigureOf(
        "identify", "growth", growth_figure,
        "Unknowns over the dates of the records, with 95 % intervals and the median rate.", 2,
    ),
)  # fmt: skip
