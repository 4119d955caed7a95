"""What a planar mechanism is made of: bodies, joints, drives and loads, each a frozen record in SI units.

A place is ``"body.point"``; the ground is the body ``ground``. Points and centres are given in the body's own axes,
angles count counter-clockwise.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np

from hpcclear.base.outcome import CORNERS, WALLS
from hpcclear.dynamics.contacts import pin_in_slot
from hpcclear.dynamics.contacts.declared import ContactGeometry
from hpcclear.dynamics.contacts.guide import corner, gap_of
from hpcclear.dynamics.contacts.registry import GEOMETRIES

GROUND = "ground"
Pair = tuple[float, float]


@dataclass(frozen=True)
class Bending:
    """Of a bar from its point a to b: how many modes, stiffness EI in N m2, damping ratio of each mode."""

    modes: int
    stiffness: float
    damping: float = 0.0


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
    bending: Bending | None = None


class Contact(NamedTuple):
    """Where two bodies may touch: a place of the journal's body against one of the bearing's, by a geometry of contact.

    `name` is the joint's, followed by a dot and a word where the joint has several; `side`: of a contact at a guide's line,
    1 on its left, -1 on its right.
    """

    name: str
    joint: "Joint"
    journal: str
    bearing: str
    geometry: ContactGeometry
    side: float = 0.0

    @property
    def word(self) -> str:
        """Its name in texts."""
        return self.name.replace(".", "_")


@dataclass(frozen=True)
class IdealFriction:
    """Friction of a guide or pin over its reaction, sliding speed (m/s) below which it falls linearly to 0, and radius of the
    pin (m), which makes torques of forces: 1 of a guide."""

    coefficient: float
    ramp_speed: float
    radius: float = 1.0


@dataclass(frozen=True)
class Revolute:
    """A pin without clearance between two places."""

    name: str
    journal: str
    bearing: str
    friction: IdealFriction | None = field(default=None, kw_only=True)
    contacts: ClassVar[tuple[Contact, ...]] = ()

    @property
    def places(self) -> tuple[str, str]:
        """Both places: journal, bearing."""
        return self.journal, self.bearing


@dataclass(frozen=True)
class Clearance(Revolute):
    """A journal that moves freely in a bearing larger than itself by the clearance, m."""

    ideal: ClassVar[type] = Revolute

    clearance: float = 0.0
    bearing_radius: float = 0.0
    stiffness: float = 0.0
    start_eccentricity: Pair = (0.0, 0.0)

    @property
    def contacts(self) -> tuple[Contact, ...]:  # type: ignore[override]
        """The one of its journal."""
        pin = GEOMETRIES["pin_in_bearing"]
        return (Contact(self.name, self, self.journal, self.bearing, pin),)

    @property
    def gaps(self) -> tuple[Any, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        return (np.hypot(*self.start_eccentricity) - self.clearance,)


@dataclass(frozen=True)
class Aligned:
    """A body whose x axis keeps the direction of a line through a place of another body or of the ground.

    `line` is that place, on the carrier; `angle` the line's direction in the carrier's axes, rad.
    """

    name: str
    point: str
    line: str
    angle: float = 0.0
    contacts: ClassVar[tuple[Contact, ...]] = ()

    @property
    def places(self) -> tuple[str, str]:
        """Both places: of the body, of the one that carries the line."""
        return self.point, self.line


@dataclass(frozen=True)
class Slide(Aligned):
    """A guide: the point moves along the line."""

    friction: IdealFriction | None = None


@dataclass(frozen=True)
class LooseSlide(Slide):
    """A rectangular slider, its middle at the point, in a channel that is higher by twice the clearance; all in m.

    Its x axis goes along the line but for tilt. At the start it is offset to the left of the line and tilted (rad).
    """

    ideal: ClassVar[type] = Slide

    clearance: float = 0.0
    length: float = 0.0
    height: float = 0.0
    corner_radius: float = 0.0
    stiffness: float = 0.0
    start_offset: float = 0.0
    start_tilt: float = 0.0

    @property
    def contacts(self) -> tuple[Contact, ...]:  # type: ignore[override]
        """One a corner, in the order of `CORNERS`."""
        body, guide = split(self.point)[0], GEOMETRIES["guide"]
        return tuple(
            Contact(
                f"{self.name}.{word}", self, f"{body}.{self.name}_{word}", self.line, guide, side
            )
            for word, (_, side) in CORNERS.items()
        )

    @property
    def gaps(self) -> tuple[Any, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        return tuple(gap_of(self, word, self.start_offset, self.start_tilt) for word in CORNERS)

    @property
    def start_eccentricity(self) -> tuple[Any, Any]:
        """What the constraints of a guide without clearance are at the start: offset, sine of the tilt."""
        return self.start_offset, np.sin(self.start_tilt)

    def corners(self, middle: object) -> dict[str, tuple[Any, Any]]:
        """Points of the slider that are centres of its corners, `middle` its place in the slider's axes."""
        size = self.length, self.height
        return {
            f"{self.name}_{word}": corner(middle, size, self.corner_radius, word)
            for word in CORNERS
        }


