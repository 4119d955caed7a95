"""A linkage by its points, as drawing programs know it, and the tables of a scene that follow from them."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import tomli_w

from hpcclear.base.errors import InputError

GROUND = "ground"
MASS = 0.1
"""kg of a body whose mass nobody has given."""
SPEED = 60.0
"""rpm of a drive whose speed nobody has given."""
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")
"""Of a point or a body."""


class Point(NamedTuple):
    """A point of a linkage where it stands."""

    name: str
    x: float
    y: float
    bodies: tuple[str, ...]
    """That it belongs to: a pin of all of them; ground among them where it stands still."""
    slide: float | None = None
    """Direction of the line that it moves along, rad, in the axes of the drawing."""
    guide: str = GROUND
    """Body that has this line."""
    block: str = ""
    """Body that slides without turning against the guide; "" for one that has this point alone, or a new one."""


class Drawing(NamedTuple):
    """A linkage that a file holds."""

    points: Sequence[Point]
    """In m."""
    speeds: Mapping[str, float] = {}
    """rpm of each driven body, counter-clockwise; none: the first body on the ground, at `SPEED`."""
    notes: Sequence[str] = ()
    """What the file has and the scene does not, and what to check."""


def named(text: str, kind: str, taken: Sequence[str]) -> str:
    """A name of a point or body that a file calls `text`: of letters, digits, - and _, and not yet taken."""
    plain = re.sub(r"[^A-Za-z0-9_-]+", "_", text.strip()).strip("_")[:30]
    name = plain if NAME.fullmatch(plain) else f"{kind}{plain}"
    made, count = name, 1
    while made in taken or made == GROUND:
        count += 1
        made = f"{name}_{count}"
    return made


def scene_of(drawing: Drawing, key: str) -> dict[str, Any]:
    """The tables of a scene whose linkage has its points where a drawing has them.

    Parameters
    ----------
    drawing : Drawing
    key : str
        The file, in errors.

    Raises
    ------
    InputError
        If the bodies make no linkage.
    """
    points = _with_blocks(drawing.points, key)
    names = list(dict.fromkeys(body for one in points for body in one.bodies if body != GROUND))
    speeds = dict(drawing.speeds) or {_driven(points, names, key): SPEED}
    size = max((math.dist(a[1:3], b[1:3]) for a in points for b in points), default=0.0)
    frames = {name: _frame(name, points, key) for name in names}
    still = [
        one for one in points if GROUND in (*one.bodies, one.guide if one.slide is not None else "")
    ]
    return {
        "format_version": 1,
        "mechanism": {
            "kind": "planar",
            "bodies": {name: _body(name, points, frames[name], size) for name in names},
            "ground": {"points": {one.name: [one.x, one.y] for one in still}},
            "joints": _joints(points, frames),
            "drives": {
                "motor" if len(speeds) == 1 else f"motor_{body}": {
                    "kind": "constant-speed", "body": body, "speed": f"{speed:.12g} rpm",
                }
                for body, speed in speeds.items()
            },
        },
        "effects": {"gravity": 0.0},
    }  # fmt: skip


def text_of(content: dict[str, Any], source: str, notes: Sequence[str] = ()) -> str:
    """The scene file: the tables, and what to put in below a heading."""
    lines = [
        f"A linkage with the points of {' '.join(source.split())}.",
        f"Masses ({MASS} kg each), inertias and speeds that are not in the file are placeholders: put yours in.",
        "For clearance write a joint as",
        '  kind = "clearance", clearance = "0.1 mm", bearing_radius = "10 mm", materials = { ... }',
        "and a contact law in [effects].",
        *(" ".join(note.split()) + "." for note in notes),
    ]
    return "\n".join(f"# {line}" for line in lines) + "\n\n" + tomli_w.dumps(content)


def _driven(points: Sequence[Point], names: Sequence[str], key: str) -> str:
    """The first body that is pinned to the ground."""
    for name in names:
        if any(name in one.bodies and GROUND in one.bodies for one in points):
            return name
    raise InputError(
        key, ", ".join(names), "no body is pinned to the ground",
        'Name the body "ground" at points that stand still'
    )  # fmt: skip


def _with_blocks(points: Sequence[Point], key: str) -> list[Point]:
    """Points with the body that slides last at each that does: a guide keeps it from turning."""
    made = []
    for one in points:
        if one.slide is not None:
            if GROUND in one.bodies and one.guide == GROUND:
                raise InputError(
                    key, one.name, "a point of the ground slides", "Name its moving bodies"
                )
            alone = [
                b for b in one.bodies if b != GROUND and sum(b in p.bodies for p in points) == 1
            ]
            block = one.block or (alone[-1] if alone else f"slider_{one.name}")
            one = one._replace(bodies=(*(b for b in one.bodies if b != block), block), block=block)
        made.append(one)
    return made


class _Frame(NamedTuple):
    """Axes of a body in the drawing."""

    x: float
    y: float
    angle: float

    def local(self, point: Point) -> list[float]:
        """Place of a point in these axes, m."""
        dx, dy = point.x - self.x, point.y - self.y
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return [
            0.0 + round(dx * cosine + dy * sine, 12),
            0.0 + round(dy * cosine - dx * sine, 12),
        ]  # no -0


def _points_of(name: str, points: Sequence[Point]) -> list[Point]:
    """Pins of a body first, then the places of its guides."""
    pins = [one for one in points if name in one.bodies]
    return pins + [
        one for one in points if one.slide is not None and one.guide == name and one not in pins
    ]


def _frame(name: str, points: Sequence[Point], key: str) -> _Frame:
    """The first point at the origin and the second on the x axis; of a body that slides the x axis along its line."""
    own = _points_of(name, points)
    slides = [one.slide for one in own if one.slide is not None and one.block == name]
    if slides:
        return _Frame(own[0].x, own[0].y, slides[0])
    if len(own) == 1:
        return _Frame(own[0].x, own[0].y, 0.0)
    first, second = own[:2]
    if math.hypot(second.x - first.x, second.y - first.y) == 0.0:
        raise InputError(
            key, name, f"{first.name} and {second.name} are at one place", "Mend one of them"
        )
    return _Frame(first.x, first.y, math.atan2(second.y - first.y, second.x - first.x))


def _body(name: str, points: Sequence[Point], frame: _Frame, size: float) -> dict[str, Any]:
    """Its table; a body of one point is as long as a tenth of the linkage."""
    places = {one.name: frame.local(one) for one in _points_of(name, points)}
    centre = [round(sum(place[k] for place in places.values()) / len(places), 12) for k in (0, 1)]
    spread = sum(math.dist(place, centre) ** 2 for place in places.values()) / len(places)
    return {
        "mass": MASS,
        "inertia": round(MASS * (spread or (0.1 * size) ** 2 / 12.0), 15),
        "center": centre,
        "start_angle": _degrees(frame.angle),
        "points": places,
    }


def _degrees(angle: float) -> str:
    return f"{0.0 + round(math.degrees(angle), 9)!r} deg"


def _joints(points: Sequence[Point], frames: Mapping[str, _Frame]) -> dict[str, Any]:
    """A pin for each further body of a point; a guide where a point slides."""
    made = {}
    for one in points:
        if one.slide is not None:
            carrier = frames[one.guide].angle if one.guide in frames else 0.0
            turned = math.remainder(one.slide - carrier, 2.0 * math.pi)
            made[f"{one.name}_guide"] = {
                "kind": "slide", "point": f"{one.block}.{one.name}",
                "line": f"{one.guide}.{one.name}", "angle": _degrees(turned),
            }  # fmt: skip
        others = [body for body in one.bodies if body != GROUND]
        hub, *rest = [GROUND, *others] if GROUND in one.bodies else others
        for number, body in enumerate(rest):
            name = one.name if number == 0 else f"{one.name}_{number + 1}"
            made[name] = {
                "kind": "revolute", "journal": f"{body}.{one.name}", "bearing": f"{hub}.{one.name}",
            }  # fmt: skip
    if not made:
        raise InputError(
            "points", len(points), "no two bodies share a point", "Name the bodies of each point"
        )
    return made
