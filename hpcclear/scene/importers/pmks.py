"""Linkages of PMKS+ (app.pmksplus.com): its project files (.pmks), links that it shares, and tables of its successor.

A project is what stands behind the question mark of a link: fields between full stops, tokens between commas, numbers
to the base 64 in thousandths, a leading 0 for a minus sign, and a last character that states the length.
"""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote

from hpcclear.base.errors import InputError
from hpcclear.scene.importers.points import GROUND, Drawing, Point, named
from hpcclear.scene.units import to_si

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
_LENGTHS = ("in", "cm", "m")
"""Units of a project, by the number that it states."""
_PRISMATIC, _INPUT, _GROUNDED, _WELDED = 1, 2, 4, 8
"""Flags of a joint."""
_AGAIN = "Copy the whole link, or save the project again"


class _Joint(NamedTuple):
    """A joint of a project."""

    key: str
    name: str
    x: float
    y: float
    flags: int
    angle: float
    """Of a slider's line, rad."""
    slot: tuple[str, ...] = ()
    """Link that has this line, and its joints at both ends; the ground, where there is none."""


class _Link(NamedTuple):
    """A link; the block of a slider is one too."""

    key: str
    name: str
    is_block: bool
    joints: tuple[str, ...]


def begins(data: bytes) -> bool:
    """Whether a file is a project, a link or such a table."""
    text = data.lstrip(b"\xef\xbb\xbf \r\n")
    return bool(
        re.match(rb"https?://\S*pmks\S*\?|--- j ---", text)
        or re.match(rb"[\w-]{1,4}\.[\w,-]+\.[\w,-]+\.\d{2,6}\.[\w-]", text)
    )


def drawing_of(path: Path, unit: str) -> Drawing:
    """Joints, links, sliders and the rotating input of a project; raises InputError where the file cannot be read in full."""
    key = str(path)
    try:
        text = unquote(path.read_text(encoding="utf-8-sig").strip())
    except UnicodeDecodeError:
        raise InputError(key, path.name, "is no UTF-8 text", _AGAIN) from None
    if text.startswith("---"):
        return _table(text, key, unit)
    query = text.partition("?")[2] if "://" in text else text
    if query.startswith("data="):
        raise InputError(
            key,
            path.name,
            "is a compressed link",
            "Export the mechanism there as CSV, and import that file",
        )
    return _project(query, key, unit)


def _project(query: str, key: str, unit: str) -> Drawing:
    if not query or "\n" in query or _DIGITS[(len(query) - 1) % 62] != query[-1]:
        raise InputError(
            key,
            query[:20],
            "is no complete project: its length is not what its last character says",
            _AGAIN,
        )
    fields = query[:-1].split(".")
    if len(fields) < 7:
        raise InputError(key, len(fields), "has fewer fields than a project", _AGAIN)
    flags, _, integers, kinds, *rest = fields
    first, second = _ends(rest, key)
    joints = [_joint(row, key) for row in rest[:first]]
    links = [_link(row, key) for row in rest[first + 1 : second] if row.startswith("Y")]
    speed = float(_number(integers.split(",")[0], key)) * (
        -1.0 if _number(flags, key, plain=True) & 1 else 1.0
    )
    length = int(kinds[0]) if kinds[:1].isdigit() else len(_LENGTHS)
    stated = _LENGTHS[length] if length < len(_LENGTHS) else unit
    notes = []
    if any(rest[second + 1 : -1]):
        notes.append("Forces of the project are not taken over")
    return _drawing(joints, links, speed, stated, key, notes)


def _ends(rest: Sequence[str], key: str) -> tuple[int, int]:
    """Where the joints and the links end: at empty fields."""
    empty = [k for k, one in enumerate(rest) if one == ""]
    if len(empty) < 2:
        raise InputError(key, len(rest), "has no joints or no links", _AGAIN)
    return empty[0], empty[1]


def _number(token: str, key: str, plain: bool = False) -> int:
    """An integer to the base 64; a leading 0 is a minus sign unless the number is plain."""
    value = 0
    for digit in token:
        place = _DIGITS.find(digit)
        if place < 0:
            raise InputError(key, token[:20], "is no number of a project", _AGAIN)
        value = len(_DIGITS) * value + place
    return -value if token[:1] == "0" and not plain else value


def _joint(row: str, key: str) -> _Joint:
    name, *tokens = row[1:].split(",")
    if len(tokens) < 4 or not row:
        raise InputError(key, row[:40], "is no joint", _AGAIN)
    x, y, angle = (_number(token, key) / 1e3 for token in tokens[1:4])
    return _Joint(name, tokens[0], x, y, _number(row[0], key, plain=True), angle, tuple(tokens[4:]))


def _link(row: str, key: str) -> _Link:
    name, *tokens = row[2:].split(",")
    if len(tokens) < 8:
        raise InputError(key, row[:40], "is no link", _AGAIN)
    joints = tokens[6:]
    return _Link(
        name,
        tokens[0],
        row[1] == "P",
        tuple(joints[: joints.index("")] if "" in joints else joints),
    )