@dataclass(frozen=True)
class Slot(Aligned):
    """A pin in a slot: the point moves along the line, and its body turns freely."""


@dataclass(frozen=True)
class LooseSlot(Slot):
    """A pin, its centre at the point, in a slot that is wider by twice the clearance; all in m.

    At the start it is offset to the left of the line.
    """

    ideal: ClassVar[type] = Slot

    clearance: float = 0.0
    pin_radius: float = 0.0
    stiffness: float = 0.0
    start_offset: float = 0.0

    @property
    def contacts(self) -> tuple[Contact, ...]:  # type: ignore[override]
        """One a wall, in the order of `WALLS`."""
        slot = GEOMETRIES["pin_in_slot"]
        return tuple(
            Contact(f"{self.name}.{word}", self, self.point, self.line, slot, side)
            for word, side in WALLS.items()
        )

    @property
    def gaps(self) -> tuple[Any, ...]:
        """Of its contacts at the start, m, below 0 in flight."""
        return tuple(pin_in_slot.gap_of(self, word, self.start_offset) for word in WALLS)

    @property
    def start_eccentricity(self) -> tuple[Any]:
        """What the constraint of a slot without clearance is at the start: the offset."""
        return (self.start_offset,)


@dataclass(frozen=True)
class Fixed(Aligned):
    """A body held on the ground: the point stays where the line begins."""


Joint = Revolute | Clearance | Slide | LooseSlide | Slot | LooseSlot | Fixed
Loose = Clearance | LooseSlide | LooseSlot


@dataclass(frozen=True)
class ConstantSpeed:
    """The body's angle is prescribed: it turns at a constant speed, rad/s."""

    name: str
    body: str
    speed: float
    period: bool = False
    turns: int = 1
    prescribed: ClassVar[bool] = True

    @property
    def seconds(self) -> float:
        """One revolution of as many turns, s."""
        return 2 * math.pi * self.turns / abs(self.speed)

    @property
    def advance(self) -> float:
        """By how much the angle changes until then, rad: negative clockwise."""
        return math.copysign(2 * math.pi * self.turns, self.speed)


@dataclass(frozen=True)
class Harmonic:
    """The body's angle is ``mean + amplitude sin(2 pi frequency t + phase)``; rad and 1/s."""

    name: str
    body: str
    amplitude: float
    frequency: float
    mean: float = 0.0
    phase: float = 0.0
    period: bool = False
    prescribed: ClassVar[bool] = True
    turns: ClassVar[int] = 1
    advance: ClassVar[float] = 0.0

    @property
    def seconds(self) -> float:
        """One swing to and fro, s."""
        return 1 / self.frequency


@dataclass(frozen=True)
class TableDrive:
    """The body's angle is prescribed by rows (time in s, angle in rad), the first at 0, the last where it repeats.

    A cubic spline that is smooth where it repeats as well; `pieces`: those of its `curves` (`planar.curves.angle_pieces`). The
    last angle is the first, or a turn further on or back.
    """

    name: str
    body: str
    rows: tuple[Pair, ...]
    pieces: Any = field(compare=False, repr=False)
    period: bool = False
    prescribed: ClassVar[bool] = True
    turns: ClassVar[int] = 1
    curves: ClassVar[tuple[str, ...]] = ("angle", "spin", "turn")
    """Angle but for what it gains evenly (rad), and its first and second derivative (rad/s, rad/s2)."""

    @property
    def seconds(self) -> float:
        """Until it repeats, s."""
        return self.rows[-1][0]

    @property
    def advance(self) -> float:
        """What is gained until then, rad: a turn, either way round, or nothing."""
        return 2 * math.pi * round((self.rows[-1][1] - self.rows[0][1]) / (2 * math.pi))


