"""Figure of where the time went (kind ``timing``)."""

import numpy as np

from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results


@style.figure("Time of the ranks, by rank and by stage.")
def timing_figure(timing: Results) -> "style.Figure":
    """How every rank spent its time, and how much of it each stage took (kind ``timing``)."""
    shown = min(timing.sizes["rank"], 64), timing.sizes["stage"]
    sizes = [max(3, size) for size in shown]
    figure, axes = style.grid(2, 1, 40.0 + 5.0 * sum(sizes), height_ratios=sizes)
    parts = [("busy", "computing", "blue"), ("compile", "compiling", "orange")]
    parts += [("write", "writing", "green"), ("idle", "waiting", "grey")]
    for panel, along, over in zip(axes[:, 0], ("rank", "stage"), (1, 0), strict=True):
        names = [labels.literal(str(name)) for name in timing[along].values]
        left = np.zeros(len(names))
        for name, label, colour in parts:
            spent = timing[name].values.sum(over)
            look: style.Look = {"left": left, "color": style.colour(colour), "label": label}
            panel.barh(np.arange(len(names)), spent, 0.7, **look)
            left += spent
        if len(names) <= 64:
            panel.set_yticks(np.arange(len(names)), names)
        panel.invert_yaxis()
        panel.grid(axis="y", visible=False)
        across = "time (s)" if along == "rank" else "time of all ranks (s)"
        panel.set(xlabel=across, ylabel=f"{along} (–)")
    style.legend(figure, axes[0, 0], "lower", columnspacing=1.0)
    return figure
