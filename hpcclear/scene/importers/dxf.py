"""Drawings in DXF (ASCII, any version): points, lines, circles and polylines of a sketch as the bodies of a linkage.

A layer is a body, and the layer "ground" stands still. Without a layer of this name each line or polyline is a body,
and a POINT marks a pin that stands still. Ends of lines, vertices, centres of circles and POINTs are the points of a
body; points of several bodies at one place are a pin. A point inside a line of the ground slides along it.
"""

import itertools
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.base.units import to_si
from hpcclear.scene.importers.file import GROUND, MOST_POINTS, File, Names, listed
from hpcclear.scene.importers.points import Drawing, DrawnPoint

_FOOT = 1200 / 3937  # of US surveys
_UNITS = {
    1: ("inches", 0.0254), 2: ("feet", 0.3048), 3: ("miles", 1609.344), 4: ("millimetres", 1e-3), 5: ("centimetres", 1e-2),
    6: ("metres", 1.0), 7: ("kilometres", 1e3), 8: ("microinches", 2.54e-8), 9: ("mils", 2.54e-5), 10: ("yards", 0.9144),
    11: ("angstroms", 1e-10), 12: ("nanometres", 1e-9), 13: ("micrometres", 1e-6), 14: ("decimetres", 0.1),
    15: ("decametres", 10.0), 16: ("hectometres", 100.0), 17: ("gigametres", 1e9), 18: ("astronomical units", 1.495978707e11),
    19: ("light years", 9.4607304725808e15), 20: ("parsecs", 3.0856775814913673e16), 21: ("US survey feet", _FOOT),
    22: ("US survey inches", _FOOT / 12), 23: ("US survey yards", 3 * _FOOT), 24: ("US survey miles", 5280 * _FOOT),
}  # fmt: skip
"""Units of lengths and their size in m, by $INSUNITS."""
_STILL = ("ground", "frame", "base", "fixed", "gestell")
"""Layers that stand still, in small letters."""
_TEXTS = (
    "TEXT", "MTEXT", "DIMENSION", "LEADER", "MULTILEADER", "HATCH", "VIEWPORT", "ATTDEF",
)  # fmt: skip
"""Entities without points of a mechanism."""
_READ = ("POINT", "LINE", "CIRCLE", "LWPOLYLINE", "POLYLINE")
MOST_LINES = 2000
"""Of a drawing, each counted once."""
_SAME, _NEAR = 1e-6, 1e-3
"""Distances of the drawing's size up to which points are one, and from which on they are two."""

Place = tuple[float, float]


class _Entity(NamedTuple):
    """An entity, or the header: its kind and its pairs of code and value."""

    kind: str
    pairs: list[tuple[int, str]]

    def text(self, code: int, default: str = "") -> str:
        return next((value for one, value in self.pairs if one == code), default)

    def places(self, code: int, file: File) -> list[Place]:
        """Places of a code of x, such as 10; y has the code that is 10 higher."""
        x, y = ([v for one, v in self.pairs if one == c] for c in (code, code + 10))
        if len(x) != len(y):
            file.refuse(self.kind, "has a place that cannot be read")
        what = f"a place of {self.kind[:40]}"
        return [(file.number(a, what), file.number(b, what)) for a, b in zip(x, y, strict=True)]


@dataclass
class _Body:
    """Points and lines of one body of the drawing."""

    points: list[Place] = field(default_factory=list)
    lines: dict[tuple[Place, Place], None] = field(default_factory=dict)
    """Each once."""


def begins(data: bytes) -> bool:
    """Whether a file is a DXF drawing, ASCII or binary."""
    section = rb"(\xef\xbb\xbf)?(\s*999\r?\n[^\n]*\n)*\s*0\s*\r?\n\s*SECTION\b"
    return data.startswith(b"AutoCAD Binary DXF") or re.match(section, data) is not None


