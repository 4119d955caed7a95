"""Linkages of PMKS+ (app.pmksplus.com): its project files (.pmks), links that it shares, and tables of its successor.

A project is what stands behind the question mark of a link: fields between full stops, tokens between commas, numbers
to the base 64 in thousandths, a leading 0 for a minus sign, and a last character that states the length. Earlier
projects write a slider as a pin, a joint of the line and a block that connects both, newer ones as one joint.
"""

import csv
import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from urllib.parse import unquote

from hpcclear.base.units import to_si
from hpcclear.scene.importers.file import GROUND, File, Names, limit, listed
from hpcclear.scene.importers.points import Drawing, DrawnPoint

_DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
_LENGTHS = ("in", "cm", "m")
"""Units of a project, by the number that it states."""
_LONGEST_TOKEN = 11
"""Characters of a number: 64^11 thousandths are farther than any place."""
_PRISMATIC, _INPUT, _GROUNDED, _WELDED = 1, 2, 4, 8
"""Flags of a joint."""
_ROOTS, _MEMBERS = "YAMG0123", "Namg4567"
"""First characters of the rows of links, by what is drawn as a bar or disc with a stated or computed mass centre: links, and
those that are welded to others and stand in the row of the whole."""


class _Joint(NamedTuple):
    key: str
    name: str
    x: float
    y: float
    flags: int
    angle: float
    """Of a slider's line, rad."""
    slot: tuple[str, ...] = ()
    """Link that has this line, and its joints at both ends; the ground, where there is none."""
    speed: float = 0.0
    """rpm of an input, counter-clockwise; 0 for that of the project."""


class _Link(NamedTuple):
    """A link; the block of a slider is one too."""

    key: str
    name: str
    is_block: bool
    joints: tuple[str, ...]
    members: tuple[str, ...] = ()
    """Links that are welded together in it."""


def begins(data: bytes) -> bool:
    """Whether a file is a project, a link or such a table."""
    text = data.lstrip(b"\xef\xbb\xbf \r\n")
    return bool(
        re.match(rb"https?://\S*pmks\S*\?|--- j ---", text)
        or re.match(rb"[\w-]{1,4}\.[\w,-]+\.[\w,-]+\.\d{2,6}\.[\w-]", text)
    )


def drawing_of(file: File) -> Drawing:
    """Joints, links, sliders and the rotating input of a project; raises InputError where the file cannot be read in full."""
    try:
        text = unquote(file.data.decode("utf-8-sig").strip())
    except UnicodeDecodeError:
        file.refuse(file.path.name, "is no UTF-8 text")
    if text.startswith("---"):
        return _table(text, file)
    query = text.partition("?")[2] if "://" in text else text
    if query.startswith("data="):
        remedy = "Export the mechanism there as CSV, and import that file"
        file.refuse(file.path.name, "is a compressed link", remedy)
    return _project(query, file)


