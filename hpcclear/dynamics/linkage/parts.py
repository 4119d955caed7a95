"""What a planar mechanism is made of: bodies, joints, drives and loads, each a frozen record in SI units.

A place is ``"body.point"``; the ground is the body ``ground``. Points and centres are given in the body's own axes,
angles count counter-clockwise.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

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


@dataclass(frozen=True)
class Revolute:
    """A pin without clearance between two places."""

    name: str
    journal: str
    bearing: str

    @property
    def places(self) -> tuple[str, str]:
        """Both places: journal, bearing."""
        return self.journal, self.bearing


@dataclass(frozen=True)
class Clearance(Revolute):
    """A journal that moves freely in a bearing larger than itself by the clearance, m."""

    clearance: float = 0.0
    bearing_radius: float = 0.0
    stiffness: float = 0.0
    start_eccentricity: Pair = (0.0, 0.0)


@dataclass(frozen=True)
class GuideFriction:
    """Friction of a guide over its reaction, and the sliding speed (m/s) below which it falls linearly to 0."""

    coefficient: float
    ramp_speed: float


@dataclass(frozen=True)
class Aligned:
    """A body whose x axis keeps the direction of a line through a place of another body or of the ground.

    `line` is that place, on the carrier; `angle` the line's direction in the carrier's axes, rad.
    """

    name: str
    point: str
    line: str
    angle: float = 0.0

    @property
    def places(self) -> tuple[str, str]:
        """Both places: of the body, of the one that carries the line."""
        return self.point, self.line


@dataclass(frozen=True)
class Slide(Aligned):
    """A guide: the point moves along the line."""

    friction: GuideFriction | None = None


@dataclass(frozen=True)
class Fixed(Aligned):
    """A body held on the ground: the point stays where the line begins."""


Joint = Revolute | Clearance | Slide | Fixed


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

    A cubic spline that is smooth where it repeats as well; `cells`: what the kernel reads of it (`curves.angle_cells`). The
    last angle is the first, or a turn further on or back.
    """

    name: str
    body: str
    rows: tuple[Pair, ...]
    cells: Any = field(compare=False, repr=False)
    period: bool = False
    prescribed: ClassVar[bool] = True
    turns: ClassVar[int] = 1

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

    Where there is a speed without load (rad/s), the torque falls in proportion to the speed and is 0 at that one.
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
    prescribed: ClassVar[bool] = False

    @property
    def usual_speed(self) -> float:
        """About how fast it turns, rad/s: what is expected, or else what it starts with."""
        return self.initial_speed if self.expected_speed is None else self.expected_speed

    @property
    def seconds(self) -> float:
        """One revolution of as many turns at the usual speed, s."""
        return 2 * math.pi * self.turns / abs(self.usual_speed)

    @property
    def advance(self) -> float:
        """By how much the angle changes until then, rad."""
        return 2 * math.pi * self.turns


Drive = ConstantSpeed | Harmonic | TableDrive | TorqueDrive


@dataclass(frozen=True)
class Force:
    """A force (N, along the ground's axes) at a place; `table`: times a curve over the angle of the period's body."""

    name: str
    place: str
    force: Pair
    table: bool = False


@dataclass(frozen=True)
class Torque:
    """A torque on a body, N m; `table` as of a force."""

    name: str
    body: str
    torque: float
    table: bool = False


@dataclass(frozen=True)
class Spring:
    """A spring (N/m, free length in m) and damper (N s/m) between two places."""

    name: str
    first: str
    second: str
    stiffness: float
    length: float = 0.0
    damping: float = 0.0


Load = Force | Torque | Spring


def split(place: str) -> tuple[str, str]:
    """Body and point of a place."""
    body, _, point = place.partition(".")
    return body, point


def as_complex(pair: Any) -> Any:
    """x + iy of a pair, of numbers or of arrays of samples."""
    x, y = pair
    return x + 1j * y
