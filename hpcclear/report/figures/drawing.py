"""A mechanism drawn to scale: bodies, joints, guides, drives and loads by their names, with dimensions."""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.report.figures import labels, style
from hpcclear.report.figures.lettering import Lettering
from hpcclear.report.figures.placed import Placed, Pose
from hpcclear.scene import Scene

CHANGED, ACTING = "vermilion", "green"
"""Colours of parts that differ from another design, and of what acts."""
_KEPT = _FIXED = _OTHER = "grey"
_HEIGHTS = 55.0, 105.0  # mm, least and most of a drawing
_MARGIN = 56.0  # points about the mechanism, for dimensions and names
_PIN = 2.6  # radius of a pin, points; pins are not to scale
_GAP = 3.0  # to which the largest clearance is enlarged, points
_BLOCK = np.array([11.0, 7.0])  # half of a slider without dimensions, points
_OFFSETS = (11.0, -11.0, 17.0, -17.0, 24.0, -24.0, 33.0, -33.0)  # of dimension lines, points

Acting = tuple[Array, str, str]
"""Places of something that acts, its word and the colour of that."""


def height(scene: Scene, poses: Mapping[str, Pose], width: float) -> float:
    """How high a drawing of a width is, mm."""
    size = np.ptp(Placed(scene.linkage, poses).everything, axis=0)
    margins = 2.0 * _MARGIN * 25.4 / 72.0
    needed = margins + (width - margins) * float(size[1]) / max(float(size[0]), 1e-9)
    return float(np.clip(needed, *_HEIGHTS))


def draw(
    axes: "style.Axes",
    scene: Scene,
    poses: Mapping[str, Pose],
    changed: Mapping[str, list[str]] | None = None,
    before: tuple[Scene, Mapping[str, Pose]] | None = None,
) -> str:
    """Draw the linkage where `poses` has its bodies; return what is said of its scale.

    `changed`: what differs from another design, in lines, by the names of bodies and joints, which are coloured, others
    grey; `before`: scene and poses of that design, whose outline is drawn beneath.
    """
    mechanism = scene.linkage
    placed = Placed(mechanism, poses)
    every = placed.everything
    others = None if before is None else Placed(before[0].linkage, before[1])
    if others is not None:
        every = np.vstack([every, others.everything])
    sheet = Lettering(axes, every.min(axis=0), every.max(axis=0), _MARGIN)
    loose = [getattr(joint, "clearance", None) or 0.0 for joint in mechanism.joints]
    gain = max(1.0, float(f"{_GAP / (max(loose) * sheet.per_m):.0e}")) if any(loose) else 0.0
    for points in others.bodies.values() if others is not None else ():
        sheet.line(around(list(points.values())), _OTHER, 1.0, ls=(0, (4, 2)), zorder=1)
    _Drawing(sheet, scene, placed, changed, gain).everything()
    enlarged = f"clearances enlarged {gain:g} times; " if gain else ""
    return f"○ mass centre; {enlarged}pins not to scale"


