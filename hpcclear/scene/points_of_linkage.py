"""A linkage from a table of its points: names and places, and the bodies that each of them belongs to."""

import itertools
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from hpcclear.base.errors import InputError
from hpcclear.scene.fields import nearest
from hpcclear.scene.sheets import Column, Sheet, read
from hpcclear.scene.units import UnitError, to_si

GROUND = "ground"
MASS = 0.1
"""kg of a body whose mass nobody has given."""
_COLUMNS = {
    "name": ("name", "point", "joint", "label", "punkt"),
    "x": ("x",),
    "y": ("y",),
    "bodies": ("bodies", "body", "links", "link", "parts", "members"),
    "slide": ("slide", "guide", "angle"),
}
"""Headings, in small letters, of what a table may have."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")


class Point(NamedTuple):
    """A point of a linkage where it stands."""

    name: str
    x: float
    y: float
    bodies: tuple[str, ...]
    """That it belongs to: a pin of all of them; ground among them where it stands still."""
    slide: float | None
    """Direction of the ground's line that it moves along, rad."""


def linkage_of(path: Path) -> dict[str, Any]:
    """The tables of a scene whose linkage has its points where a file has them.

    The file has the columns name, x, y (with their unit) and,
    unless its points are a chain of bars between two that stand still,
    bodies, such as "crank coupler": points that bodies share are pins. `slide` is the angle of a guide.

    Parameters
    ----------
    path : Path
        CSV or .xlsx.

    Raises
    ------
    InputError
        If it is no such table, or its bodies make no linkage.
    """
    points = _points(read(path, "table of points"), str(path))
    names = list(dict.fromkeys(body for one in points for body in one.bodies if body != GROUND))
    joints = _joints(points)
    driven = next(
        (b for b in names if any(b in p.bodies and GROUND in p.bodies for p in points)), None
    )
    if driven is None:
        raise InputError(
            str(path), ", ".join(names), "no body is pinned to the ground",
            'Name the body "ground" at points that stand still'
        )  # fmt: skip
    fixed = [one for one in points if GROUND in one.bodies or one.slide is not None]
    return {
        "format_version": 2,
        "mechanism": {
            "kind": "planar",
            "bodies": {name: _body(name, points, str(path)) for name in names},
            "ground": {"points": {one.name: [one.x, one.y] for one in fixed}},
            "joints": joints,
            "drives": {"motor": {"kind": "constant-speed", "body": driven, "speed": "60 rpm"}},
        },
        "effects": {"gravity": 0.0},
    }


def text_of(content: dict[str, Any], source: str) -> str:
    """The scene file: the tables, and what to put in below a heading."""
    return (
        f"# A linkage with the points of {' '.join(source.split())}.\n"
        f"# Masses ({MASS} kg each), inertias and the speed are placeholders: put yours in. For clearance write a joint as\n"
        '#   kind = "clearance", clearance = "0.1 mm", bearing_radius = "10 mm", materials = { ... }\n'
        "# and a contact law in [effects].\n\n" + tomli_w.dumps(content)
    )


def _points(sheet: Sheet, key: str) -> list[Point]:
    columns = {
        kind: next((one for one in sheet.columns if one.name.strip().lower() in words), None)
        for kind, words in _COLUMNS.items()
    }
    for needed in ("name", "x", "y"):
        if columns[needed] is None:
            remedy = "Write the headings name, x [mm], y [mm] and bodies"
            raise InputError(key, ", ".join(sheet.names), f"has no column {needed}", remedy)
    x, y = (_lengths(sheet, columns[axis], key) for axis in ("x", "y"))
    rows = range(len(sheet.lines))
    names = [_cell(columns["name"], row) for row in rows]
    for row, name in enumerate(names):
        where = f"{key}, line {sheet.lines[row]}"
        if not _NAME.fullmatch(name):
            raise InputError(
                where,
                name,
                "is no name of a point",
                "Begin with a letter; use letters, digits, - and _",
            )
        if name in names[:row]:
            raise InputError(where, name, "a point of this name stands above", "Name each once")
    bodies = _bodies(columns["bodies"], names, key)
    slides = [_slide(sheet, columns["slide"], row) for row in rows]
    return _with_sliders(
        [Point(*one) for one in zip(names, x, y, bodies, slides, strict=True)], key
    )


def _with_sliders(points: list[Point], key: str) -> list[Point]:
    """Points with a body of its own for each that slides, the last of its bodies: a guide keeps a body from turning."""
    made = []
    for one in points:
        if one.slide is not None:
            if GROUND in one.bodies:
                raise InputError(
                    key, one.name, "a point of the ground slides", "Name its moving bodies"
                )
            alone = [body for body in one.bodies if sum(body in p.bodies for p in points) == 1]
            slider = alone[-1] if alone else f"slider_{one.name}"
            one = one._replace(bodies=(*(b for b in one.bodies if b != slider), slider))
        made.append(one)
    return made


