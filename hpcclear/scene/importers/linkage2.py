"""Documents of the program Linkage by David Rector (.linkage2): connectors and links as XML.

Coordinates are in 1/96 inch, y upwards. The program shows millimetres as 24.5/96 of them, not 25.4/96
(`CLinkageDoc::SetUnits`), so a bar that its user gave 100 mm has 391.8 units: lengths here are those that the program
shows. A positive speed is clockwise.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

from hpcclear.base.errors import InputError
from hpcclear.scene.importers.points import GROUND, Drawing, Point, named

_SIZES = {"millimeters": 24.5e-3 / 96.0, "mm": 24.5e-3 / 96.0, "inches": 25.4e-3 / 96.0}
"""m of a unit of the coordinates, by the unit that the document shows."""
_DRAWING_LAYER = 1
_REFUSED = {
    "actuator": ("an actuator, which changes its length", "Replace it with a crank"),
    "gear": ("a gear", "Remove gears: only pins and sliders are read"),
}
"""Attributes of links that no scene can have, and what to do."""


def begins(data: bytes) -> bool:
    """Whether a file is such a document."""
    return re.match(rb"(\xef\xbb\xbf)?\s*(<\?xml[^>]*>\s*)?<linkage2?\b", data) is not None


@dataclass
class _Connector:
    """A connector of the document."""

    row: ElementTree.Element
    name: str
    x: float
    y: float
    links: list[str] = field(default_factory=list)

    def has(self, key: str) -> bool:
        return self.row.get(key) == "true"


def drawing_of(path: Path, unit: str) -> Drawing:
    """Pins, sliders, anchors and rotating inputs of a document; raises InputError where it cannot be read in full."""
    root = _root(path)
    program = root.find("program")
    shown = "Millimeters" if program is None else program.get("units", "Millimeters")
    size = _SIZES.get(shown.lower())
    if size is None:
        raise InputError(
            str(path),
            shown,
            "is no unit of this program that is known",
            "Set millimetres or inches there",
        )
    connectors = _connectors(root, str(path))
    bodies = _links(root, connectors, str(path))
    points, speeds = [], {}
    for one in connectors.values():
        if not one.links and not (one.has("anchor") and one.has("slider")):
            continue
        points.append(_point(one, connectors, bodies, size, str(path)))
        if one.has("input"):
            speeds[_driven(one, str(path))] = -float(one.row.get("rpm") or 15.0)
    note = f"Lengths are those that the program shows, in {shown.lower()}; compare one: {_longest(points)}"
    return Drawing([p for p in points if p.bodies], speeds, [note])


def _root(path: Path) -> ElementTree.Element:
    data = path.read_bytes()
    if b"<!" in data:  # no entities: they may expand without bound
        raise InputError(
            str(path),
            path.name,
            "has a declaration or comment, which the program does not write",
            "Save it again",
        )
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise InputError(
            str(path), path.name, f"is no XML that can be read ({error})", "Save it again"
        ) from None
    if root.tag != "linkage2":
        raise InputError(
            str(path),
            root.tag,
            "is the format of an old version of the program",
            "Save it with version 3",
        )
    if root.find("ratios") is not None and len(root.find("ratios")):  # type: ignore[arg-type]
        reason, remedy = _REFUSED["gear"]
        raise InputError(str(path), "ratios", f"the document has {reason}", remedy)
    return root


def _is_drawing(row: ElementTree.Element) -> bool:
    """Whether it is a line, note or dimension, which takes no part in the motion."""
    return row.get("layer") == str(_DRAWING_LAYER) or row.get("measurementelement") == "true"


def _connectors(root: ElementTree.Element, key: str) -> dict[str, _Connector]:
    found: dict[str, _Connector] = {}
    for row in root.findall("connector"):
        if _is_drawing(row):
            continue
        name = named(
            row.get("name") or f"P{row.get('id')}", "P", [one.name for one in found.values()]
        )
        try:
            place = float(row.get("x", "")), float(row.get("y", ""))
        except ValueError:
            raise InputError(
                key, name, "a connector has no place", "Save the document again"
            ) from None
        if float(row.get("slideradius") or 0.0) > 0.0:
            raise InputError(
                key,
                name,
                "a connector slides along an arc",
                "Replace the arc by a bar to its centre",
            )
        found[row.get("id", "")] = _Connector(row, name, *place)
    return found


def _links(
    root: ElementTree.Element, connectors: Mapping[str, _Connector], key: str
) -> dict[str, list[str]]:
    """Connectors of each body; a link with two anchors belongs to the ground."""
    bodies: dict[str, list[str]] = {GROUND: []}
    for row in [*root.findall("Link"), *root.findall("element")]:
        own = [c.get("id", "") for c in row.findall("connector")]
        for word, (what, remedy) in _REFUSED.items():
            if row.get(word) == "true":
                raise InputError(key, f"link {row.get('id')}", f"the document has {what}", remedy)
        if _is_drawing(row) or any(c not in connectors for c in own) or len(own) < 2:
            continue  # a link of one connector is the program's way to write a lone point
        if sum(connectors[c].has("anchor") for c in own) > 1:
            bodies[GROUND] += own
            continue
        name = named(row.get("name") or f"link{row.get('id')}", "link", list(bodies))
        bodies[name] = own
        for c in own:
            connectors[c].links.append(name)
    for one in connectors.values():
        if one.has("anchor") or one.row.get("id", "") in bodies[GROUND]:
            one.links.insert(0, GROUND)
    return bodies


def _point(
    one: _Connector,
    connectors: Mapping[str, _Connector],
    bodies: Mapping[str, Sequence[str]],
    size: float,
    key: str,
) -> Point:
    made = Point(one.name, round(size * one.x, 12), round(size * one.y, 12), tuple(one.links))
    limits = [limit.get("id", "") for limit in one.row.findall("slidelimit")]
    if not one.has("slider") or len(limits) < 2:
        return made
    first, second = (connectors.get(limit) for limit in limits[:2])
    if first is None or second is None:
        raise InputError(
            key, one.name, "slides between connectors that are missing", "Save the document again"
        )
    if first.has("anchor") and second.has("anchor"):
        guide = GROUND
    else:
        guide = next((name for name, own in bodies.items() if {*limits[:2]} <= {*own}), "")
    if not guide:
        raise InputError(
            key, one.name, f"slides between {first.name} and {second.name}, which belong to no body together",
            "Join both with a link"
        )  # fmt: skip
    return made._replace(slide=math.atan2(second.y - first.y, second.x - first.x), guide=guide)


def _driven(one: _Connector, key: str) -> str:
    """The body that an input turns."""
    body = next((name for name in one.links if name != GROUND), None)
    if body is None or not one.has("anchor"):
        raise InputError(
            key,
            one.name,
            "an input turns no link about an anchor",
            "Make the input an anchor of its crank",
        )
    return body


def _longest(points: Sequence[Point]) -> str:
    """The longest distance of two points of a body, to compare."""
    pairs = [
        (math.hypot(a.x - b.x, a.y - b.y), a.name, b.name)
        for k, a in enumerate(points)
        for b in points[:k]
        if set(a.bodies) & set(b.bodies) - {GROUND}
    ]
    length, first, second = max(pairs, default=(0.0, "", ""))
    return f"{second} to {first} {1e3 * length:.6g} mm"
