"""A drawing of a linkage at its start: bodies, joints, guides, drives and loads by their names, to scale."""

import textwrap
from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.report.figures import curves, labels, style
from hpcclear.scene import Scene
from hpcclear.scene.planar import Planar, PlanarBody

Pose = tuple[float, float, float]
"""Of a body: its mass centre, m, and its angle, rad."""


def points_of(body: PlanarBody) -> dict[str, Array]:
    """Points (2,) of a body in its own axes, m; those of a bar are a and b besides."""
    found = {point.name: np.array([point.x, point.y]) for point in body.points}
    if body.length is not None:
        found = {"a": np.zeros(2), "b": np.array([body.length, 0.0])} | found
    return found


def centre_of(body: PlanarBody) -> Array:
    """Its mass centre (2,) in its own axes, m."""
    if body.length is None:
        return np.array([body.center.x, body.center.y])
    along = 0.5 * body.length if body.mass_center is None else body.mass_center
    return np.array([along, 0.0])


class Placed:
    """Where all points of a linkage are."""

    def __init__(self, mechanism: Planar, poses: Mapping[str, Pose]) -> None:
        self.bodies: dict[str, dict[str, Array]] = {}
        self.angles: dict[str, float] = {"ground": 0.0}
        for body in mechanism.bodies:
            x, y, angle = poses[body.name]
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            own = points_of(body)
            self.bodies[body.name] = {
                name: np.array([x, y]) + turn @ (point - centre_of(body))
                for name, point in own.items()
            }
            self.angles[body.name] = angle
        self.ground = {
            point.name: np.array([point.x, point.y]) for point in mechanism.ground.points
        }

    def at(self, place: str) -> Array:
        """A place (2,), ``"body.point"``, m."""
        owner, name = place.split(".")
        return self.ground[name] if owner == "ground" else self.bodies[owner][name]

    @property
    def everything(self) -> Array:
        """All points, shape (points, 2)."""
        groups = [self.ground, *self.bodies.values()]
        return np.array([point for group in groups for point in group.values()])


class Words:
    """Words beside places, each where it covers no other: written when all are known."""

    def __init__(self, axes: "style.Axes") -> None:
        self._axes = axes
        self._asked: list[tuple[Array, str, str]] = []

    def add(self, place: Any, text: str, colour: str) -> None:
        """Request a word beside a place."""
        self._asked.append((np.array([float(place[0]), float(place[1])]), text, colour))

    def write(self) -> None:
        """Write all words, the first ones nearest to their places."""
        to_points = 72.0 / self._axes.figure.dpi
        frame = self._axes.get_window_extent()
        inside = np.array([frame.x0, frame.y0, frame.x1, frame.y1]) * to_points
        taken: list[Array] = []  # low x, low y, high x, high y, in points
        for place, text, colour in self._asked:
            at = self._axes.transData.transform(place) * to_points
            half = np.array([0.31 * style.NORMAL * len(text), 0.6 * style.NORMAL])
            best, least = (0.0, 0.0), np.inf
            for reach in (1.0, 1.7, 2.6, 3.6):
                for angle in np.radians([45, 315, 90, 270, 135, 225, 0, 180]):
                    offset = np.array([np.cos(angle), np.sin(angle)]) * (half + 5.0 * reach)
                    box = np.concatenate([at + offset - half, at + offset + half])
                    covered = sum(_overlap(box, other) for other in taken)
                    covered += 4.0 * float(np.prod(half)) - _overlap(box, inside)
                    if covered < least - 1e-9:
                        best, least = (float(offset[0]), float(offset[1])), covered
                if least < 1e-9:
                    break
            taken.append(np.concatenate([at + best - half, at + best + half]))
            word(self._axes, place, text, colour, best)


def _overlap(one: Array, other: Array) -> float:
    """Area that two boxes share."""
    sides = np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2])
    return float(np.prod(np.maximum(sides, 0.0)))


