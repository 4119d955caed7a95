"""Figure of guides with clearance in a response (kind ``response``): where sliders stand, and which corners touch when."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, motion, style
from hpcclear.results.content import Results, texts_in


class Touch(NamedTuple):
    """The beginning of a contact."""

    time: float
    """s."""
    turn: float
    """Revolutions of the crank since the start."""
    contact: str
    """Label along the dimension ``joint``."""


def touches(response: Results) -> list[Touch]:
    """Contacts of a response in the order in which they begin.

    Those between two stored instants are missed: store every step, `output.instants_per_revolution` = 0. A law of impacts
    begins a step at each impact, so that its instant is exact then.
    """
    time, turn = response["time"].values, motion.turns(response)
    depth = response["penetration"].values > 0.0
    return sorted(
        Touch(float(time[k]), float(turn[k]), str(label))
        for column, label in zip(depth.T, response["joint"].values, strict=True)
        for k in np.flatnonzero(column[1:] & ~column[:-1]) + 1
    )


@style.figure("offset, tilt and contacts in guides", 40, along="guide")
def guide_figure(response: Results) -> "style.Figure":
    """Offset, tilt and contacts of sliders over the last two revolutions. Raises InputError where no guide has clearance."""
    if "guide" not in response.sizes:
        remedy = "Give a slide a clearance, length, height and corner_radius"
        raise InputError("guide", "", "no guide of this mechanism has clearance", remedy)
    shown = motion.latest(response)
    turn, guides = motion.turns(shown), texts_in(shown, "guide")
    figure, axes = style.grid(3, 1, 110.0, sharex=True)
    for panel, name in zip(axes[:2, 0], ("guide_offset", "guide_tilt"), strict=True):
        unit = labels.of(shown[name])
        for row, guide in enumerate(guides):
            values = unit(shown[name].sel(guide=guide))
            panel.plot(turn, values, color=style.colour(row), lw=0.7, label=guide)
        panel.set_ylabel(unit.label(name.replace("guide_", "")))
    if len(guides) > 1:
        style.key(axes[0, 0], "above")
    _corners(axes[2, 0], shown, turn)
    axes[2, 0].set_xlabel(motion.turns_label(shown))
    figure.align_ylabels()
    return figure


def _corners(panel: "style.Axes", shown: Results, turn: Array) -> None:
    """A row for each corner, filled while it touches, with a tick where a contact begins."""
    rows = [label for label in texts_in(shown, "joint") if "." in label]
    for row, label in enumerate(rows):
        depth = shown["penetration"].sel(joint=label).values
        colour, ends = style.colour(row), (row - 0.3, row + 0.3)
        panel.fill_between(turn, *ends, where=depth > 0.0, color=colour, alpha=0.5, lw=0.0)
        begun = [one.turn for one in touches(shown) if one.contact == label]
        panel.plot(begun, np.full(len(begun), row), "|", color=colour, ms=5.0)
    panel.set_yticks(range(len(rows)), [label.replace("_", " ") for label in rows])
    panel.set_ylim(len(rows) - 0.5, -0.5)
    panel.set_title("corners in contact")
