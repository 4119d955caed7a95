"""Figures of one response (kind ``response``) without a time axis: orbits, forces by direction, phase space."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, motion, style
from hpcclear.results.content import Results, texts_in


@style.figure("journal-centre orbits in the clearance circle", 10)
def orbit_figure(response: Results) -> "style.Figure":
    """Orbits of journal centres, contact distinguished from free flight, over the later half of the revolutions."""
    shown = motion.of_pins(motion.steady(response))
    joints = texts_in(shown, "joint")
    figure, axes = style.side_by_side(len(joints), min(style.across(), style.WIDTH))
    unit = labels.scale("m", motion.eccentricity(shown))
    clearances = unit(motion.clearances(shown))
    for row, (joint, panel) in enumerate(zip(joints, axes[:, 0], strict=True)):
        x, y = (unit(shown[f"eccentricity_{c}"].sel(joint=joint)) for c in "xy")
        contact = shown["penetration"].sel(joint=joint).values > 0.0
        radius, angle = np.hypot(x, y), np.arctan2(y, x)
        flown = ~_rolls(angle, contact)  # the path between such instants, in pieces
        gap = np.full(len(x) - 1, np.nan)
        pieces = [np.column_stack([c[:-1], c[1:], gap])[flown].ravel() for c in (x, y)]
        panel.plot(*pieces, color=style.colour("sky"), lw=0.7, label="free flight")
        rolled: style.Look = {"color": style.colour("vermilion"), "lw": 0.7, "label": "contact"}
        panel.plot(*_along(radius, angle, contact), **rolled)
        _circle(panel, clearances[row])
        arc = _along(np.full_like(angle, clearances[row]), angle, contact)
        panel.plot(*arc, color=style.colour("ink"), lw=2.4, label="contact arc")
        panel.set_title(f"{joint}\n{motion.contact(shown, joint)}")
        _equal(panel, unit)
    style.legend(figure, axes[0, 0], "lower")
    return figure


@style.figure("contact force by its direction", 20, name="force-direction")
def force_polar_figure(response: Results) -> "style.Figure":
    """Contact force over its direction in the fixed frame, over the same revolutions as `orbit_figure`."""
    from matplotlib.colors import ListedColormap

    shown = motion.steady(response)
    joints = texts_in(shown, "joint")
    polar = {"projection": "polar"}
    figure, axes = style.grid(len(joints), 1, 0.97 * style.across() * len(joints), subplot_kw=polar)
    force = labels.of(shown["contact_force"])
    # colours for an angle: the ends meet, and none is as light as the page
    cyclic = ListedColormap(style.matplotlib().colormaps["twilight"](np.linspace(0.13, 0.87, 256)))
    angle, sense = motion.crank_angle(shown)
    for joint, panel in zip(joints, axes[:, 0], strict=True):
        x, y = (shown[f"eccentricity_{c}"].sel(joint=joint).values for c in "xy")
        radius = force(shown["contact_force"].sel(joint=joint))
        contact = radius > 0.0
        colour = np.mod(sense * angle / motion.TURN, 1.0)[contact] * 360.0
        look: style.Look = {"s": 3.0, "cmap": cyclic, "vmin": 0.0, "vmax": 360.0, "lw": 0}
        drawn = panel.scatter(np.arctan2(y, x)[contact], radius[contact], c=colour, **look)
        panel.set_title(joint)
        panel.set_rlabel_position(112.5)
        panel.set_ylabel(force.label("contact force"), labelpad=22.0)
        panel.set_xlabel("direction of the force on the bearing (°)")
    _bar(figure, drawn, axes[:, 0], "crank angle (°)").set_ticks([0, 90, 180, 270, 360])
    return figure


@style.figure("phase portraits", 50)
def phase_figure(response: Results) -> "style.Figure":
    """Phase portraits of the slider, or of a linkage's last body: velocity over position, acceleration over velocity; over the
    same revolutions as `orbit_figure`."""
    from matplotlib.collections import LineCollection

    shown = motion.steady(response)
    position, velocity = motion.followed(shown)
    pairs = [(position, velocity)]
    if "slider_acceleration" in shown:
        pairs.append((velocity, shown["slider_acceleration"]))
    figure, axes = style.grid(len(pairs), 1, 62.5 * len(pairs))
    turn = motion.turns(shown)
    for panel, both in zip(axes[:, 0], pairs, strict=True):
        x, y = (labels.of(one) for one in both)
        points = np.column_stack([x(both[0]), y(both[1])])
        parts = np.stack([points[:-1], points[1:]], axis=1)
        line = LineCollection(list(parts), array=turn[1:], linewidths=0.6)
        panel.add_collection(line)
        panel.autoscale_view()
        panel.set(xlabel=x.label(labels.axis(both[0])), ylabel=y.label(labels.axis(both[1])))
    _bar(figure, line, axes[:, 0], motion.turns_label(shown))
    return figure


def _bar(
    figure: "style.Figure", drawn: Any, panels: "Sequence[style.Axes] | np.ndarray", words: str
) -> Any:
    look: style.Look = {"location": "bottom", "aspect": 50, "pad": 0.02, "label": words}
    return figure.colorbar(drawn, ax=list(panels), **look)


@style.drawn
def poincare_figure(response: Results, revolutions: int | None = None) -> "style.Figure":
    """Poincaré section of a response (kind ``response``): output (slider, or a linkage's last body) and journal centres once a
    revolution, at crank angle 0, over the last `revolutions`, half of all by default.

    A periodic motion is one point, a motion of period n is n points, anything else a cloud; the more revolutions
    the response has, the more it says.
    """
    shown = motion.steady(response, revolutions)
    joints = texts_in(shown, "joint")
    cells = [["motion"] * max(len(joints), 1), joints or ["."]]
    figure, axes = style.mosaic(cells, 118.0, height_ratios=[1.1, 1.0])
    top, panels = axes["motion"], [axes[joint] for joint in joints]
    output = motion.followed(shown)
    x, y = (labels.of(one) for one in output)
    position, velocity = (labels.of(one)(motion.section(shown, one)) for one in output)
    order = np.arange(1, len(position) + 1)
    options: style.Look = {"c": order, "s": 10.0, "lw": 0, "zorder": 3}
    drawn = top.scatter(position, velocity, **options)
    top.set(xlabel=x.label(labels.axis(output[0])), ylabel=y.label(labels.axis(output[1])))
    top.set_title(f"{len(order)} crossings of crank angle 0°")
    unit = labels.scale("m", motion.eccentricity(shown))
    clearances = unit(motion.clearances(shown))
    across, up = (unit(motion.section(shown, f"eccentricity_{c}")) for c in "xy")
    reach = 1.08 * np.nanmax([*clearances, *np.abs(np.ravel([across, up]))])
    for joint, panel in enumerate(panels):
        panel.scatter(across[:, joint], up[:, joint], **options)
        _circle(panel, clearances[joint])
        panel.set_title(joints[joint])
        _equal(panel, unit, reach)
        panel.tick_params(labelleft=joint == 0)
    for panel in panels[1:]:
        panel.set_ylabel("")
    top.ticklabel_format(useOffset=False)
    _bar(figure, drawn, [top, *panels], "crossing (number)")
    return figure


WIDEST = np.pi / 2.0
"""Angle between two instants in contact beyond which the journal is taken to have flown between them, rad."""

_STEP = np.radians(2.0)


def _turned(angle: Array) -> Array:
    """By how much an angle changes from instant to instant, the shorter way round, rad, shape (n - 1,)."""
    return np.mod(np.diff(angle) + np.pi, 2.0 * np.pi) - np.pi


def _rolls(angle: Array, contact: Booleans) -> Booleans:
    """Whether the journal stays on the bearing from each instant to the next, shape (n - 1,)."""
    return contact[:-1] & contact[1:] & (np.abs(_turned(angle)) <= WIDEST)


def _along(radius: Array, angle: Array, contact: Booleans) -> tuple[Array, Array]:
    """The path in contact, along the bore from instant to instant and never across it; single instants are dots."""
    rolls, turned = _rolls(angle, contact), _turned(angle)
    alone = contact & ~np.append(rolls, False) & ~np.insert(rolls, 0, False)
    begin = np.flatnonzero(np.append(rolls, False) | alone)
    ahead = np.where(alone[begin], 0, 1)
    turn = np.append(turned, 0.0)[begin] * ahead
    points = 2 + (np.abs(turn) / _STEP).astype(int)
    ends = ~(np.append(rolls, [False, False])[begin + 1] & (ahead > 0))  # with a gap behind it
    whole = points + ends
    piece = np.repeat(np.arange(len(begin)), whole)
    place = np.arange(len(piece)) - np.repeat(np.cumsum(whole) - whole, whole)
    k, last = begin[piece], points[piece] - 1
    part = np.where(place < last, place * (ahead[piece] / last), ahead[piece])
    r = radius[k] + part * (radius[k + ahead[piece]] - radius[k])
    r[place > last] = np.nan
    phi = angle[k] + part * turn[piece]
    return np.insert(r * np.cos(phi), 0, np.nan), np.insert(r * np.sin(phi), 0, np.nan)


def _circle(axes: "style.Axes", radius: float) -> None:
    """The clearance circle; nothing for a joint without clearance."""
    if np.isfinite(radius):
        angle = np.linspace(0.0, 2.0 * np.pi, 361)
        look: style.Look = {"lw": 0.7, "label": "clearance circle", "color": style.colour("ink")}
        axes.plot(radius * np.cos(angle), radius * np.sin(angle), "--", **look)


def _equal(axes: "style.Axes", unit: labels.Scale, reach: float | None = None) -> None:
    """Equal scales, the bearing centre in the middle."""
    if reach is None:
        reach = 1.05 * float(np.abs(axes.dataLim.get_points()).max())
    beside = [one for one in axes.get_shared_y_axes().get_siblings(axes) if one.has_data()]
    reach = max([reach, *(one.get_xlim()[1] for one in beside if one.get_aspect() == 1.0)])
    reach = reach or 1.0  # a joint without clearance stays in the middle
    for one in beside or [axes]:
        one.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axes.set(xlabel=unit.label("eccentricity x"), ylabel=unit.label("eccentricity y"))


CROSSINGS = 200
"""Fewest points of a Poincaré section: with fewer, a cloud and a long period look alike."""


@style.figure("Poincaré section, once a revolution", 60, name="poincare")
def section_figure(response: Results) -> "style.Figure":
    """Return the Poincaré section of a response over its averaged revolutions; raises InputError of fewer than `CROSSINGS`."""
    count = motion.whole_turns(response) - int(response.attrs.get("transient_turns", 0))
    if count < CROSSINGS:
        reason = f"a Poincaré section takes at least {CROSSINGS} revolutions"
        remedy = f"Simulate with --set numerics.averaged_revolutions={CROSSINGS}"
        raise InputError("revolutions", count, reason, remedy)
    return poincare_figure(response, revolutions=count)