def _table(text: str, key: str, unit: str) -> Drawing:
    """The CSV export of the successor: sections of joints (j), links (l) and welded links (c)."""
    rows: dict[str, list[list[str]]] = {}
    section = ""
    for line in text.splitlines():
        if line.startswith("---"):
            section = line.strip("- ")
            rows[section] = []
        elif line.strip():
            rows.setdefault(section, []).append(line.split(","))
    bodies = [row for row in rows.get("l", [])[1:] if len(row) > 6]
    joints, links = [], [_Link(row[0], row[1], False, tuple(row[6].split("|"))) for row in bodies]
    speed = 0.0
    for row in rows.get("j", [])[1:]:
        try:
            prismatic, grounded, turned = row[4] == "0", row[6] == "true", row[7] == "true"
            flags = _PRISMATIC * prismatic + _INPUT * turned + _GROUNDED * grounded
            joints.append(
                _Joint(
                    row[0], row[1], float(row[2]), float(row[3]), flags, math.radians(float(row[5]))
                )
            )
            speed = float(row[8]) if turned else speed
        except (IndexError, ValueError):
            raise InputError(key, ",".join(row)[:40], "is no joint", _AGAIN) from None
    for row in rows.get("c", [])[1:]:
        members = [one for one in links if one.key in row[5].split("|")]
        welded = tuple(dict.fromkeys(joint for one in members for joint in one.joints))
        links = [one for one in links if one not in members] + [
            _Link(row[0], row[1], False, welded)
        ]
    notes = ["The file does not state the unit of lengths, nor whether the input turns clockwise"]
    return _drawing(*_split(joints, links), speed, unit, key, notes)


def _split(joints: Sequence[_Joint], links: Sequence[_Link]) -> tuple[list[_Joint], list[_Link]]:
    """Sliders as a project has them: a pin, and a joint of the line that a block connects with it."""
    made, blocks = [], []
    for one in joints:
        if one.flags & _PRISMATIC:
            line = one._replace(key=f"line {one.key}", flags=one.flags | _GROUNDED)
            blocks.append(_Link(f"block {one.key}", "", True, (one.key, line.key)))
            made += [one._replace(flags=0), line]
        else:
            made.append(one)
    return made, [*links, *blocks]


def _drawing(
    joints: Sequence[_Joint],
    links: Sequence[_Link],
    speed: float,
    unit: str,
    key: str,
    notes: list[str],
) -> Drawing:
    if not unit:
        raise InputError(
            key, "length", "the file states no unit of lengths", "Add --unit, such as --unit cm"
        )
    size = to_si(f"1 {unit}", "m")
    by_key = {one.key: one for one in joints}
    lost = next((k for link in links for k in link.joints if k not in by_key), None)
    if lost is not None:
        raise InputError(key, lost, "is a joint of a link, but not in the file", _AGAIN)
    bodies: dict[str, str] = {}
    for link in links:
        if not link.is_block:
            bodies[link.key] = named(link.name or link.key, "link", list(bodies.values()))
    lines = _lines(links, by_key, key)
    points: list[Point] = []
    speeds: dict[str, float] = {}
    taken: list[str] = []
    for one in joints:
        own = [bodies[link.key] for link in links if not link.is_block and one.key in link.joints]
        if not own:
            continue
        if one.flags & _INPUT:
            if not one.flags & _GROUNDED:
                raise InputError(
                    key,
                    one.name,
                    "the input is not on the ground",
                    "Drive a crank on the ground there",
                )
            speeds[own[0]] = speed
        taken.append(named(one.name or one.key, "P", taken))
        pins = (GROUND, *own) if one.flags & _GROUNDED else tuple(own)
        point = Point(taken[-1], round(size * one.x, 12), round(size * one.y, 12), pins)
        points.append(_sliding(point, one, lines.get(one.key), by_key, bodies, key))
    return Drawing(points, speeds, [*notes, "Masses of the file are not taken over"])


def _lines(links: Sequence[_Link], joints: Mapping[str, _Joint], key: str) -> dict[str, _Joint]:
    """The joint that has the line of each pin that slides."""
    found: dict[str, _Joint] = {}
    for link in links:
        if not link.is_block:
            continue
        line = next((joints[k] for k in link.joints if joints[k].flags & _PRISMATIC), None)
        if line is None:
            raise InputError(key, link.key, "a block has no line that it slides along", _AGAIN)
        if line.flags & _INPUT:
            raise InputError(
                key,
                line.name,
                "is driven along a line, like a hydraulic cylinder",
                "Drive a crank there: cylinders are loads here",
            )
        found |= {k: line for k in link.joints if k != line.key}
    return found


def _sliding(
    point: Point,
    joint: _Joint,
    line: _Joint | None,
    joints: Mapping[str, _Joint],
    bodies: Mapping[str, str],
    key: str,
) -> Point:
    """The point with its line, if it slides; a welded joint keeps its own link from turning."""
    if line is None:
        return point
    angle, guide = line.angle, GROUND
    if line.slot:
        ends = [joints.get(k) for k in line.slot[1:3]]
        if line.slot[0] not in bodies or len(ends) < 2 or None in ends:
            raise InputError(key, line.name, "slides along a link that is not in the file", _AGAIN)
        first, second = ends
        assert first is not None
        assert second is not None
        guide, angle = bodies[line.slot[0]], math.atan2(second.y - first.y, second.x - first.x)
    block = point.bodies[-1] if joint.flags & _WELDED else ""
    return point._replace(slide=angle, guide=guide, block=block)
