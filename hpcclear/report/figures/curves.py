"""Tables of a scene as they are drawn: loads and torques against the crank angle, motions against time."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.pieces import Pieces, Rows, level, periodic
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results
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
    """Turns after which it repeats; 0 of rows over the time."""
    over: str
    """What its rows go by."""
    acting: Pieces | None = None
    """The curve that acts; a motion has no such entry."""


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
                entries += [
                    (f"mechanism.{table}.{row.name}.{name}", getattr(row, name, None), unit)
                    for name, unit in _ENTRIES.items()
                ]
    rows_of = {row.name: row for row in getattr(scene.mechanism, "loads", ())}
    found = []
    for key, rows, unit in entries:
        if isinstance(rows, tuple):
            load = rows_of.get(key.split(".")[2]) if key.startswith("mechanism.loads.") else None
            found.append(_tabulated(scene, key, rows, unit, turns, load))
    return found


_ENTRIES = {
    "size": "N", "torque": "N*m", "angle": "rad", "speed_by_time": "rad/s", "size_by_time": "N", "torque_by_time": "N*m",
}  # fmt: skip


def _tabulated(scene: Scene, key: str, rows: Rows, unit: str, turns: int, load: Any) -> Tabulated:
    interpolation = scene.numerics.interpolation
    if unit == "rad":
        return Tabulated(key, rows, unit, 0, "time")
    if key.endswith("_by_time"):
        repeats = getattr(load, "repeats", False)
        how = "smooth" if unit == "rad/s" else interpolation
        curve = periodic(rows, rows[-1][0], how) if repeats else level(rows, how)
        return Tabulated(key, rows, unit, 0, "time", curve)
    body = getattr(load, "angle_of", None)
    turns = turns if body is None else 1
    over = "crank angle" if body is None else f"angle of {body}"
    return Tabulated(
        key, rows, unit, turns, over, periodic(rows, 2.0 * np.pi * turns, interpolation)
    )


@style.drawn
def tables_figure(found: Results) -> "Figure":
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
        factor = np.degrees(1.0) if curve.turns else 1.0
        if curve.turns:
            places = np.mod(places, 2.0 * np.pi * curve.turns)
            axes.set_xlim(0.0, 360.0 * curve.turns)
            axes.set_xticks(np.arange(0.0, 360.0 * curve.turns + 1.0, 90.0 * curve.turns))
        else:
            axes.set_xlim(0.0, places[-1])
        if curve.acting is not None:
            lines = _drawn(curve.acting)
        else:
            lines = places, values
        color = style.CYCLE[2]
        axes.plot(factor * lines[0], shown.factor * lines[1], lw=0.9, color=color)
        if len(curve.rows) <= _FEW:
            axes.plot(factor * places, shown.factor * values, ".", ms=3.0, color=color)
        label = f"{curve.over} ({'°' if curve.turns else 's'})"
        axes.set_xlabel(label, fontsize=style.SMALL, labelpad=1.0)
        axes.tick_params(labelsize=style.SMALL)
        axes.set_title(
            labels.literal(shown.label(curve.key)), fontsize=style.SMALL, pad=2.0, loc="left"
        )


def _drawn(curve: Pieces) -> tuple[Array, Array]:
    """Places and values of a curve over its length, some within each piece however short it is."""
    ends = np.append(curve.starts, 1.0)
    share = (ends[:-1, None] + np.diff(ends)[:, None] * np.arange(8) / 8.0).ravel()
    last = np.nextafter(1.0, 0.0)
    places = np.append(share, last) * curve.length
    return places, curve.at(places)