def _project(query: str, file: File) -> Drawing:
    if not query or "\n" in query or _DIGITS[(len(query) - 1) % 62] != query[-1]:
        reason = "is no complete project: its length is not what its last character says"
        file.refuse(query[:20], reason)
    fields = query[:-1].split(".")
    if len(fields) < 7:
        file.refuse(len(fields), "has fewer fields than a project")
    flags, _, integers, kinds, *rest = fields
    empty = [k for k, one in enumerate(rest) if one == ""]  # joints and links end at these
    if len(empty) < 2:
        file.refuse(len(rest), "has no joints or no links")
    first, second, *_ = empty
    limit(max(first, second - first) // 2, file.key)
    joints = [_joint(row, file) for row in rest[:first]]
    rows = rest[first + 1 : second]
    wrong = next((row for row in rows if row[0] not in _ROOTS + _MEMBERS), None)
    if wrong is not None:
        reason = f"begins with {wrong[0]!r}: no kind of link that is known"
        file.refuse(wrong[:40], reason, "Export it with an older version, or as CSV")
    links = [_link(row, file) for row in rows if row[0] in _ROOTS]
    welded = {member for link in links for member in link.members}
    parts = (_link(row, file).key for row in rows if row[0] in _MEMBERS)
    for key in (one for one in parts if one not in welded):
        file.refuse(key, "is part of a welded link that is not in the file")
    sense = -1.0 if _number(flags, file, plain=True) & 1 else 1.0
    speed = sense * abs(_number(integers.split(",")[0], file))
    length = int(kinds[0]) if kinds[:1] in tuple("0123456789") else len(_LENGTHS)
    stated = _LENGTHS[length] if length < len(_LENGTHS) else ""
    size = file.scale(to_si(f"1 {stated}", "m") if stated else None, stated)
    forces = [row for row in rest[second + 1 : -1] if row]
    notes = [f"Not read: {len(forces)} forces of the project"] if forces else []
    return _drawing(joints, links, speed, size, file, notes)


def _number(token: str, file: File, plain: bool = False) -> int:
    """An integer to the base 64; a leading 0 is a minus sign unless the number is plain."""
    if len(token) > _LONGEST_TOKEN:
        file.refuse(token[:20], "is no number of a project")
    value = 0
    for digit in token:
        place = _DIGITS.find(digit)
        if place < 0:
            file.refuse(token[:20], "is no number of a project")
        value = len(_DIGITS) * value + place
    return -value if token[:1] == "0" and not plain else value


def _joint(row: str, file: File) -> _Joint:
    name, *tokens = row[1:].split(",")
    if len(tokens) < 4 or not row:
        file.refuse(row[:40], "is no joint")
    x, y, angle = (_number(token, file) / 1e3 for token in tokens[1:4])
    slot = tuple(tokens[4:7]) if tokens[4:5] not in ([], [""]) else ()
    speed = _number(tokens[7], file) / 1e3 if tokens[7:8] not in ([], [""]) else 0.0
    return _Joint(name, tokens[0], x, y, _number(row[0], file, plain=True), angle, slot, speed)


def _link(row: str, file: File) -> _Link:
    name, *tokens = row[2:].split(",")
    if len(tokens) < 7:
        file.refuse(row[:40], "is no link")
    joints = tokens[6:]
    end = joints.index("") if "" in joints else len(joints)
    members = tuple(one for one in joints[end + 1 :] if one)
    return _Link(name, tokens[0], row[1] == "P", tuple(joints[:end]), members)


def _table(text: str, file: File) -> Drawing:
    """The CSV export of the successor: sections of joints (j), links (l) and welded links (c)."""
    rows: dict[str, list[list[str]]] = {}
    section = ""
    try:
        for row in csv.reader(text.splitlines(), strict=True):
            if row and row[0].startswith("---"):
                section = row[0].strip("- ")
                rows[section] = []
            elif row:
                rows.setdefault(section, []).append(row)
    except csv.Error as error:
        file.refuse("table", f"cannot be read ({error})")
    limit(max(map(len, rows.values()), default=0) // 2, file.key)
    joints = [_joint_of(row, file) for row in rows.get("j", [])[1:]]
    owns = [(row, _ids(row, 6, file)) for row in rows.get("l", [])[1:]]
    links = [_Link(row[0], row[1], False, own) for row, own in owns if own]
    for row in rows.get("c", [])[1:]:
        parts = _ids(row, 5, file)
        members = {one.key: one for one in links if one.key in parts}
        if len(members) < len(parts):
            file.refuse(",".join(row)[:40], "is welded of links that are not in the file")
        joined = tuple(dict.fromkeys(k for one in members.values() for k in one.joints))
        links = [one for one in links if one.key not in members]
        links.append(_Link(f"welded {row[0]}", row[1], False, joined, tuple(members)))
    notes = ["The file does not state the unit of lengths, nor whether the input turns clockwise"]
    kinds = (("f", "forces"), ("p", "positions of a synthesis"), ("t", "trajectories"))
    left = [f"{count} {words}" for kind, words in kinds if (count := len(rows.get(kind, [])[1:]))]
    if left:
        notes.append(f"Not read: {', '.join(left)}")
    return _drawing(joints, links, 0.0, file.scale(None, ""), file, notes)


def _ids(row: Sequence[str], place: int, file: File) -> tuple[str, ...]:
    if len(row) <= place:
        file.refuse(",".join(row)[:40], "is no row of a link")
    return tuple(one for one in row[place].split("|") if one)


def _joint_of(row: Sequence[str], file: File) -> _Joint:
    if len(row) < 9:
        file.refuse(",".join(row)[:40], "is no joint")
    joint = f"joint {row[1][:40]}"
    x, y, angle = (file.number(row[k], f"a place or angle of {joint}") for k in (2, 3, 5))
    turned = row[7] == "true"
    flags = _PRISMATIC * (row[4] == "0") + _INPUT * turned
    flags += _GROUNDED * (row[6] == "true") + _WELDED * (row[9:10] == ["true"])
    speed = file.number(row[8] or "0", f"the speed of {joint}") if turned else 0.0
    return _Joint(row[0], row[1], x, y, flags, math.radians(angle), speed=speed)


def _sliders(joints: Sequence[_Joint], links: Sequence[_Link], file: File) -> list[_Joint]:
    """Sliders of earlier projects as newer ones have them: one joint, for a pin and the joint of a line that a block connects.

    A pin of a block stands still where its line does.
    """
    made, lines = {one.key: one for one in joints}, set[str]()
    for link in links:
        if not link.is_block:
            continue
        line = next((made[k] for k in link.joints if made[k].flags & _PRISMATIC), None)
        if line is None:
            file.refuse(link.key, "a block has no line that it slides along")
        lines.add(line.key)
        for key in link.joints:
            if key != line.key:
                flags = made[key].flags & ~_GROUNDED | line.flags & _INPUT | _PRISMATIC
                made[key] = made[key]._replace(flags=flags, angle=line.angle, slot=line.slot)
    for one in made.values():
        if one.flags & _PRISMATIC and one.flags & _INPUT:
            reason = "is driven along a line, like a hydraulic cylinder"
            file.refuse(one.name[:40], reason, "Drive a crank there: cylinders are loads here")
    linked = {key for link in links if not link.is_block for key in link.joints}
    for key in lines & linked:
        made[key] = made[key]._replace(flags=made[key].flags & ~_PRISMATIC)
    return [one for one in made.values() if one.key in linked or one.key not in lines]


def _drawing(
    joints: Sequence[_Joint], links: Sequence[_Link], speed: float, size: float, file: File, notes: list[str],
) -> Drawing:  # fmt: skip
    by_key = {one.key: one for one in joints}
    if len(by_key) < len(joints):
        file.refuse(len(joints), "two joints have the same letter")
    lost = next((k for link in links for k in link.joints if k not in by_key), None)
    if lost is not None:
        file.refuse(lost[:40], "is a joint of a link, but not in the file")
    names, given = Names("link", "link"), Names("joint", "P")
    bodies: dict[str, str] = {}
    own: dict[str, list[str]] = {one.key: [] for one in joints}
    for link in links:
        if not link.is_block:
            bodies[link.key] = names.given(link.name, link.key)
            bodies |= dict.fromkeys(link.members, bodies[link.key])
            for k in dict.fromkeys(link.joints):
                own[k].append(bodies[link.key])
    points: list[DrawnPoint] = []
    speeds: dict[str, float] = {}
    alone = []
    for one in _sliders(joints, links, file):
        slides = one.flags & _PRISMATIC
        if not own[one.key]:
            alone += [] if slides else [one.name or one.key]
            continue
        if one.flags & _INPUT:
            speeds[own[one.key][0]] = one.speed or speed
            if not one.flags & _GROUNDED:
                reason = "the input is not on the ground"
                file.refuse(one.name[:40], reason, "Drive a crank on the ground there")
            if len(own[one.key]) > 1:
                first, every = own[one.key][0], listed(own[one.key])
                notes.append(f"Input {one.name} turns {first}, the first of {every}")
        still = one.flags & _GROUNDED and not slides
        pins = (*([GROUND] if still else []), *own[one.key])
        point = DrawnPoint(given.given(one.name, one.key), 0.0, 0.0, pins).at(size, one.x, one.y)
        points.append(_sliding(point, one, by_key, bodies, file) if slides else point)
    if alone:
        notes.append(f"Not read: joints without a link: {listed(alone)}")
    if not all(speeds.values()):
        file.refuse("input", "an input has the speed 0", "Give it a speed there")
    notes = [*notes, "Masses of the file are not taken over", *names.notes(), *given.notes()]
    return Drawing(points, speeds, notes)


def _sliding(
    point: DrawnPoint, joint: _Joint, joints: Mapping[str, _Joint], bodies: Mapping[str, str], file: File,
) -> DrawnPoint:  # fmt: skip
    """The point with its line; a welded joint keeps its own link from turning."""
    angle, guide = joint.angle, GROUND
    if joint.slot:
        first, second = [*(joints.get(k) for k in joint.slot[1:3]), None, None][:2]
        if joint.slot[0] not in bodies or first is None or second is None:
            file.refuse(joint.name, "slides along a link that is not in the file")
        guide, angle = bodies[joint.slot[0]], math.atan2(second.y - first.y, second.x - first.x)
    block = point.bodies[-1] if joint.flags & _WELDED else ""
    return point._replace(slide=angle, guide=guide, block=block)
