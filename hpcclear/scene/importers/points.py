"""A linkage by its points, as drawing programs know it, and the tables of a scene that follow from them."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import tomli_w

from hpcclear.base.errors import InputError
from hpcclear.base.units import written
from hpcclear.scene.driving import MOST_TURNS
from hpcclear.scene.fields import Content
from hpcclear.scene.importers.file import GROUND, limit, listed

MASS = 0.1
"""kg of a body whose mass nobody has given."""
SPEED = 60.0
"""rpm of a drive whose speed nobody has given."""
FARTHEST = 1e5
"""m from the origin."""


class DrawnPoint(NamedTuple):
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

    def at(self, size: float, x: float, y: float) -> "DrawnPoint":
        """The point at a place in a unit of a size, m."""
        return self._replace(x=round(size * x, 12), y=round(size * y, 12))


class Drawing(NamedTuple):
    """A linkage that a file holds."""

    points: Sequence[DrawnPoint]
    """In m."""
    speeds: Mapping[str, float] = {}
    """rpm of each driven body, counter-clockwise; none: the first body that turns about a pin of the ground, at `SPEED`."""
    notes: Sequence[str] = ()
    """What the file has and the scene does not, and what to check."""


def scene_of(drawing: Drawing, key: str) -> Content:
    """The tables of a scene with the points of a drawing. Raises InputError of the file `key` if they make no linkage."""
    points = _with_blocks(_checked(drawing.points, key), key)
    own = _by_body(points)
    names = [name for name in own if name != GROUND]
    speeds = dict(drawing.speeds) or {_driven(points, names, key): SPEED}
    size = max((math.dist(a[1:3], b[1:3]) for a, b in combinations(points, 2)), default=0.0)
    frames = {name: _frame(name, own[name], key) for name in names}
    return {
        "format_version": 1,
        "mechanism": {
            "kind": "planar",
            "bodies": {name: _body(own[name], frames[name], size) for name in names},
            "ground": {"points": {one.name: [one.x, one.y] for one in own.get(GROUND, [])}},
            "joints": _joints(points, frames),
            "drives": _drives(speeds),
        },
        "effects": {"gravity": 0.0},
    }  # fmt: skip


def text_of(content: Content, source: str, notes: Sequence[str] = ()) -> str:
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


def _drives(speeds: Mapping[str, float]) -> Content:
    """A drive for each body; where one turn of the slowest is not enough for all to repeat, its turns until they do."""
    made: Content = {
        "motor" if len(speeds) == 1 else f"motor_{body}": {
            "kind": "constant-speed", "body": body, "speed": written(float(f"{speed:.12g}"), "rpm"),
        }
        for body, speed in speeds.items()
    }  # fmt: skip
    sizes = [round(1e6 * abs(speed)) for speed in speeds.values()]
    turns = min(sizes) // max(math.gcd(*sizes), 1)
    slowest = list(made.values())[sizes.index(min(sizes))]
    slowest |= {"period": True} if len(set(sizes)) > 1 else {}
    slowest |= {"turns": turns} if 1 < turns <= MOST_TURNS else {}
    return made


def _repeating(drives: Mapping[str, Content]) -> str:
    """After how many turns several drives repeat together, in words."""
    main = next((row for row in drives.values() if row.get("period")), None)
    if main is None:
        return ""
    speed = float(main["speed"].split()[0]) / main.get("turns", 1)
    ratios = [float(row["speed"].split()[0]) / speed for row in drives.values()]
    if any(abs(one - round(one)) > 1e-9 * abs(one) for one in ratios):
        return f"; check refuses them, since they do not repeat together within {MOST_TURNS} turns"
    return f"; they repeat together after {main.get('turns', 1)} turns of {main['body']}, which is one revolution of the scene"


def summary(content: Content, drawing: Drawing) -> list[tuple[str, str]]:
    """Return what a scene has of a file, and what it leaves, as labels and texts."""
    mechanism = content["mechanism"]
    drives = [f"{row['body']} at {row['speed']}" for row in mechanism["drives"].values()]
    rows = mechanism["joints"].items()
    kinds = [f"{name} ({'guide' if row['kind'] == 'slide' else 'pin'})" for name, row in rows]
    stated = "" if drawing.speeds else ", a placeholder: the file states no drive"
    driven = listed(drives) + stated + _repeating(mechanism["drives"])
    lines = [("bodies", listed(mechanism["bodies"])), ("joints", listed(kinds)), ("drives", driven)]
    lengths = [
        (math.dist(a[1:3], b[1:3]), body, a.name, b.name)
        for body, own in _by_body(drawing.points).items() for a, b in combinations(own, 2)
    ]  # fmt: skip
    for size, body, first, second in sorted(lengths)[-1:]:
        lines.append(("length", f"at most {1e3 * size:.6g} mm, from {first} to {second} of {body}"))
    return lines + [("note", note) for note in drawing.notes]


def _checked(points: Sequence[DrawnPoint], key: str) -> Sequence[DrawnPoint]:
    """Points that are not too many, and near enough."""
    limit(len(points), key)
    limit(sum(len(one.bodies) for one in points) // 4, key)
    for one in points:
        if not max(abs(one.x), abs(one.y)) <= FARTHEST:
            reason = f"is more than {FARTHEST:g} m from the origin"
            raise InputError(key, one.name, reason, "Correct its place or the unit of lengths")
    return points


def _driven(points: Sequence[DrawnPoint], names: Sequence[str], key: str) -> str:
    """The first body that turns about a pin of the ground."""
    pins = [one.bodies for one in points if GROUND in one.bodies and one.slide is None]
    for name in names:
        if any(name in bodies for bodies in pins):
            return name
    reason = "the file states no drive, and no body turns about a pin of the ground"
    remedy = "Drive a crank on the ground"
    slides = [one.guide for one in points if one.slide is not None]
    if not any(GROUND in one.bodies for one in points) and GROUND not in slides:
        reason = "no body is pinned to the ground"
        remedy = 'Name the body "ground" at points that stand still'
    raise InputError(key, listed(names), reason, remedy)


def _with_blocks(points: Sequence[DrawnPoint], key: str) -> list[DrawnPoint]:
    """Points with the body that slides last at each that does: a guide keeps it from turning."""
    made = []
    uses = Counter(body for one in points for body in set(one.bodies))
    for one in points:
        if one.slide is not None:
            if GROUND in one.bodies and one.guide == GROUND:
                raise InputError(key, one.name, "a ground point slides", "Name its moving bodies")
            alone = [b for b in one.bodies if b != GROUND and uses[b] == 1]
            block = one.block or (alone[-1] if alone else f"slider_{one.name}")
            while not one.block and not alone and block in uses:
                block += "_"
            one = one._replace(bodies=(*(b for b in one.bodies if b != block), block), block=block)
        made.append(one)
    return made


class _Frame(NamedTuple):
    """Axes of a body in the drawing."""

    x: float
    y: float
    angle: float

    def local(self, point: DrawnPoint) -> list[float]:
        """Place of a point in these axes, m."""
        dx, dy = point.x - self.x, point.y - self.y
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        place = dx * cosine + dy * sine, dy * cosine - dx * sine
        return [0.0 + round(one, 12) for one in place]  # no -0


def _by_body(points: Sequence[DrawnPoint]) -> dict[str, list[DrawnPoint]]:
    """Points of each body: its pins first, then the places of its guides."""
    made: dict[str, list[DrawnPoint]] = {}
    for one in points:
        for name in dict.fromkeys(one.bodies):
            made.setdefault(name, []).append(one)
    for one in points:
        if one.slide is not None and one.guide not in one.bodies:
            made.setdefault(one.guide, []).append(one)
    return made


def _frame(name: str, own: Sequence[DrawnPoint], key: str) -> _Frame:
    """The first point at the origin and the second on the x axis; of a body that slides the x axis along its line."""
    slides = [one.slide for one in own if one.slide is not None and one.block == name]
    if slides:
        return _Frame(own[0].x, own[0].y, slides[0])
    if len(own) == 1:
        return _Frame(own[0].x, own[0].y, 0.0)
    first, second = own[:2]
    if math.hypot(second.x - first.x, second.y - first.y) == 0.0:
        raise InputError(key, name, f"{first.name} and {second.name} are at one place", "Mend one")
    return _Frame(first.x, first.y, math.atan2(second.y - first.y, second.x - first.x))


def _body(own: Sequence[DrawnPoint], frame: _Frame, size: float) -> Content:
    """Its table; a body of one point is as long as a tenth of the linkage."""
    places = {one.name: frame.local(one) for one in own}
    centre = [round(sum(place[k] for place in places.values()) / len(places), 12) for k in (0, 1)]
    spread = sum(math.dist(place, centre) ** 2 for place in places.values()) / len(places)
    inertia = round(MASS * (spread or (0.1 * size) ** 2 / 12.0), 15)
    turned = {"start_angle": _degrees(frame.angle), "points": places}
    return {"mass": MASS, "inertia": inertia, "center": centre, **turned}


def _degrees(angle: float) -> str:
    return f"{0.0 + round(math.degrees(angle), 9)!r} deg"


def _joints(points: Sequence[DrawnPoint], frames: Mapping[str, _Frame]) -> Content:
    """A pin for each further body of a point; a guide where a point slides."""
    made: Content = {}
    taken = {one.name for one in points}
    for one in points:
        if one.slide is not None:
            carrier = frames[one.guide].angle if one.guide in frames else 0.0
            turned = math.remainder(one.slide - carrier, 2.0 * math.pi)
            name = _free(f"{one.name}_guide", taken)
            made[name] = {
                "kind": "slide", "point": f"{one.block}.{one.name}",
                "line": f"{one.guide}.{one.name}", "angle": _degrees(turned),
            }  # fmt: skip
        others = [body for body in one.bodies if body != GROUND]
        hub, *rest = [GROUND, *others] if GROUND in one.bodies else others
        for count, body in enumerate(rest):
            name = one.name if count == 0 else _free(f"{one.name}_{count + 1}", taken)
            made[name] = {
                "kind": "revolute", "journal": f"{body}.{one.name}", "bearing": f"{hub}.{one.name}",
            }  # fmt: skip
    if not made:
        reason = "no two bodies share a point"
        raise InputError("points", len(points), reason, "Name the bodies of each point")
    return made


def _free(name: str, taken: set[str]) -> str:
    """A name that no other joint has."""
    while name in taken:
        name += "_"
    taken.add(name)
    return name
