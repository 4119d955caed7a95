"""Bodies of a planar mechanism as frozen records in SI units, and what follows from the tables of its joints.

A place is ``"body.point"``; the ground is the body ``ground``. Points and centres are given in the body's own axes,
angles count counter-clockwise.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

from hpcclear.base.arrays import Array
from hpcclear.base.terms import Acting, Term

GROUND = "ground"
Pair = tuple[float, float]
Number = float | Array  # one number, or those of samples (m,)


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
    """The same of a load (`hpcclear.scene.loads`): its parameters, and the terms that it adds.

    Its entries `place`, `first` and `second` are places, `body` and `other` bodies that rotate, where it has these.
    """

    by_angle: bool

    def numbers(self) -> Mapping[str, Number]:
        """Its parameters, SI; numbers or arrays of samples."""

    def act(self, on: Acting) -> Term:
        """Add its forces and torques to a motion; return the power that it gives, W."""


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
    """Where two bodies may touch: a place of the journal's body against one of the bearing's, by the joint's geometry.

    `part` is the word of the contact where the joint has several; else "".
    """

    part: str
    joint: Joint
    journal: str
    bearing: str

    @property
    def name(self) -> str:
        """The joint's, followed by a dot and the word where it has several."""
        return f"{self.joint.name}.{self.part}" if self.part else self.joint.name

    @property
    def word(self) -> str:
        """Its name in texts."""
        return self.name.replace(".", "_")


def is_loose(joint: Joint) -> bool:
    """Whether a joint has clearance."""
    return getattr(joint, "clearance", None) is not None


def is_pin(row: TableRow) -> bool:
    """Whether a joint or drive is a joint of two points, with no line."""
    return hasattr(row, "journal")


def is_joint(row: TableRow) -> bool:
    """Whether it is a joint and no drive."""
    return is_pin(row) or hasattr(row, "line")


def places_of(joint: Joint) -> tuple[str, str]:
    """Both places: journal and bearing, or that of the body and that of the one that carries the line."""
    return (joint.journal, joint.bearing) if is_pin(joint) else (joint.point, joint.line)


def split(place: str) -> tuple[str, str]:
    """Body and point of a place."""
    body, _, point = place.partition(".")
    return body, point


def as_complex(pair: Any) -> Any:
    """x + iy of a pair, of numbers or of arrays of samples."""
    x, y = pair
    return x + 1j * y
