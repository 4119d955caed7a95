"""Documents of the program Linkage by David Rector (.linkage2): connectors and links as XML.

Coordinates are in 1/96 inch, y upwards. The program shows millimetres as 24.5/96 of them, not 25.4/96
(`CLinkageDoc::SetUnits`), so a bar that its user gave 100 mm has 391.8 units: lengths here are those that the program
shows. A positive speed is clockwise.
"""

import math
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from xml.etree import ElementTree

from hpcclear.scene.importers.file import GROUND, File, Names, limit, listed
from hpcclear.scene.importers.points import Drawing, DrawnPoint

_SIZES = {
    "millimeters": (24.5e-3 / 96.0, 1e-3), "mm": (24.5e-3 / 96.0, 1e-3), "inches": (25.4e-3 / 96.0, 25.4e-3),
}  # fmt: skip
"""m of a unit of the coordinates, and of the unit that the document shows, by its name."""
_DRAWING_LAYER = 1
_LINKS = ("Link", "element")
_SPEED = "15"
"""rpm of an input that states none."""
_IGNORED = {
    "alwaysmanual": "inputs or actuators that are moved by hand",
    "limitangle": "inputs that swing to and fro",
    "startoffset": "inputs that start at an offset",
    "drawcircle": "circles around connectors",
}
"""Attributes without a counterpart."""
_REFUSED = {
    "actuator": ("an actuator, which changes its length", "Replace it with a crank"),
    "gear": ("a gear", "Remove gears: only pins and sliders are read"),
    "fastenlink": ("a link that is fastened to another one", "Combine both into one link"),
    "fastenconnector": ("a link that is fastened to a connector", "Combine both into one link"),
    "fasten": ("a connector that is fastened to a link", "Make it a connector of this link"),
}
"""Attributes of links that no scene can have, and what to do."""


def begins(data: bytes) -> bool:
    """Whether a file is such a document."""
    return re.match(rb"(\xef\xbb\xbf)?\s*(<\?xml[^>]*>\s*)?<linkage2?\b", data) is not None


@dataclass
class _Connector:
    row: ElementTree.Element
    name: str
    x: float
    y: float
    links: list[str] = field(default_factory=list)

    def has(self, key: str) -> bool:
        return self.row.get(key) == "true"


Connectors = Mapping[str, _Connector]
Bodies = dict[str, list[str]]
"""Connectors by the names of bodies."""


