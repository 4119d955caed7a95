"""A simulated response over measured series (`hpcclear.report.compare`)."""

from typing import TYPE_CHECKING

import numpy as np

from hpcclear.base.units import factor
from hpcclear.report.figures import labels, style

if TYPE_CHECKING:
    from hpcclear.report.compare import Comparison


@style.drawn
def overlay_figure(comparison: "Comparison") -> "style.Figure":
    """Each quantity over the measured time or angle, in measured units: measured points, and all instants of the simulation."""
    count = len(comparison.quantities)
    figure, axes = style.grid(count, 1, 10.0 + 38.0 * count, sharex=True)
    across = scale(comparison.shown, "s" if comparison.axis == "time" else "rad")
    order = np.argsort(comparison.x, kind="stable")
    x, along = across(comparison.x[order]), across(comparison.series_x)
    steps = np.diff(along, prepend=along[:1])
    begins = steps * np.sign(np.median(steps)) < 0.0  # an angle that starts again from 0
    for panel, one in zip(axes[:, 0], comparison.quantities, strict=True):
        unit = scale(one.shown, one.unit)
        dots: style.Look = {"ms": 2.0, "mew": 0.0, "color": style.colour("grey")}
        panel.plot(x, unit(one.measured[order]), ".", label="measured", **dots)
        line = np.where(begins, np.nan, unit(one.series))
        panel.plot(along, line, color=style.colour("blue"), label="simulated")
        panel.set_ylabel(unit.label(labels.literal(one.label)))
    style.legend(figure, axes[0, 0], "upper")
    name = "measured time" if comparison.axis == "time" else "measured crank angle"
    axes[-1, 0].set_xlabel(across.label(name))
    figure.align_ylabels()
    return figure


def scale(unit: str, si: str) -> labels.Scale:
    """Return how to show numbers in the unit of the measurement, SI where it names none."""
    if not unit:
        return labels.Scale(1.0, labels.pretty(si))
    return labels.Scale(1.0 / float(factor(unit, "" if si == "1" else si)), unit)
