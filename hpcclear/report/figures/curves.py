"""Tables of a scene as they are drawn: loads and torques against the crank angle, motions against time."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.base.pieces import Pieces, level, periodic
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results
from hpcclear.scene import Scene
from hpcclear.scene.loading import scene_of_text
from hpcclear.scene.planar import turns_of

HEIGHT = 26.0
"""mm of one curve."""
_FEW = 40
"""Rows of a table up to which each is marked."""
_POINTS = 200
"""Points of a small drawing, about."""
_TURNING = labels.Scale(float(np.degrees(1.0)), "°")
_BY = {"time": labels.Scale(1.0, "s"), "speed": labels.Scale(30.0 / np.pi, "rpm")}
"""Units in which what rows go by is shown; angles in `_TURNING`."""


class Tabulated(NamedTuple):
    """A table of a scene."""

    key: str
    """Dotted path of its entry."""
    rows: tuple[tuple[float, float], ...]
    """Angle in rad, or time, speed or distance, and value in SI."""
    unit: str
    turns: int
    """Turns after which it repeats; 0 of rows that go by no angle."""
    over: str
    """What its rows go by."""
    acting: Pieces | None = None
    """The curve that acts; None where it is straight between the rows, and of a motion."""


def tabulated(scene: Scene) -> list[Tabulated]:
    """Every curve of a scene: what acts on it, and how it is moved."""
    linkage, how, found = scene.linkage, scene.numerics.interpolation, []
    turns = turns_of(linkage)
    for drive in linkage.drives:
        key, torque = f"mechanism.drives.{drive.name}", getattr(drive, "torque", None)
        if drive.kind == "table":
            found.append(Tabulated(f"{key}.angle", drive.angle, "rad", 0, "time"))
        elif drive.kind == "run-up":
            acting, entry = level(drive.speed_by_time), f"{key}.speed_by_time"
            found.append(Tabulated(entry, drive.speed_by_time, "rad/s", 0, "time", acting))
        elif isinstance(torque, tuple):
            curve = periodic(torque, 2.0 * np.pi * turns, how)
            found.append(Tabulated(f"{key}.torque", torque, "N*m", turns, "crank angle", curve))
        elif rows := getattr(drive, "torque_by_speed", None):
            found.append(Tabulated(f"{key}.torque_by_speed", rows, "N*m", 0, "speed"))
        elif isinstance(speed := getattr(drive, "no_load_speed", None), float):
            rows = ((0.0, float(torque or 0.0)), (speed, 0.0))
            found.append(Tabulated(f"{key}.torque", rows, "N*m", 0, "speed"))
    for load in linkage.loads:
        key = f"mechanism.loads.{load.name}"
        for rows in load.straight.values():
            found.append(Tabulated(f"{key}.force", rows, "N", 0, "distance"))
        if not load.table:
            continue
        entry, rows, over = load.size_entry, load.timed, "time"
        if rows is None:
            rows = getattr(load, entry)
            over = f"angle of {load.angle_of}" if load.angle_of else "crank angle"
        entry = f"{key}.{entry}{'_by_time' if load.timed else ''}"
        own = 0 if load.timed else 1 if load.angle_of else turns
        found.append(Tabulated(entry, rows, load.unit, own, over, load.curve(turns, how)))
    return [one._replace(key=scene.path_in_scene(one.key)) for one in found]


def outline(curve: Tabulated) -> str:
    """Return a small drawing of a curve: the points of an SVG polyline, 100 wide and 24 high."""
    found = np.array(curve.rows).T if curve.acting is None else np.array(_drawn(curve.acting))
    found = found[:, :: max(1, found.shape[1] // _POINTS)]
    reach = np.ptp(found, axis=1, keepdims=True)
    shares = (found - found.min(axis=1, keepdims=True)) / np.where(reach > 0.0, reach, 1.0)
    return " ".join(f"{100 * x:.1f},{24 - 24 * y:.1f}" for x, y in shares.T)


@style.figure("tables of the scene, as they are simulated", 100)
def tables_figure(response: Results) -> "style.Figure":
    """Return the tables of the scene of a response (kind ``response``), below one another; raises InputError without any."""
    tables = tabulated(scene_of_text(str(response.attrs["scene"]), "scene"))
    if not tables:
        reason = "nothing in the scene is given by a table"
        raise InputError("scene", "tables", reason, "Draw another figure")
    figure, axes = style.grid(len(tables), 1, HEIGHT * len(tables))
    for panel, table in zip(axes[:, 0], tables, strict=True):
        _curve(panel, table)
    return figure


def draw(
    figure: "style.Figure", curves: list[Tabulated], height: float, across: tuple[float, float]
) -> None:
    """Draw curves below one another, each `height` high; `across`: left end and width; shares of the figure."""
    left, width = across
    for number, curve in enumerate(curves):
        bottom = 1.0 - (number + 1) * height
        corner = left + 0.17 * width, bottom + 0.42 * height
        _curve(figure.add_axes((*corner, 0.79 * width, 0.42 * height)), curve)


def _curve(axes: "style.Axes", curve: Tabulated) -> None:
    places, values = np.array(curve.rows).T
    shown = labels.scale(curve.unit, values)
    by = _BY.get(curve.over, _TURNING) if curve.over != "distance" else labels.scale("m", places)
    if curve.turns:
        places = np.mod(places, 2.0 * np.pi * curve.turns)
        axes.set_xlim(0.0, 360.0 * curve.turns)
        axes.set_xticks(np.arange(0.0, 360.0 * curve.turns + 1.0, 90.0 * curve.turns))
    else:
        axes.set_xlim(*by(places[[0, -1]]))
    x, y = (places, values) if curve.acting is None else _drawn(curve.acting)
    axes.plot(by(x), shown(y), lw=0.9, color=style.colour("green"))
    if len(curve.rows) <= _FEW:
        axes.plot(by(places), shown(values), ".", ms=3.0, color=style.colour("green"))
    axes.set_xlabel(by.label(curve.over), labelpad=1.0)
    axes.set_title(labels.literal(shown.label(labels.entry(curve.key))), pad=2.0)


def _drawn(curve: Pieces) -> tuple[Array, Array]:
    """Places and values of a curve over its length, some within each piece however short it is."""
    ends = np.append(curve.starts, 1.0)
    share = (ends[:-1, None] + np.diff(ends)[:, None] * np.arange(8) / 8.0).ravel()
    last = np.nextafter(1.0, 0.0)
    places = np.append(share, last) * curve.length
    return places, curve.at(places)