def draw(axes: "style.Axes", scene: Scene, poses: Mapping[str, Pose]) -> None:
    """The linkage where `poses` has its bodies: at its start, or a template's at an angle that shows more."""
    mechanism = scene.linkage
    placed, words = Placed(mechanism, poses), Words(axes)
    low, high = placed.everything.min(axis=0), placed.everything.max(axis=0)
    size = 0.12 * float(max(high - low))
    axes.set(
        xlim=(low[0] - 2.5 * size, high[0] + 2.5 * size),
        ylim=(low[1] - 2 * size, high[1] + 2 * size),
        aspect="equal",
    )
    axes.set_axis_off()
    axes.apply_aspect()
    for joint in mechanism.joints:
        place = placed.at(getattr(joint, "bearing", None) or joint.point)  # type: ignore[union-attr]
        axes.plot(*place, "o", color="black", ms=3.2, zorder=6)
        if joint.kind == "clearance":
            axes.plot(*place, "o", mfc="none", mec="black", mew=0.8, ms=8.5, zorder=6)
        if joint.kind == "slide":
            _guide(axes, placed, joint, size)
        words.add(place, joint.name, "black")
    for body, colour in zip(mechanism.bodies, cycle(style.CYCLE), strict=False):
        _body(axes, placed.bodies[body.name], poses[body.name], colour)
        words.add(poses[body.name][:2], body.name, colour)
    _actions(axes, scene, placed, size, words)
    for name, point in placed.ground.items():
        axes.plot(*point, "k^", ms=5.0, zorder=4)
        words.add(point, f"ground.{name}", "#555555")
    words.write()


def _body(axes: "style.Axes", points: dict[str, Array], pose: Pose, colour: str) -> None:
    """A bar, a plate, or a block where there is one point; its mass centre."""
    corners = np.array(list(points.values()))
    if len(corners) == 1:
        axes.plot(*corners[0], "s", mfc="white", mec=colour, mew=1.6, ms=13.0, zorder=1)
    elif len(corners) == 2:
        axes.plot(*corners.T, color=colour, lw=3.0, solid_capstyle="round", zorder=2)
    else:
        about = corners - corners.mean(axis=0)
        around = corners[np.argsort(np.arctan2(about[:, 1], about[:, 0]))]
        axes.fill(*around.T, facecolor=colour, alpha=0.15, zorder=1)
        axes.plot(*np.vstack([around, around[:1]]).T, color=colour, lw=2.0, zorder=2)
    axes.plot(*pose[:2], "o", color="white", mec=colour, mew=0.9, ms=4.0, zorder=5)


def _guide(axes: "style.Axes", placed: Placed, joint: Any, size: float) -> None:
    """The line that a point slides on, a little beyond both."""
    point, start = placed.at(joint.point), placed.at(joint.line)
    angle = placed.angles[joint.line.split(".")[0]] + joint.angle
    along = np.array([np.cos(angle), np.sin(angle)])
    reach = float((point - start) @ along)
    ends = [start + t * along for t in (min(reach, 0.0) - size, max(reach, 0.0) + size)]
    axes.plot(*np.transpose(ends), color="#aaaaaa", lw=1.2, ls="--", zorder=0)


def _actions(axes: "style.Axes", scene: Scene, placed: Placed, size: float, words: Words) -> None:
    """Drives as arcs, forces and gravity as arrows, in their positive directions."""
    mechanism = scene.linkage
    green = style.CYCLE[2]
    for drive in mechanism.drives:
        x, y = next(iter(placed.bodies[drive.body].values()))
        side = -1.0 if getattr(drive, "speed", 1.0) >= 0.0 else 1.0
        ends = [(x + k * 0.6 * size, y - 0.5 * size) for k in (side, -side)]
        bend = -0.45 * side
        arrow(axes, ends[0], ends[1], green, connectionstyle=f"arc3,rad={bend}")
        words.add((x, y - 0.75 * size), drive.name, green)
    for load in mechanism.loads:
        if load.kind != "force":
            continue
        place, angle = placed.at(load.place), load.direction
        if load.force is not None:
            angle = float(np.arctan2(load.force.y, load.force.x))
        tip = place + 1.3 * size * np.array([np.cos(angle), np.sin(angle)])
        arrow(axes, place, tip, green)
        words.add(tip, load.name, green)
    if scene.effects.gravity > 0.0:
        x, y = placed.everything.max(axis=0) + 0.8 * size
        arrow(axes, (x, y), (x, y - 1.2 * size), green)
        words.add((x, y - 0.6 * size), "g", green)


