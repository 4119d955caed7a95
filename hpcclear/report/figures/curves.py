"""Tables of a scene as they are drawn: loads and torques against the crank angle, motions against time."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.scene import Scene
from hpcclear.scene.loading import scene_of_text
from hpcclear.scene.planar import Planar, turns_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

HEIGHT = 26.0
"""mm of one curve."""
_FEW = 40
"""Rows of a table up to which each is marked."""


class Tabulated(NamedTuple):
    """A table of a scene."""

    key: str
    """Dotted path of its entry."""
    rows: tuple[tuple[float, float], ...]
    """Angle in rad, or time in s, and value in SI."""
    unit: str
    turns: int
    """Of a revolution; 0 of a motion, whose rows are times."""


def tabulated(scene: Scene) -> list[Tabulated]:
    """Every table of a scene: what acts on it, and how it is moved."""
    planar = isinstance(scene.mechanism, Planar)
    turns = turns_of(scene.mechanism) if planar else getattr(scene.drive, "turns", 1)  # type: ignore[arg-type]
    entries = [
        ("effects.slider_load", scene.effects.slider_load, "N"),
        ("drive.torque", getattr(scene.drive, "torque", None), "N*m"),
    ]
    if isinstance(scene.mechanism, Planar):
        for table in ("drives", "loads"):
            for row in getattr(scene.mechanism, table):
                for name, unit in (("size", "N"), ("torque", "N*m"), ("angle", "rad")):
                    key = f"mechanism.{table}.{row.name}.{name}"
                    entries.append((key, getattr(row, name, None), unit))
    return [
        Tabulated(key, rows, unit, 0 if unit == "rad" else turns)
        for key, rows, unit in entries
        if isinstance(rows, tuple)
    ]


@style.drawn
def tables_figure(found: xr.Dataset) -> "Figure":
    """Return the tables of the scene of a response (kind ``response``), below one another; raises InputError without any."""
    tables = tabulated(scene_of_text(str(found.attrs["scene"]), "scene"))
    if not tables:
        reason = "nothing in the scene is given by a table"
        raise InputError("scene", "tables", reason, "Draw another figure")
    figure = style.page(HEIGHT * len(tables))
    figure.set_layout_engine("none")
    draw(figure, tables, 1.0, 1.0 / len(tables))
    return figure


def draw(figure: "Figure", curves: list[Tabulated], top: float, height: float) -> None:
    """Draw curves below one another, from `top` down, each `height` high; shares of the figure."""
    for number, curve in enumerate(curves):
        bottom = top - (number + 1) * height
        axes = figure.add_axes((0.17, bottom + 0.42 * height, 0.79, 0.42 * height))
        places, values = np.array(curve.rows).T
        shown = labels.scale(curve.unit, values)
        if curve.turns:
            turn = 2.0 * np.pi * curve.turns
            places = np.mod(places, turn)
            order = np.argsort(places, kind="stable")
            places, values = places[order], values[order]
            # beyond both ends, so that the seam is seen as the kernel closes it
            places = np.concatenate([places[-1:] - turn, places, places[:1] + turn])
            values = np.concatenate([values[-1:], values, values[:1]])
            axes.set_xlim(0.0, 360.0 * curve.turns)
            axes.set_xticks(np.arange(0.0, 360.0 * curve.turns + 1.0, 90.0 * curve.turns))
            places, label = np.degrees(places), "crank angle (°)"
        else:
            axes.set_xlim(places[0], places[-1])
            label = "time (s)"
        mark = "." if len(curve.rows) <= _FEW else ""
        axes.plot(places, shown.factor * values, marker=mark, ms=3.0, lw=0.9, color=style.CYCLE[2])
        axes.set_xlabel(label, fontsize=style.SMALL, labelpad=1.0)
        axes.tick_params(labelsize=style.SMALL)
        axes.set_title(
            labels.literal(shown.label(curve.key)), fontsize=style.SMALL, pad=2.0, loc="left"
        )