class _Drawing(NamedTuple):
    """What the parts of a drawing share."""

    sheet: Lettering
    scene: Scene
    placed: Placed
    changed: Mapping[str, list[str]] | None
    gain: float
    """How much larger clearances are drawn; 0 without any."""

    def everything(self) -> None:
        """Lines first, then dimensions, then names, those with least room first."""
        mechanism, sheet = self.scene.linkage, self.sheet
        colours = {}
        for k, body in enumerate(mechanism.bodies):
            colours[body.name] = style.colour(self._colour(body.name, style.colour(k % 7)))
            self._body(body.name, colours[body.name])
        self._ground()
        for joint in mechanism.joints:
            if hasattr(joint, "line") and joint.kind != "fixed":
                self._guide(joint, colours[joint.point.partition(".")[0]])
            self._joint(joint)
        acting = [*self._drives(), *self._loads(), *self._corner()]
        self._dimensions()
        for place, lines, colour in self._joint_words():
            sheet.word(place, "\n".join(lines), colour, _PIN + 1.0)
        for body in mechanism.bodies:
            lines = [body.name, *((self.changed or {}).get(body.name, ()))]
            sheet.word(self._beside(body.name), "\n".join(lines), colours[body.name], 1.0)
        for place, text, colour in acting:
            sheet.word(place, text, colour)

    def _colour(self, name: str, own: str) -> str:
        if self.changed is None:
            return own
        return CHANGED if name in self.changed else _KEPT

    def _mm(self, *lengths: float) -> Array:
        """Lengths on paper, points, as lengths of the mechanism, m."""
        return np.array(lengths) / self.sheet.per_m

    def _gap(self, joint: Any) -> float:
        """Its clearance as drawn, points; 0 without."""
        return self.gain * (getattr(joint, "clearance", None) or 0.0) * self.sheet.per_m

    # -- bodies, ground, joints

    def _body(self, name: str, colour: str) -> None:
        """A bar or a plate, and its mass centre."""
        corners = around(list(self.placed.bodies[name].values()))
        width = 3.0 if len(corners) == 2 else 2.0
        if len(corners) > 1:
            self.sheet.line(corners, colour, width, solid_capstyle="round", zorder=2)
        if len(corners) > 2:
            self.sheet.axes.fill(*corners.T, facecolor=colour, alpha=0.15, zorder=1)
        centre = self.placed.centres[name]
        self.sheet.dot(centre, "o", 3.4, mfc="paper", mec=colour, mew=0.8, zorder=4)

    def _guide(self, joint: Any, colour: str) -> None:
        """The line that a point slides on, a slider, to scale where it has dimensions, and walls; on the ground hatched."""
        sheet, point, start = self.sheet, self.placed.at(joint.point), self.placed.at(joint.line)
        along = way(self.placed.angles[joint.line.partition(".")[0]] + joint.angle)
        across, reach = np.array([-along[1], along[0]]), float((point - start) @ along)
        half = _BLOCK if joint.kind == "slide" else np.array([_PIN, _PIN])
        if getattr(joint, "height", None):
            half = np.maximum(0.5 * np.array([joint.length, joint.height]) * sheet.per_m, 3.0)
        ends = (min(reach, 0.0) - self._mm(20.0)[0], max(reach, 0.0) + self._mm(20.0)[0])
        sheet.line([start + t * along for t in ends], _OTHER, 0.6, ls=(0, (8, 2, 1, 2)), zorder=0)
        if joint.kind == "slide":
            signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1], [1, 1]])
            corners = point + self._mm(1.0) * (signs * half) @ np.array([along, across])
            sheet.axes.fill(*corners.T, facecolor=colour, alpha=0.15, zorder=1)
            sheet.line(corners, colour, 1.4, zorder=2)
        foot, long = start + reach * along, self._mm(half[0] + 16.0)[0]
        for side in (1.0, -1.0):
            wall = foot + side * self._mm(half[1] + self._gap(joint) + 0.6)[0] * across
            sheet.line([wall - long * along, wall + long * along], _FIXED, 0.9, zorder=1)
            if joint.line.startswith("ground."):
                self._hatch(wall, along, side * across, long)

    def _hatch(self, middle: Array, along: Array, outward: Array, half: float) -> None:
        """Strokes on the far side of a line that does not move."""
        starts = middle + np.outer(np.arange(-half, half, self._mm(4.0)[0]), along)
        ends = starts + self._mm(3.0) * (outward - along)
        strokes = np.stack([starts, ends]).T.swapaxes(1, 2)
        self.sheet.axes.plot(*strokes, color=style.colour(_FIXED), lw=0.4)

    def _ground(self) -> None:
        """Bearings of the ground as triangles on a hatched line; points that nothing turns about as crosses."""
        ends, joints = ("journal", "bearing"), self.scene.linkage.joints
        pinned = {getattr(joint, end, "") for joint in joints for end in ends}
        for name, point in self.placed.ground.items():
            if f"ground.{name}" in pinned:
                foot = point + self._mm(1.0) * np.array([[0, 0], [-5, -9], [5, -9], [0, 0]])
                self.sheet.line(foot, _FIXED, 0.9, zorder=3)
                self._hatch(foot[1:3].mean(axis=0), way(0.0), way(-np.pi / 2.0), self._mm(8.0)[0])
            else:
                self.sheet.dot(point, "+", 5.0, mec=_FIXED, mew=0.7, zorder=4)

    def _joint(self, joint: Any) -> None:
        """A pin; with clearance a journal in a bearing that is as much larger as said."""
        place, colour = self._at(joint), self._colour(joint.name, "ink")
        loose = joint.kind == "clearance"
        size = 2.0 * (_PIN + max(self._gap(joint), 0.7)) if loose else 2.0 * _PIN - 0.8
        if joint.kind != "slide":
            self.sheet.dot(place, "o", size, mfc="paper", mec=colour, mew=0.9, zorder=5)
        if loose:
            self.sheet.dot(place, "o", 2.0 * _PIN, color=colour, mew=0.0, zorder=6)

    def _at(self, joint: Any) -> Array:
        return self.placed.at(getattr(joint, "bearing", None) or joint.point)

    # -- what acts: places, a word and its colour

    def _drives(self) -> Iterator[Acting]:
        """Arcs about the driven bodies, in the sense of their rotation."""
        for drive in self.scene.linkage.drives:
            rate = getattr(drive, "speed", None)
            said = "" if rate is None else labels.quantity(rate, "rad/s")
            if drive.kind == "harmonic":
                said = labels.quantity(drive.frequency, "Hz")
            both = drive.kind in ("harmonic", "table", "free")
            yield self._arc(drive.body, 15.0, rate or 1.0, both), _pair(drive.name, said), ACTING

    def _loads(self) -> Iterator[Acting]:
        """Loads in the direction in which they act when they are largest."""
        for load in self.scene.linkage.loads:
            peak = _largest(load)
            said = "" if peak is None else labels.quantity(abs(peak), load.unit)  # type: ignore[union-attr]
            words = _pair(load.name, f"at most {said}" if load.table else said)
            if load.kind == "force":
                yield self._force(load, peak or 1.0), words, ACTING
            elif hasattr(load, "first"):
                yield self._strut(load), words, ACTING
            else:
                yield self._arc(load.body, 21.0, peak or 1.0, peak is None), words, ACTING

    def _arc(self, body: str, radius: float, sense: float, both: bool) -> Array:
        """An arc with an arrow, about the point of a body that is nearest to the ground, on the far side of the body."""
        points, fixed = list(self.placed.bodies[body].values()), list(self.placed.ground.values())
        pivot = min(points, key=lambda point: min(float(np.hypot(*(point - one))) for one in fixed))
        away = pivot - np.mean(points, axis=0)
        middle = np.arctan2(away[1], away[0]) if np.hypot(*away) > 0.0 else -np.pi / 2.0
        turn = middle + np.sign(sense) * np.linspace(-1.1, 1.1, 25)
        arc: Array = pivot + self._mm(radius) * np.column_stack([np.cos(turn), np.sin(turn)])
        self.sheet.line(arc, ACTING, 1.0, zorder=3)
        self.sheet.arrow(arc[-3], arc[-1], ACTING)
        if both:
            self.sheet.arrow(arc[2], arc[0], ACTING)
        return arc[[12, 6, 18, 0, 24]]

    def _force(self, load: Any, peak: float) -> Array:
        """An arrow from a place, or towards it where that way is emptier."""
        body, place = load.place.partition(".")[0], self.placed.at(load.place)
        angle = load.direction + (np.pi if peak < 0.0 else 0.0)
        if load.force is not None:
            angle = float(np.arctan2(load.force.y, load.force.x))
        angle += self.placed.angles[body] if load.follows else 0.0
        clear = 4.0 + (_BLOCK[0] if len(self.placed.bodies[body]) == 1 else 0.0)
        near, far = (self._mm(reach) * way(angle) for reach in (clear, clear + 26.0))
        ends = ((place + near, place + far), (place - far, place - near))
        start, end = min(ends, key=lambda one: self.sheet.crowding(*one))
        self.sheet.arrow(start, end, ACTING, "-|>", 1.4)
        return np.array([0.5 * (start + end), start, end])

    def _strut(self, load: Any) -> Array:
        """A spring or cylinder between two points, as a zigzag."""
        start, end = self.placed.at(load.first), self.placed.at(load.second)
        across = way(np.arctan2(*(end - start)[::-1]) + np.pi / 2.0)
        t = np.array([0.0, *np.linspace(0.25, 0.75, 9), 1.0])
        side = self._mm(*([0.0, 0.0] + [3.5, -3.5] * 3 + [3.5, 0.0, 0.0]))
        self.sheet.line(start + np.outer(t, end - start) + np.outer(side, across), ACTING, 1.0)
        return start + np.outer([0.5, 0.3, 0.7], end - start)

    def _corner(self) -> Iterator[Acting]:
        """The axes, and gravity, in the lower left corner."""
        origin = self.sheet.corners[0] + self._mm(10.0, 12.0)
        for axis, name in zip(np.eye(2), "xy", strict=True):
            self.sheet.arrow(origin, origin + self._mm(16.0) * axis, _FIXED)
            yield origin + self._mm(18.0) * axis, name, _FIXED
        if self.scene.effects.gravity > 0.0:
            top = origin + self._mm(34.0, 18.0)
            self.sheet.arrow(top, top - self._mm(0.0, 20.0), ACTING)
            yield top - self._mm(0.0, 10.0), "g", ACTING

    # -- words

    def _dimensions(self) -> None:
        """Lengths of bars beside them; places of points of the ground from the first one, outside."""
        for body in self.scene.linkage.bodies:
            if body.length is not None:
                ends = [self.placed.at(f"{body.name}.{end}") for end in "ab"]
                along = way(self.placed.angles[body.name])
                levels = float(ends[0] @ [-along[1], along[0]]) + self._mm(*_OFFSETS)
                text = labels.quantity(body.length, "m")
                self.sheet.dimension(ends, text, along, levels)
        low, high = self.placed.everything.min(axis=0), self.placed.everything.max(axis=0)
        origin, steps = next(iter(self.placed.ground.values())), self._mm(17.0, 28.0, 39.0, 50.0)
        drawn = set[tuple[int, float]]()
        for point in self.placed.ground.values():
            for k in range(2):
                apart = float(point[k] - origin[k])
                if abs(apart) * self.sheet.per_m < 1.0 or (k, round(apart, 9)) in drawn:
                    continue
                drawn.add((k, round(apart, 9)))
                text = labels.quantity(apart, "m").removeprefix("-")
                ends = [origin, point] if apart > 0.0 else [point, origin]
                levels = np.concatenate([low[1 - k] - steps, high[1 - k] + steps])
                # across x is y, across y is -x
                self.sheet.dimension(ends, text, np.eye(2)[k], levels * (1 - 2 * k))

    def _joint_words(self) -> list[tuple[Array, list[str], str]]:
        """Names of joints with their clearances, those at one place together."""
        found: list[tuple[Array, list[str], str]] = []
        for joint in self.scene.linkage.joints:
            lines, place = [joint.name], self._at(joint)
            if clearance := getattr(joint, "clearance", None):
                lines.append(f"clearance {labels.quantity(clearance, 'm')}")
            lines += (self.changed or {}).get(joint.name, ())
            same = [one for one in found if np.hypot(*(one[0] - place)) < self._mm(3.0)[0]]
            if same:
                same[0][1].extend(lines)
            else:
                found.append((place, lines, self._colour(joint.name, "ink")))
        return found

    def _beside(self, name: str) -> Array:
        """Places of a body beside which its name may stand: along its longest side."""
        corners = list(self.placed.bodies[name].values()) or [self.placed.centres[name]]
        pairs = [*combinations(corners, 2)] or [(corners[0], corners[0])]
        start, end = max(pairs, key=lambda ends: float(np.hypot(*(ends[1] - ends[0]))))
        return start + np.outer([0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8], end - start)


def around(corners: list[Array]) -> Array:
    """Corners in the order of a closed outline about their middle; two as they are."""
    if len(corners) < 3:
        return np.array(corners)
    about = np.array(corners) - np.mean(corners, axis=0)
    order = np.argsort(np.arctan2(about[:, 1], about[:, 0]))
    return np.array(corners)[[*order, order[0]]]


def way(angle: float) -> Array:
    """Direction (2,) of an angle."""
    return np.array([np.cos(angle), np.sin(angle)])


def _pair(name: str, said: str) -> str:
    return f"{name}\n{said}" if said else name


def _largest(load: Any) -> float | None:
    """The largest size of a load, with its sign; None of one that depends on the motion."""
    if not hasattr(load, "size_entry"):
        return None
    if (force := getattr(load, "force", None)) is not None:
        return float(np.hypot(force.x, force.y))
    rows = load.timed if load.timed is not None else getattr(load, load.size_entry)
    return float(max((value for _, value in rows), key=abs) if isinstance(rows, tuple) else rows)