@dataclass(frozen=True)
class TorqueDrive:
    """A torque (N m) acts on a free body with `inertia` (kg m2) turning along; `table`: times a curve over the angle of the
    period's body.

    Where there is a speed without load (rad/s), the torque falls in proportion to the speed and is 0 at that one. `by_speed`:
    rows (rad/s, N m) in place of the torque, straight between and level beyond. `interval`: a time (s) that replaces the
    revolution.
    """

    name: str
    body: str
    torque: float
    initial_speed: float
    inertia: float = 0.0
    table: bool = False
    period: bool = False
    turns: int = 1
    expected_speed: float | None = None
    no_load_speed: float | None = None
    by_speed: tuple[Pair, ...] | None = None
    interval: float | None = field(default=None, kw_only=True)
    prescribed: ClassVar[bool] = False

    @property
    def straight(self) -> dict[str, tuple[Pair, ...]]:
        """Its table over the speed, by the name that its parameters begin with."""
        return {} if self.by_speed is None else {f"{self.name}_by_speed": self.by_speed}

    @property
    def usual_speed(self) -> float:
        """About how fast it turns, rad/s: what is expected, or else what it starts with."""
        return self.initial_speed if self.expected_speed is None else self.expected_speed

    @property
    def seconds(self) -> float:
        """One revolution of as many turns at the usual speed, s."""
        if self.interval is not None:
            return self.interval
        return 2 * math.pi * self.turns / abs(self.usual_speed)

    @property
    def advance(self) -> float:
        """By how much the angle changes until then, rad; 0 where a time replaces the revolution."""
        return 2 * math.pi * self.turns if self.interval is None else 0.0


@dataclass(frozen=True)
class Release(TorqueDrive):
    """No drive: a body is let go at a speed, and a time replaces the revolution."""


@dataclass(frozen=True)
class RunUp(TorqueDrive):
    """A body whose angle is free turns at speeds given by rows (s, rad/s), smooth and level beyond, whatever torque that takes.

    `pieces`: those of its `curves`.
    """

    rows: tuple[Pair, ...] = ()
    pieces: Any = field(default=None, compare=False, repr=False)
    curves: ClassVar[tuple[str, ...]] = ("speed", "rise")

    @property
    def length(self) -> float:
        """Until the speed stays as it is, s."""
        return self.rows[-1][0]


Drive = ConstantSpeed | Harmonic | TableDrive | TorqueDrive


class LoadTerms(Protocol):
    """What is known here of a load (`hpcclear.scene.loads`): its parameters, and the terms that it adds by an `acting.Acting`.

    Its entries `place`, `first` and `second` are places, `body` and `other` bodies that rotate, where it has these.
    """

    @property
    def name(self) -> str:
        """That of its parameters and curve."""

    @property
    def table(self) -> bool:
        """Whether it follows a curve."""

    @property
    def by_angle(self) -> bool:
        """Whether it goes by the angle of its `body`, or between that and `other`."""

    def numbers(self) -> dict[str, Any]:
        """Its parameters, SI; numbers or arrays of samples."""

    def act(self, on: Any) -> Any:
        """Add its forces and torques to a motion; return the power that it gives, W, as a term."""


def seconds_of(load: object) -> float:
    """Length of a load's curve over the time, s; 0 where it has none."""
    return float(getattr(load, "seconds", 0.0))


def curves_of(part: Drive | LoadTerms) -> list[str]:
    """Names of the tabulated curves that a drive or load has."""
    if isinstance(part, (TableDrive, RunUp)):
        return [f"{part.name}.{one}" for one in part.curves]
    return [part.name] if getattr(part, "table", False) else []


def straight_of(part: Drive | LoadTerms) -> dict[str, tuple[Pair, ...]]:
    """Tables of a drive or load that run straight from row to row, over a speed or a distance."""
    found: dict[str, tuple[Pair, ...]] = getattr(part, "straight", {})
    return found


def split(place: str) -> tuple[str, str]:
    """Body and point of a place."""
    body, _, point = place.partition(".")
    return body, point


def as_complex(pair: Any) -> Any:
    """x + iy of a pair, of numbers or of arrays of samples."""
    x, y = pair
    return x + 1j * y
