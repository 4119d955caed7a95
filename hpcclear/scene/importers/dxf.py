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
from pathlib import Path
from typing import NamedTuple

from hpcclear.base.errors import InputError
from hpcclear.scene.importers.points import GROUND, Drawing, Point, named
from hpcclear.scene.units import to_si

_UNITS = {1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 14: "dm"}
"""Units of lengths, by $INSUNITS."""
_STILL = ("ground", "frame", "base", "fixed", "gestell")
"""Layers that stand still, in small letters."""
_SKIPPED = {
    "TEXT",
    "MTEXT",
    "DIMENSION",
    "LEADER",
    "MULTILEADER",
    "HATCH",
    "VIEWPORT",
    "SEQEND",
    "ATTDEF",
}
"""Entities without points of a mechanism."""
_SAME, _NEAR = 1e-6, 1e-3
"""Distances of the drawing's size up to which points are one, and from which on they are two."""

Place = tuple[float, float]


class _Entity(NamedTuple):
    """An entity, or the header: its kind and its pairs of code and value."""

    kind: str
    pairs: list[tuple[int, str]]

    def text(self, code: int, default: str = "") -> str:
        return next((value for one, value in self.pairs if one == code), default)

    def places(self, code: int, key: str) -> list[Place]:
        """Places of a code of x, such as 10; y has the code that is 10 higher."""
        found = {c: [v for one, v in self.pairs if one == c] for c in (code, code + 10)}
        try:
            return [(float(x), float(y)) for x, y in zip(*found.values(), strict=True)]
        except ValueError:
            raise InputError(
                key, self.kind, "has a place that cannot be read", "Save the drawing again"
            ) from None


@dataclass
class _Body:
    """Points and lines of one body of the drawing."""

    points: list[Place] = field(default_factory=list)
    lines: list[tuple[Place, Place]] = field(default_factory=list)


def begins(data: bytes) -> bool:
    """Whether a file is a DXF drawing, ASCII or binary."""
    return (
        data.startswith(b"AutoCAD Binary DXF")
        or re.match(rb"(\xef\xbb\xbf)?(\s*999\r?\n[^\n]*\n)*\s*0\s*\r?\n\s*SECTION\b", data)
        is not None
    )


def drawing_of(path: Path, unit: str) -> Drawing:
    """Bodies and pins of a drawing; raises InputError where the file cannot be read in full."""
    key = str(path)
    header, entities = _read(path)
    unit = _UNITS.get(header, "") or unit
    if not unit:
        raise InputError(
            key,
            f"$INSUNITS = {header}",
            "the drawing states no unit of lengths",
            "Add --unit, such as --unit mm",
        )
    bodies, notes = _bodies(list(_joined(entities)), key)
    every = [place for body in bodies.values() for place in body.points]
    if not every:
        raise InputError(
            key,
            path.name,
            "has no points, lines, circles or polylines",
            "Draw the sketch in the model space",
        )
    low = tuple(min(place[k] for place in every) for k in (0, 1))
    size = max(math.dist(place, low) for place in every)
    places = _distinct(every, size, key)
    scale = to_si(f"1 {unit}", "m")
    points = [
        _point(f"P{k}", place, bodies, _SAME * size, scale, key)
        for k, place in enumerate(places, 1)
    ]
    return Drawing([one for one in points if one.bodies != (GROUND,)], {}, notes)


def _read(path: Path) -> tuple[int, list[_Entity]]:
    """$INSUNITS, and the entities of the model."""
    data = path.read_bytes()
    if data.startswith(b"AutoCAD Binary DXF"):
        raise InputError(str(path), path.name, "is a binary DXF drawing", "Save it as ASCII DXF")
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        lines = data.decode("cp1252", "replace").splitlines()
    section, unit = "", 0
    found: list[_Entity] = []
    last = ""
    for code, value in _pairs(lines, str(path)):
        if code == 2 and last == "SECTION":
            section = value
        elif section == "HEADER" and last == "$INSUNITS" and code == 70:
            unit = int(value)
        elif section == "ENTITIES" and code == 0 and value != "ENDSEC":
            found.append(_Entity(value, []))
        elif section == "ENTITIES" and found:
            found[-1].pairs.append((code, value))
        last = value if code in (0, 9) else last
        section = "" if (code, value) == (0, "ENDSEC") else section
    return unit, found