def drawing_of(file: File) -> Drawing:
    """Pins, sliders, anchors and rotating inputs of a document; raises InputError where it cannot be read in full."""
    root = _root(file)
    program = root.find("program")
    shown = "Millimeters" if program is None else program.get("units", "Millimeters")
    if shown.lower() not in _SIZES:
        reason = "is no unit of this program that is known"
        file.refuse(shown[:40], reason, "Set millimetres or inches there")
    size, stated = _SIZES[shown.lower()]
    file.scale(stated, shown)
    names = Names("connector", "P"), Names("link", "link")
    connectors = _connectors(root, file, names[0])
    limit(len(connectors) // 2, file.key)
    bodies = _links(root, connectors, file, names[1])
    points, speeds, unstated, lone = [], {}, [], Counter[str]()
    for one in connectors.values():
        if not one.links and not (one.has("anchor") and one.has("slider")):
            lone["connectors without a link"] += 1
            continue
        point = _point(one, connectors, bodies, size, file)
        if point.bodies:
            points.append(point)
        if one.has("input"):
            if not one.row.get("rpm"):
                unstated.append(one.name)
            speed = one.row.get("rpm") or _SPEED
            speeds[_driven(one, file)] = -file.number(speed, f"the rpm of {one.name}")
    notes = [f"Lengths are those that the program shows, in {shown.lower()}: compare one"]
    notes += _left(root, lone)
    if unstated:
        notes.append(f"Inputs without a speed turn at {_SPEED} rpm: {listed(unstated)}")
    return Drawing(points, speeds, [*notes, *names[0].notes(), *names[1].notes()])


def _left(root: ElementTree.Element, lone: Counter[str]) -> list[str]:
    """What the document has and a scene does not."""
    lone["elements of the drawing layer"] = sum(map(_is_drawing, root))
    links = [row for row in root if row.tag in _LINKS and not _is_drawing(row)]
    lone["links of one connector"] = sum(len(row.findall("connector")) < 2 for row in links)
    for row in root:
        if row.tag not in ("connector", "program", "selected", "ratios", *_LINKS):
            lone[f"elements {row.tag[:40]!r}"] += 1
        for key, words in _IGNORED.items():
            lone[words] += row.get(key, "") not in ("", "false", "0", "0.000000")
    counted = [f"{count} {what}" for what, count in lone.items() if count]
    return [f"Not read: {listed(counted)}"] if counted else []


def _root(file: File) -> ElementTree.Element:
    data = file.data
    if b"<!" in data:  # no entities: they may expand without bound
        reason = "has a declaration or comment, which the program does not write"
        file.refuse(file.path.name, reason)
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # or of an unknown encoding
        file.refuse(file.path.name, f"is no XML that can be read ({error})")
    if root.tag != "linkage2":
        reason = "is the format of an old version of the program"
        file.refuse(root.tag, reason, "Save it with version 3")
    if root.find("ratios") is not None and len(root.find("ratios")):  # type: ignore[arg-type]
        reason, remedy = _REFUSED["gear"]
        file.refuse("ratios", f"the document has {reason}", remedy)
    return root


def _is_drawing(row: ElementTree.Element) -> bool:
    """Whether it is a line, note or dimension, which takes no part in the motion."""
    return row.get("layer") == str(_DRAWING_LAYER) or row.get("measurementelement") == "true"


def _refuse(row: ElementTree.Element, file: File, has: str = "") -> None:
    """InputError where an element has what no scene can have, by its attributes, or as stated."""
    for word, (what, remedy) in _REFUSED.items():
        if row.get(word, "false") not in ("false", "") or word == has:
            file.refuse(f"{row.tag} {row.get('id')}"[:40], f"the document has {what}", remedy)


def _connectors(root: ElementTree.Element, file: File, names: Names) -> dict[str, _Connector]:
    found: dict[str, _Connector] = {}
    for row in root.findall("connector"):
        if _is_drawing(row):
            continue
        id_ = row.get("id", "")
        name = names.given(row.get("name") or "", f"P{id_}")
        if id_ in found:
            file.refuse(id_[:40], "two connectors have this id")
        _refuse(row, file)
        x, y = (file.number(row.get(axis, ""), f"{axis} of {name}") for axis in ("x", "y"))
        if file.number(row.get("slideradius") or "0", f"the slide radius of {name}") > 0.0:
            reason = "a connector slides along an arc"
            file.refuse(name, reason, "Replace the arc by a bar to its centre")
        found[id_] = _Connector(row, name, x, y)
    return found


def _links(root: ElementTree.Element, connectors: Connectors, file: File, names: Names) -> Bodies:
    """Connectors of each body; a link with two anchors belongs to the ground."""
    bodies: Bodies = {GROUND: []}
    for row in [row for tag in _LINKS for row in root.findall(tag)]:
        own = list(dict.fromkeys(c.get("id", "") for c in row.findall("connector")))
        if _is_drawing(row):
            continue
        fastened = any(c.get("id") in connectors for c in row.findall("fastenconnector"))
        _refuse(row, file, "fastenconnector" if fastened else "")
        lost = next((c for c in own if c not in connectors), None)
        if lost is not None:
            reason = f"has the connector {lost[:40]}, which is not in the document or is of its drawing layer"
            file.refuse(f"link {row.get('id')}"[:40], reason)
        if len(own) < 2:
            continue  # the program's way to write a lone point
        if sum(connectors[c].has("anchor") for c in own) > 1:
            bodies[GROUND] += own
            continue
        name = names.given(row.get("name") or "", f"link{row.get('id')}")
        bodies[name] = own
        for c in own:
            connectors[c].links.append(name)
    still = set(bodies[GROUND])
    for one in connectors.values():
        if one.has("anchor") or one.row.get("id", "") in still:
            one.links.insert(0, GROUND)
    return bodies


def _point(
    one: _Connector, connectors: Connectors, bodies: Bodies, size: float, file: File
) -> DrawnPoint:
    made = DrawnPoint(one.name, 0.0, 0.0, tuple(one.links)).at(size, one.x, one.y)
    limits = [limit.get("id", "") for limit in one.row.findall("slidelimit")]
    if not one.has("slider") or len(limits) < 2:
        return made
    first, second = (connectors.get(limit) for limit in limits[:2])
    if first is None or second is None:
        file.refuse(one.name, "slides between connectors that are missing")
    if first.has("anchor") and second.has("anchor"):
        guide = GROUND
    else:
        guide = next((name for name, own in bodies.items() if {*limits[:2]} <= {*own}), "")
    if not guide:
        reason = f"slides between {first.name} and {second.name}, which belong to no body together"
        file.refuse(one.name, reason, "Join both with a link")
    return made._replace(slide=math.atan2(second.y - first.y, second.x - first.x), guide=guide)


def _driven(one: _Connector, file: File) -> str:
    """The body that an input turns."""
    body = next((name for name in one.links if name != GROUND), None)
    if body is None or not one.has("anchor"):
        reason = "an input turns no link about an anchor"
        file.refuse(one.name, reason, "Make the input an anchor of its crank")
    return body