def arrow(axes: "style.Axes", start: Any, end: Any, colour: str, **more: Any) -> None:
    """An arrow between two places."""
    options = {"arrowstyle": "->", "color": colour, "lw": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    first, last = ((float(place[0]), float(place[1])) for place in (start, end))
    axes.annotate("", last, first, arrowprops=options | more)


def word(
    axes: "style.Axes", place: Any, text: str, colour: str, offset: tuple[float, float]
) -> None:
    """A word beside a place, so many points off, whatever the scale."""
    options: style.Look = {"color": colour, "ha": "center", "va": "center"}
    options |= {"textcoords": "offset points", "fontsize": style.NORMAL, "zorder": 7}
    axes.annotate(text, (float(place[0]), float(place[1])), offset, **options)


def key(scene: Scene, poses: Mapping[str, Pose]) -> list[str]:
    """A line for each body, joint, drive and load."""
    mechanism = scene.linkage
    q = labels.quantity
    lines = ["angles from x, counter-clockwise; ○ mass centre; a ring about a joint: clearance"]
    placed = "starts at" if scene.template is None else "drawn at"
    for body in mechanism.bodies:
        size = centre = ""
        if body.length is not None:
            along = 0.5 * body.length if body.mass_center is None else body.mass_center
            size, centre = f"{q(body.length, 'm')}, ", f"mass centre at {q(along, 'm')}, "
        lines.append(
            f"{body.name}: {size}{q(body.mass, 'kg')}, {q(body.own_inertia, 'kg m^2')}, {centre}"
            f"{placed} {(np.degrees(poses[body.name][2]) + 180.0) % 360.0 - 180.0:.4g}°"
        )
    for joint in mechanism.joints:
        if joint.kind == "slot" and joint.clearance is not None:
            sizes = [q(getattr(joint, name), "m") for name in ("pin_radius", "clearance")]
            lines.append(f"{joint.name}: pin R {sizes[0]} in a slot, {sizes[1]} on either side")
        elif joint.name in scene.guides():
            sizes = [q(getattr(joint, name), "m") for name in ("length", "height", "clearance")]
            lines.append(f"{joint.name}: slider {' x '.join(sizes[:2])}, {sizes[2]} on either side")
        if joint.kind == "clearance":
            lines.append(
                f"{joint.name}: radial clearance {q(joint.clearance, 'm')}, bearing R {q(joint.bearing_radius, 'm')}"
            )
    named = {"constant-speed": "turns at", "harmonic": "swings at", "run-up": "runs up"}
    for drive in mechanism.drives:
        rate = getattr(drive, "speed", None)
        how = f" {60.0 * rate / (2.0 * np.pi):.5g} rpm" if rate is not None else ""
        how = f" {drive.frequency:.4g} Hz" if drive.kind == "harmonic" else how
        what = f"{named[drive.kind]}{how}" if drive.kind in named else "is driven by a torque"
        lines.append(f"{drive.name}: {drive.body} {what}")
    lines += [f"{load.name}: {load.kind}{_range(load)}" for load in mechanism.loads]
    if scene.effects.gravity > 0.0:
        lines.append(f"gravity {scene.effects.gravity:g} m/s², towards -y")
    return lines


def _range(load: object) -> str:
    """Of a force: its size, or the range of its table."""
    size = getattr(load, "size", None)
    if size is None:
        return ""
    if not isinstance(size, tuple):
        return f" {labels.quantity(size, 'N')}"
    values = [value for _, value in size]
    low, high = (labels.quantity(one, "N") for one in (min(values), max(values)))
    return f" {low} to {high} by angle"


_DRAWING, _LINE = 75.0, 3.7  # mm of the drawing, and of a line of the key
_COLUMNS = 58  # letters of a line


@style.drawn
def sketch_figure(scene: Scene, poses: Mapping[str, Pose]) -> "style.Figure":
    """The mechanism where its bodies are put together, and a key with every number's place.

    Lengths are to scale; clearances are not, since they would be invisible. Tables of loads and motions are drawn below.
    `poses`: where its bodies are
    (`hpcclear.dynamics.planar.problem.poses_at_start`).
    """
    words = key(scene, poses)
    lines = [part for line in words for part in textwrap.wrap(line, _COLUMNS)]
    tables = curves.tabulated(scene)
    height = _DRAWING + _LINE * len(lines) + curves.HEIGHT * len(tables)
    figure = style.page(height)
    figure.set_layout_engine("none")
    below = 1.0 - _DRAWING / height
    axes = figure.add_axes((0.0, below, 1.0, 1.0 - below))
    draw(axes, scene, poses)
    text = "\n".join(labels.literal(line) for line in lines)
    curves.draw(figure, tables, below, curves.HEIGHT / height)
    below = _LINE * len(lines) / height
    figure.text(0.02, below, text, va="top", fontsize=style.SMALL, linespacing=1.35)
    return figure