def _pairs(lines: Sequence[str], key: str) -> Iterator[tuple[int, str]]:
    for number in range(0, len(lines) - 1, 2):
        try:
            yield int(lines[number]), lines[number + 1].strip()
        except ValueError:
            raise InputError(
                f"{key}, line {number + 1}",
                lines[number][:40],
                "is no group code",
                "Save the drawing again as ASCII DXF",
            ) from None


def _joined(entities: Sequence[_Entity]) -> Iterator[_Entity]:
    """Entities with the vertices of each old polyline in it."""
    made: list[_Entity] = []
    for one in entities:
        if one.kind == "VERTEX" and made:
            made[-1].pairs.extend(pair for pair in one.pairs if pair[0] in (10, 20))
        elif one.kind == "POLYLINE":  # its own place says nothing
            made.append(one._replace(pairs=[pair for pair in one.pairs if pair[0] not in (10, 20)]))
        elif one.kind not in _SKIPPED and one.text(8).lower() != "defpoints":
            made.append(one)
    yield from made


def _bodies(entities: Sequence[_Entity], key: str) -> tuple[dict[str, _Body], list[str]]:
    """Bodies by name, the ground among them, and what was left out."""
    by_layer = any(one.text(8).lower() in _STILL for one in entities)
    bodies, names = {GROUND: _Body()}, dict[str, str]()
    left = Counter[str]()
    for number, one in enumerate(entities, 1):
        layer = one.text(8, "0")
        if one.kind == "INSERT":
            raise InputError(
                key, one.text(2), "the drawing has a block", "Explode blocks, and save it again"
            )
        if one.text(230).startswith("-"):
            raise InputError(
                key,
                one.kind,
                "is seen from behind (extrusion along -z)",
                "Draw it in the plane of the sketch",
            )
        if one.kind not in ("POINT", "LINE", "CIRCLE", "LWPOLYLINE", "POLYLINE"):
            left[one.kind] += 1
            continue
        if layer.lower() in _STILL or (not by_layer and one.kind == "POINT"):
            name = GROUND
        elif by_layer:
            if layer not in names:
                names[layer] = named(layer, "layer", list(bodies))
            name = names[layer]
        elif one.kind == "CIRCLE":
            continue  # drawn around a pin
        else:
            name = f"bar{number}"
        _add(bodies.setdefault(name, _Body()), one, key)
    if not bodies[GROUND].points:
        raise InputError(
            key, "ground", "nothing says what stands still",
            "Put it on a layer of the name ground, or draw a POINT at each pin of the ground"
        )  # fmt: skip
    return bodies, [f"Not read: {count} {kind}" for kind, count in left.items()]


def _add(body: _Body, one: _Entity, key: str) -> None:
    """Points and lines of an entity."""
    places = one.places(10, key)
    if one.kind == "LINE":
        places += one.places(11, key)
    if "POLYLINE" in one.kind and int(one.text(70, "0") or 0) & 1:
        places = [*places, places[0]]
    body.points += places
    body.lines += list(itertools.pairwise(places))


def _distinct(places: Sequence[Place], size: float, key: str) -> list[Place]:
    """Each place once; places that are neither one nor two are refused."""
    made: list[Place] = []
    for place in places:
        gap, near = min(((math.dist(place, one), one) for one in made), default=(math.inf, place))
        if _SAME * size < gap < _NEAR * size:
            reason = f"is {gap:.3g} beside {near[0]:g}, {near[1]:g}: neither one pin nor two points"
            raise InputError(
                key, f"{place[0]:g}, {place[1]:g}", reason, "Let the ends of lines snap"
            )
        if gap > _SAME * size:
            made.append(place)
    return made


def _point(
    name: str, place: Place, bodies: Mapping[str, _Body], near: float, scale: float, key: str
) -> Point:
    """The point at a place, with its bodies; it slides where it lies inside a line of the ground."""
    own = tuple(
        n for n, body in bodies.items() if any(math.dist(place, p) <= near for p in body.points)
    )
    made = Point(name, round(scale * place[0], 12), round(scale * place[1], 12), own)
    for carrier, body in bodies.items():
        line = next(
            (ends for ends in body.lines if carrier not in own and _is_inside(place, ends, near)),
            None,
        )
        if line is not None and carrier == GROUND:
            made = made._replace(slide=math.atan2(line[1][1] - line[0][1], line[1][0] - line[0][0]))
        elif line is not None:
            raise InputError(
                key, f"{place[0]:g}, {place[1]:g}", f"lies on a line of {carrier}, and may be a pin or in a slot",
                f"Draw a POINT on {carrier} for a pin; write a slot into the scene"
            )  # fmt: skip
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