def drawing_of(file: File) -> Drawing:
    """Bodies and pins of a drawing; raises InputError where the file cannot be read in full."""
    header, entities = _read(file)
    stated, size = _UNITS.get(header, ("", None))
    notes = []
    given = to_si(f"1 {file.unit}", "m") if file.unit else size
    if size is not None and given is not None and not math.isclose(size, given, rel_tol=1e-9):
        used = f"--unit {file.unit} is used: check the largest length"
        notes.append(f"The drawing states {stated} ($INSUNITS = {header}), and {used}")
        size = None  # programs state the unit of their template, whatever was drawn
    scale = file.scale(size, stated, f", $INSUNITS = {header}")
    bodies, left = _bodies(list(_joined(entities)), file)
    every = [place for body in bodies.values() for place in body.points]
    if not every:
        reason = "has no points, lines, circles or polylines"
        file.refuse(file.path.name, reason, "Draw the sketch in the model space")
    low = tuple(min(place[k] for place in every) for k in (0, 1))
    extent = max(math.dist(place, low) for place in every)
    places, at = _distinct(every, extent, file)
    lines = sum(len(body.lines) for body in bodies.values())
    if max(len(places), len(bodies)) > MOST_POINTS or lines > MOST_LINES:
        reason = f"has more than {MOST_POINTS} points or bodies, or {MOST_LINES} lines: no linkage has as many"
        file.refuse(file.path.name, reason, "Save the sketch of the mechanism alone")
    owners: list[list[str]] = [[] for _ in places]
    for name, body in bodies.items():
        for k in {at[place] for place in body.points}:
            owners[k].append(name)
    points = []
    for k, (place, own) in enumerate(zip(places, owners, strict=True), 1):
        one = _point(DrawnPoint(f"P{k}", *place, tuple(own)), bodies, _SAME * extent, file)
        if one.bodies != (GROUND,):
            points.append(one.at(scale, *place))
    return Drawing(points, {}, [*notes, *left])


def _read(file: File) -> tuple[int, list[_Entity]]:
    data = file.data
    if data.startswith(b"AutoCAD Binary DXF"):
        file.refuse(file.path.name, "is a binary DXF drawing", "Save it as ASCII DXF")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", "replace")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    section, unit = "", 0
    found: list[_Entity] = []
    last = ""
    for code, value in _pairs(lines, file):
        if code == 2 and last == "SECTION":
            section = value
        elif section == "HEADER" and last == "$INSUNITS" and code == 70:
            unit = int(file.number(value, "$INSUNITS"))
        elif section == "ENTITIES" and code == 0 and value != "ENDSEC":
            found.append(_Entity(value, []))
        elif section == "ENTITIES" and found:
            found[-1].pairs.append((code, value))
        last = value if code in (0, 9) else last
        section = "" if (code, value) == (0, "ENDSEC") else section
    return unit, found


def _pairs(lines: Sequence[str], file: File) -> Iterator[tuple[int, str]]:
    for at in range(0, len(lines) - 1, 2):
        try:
            yield int(lines[at]), lines[at + 1].strip()
        except ValueError:
            reason = "is no group code"
            remedy = "Save the drawing again as ASCII DXF"
            raise InputError(f"{file.key}, line {at + 1}", lines[at][:40], reason, remedy) from None


def _joined(entities: Sequence[_Entity]) -> Iterator[_Entity]:
    """Entities with the vertices of each old polyline in it."""
    made: list[_Entity] = []
    within: _Entity | None = None
    for one in entities:
        if one.kind == "VERTEX" and within is not None:
            within.pairs.extend(pair for pair in one.pairs if pair[0] in (10, 20, 42))
        elif one.kind == "POLYLINE":  # its own place says nothing
            within = one._replace(pairs=[pair for pair in one.pairs if pair[0] not in (10, 20)])
            made.append(within)
        elif one.kind != "SEQEND":
            within = None
            made.append(one)
    yield from made


