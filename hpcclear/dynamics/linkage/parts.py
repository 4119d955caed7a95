"""Bodies of a planar mechanism as frozen records in SI units, and what follows from the tables of its joints.

A place is ``"body.point"``; the ground is the body ``ground``. Points and centres are given in the body's own axes,
angles count counter-clockwise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.outcome import CORNERS, WALLS
from hpcclear.dynamics.contacts import guide, pin_in_slot
from hpcclear.dynamics.contacts.declared import ContactGeometry
from hpcclear.dynamics.contacts.registry import GEOMETRIES

GROUND = "ground"
Pair = tuple[float, float]
Number = float | Array
"""One number, or those of samples (m,)."""
PINS = ("revolute", "clearance")
KINDS = (*PINS, "slide", "slot", "fixed")
"""Of joints."""


class TableRow(Protocol):
    """What is known here of a joint or a drive: its table in a scene (`hpcclear.scene.planar`, `driving`).

    What its kind has not is not asked for: pins have `journal` and `bearing`, other joints `point`, `line` and its `angle`.
    """

    name: str
    kind: str
    journal: str
    bearing: str
    point: str
    line: str
    angle: float
    body: str
    period: bool
    prescribed: bool
    table: bool
    turns: int
    seconds: float
    advance: float
    curves: tuple[str, ...]
    straight: dict[str, tuple[Pair, ...]]

    def __getattr__(self, entry: str) -> Any:
        """Any other entry, SI; a number or an array of samples."""


Joint = TableRow
Drive = TableRow


class LoadTerms(TableRow, Protocol):
    """The same of a load (`hpcclear.scene.loads`): its parameters, and the terms that it adds by an `acting.Acting`.

    Its entries `place`, `first` and `second` are places, `body` and `other` bodies that rotate, where it has these.
    """

    by_angle: bool

    def numbers(self) -> Mapping[str, Number]:
        """Its parameters, SI; numbers or arrays of samples."""

    def act(self, on: Any) -> Any:
        """Add its forces and torques to a motion; return the power that it gives, W, as a term."""


@dataclass(frozen=True)
class Body:
    """A body: mass in kg, inertia about its mass centre in kg m2, centre and points in its own axes in m.

    `start_angle` (rad) is a rough one: the assembly starts from it. A body that cannot turn needs no inertia. It is rigid
    unless it is a bar that bends.
    """

    name: str
    mass: float
    inertia: float = 0.0
    center: Pair = (0.0, 0.0)
    points: Mapping[str, Pair] = field(default_factory=dict)
    start_angle: float = 0.0
    bending: Any = None


class Contact(NamedTuple):
    """Where two bodies may touch: a place of the journal's body against one of the bearing's, by a geometry of contact.

    `name` is the joint's, followed by a dot and a word where the joint has several; `side`: of a contact at a guide's line,
    1 on its left, -1 on its right.
    """

    name: str
    joint: Joint
    journal: str
    bearing: str
    geometry: ContactGeometry
    side: float = 0.0

    @property
    def word(self) -> str:
        """Its name in texts."""
        return self.name.replace(".", "_")


def contacts_of(joint: Joint) -> tuple[Contact, ...]:
    """The contacts of a joint with clearance: of a guide's corners, in the order of `CORNERS`, or a slot's `WALLS`."""
    geometry = GEOMETRIES[joint.geometry]
    if joint.kind == "clearance":
        return (Contact(joint.name, joint, joint.journal, joint.bearing, geometry),)
    sides = {**WALLS, **{word: side for word, (_, side) in CORNERS.items()}}
    corner_of = f"{split(joint.point)[0]}.{joint.name}_"
    return tuple(
        Contact(
            f"{joint.name}.{word}", joint,
            joint.point if joint.kind == "slot" else corner_of + word,
            joint.line, geometry, sides[word],
        )
        for word in joint.corners
    )  # fmt: skip


def start_of(joint: Joint) -> tuple[Number, ...]:
    """Of a joint with clearance at the start: the journal's eccentricity, m; the offset of a pin in a slot; offset and tilt,
    rad, of a slider."""
    if joint.kind == "clearance":
        return joint.start_eccentricity.x, joint.start_eccentricity.y
    entries = ("start_offset",) if joint.kind == "slot" else ("start_offset", "start_tilt")
    given = (getattr(joint, entry) for entry in entries)
    return tuple(0.0 if one is None else one for one in given)


def gaps_of(joint: Joint) -> tuple[Number, ...]:
    """Of its contacts at the start, m, below 0 in flight."""
    if joint.kind == "clearance":
        start = joint.start_eccentricity
        return (np.hypot(start.x, start.y) - joint.clearance,)
    module = pin_in_slot if joint.kind == "slot" else guide
    return tuple(module.gap_of(joint, word, *start_of(joint)) for word in joint.corners)


def corners_of(joint: Any, middle: Pair) -> dict[str, Pair]:
    """Points of a slider that are centres of its corners, `middle` its place in the slider's axes."""
    size = joint.length, joint.height
    return {
        f"{joint.name}_{word}": guide.corner(middle, size, joint.corner_radius, word)
        for word in CORNERS
    }


def is_loose(joint: Joint) -> bool:
    """Whether a joint has clearance."""
    return getattr(joint, "clearance", None) is not None


def places_of(joint: Joint) -> tuple[str, str]:
    """Both places: journal and bearing, or that of the body and that of the one that carries the line."""
    if joint.kind in PINS:
        return joint.journal, joint.bearing
    return joint.point, joint.line


def split(place: str) -> tuple[str, str]:
    """Body and point of a place."""
    body, _, point = place.partition(".")
    return body, point


def as_complex(pair: Any) -> Any:
    """x + iy of a pair, of numbers or of arrays of samples."""
    x, y = pair
    return x + 1j * y
