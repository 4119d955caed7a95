"""Words and dimensions of a drawing, each where it covers neither another one nor, if there is room, a line."""

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.report.figures import labels, style

_STEP = 2.0  # points between two samples of a line
_ANGLES = np.radians([45, 315, 135, 225, 90, 270, 0, 180, 20, 340, 160, 200, 70, 110, 250, 290])
_REACHES = (3.0, 6.0, 10.0, 15.0, 21.0, 28.0, 36.0, 46.0, 58.0, 72.0, 90.0)  # points
_BAR = 2.0  # width from which on a line covers a word, points
_LEADER = 12.0  # points between a word and its place from which on a line joins them


class Lettering:
    """Axes of equal scales that know what is drawn on them; lengths on paper are in points, places in m."""

    def __init__(self, axes: "style.Axes", low: Array, high: Array, margin: float) -> None:
        """Show the box from `low` to `high` (2,), m, with at least `margin` (points) around it."""
        self.axes = axes
        box = axes.get_window_extent()
        room = np.array([box.width, box.height]) * 72.0 / axes.figure.dpi
        size = np.maximum(high - low, 1e-9)
        self.per_m = float(np.min((room - 2.0 * margin) / size))
        """Points on paper of a metre."""
        middle, half = 0.5 * (low + high), 0.5 * room / self.per_m
        axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
        axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
        axes.set_aspect("equal")
        axes.set_axis_off()
        self.corners = np.array([middle - half, middle + half])
        """Lower left and upper right (2, 2), m."""
        self._boxes = np.empty((0, 4))  # of words: low x, low y, high x, high y, in points
        self._ink = np.zeros(np.ceil(room).astype(int) + 1)  # what covering a point costs
        self._total: Array | None = None  # its sums from the corner, until a line is added
        canvas: Any = axes.figure.canvas
        self._renderer = canvas.get_renderer()

    def paper(self, places: ArrayLike) -> Array:
        """Places (..., 2) from the lower left corner in points."""
        return (np.asarray(places, float) - self.corners[0]) * self.per_m

    def line(self, places: ArrayLike, colour: str, width: float = 0.8, **look: Any) -> None:
        """A line through places (n, 2) that words avoid."""
        corners = np.asarray(places, float)
        self.axes.plot(*corners.T, color=style.colour(colour), lw=width, **look)
        along = _sampled(self.paper(corners))
        wide = [0.0] if width < _BAR else [-0.5 * width, 0.0, 0.5 * width]
        self._mark(np.vstack([along + np.array([x, y]) for x in wide for y in wide]))
        if width >= _BAR:
            self._mark(along, 200.0)

    def dot(self, place: Array, marker: str, size: float, **look: Any) -> None:
        """A marker of a diameter in points, which words avoid."""
        named = {key: style.colour(look[key]) for key in look.keys() & {"mfc", "mec", "color"}}
        self.axes.plot(*place, marker, ms=size, **{**look, **named})
        turn = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
        around = self.paper(place) + 0.5 * size * np.column_stack([np.cos(turn), np.sin(turn)])
        self._mark(around)

    def arrow(
        self, start: Array, end: Array, colour: str, ends: str = "->", width: float = 0.9
    ) -> None:
        """An arrow between two places, with heads as matplotlib writes them."""
        look: style.Look = {"arrowstyle": ends, "color": style.colour(colour), "lw": width}
        look["mutation_scale"] = 7.0
        first, last = ((float(place[0]), float(place[1])) for place in (start, end))
        self.axes.annotate("", last, first, arrowprops=look | {"shrinkA": 0.0, "shrinkB": 0.0})
        self._mark(_sampled(self.paper([first, last])))

    def crowding(self, start: Array, end: Array) -> int:
        """How many samples of the way between two places have a line within 2 points."""
        way = _sampled(self.paper([start, end]))
        return int((self._covered(np.hstack([way - 2.0, way + 2.0])) > 0.0).sum())

    def word(self, places: ArrayLike, text: str, colour: str, clear: float = 0.0) -> None:
        """Write a word beside one of its places (n, 2) or (2,), at least `clear` points away; a line leads to a distant one."""
        anchors = np.atleast_2d(self.paper(places))
        written, size = self._written(text, colour)
        out = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
        reach = np.array(_REACHES)[:, None, None]
        # to where the box, not its middle, is so far away
        offsets = (out * (0.5 * size + clear + reach)).reshape(-1, 2)
        middles = (anchors[:, None] + offsets).reshape(-1, 2)
        apart = np.repeat(reach.ravel(), len(_ANGLES))
        cost = np.tile(apart, len(anchors)) + 0.5 * np.repeat(np.arange(len(anchors)), len(offsets))
        best = int(np.argmin(cost + self._cost(middles, size)))
        anchor = anchors[best // len(offsets)]
        self._put(written, middles[best], size)
        if apart[best % len(offsets)] > _LEADER:
            edge = np.clip(anchor, middles[best] - 0.5 * size, middles[best] + 0.5 * size)
            lead = self.corners[0] + np.array([anchor, edge]) / self.per_m
            self.line(lead, colour, 0.4, zorder=3)

    def dimension(self, ends: ArrayLike, text: str, along: Array, levels: Array) -> None:
        """Draw a dimension line along a direction (2,) between two places (2, 2), at a level (m) with room, if any has."""
        written, size = self._written(text, "ink")
        across, best, least = np.array([-along[1], along[0]]), None, np.inf
        places = np.asarray(ends, float)
        for k, level in enumerate(levels):
            feet = places + np.outer(level - places @ across, across)
            on_paper = self.paper(feet)
            length = float(np.hypot(*(on_paper[1] - on_paper[0])))
            beyond = 0.5 * float(abs(along) @ size) + 8.0
            room = length > 2.0 * beyond + 4.0
            shares = (0.5, 0.35, 0.65) if room else (1.0 + beyond / length, -beyond / length)
            middles = np.array([on_paper[0] + s * (on_paper[1] - on_paper[0]) for s in shares])
            cost = self._cost(middles, size) + 4.0 * k
            cost += 2.0 * self.crowding(*feet)
            at = _sampled(on_paper)[:, None]
            crossed = (at > self._boxes[:, :2]) & (at < self._boxes[:, 2:])
            cost += 1e4 * bool(crossed.all(axis=2).any())
            if cost.min() < least:
                best, least = (feet, middles[int(cost.argmin())], room), float(cost.min())
        if best is None or least >= 200.0:
            written.remove()
            return
        feet, middle, room = best
        for place, foot in zip(places, feet, strict=True):
            beyond = 2.0 * (foot - place) / (float(np.hypot(*(foot - place))) or 1.0)
            self.line([place, foot + beyond / self.per_m], "grey", 0.4)
        self.arrow(feet[0], feet[1], "ink", "<->" if room else "-", 0.5)
        if not room:  # arrows from outside, as the words do not fit between
            for foot, way in ((feet[0], along), (feet[1], -along)):
                self.arrow(foot - 7.0 * way / self.per_m, foot, "ink", "->", 0.5)
        self._put(written, middle, size)

    def _written(self, text: str, colour: str) -> tuple[Any, Array]:
        """A word at no place yet, and its size (2,) in points."""
        back: style.Look = {"boxstyle": "square,pad=0.05", "ec": "none", "alpha": 0.85}
        back["fc"] = style.colour("paper")
        made = self.axes.text(
            0.0, 0.0, labels.literal(text), color=style.colour(colour), ha="center", va="center", zorder=8,
            linespacing=1.1, bbox=back,
        )  # fmt: skip
        box = made.get_window_extent(self._renderer)
        return made, np.array([box.width, box.height]) * 73.5 / self.axes.figure.dpi + 1.0

    def _put(self, written: Any, middle: Array, size: Array) -> None:
        written.set_position(self.corners[0] + middle / self.per_m)
        box = np.concatenate([middle - 0.5 * size, middle + 0.5 * size])
        self._boxes = np.vstack([self._boxes, box])

    def _cost(self, middles: Array, size: Array) -> Array:
        """Of boxes about middles (n, 2): 1000 and more where one covers another or leaves the sheet, and what is marked."""
        low, high = middles - 0.5 * size, middles + 0.5 * size
        begin, end = np.split(self._boxes, 2, axis=1)
        sides = np.minimum(high[:, None], end) - np.maximum(low[:, None], begin)
        covered = np.prod(np.maximum(sides, 0.0), axis=2).sum(axis=1)
        room = self.paper(self.corners[1])
        outside = np.maximum(-low, 0.0).sum(axis=1) + np.maximum(high - room, 0.0).sum(axis=1)
        lines = self._covered(np.hstack([low, high]))
        return np.where(covered + outside > 1e-9, 1e3 + covered + 100.0 * outside, 0.0) + lines

    def _mark(self, places: Array, cost: float = 3.0) -> None:
        """Note that there is a line at places (n, 2), points."""
        self._total = None
        cells = np.clip(np.floor(places).astype(int), 0, np.array(self._ink.shape) - 1)
        np.maximum.at(self._ink, tuple(cells.T), cost)

    def _covered(self, boxes: Array) -> Array:
        """What is covered of lines by boxes (n, 4)."""
        if self._total is None:
            self._total = np.pad(self._ink.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
        total = self._total
        ends = np.array([*self._ink.shape] * 2)
        x0, y0, x1, y1 = np.clip(np.rint(boxes).astype(int), 0, ends).T
        return total[x1, y1] - total[x0, y1] - total[x1, y0] + total[x0, y0]


def _sampled(corners: Array) -> Array:
    """Places along a line through corners (n, 2), points."""
    parts = [np.empty((0, 2))]
    for start, end in pairwise(corners):
        count = 2 + int(np.hypot(*(end - start)) / _STEP)
        parts.append(np.linspace(start, end, count))
    return np.vstack(parts)