def _bodies(entities: Sequence[_Entity], file: File) -> tuple[dict[str, _Body], list[str]]:
    """Bodies by name, the ground among them, and what was left out."""
    by_layer = any(one.text(8).lower() in _STILL for one in entities if one.kind in _READ)
    bodies, names = {GROUND: _Body()}, dict[str, str]()
    given, left, bars = Names("layer", "layer"), Counter[str](), 0
    for one in entities:
        layer = one.text(8, "0")
        if one.kind == "INSERT":
            reason = "the drawing has a block"
            file.refuse(one.text(2)[:40], reason, "Explode blocks, and save it again")
        if one.text(67).strip() == "1" or layer.lower() == "defpoints" or one.kind not in _READ:
            where = " of the layer Defpoints" if layer.lower() == "defpoints" else ""
            where = " of the paper space" if one.text(67).strip() == "1" else where
            left[f"{one.kind[:40]}{where}"] += 1
            continue
        if one.text(230).startswith("-"):
            reason = "is seen from behind (extrusion along -z)"
            file.refuse(one.kind, reason, "Draw it in the plane of the sketch")
        if layer.lower() in _STILL or (not by_layer and one.kind == "POINT"):
            name = GROUND
        elif by_layer:
            same = layer.casefold()  # drawing programs know one layer of this name
            if same not in names:
                names[same] = given.given(layer)
            name = names[same]
        elif one.kind == "CIRCLE":
            left["CIRCLE, taken for one that is drawn around a pin"] += 1
            continue
        else:
            bars += 1
            name = f"bar{bars}"
        left["bulge of a polyline, which is read as a straight line"] += sum(
            file.number(value, "a bulge") != 0.0 for code, value in one.pairs if code == 42
        )
        _add(bodies.setdefault(name, _Body()), one, file)
    if not bodies[GROUND].points:
        remedy = "Put it on a layer called ground, or draw a POINT at each pin of it"
        file.refuse("ground", "nothing says what stands still", remedy)
    drawn = [one for one in entities if one.kind in _READ]
    heights = {file.number(one.text(code, "0"), "a height") for one in drawn for code in (30, 31)}
    notes = []
    if len(heights) > 1:
        notes.append(f"Left out: heights of {min(heights):g} to {max(heights):g} along z")
    for words, texts in (("Not read", False), ("Left out", True)):
        kinds = [kind for kind, count in left.items() if count and (kind in _TEXTS) == texts]
        if kinds:
            notes.append(f"{words}: {listed(f'{left[kind]} {kind}' for kind in kinds)}")
    return bodies, [*notes, *given.notes()]


def _add(body: _Body, one: _Entity, file: File) -> None:
    places = one.places(10, file)
    if one.kind == "LINE":
        places += one.places(11, file)
    if not places or (one.kind == "LINE" and len(places) != 2):
        file.refuse(one.kind, "has no place, or an end too many or too few")
    if "POLYLINE" in one.kind and int(file.number(one.text(70) or "0", "a flag of a polyline")) & 1:
        places = [*places, places[0]]
    body.points += places
    body.lines |= dict.fromkeys(itertools.pairwise(places))


def _distinct(every: list[Place], size: float, file: File) -> tuple[list[Place], dict[Place, int]]:
    """Each place once, found by squares, and which of them each is; places that are neither one nor two are refused."""
    made, at = list[Place](), dict[Place, int]()
    squares: dict[tuple[int, int], list[int]] = {}
    side = _NEAR * size or 1.0
    for place in dict.fromkeys(every):
        i, j = math.floor(place[0] / side), math.floor(place[1] / side)
        near_by = itertools.product((i - 1, i, i + 1), (j - 1, j, j + 1))
        beside = [k for square in near_by for k in squares.get(square, ())]
        gap, k = min(((math.dist(place, made[k]), k) for k in beside), default=(math.inf, 0))
        if _SAME * size < gap < _NEAR * size:
            near = made[k]
            reason = f"is {gap:.3g} beside {near[0]:g}, {near[1]:g}: neither one pin nor two points"
            file.refuse(f"{place[0]:g}, {place[1]:g}", reason, "Let the ends of lines snap")
        if gap > _SAME * size:
            k = len(made)
            made.append(place)
            squares.setdefault((i, j), []).append(k)
        at[place] = k
    return made, at


def _point(made: DrawnPoint, bodies: Mapping[str, _Body], near: float, file: File) -> DrawnPoint:
    """A point of some bodies, in the drawing's unit; it slides where it lies inside a line of the ground."""
    place = made.x, made.y
    for carrier, body in bodies.items():
        if carrier in made.bodies:
            continue
        line = next((ends for ends in body.lines if _is_inside(place, ends, near)), None)
        if line is not None and carrier == GROUND:
            made = made._replace(slide=math.atan2(line[1][1] - line[0][1], line[1][0] - line[0][0]))
        elif line is not None:
            reason = f"lies on a line of {carrier}, and may be a pin or in a slot"
            remedy = f"Draw a POINT on {carrier} for a pin; write a slot into the scene"
            file.refuse(f"{place[0]:g}, {place[1]:g}", reason, remedy)
    return made


def _is_inside(place: Place, ends: tuple[Place, Place], near: float) -> bool:
    """Whether a place lies on a line between its ends."""
    (x, y), (dx, dy) = ends[0], (ends[1][0] - ends[0][0], ends[1][1] - ends[0][1])
    length = math.hypot(dx, dy)
    if length <= near:
        return False
    along = ((place[0] - x) * dx + (place[1] - y) * dy) / length
    across = ((place[1] - y) * dx - (place[0] - x) * dy) / length
    return near < along < length - near and abs(across) <= near