def _cell(column: Column | None, row: int) -> str:
    return "" if column is None else column.cells[row].strip()


def _lengths(sheet: Sheet, column: Column | None, key: str) -> list[float]:
    assert column is not None  # looked for before
    if not column.unit:
        raise InputError(
            key, column.heading, "nothing says its unit", f'Write "{column.name} [mm]", say'
        )
    try:
        size = to_si(f"1 {column.unit}", "m")
    except UnitError as error:
        raise InputError(key, column.heading, error.reason, error.remedy) from None
    return [round(size * sheet.number(column, row), 12) for row in range(len(sheet.lines))]


def _bodies(column: Column | None, names: Sequence[str], key: str) -> list[tuple[str, ...]]:
    """Bodies of each point; of a file without them bars from each point to the next, the first and the last on the ground."""
    if column is None:
        if len(names) < 4:
            raise InputError(
                key,
                len(names),
                "a closed chain of bars has at least 4 points",
                "Add a column bodies",
            )
        bars = [GROUND, *(f"bar{k}" for k in range(1, len(names))), GROUND]
        return list(itertools.pairwise(bars))
    found = []
    for row, cell in enumerate(column.cells):
        bodies = tuple(dict.fromkeys(re.split(r"[\s,;+/&|-]+", cell.strip().lower())))
        wrong = next((one for one in bodies if not _NAME.fullmatch(one)), None)
        if wrong is not None:
            raise InputError(
                key, cell, f"{names[row]} belongs to no body", 'Write, say, "crank coupler"'
            )
        found.append(
            tuple(GROUND if one in ("frame", "base", "fixed", "0") else one for one in bodies)
        )
    return found


def _slide(sheet: Sheet, column: Column | None, row: int) -> float | None:
    if column is None or _cell(column, row) in ("", "-"):
        return None
    value = sheet.number(column, row, "rad")
    return to_si(f"{value!r} {column.unit or 'deg'}", "rad")


def _origin(name: str, points: Sequence[Point], key: str) -> tuple[list[Point], float]:
    """Points of a body, and the direction from its first to its second."""
    own = [one for one in points if name in one.bodies]
    if len(own) == 1:
        return own, 0.0
    first, second = own[:2]
    if math.hypot(second.x - first.x, second.y - first.y) == 0.0:
        raise InputError(
            key, name, f"{first.name} and {second.name} are at one place", "Mend one of them"
        )
    return own, math.atan2(second.y - first.y, second.x - first.x)


def _body(name: str, points: Sequence[Point], key: str) -> dict[str, Any]:
    """A body with its first point at its origin and its second on its x axis."""
    own, angle = _origin(name, points, key)
    first = own[0]
    turned = {
        one.name: [  # + 0.0: no negative zeros
            0.0
            + round((one.x - first.x) * math.cos(angle) + (one.y - first.y) * math.sin(angle), 12),
            0.0
            + round((one.y - first.y) * math.cos(angle) - (one.x - first.x) * math.sin(angle), 12),
        ]
        for one in own
    }
    centre = [round(sum(place[k] for place in turned.values()) / len(own), 12) for k in (0, 1)]
    spread = sum(math.dist(place, centre) ** 2 for place in turned.values()) / len(own)
    return {
        "mass": MASS,
        "inertia": round(MASS * spread, 15),
        "center": centre,
        "start_angle": f"{round(math.degrees(angle), 9)!r} deg",
        "points": turned,
    }


def _joints(points: Sequence[Point]) -> dict[str, Any]:
    """A pin for each further body of a point; a guide where a point slides."""
    made = {}
    for one in points:
        place = f"{GROUND}.{one.name}"
        if one.slide is not None:
            moving = one.bodies[-1]
            angle = f"{round(math.degrees(one.slide), 9)!r} deg"
            made[f"{one.name}_guide"] = {
                "kind": "slide", "point": f"{moving}.{one.name}", "line": place, "angle": angle,
            }  # fmt: skip
        others = [body for body in one.bodies if body != GROUND]
        hub, *rest = [GROUND, *others] if GROUND in one.bodies and one.slide is None else others
        for number, body in enumerate(rest):
            name = one.name if number == 0 else f"{one.name}_{number + 1}"
            made[name] = {
                "kind": "revolute",
                "journal": f"{body}.{one.name}",
                "bearing": f"{hub}.{one.name}",
            }
    if not made:
        raise InputError(
            "points", len(points), "no two bodies share a point", nearest("bodies", ("bodies",))
        )
    return made
