"""What moves a planar mechanism: drives as frozen records in SI units, and what is known of loads; their tables."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Protocol

from hpcclear.base.pieces import Pieces
from hpcclear.dynamics.linkage.parts import Number, Pair


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
    pieces: tuple[Pieces, ...] = field(compare=False, repr=False)
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
    pieces: tuple[Pieces, ...] = field(default=(), compare=False, repr=False)
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

    def numbers(self) -> Mapping[str, Number]:
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
