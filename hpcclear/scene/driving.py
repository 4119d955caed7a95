"""What moves a mechanism: drives of bodies."""

import math
from functools import lru_cache
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from hpcclear.base.pieces import Pieces, Rows, level, periodic
from hpcclear.scene.curves import Curve, Pairs, by_angle, by_time
from hpcclear.scene.fields import Angle, Count, Quantity, Table, invalid

MOST_TURNS = 64
"""Of a drive in a revolution."""
Turns = Annotated[int, Count(least=1, most=MOST_TURNS)]
Interval = Annotated[float, Quantity("s", above=0)]


def by_interval(drive: object) -> bool:
    """Whether a time replaces the revolution of a drive."""
    return getattr(drive, "interval", None) is not None


def speed_entry(drive: "CrankSpeed | CrankTorque") -> str:
    """The entry of a drive that gives its speed: `speed`, or of a torque `expected_speed` or `initial_speed`."""
    if isinstance(drive, CrankSpeed):
        return "speed"
    return "initial_speed" if drive.expected_speed is None else "expected_speed"


@lru_cache(maxsize=16)
def spline(rows: Rows) -> Pieces:
    """A periodic cubic spline through a table whose places begin at 0, but for what it gains evenly; not to be written to."""
    from scipy.interpolate import CubicSpline  # a third of a second, for this alone

    x, y = np.array(rows).T
    rest = y - (y[-1] - y[0]) * x / x[-1]
    rest[-1] = rest[0]
    length = float(x[-1])
    smooth = CubicSpline(x, rest, bc_type="periodic")
    return Pieces(x[:-1] / length, smooth.c[::-1].T * length ** np.arange(4), length)


class Driving(Table):
    """What all drives of a linkage have."""

    name: str
    body: str
    """Body that is driven; a torque on it has its reaction on the ground. Of a mechanism that is let go: the body whose
    angle is reported."""
    period: bool = False
    """Whether a turn of this body defines the revolution, or what replaces it: one oscillation, the table, the interval.
    Default: true for the first drive if no drive has this entry."""

    prescribed: ClassVar[bool] = True
    """Whether the time alone gives the angle of its body."""
    table: ClassVar[bool] = False
    """Whether it has a torque over the angle of the body that defines the period."""
    curves: ClassVar[tuple[str, ...]] = ()
    """Its tabulated motion: the angle but for what it gains evenly (rad) or the speed (rad/s), and derivatives."""

    @property
    def straight(self) -> dict[str, Rows]:
        """Its tables that run straight from row to row, by the names that their parameters begin with."""
        return {}


class FreeDriving(Driving):
    """What drives have that leave the angle of their body free."""

    prescribed: ClassVar[bool] = False

    @property
    def usual_speed(self) -> float:
        """About how fast it turns, rad/s: what is expected, or else what it starts with."""
        expected: float | None = getattr(self, "expected_speed", None)
        return self.initial_speed if expected is None else expected  # type: ignore[attr-defined, no-any-return]

    @property
    def seconds(self) -> float:
        """One revolution of as many turns at the usual speed, s, or the interval in its place."""
        if by_interval(self):
            return self.interval  # type: ignore[attr-defined, no-any-return]
        return 2 * math.pi * self.turns / abs(self.usual_speed)  # type: ignore[attr-defined, no-any-return]

    @property
    def advance(self) -> float:
        """By how much the angle changes until then, rad; 0 where a time replaces the revolution."""
        return 0.0 if by_interval(self) else 2 * math.pi * self.turns  # type: ignore[attr-defined]


class CrankSpeed(Table):
    """The crank turns at a constant prescribed speed, independent of the torque that this requires."""

    kind: Literal["constant-speed"]
    speed: Annotated[float, Quantity("rad/s", nonzero=True, why="there would be no motion")]
    """Angular speed, rad/s, counter-clockwise; negative: clockwise. "600 min^-1" means 600 revolutions per minute."""
    turns: Turns = 1
    """Turns per revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after this number of turns."""

    elsewhere: ClassVar = dict.fromkeys(
        ("torque", "flywheel_inertia", "initial_speed", "expected_speed", "no_load_speed"),
        ("contradicts a prescribed speed", 'Remove it, or set kind = "torque" with initial_speed'),
    )


class PlanarSpeed(Driving, CrankSpeed):
    """A body turns at a constant speed."""

    @property
    def seconds(self) -> float:
        """One revolution of as many turns, s."""
        return 2 * math.pi * self.turns / abs(self.speed)

    @property
    def advance(self) -> float:
        """By how much the angle changes until then, rad: negative clockwise."""
        return np.copysign(2 * math.pi * self.turns, self.speed)


class PlanarHarmonic(Driving):
    """A body oscillates: mean + amplitude sin(2 pi frequency t + phase)."""

    kind: Literal["harmonic"]
    amplitude: Angle
    """Amplitude, rad."""
    frequency: Annotated[float, Quantity("Hz", above=0)]
    """Oscillations per second, Hz. For an angular speed such as "1200 rpm": turns per second."""
    mean: Angle = 0.0
    """Mean angle, rad."""
    phase: Angle = 0.0
    """Phase at time 0, rad."""

    turns: ClassVar[int] = 1
    advance: ClassVar[float] = 0.0

    @property
    def seconds(self) -> float:
        """One swing to and fro, s."""
        return 1 / self.frequency


class PlanarTable(Driving):
    """A body follows a table of angles."""

    kind: Literal["table"]
    angle: Annotated[Rows, by_time("rad", "angle", fewest=4)]
    """``[[time, angle], ...]``, s and rad, from time 0. The motion repeats from the last time on. The last angle equals
    the first one, or differs from it by one turn (plus: counter-clockwise, minus: clockwise). Values in between follow
    a periodic cubic spline."""

    turns: ClassVar[int] = 1
    curves: ClassVar[tuple[str, ...]] = ("angle", "spin", "turn")

    @property
    def pieces(self) -> tuple[Pieces, ...]:
        """Those of its `curves`, exact derivatives, so that what is integrated belongs to where things are."""
        angle = spline(self.angle)
        spin = angle.derivative()
        return angle, spin, spin.derivative()

    @property
    def seconds(self) -> float:
        """Until it repeats, s."""
        return self.angle[-1][0]

    @property
    def advance(self) -> float:
        """What is gained until then, rad: a turn, either way round, or nothing."""
        return 2 * math.pi * round((self.angle[-1][1] - self.angle[0][1]) / (2 * math.pi))

    def _check(self) -> None:
        if self.angle[0][0] != 0.0:
            reason = "the times must rise from 0 from row to row"
            raise invalid(reason, "Sort the rows by time, the first at 0", "angle")
        gained = self.angle[-1][1] - self.angle[0][1]
        if not any(abs(abs(gained) - whole) < 1e-9 for whole in (0.0, 2 * math.pi)):
            reason = f"the last angle is {gained:.6g} rad from the first, where the motion repeats"
            raise invalid(reason, "End it where it began, or a full turn on or back", "angle")


class CrankTorque(Table):
    """A torque acts on the free crank; its speed is a result of the simulation."""

    kind: Literal["torque"]
    torque: Annotated[Curve, by_angle("N*m")] | None = None
    """Torque, N m; constant, or a table ``[[angle, torque], ...]`` over the turns of a revolution, against the angle of
    the crank or of the body that defines the period."""
    torque_by_speed: Annotated[Rows, Pairs("rad/s", "N*m", ("speed", "torque"))] | None = None
    """Instead of `torque`: ``[[speed, torque], ...]`` as of a motor with its pull-out torque, rad/s and N m; linear
    between the rows, constant outside them."""
    no_load_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """Speed at which the torque is 0, rad/s. The torque decreases linearly with the speed, as that of a motor. Without
    it the torque does not depend on the speed."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Moment of inertia of a flywheel that turns with it, kg m2."""
    initial_speed: Annotated[float, Quantity("rad/s", least=0)]
    """Angular speed at the start, rad/s; 0: from rest."""
    expected_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """Approximate speed to expect, rad/s. Tolerances and the first step are scaled by it, or by `initial_speed` if it
    is missing. Required for a start from rest."""
    turns: Turns = 1
    """Turns per revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after this number of turns."""

    elsewhere: ClassVar = {
        "speed": ("is a result of a torque", 'Give initial_speed, or kind = "constant-speed"')
    }

    def _check(self) -> None:
        """It has one torque, and a speed that tolerances go by."""
        if self.initial_speed == 0.0 and self.expected_speed is None and not by_interval(self):
            reason = "is needed where initial_speed = 0: the tolerances and the first step go by it"
            remedy = 'Write about how fast it will turn, such as expected_speed = "1500 rpm"'
            raise invalid(reason, remedy, "expected_speed")
        remedy = "Write torque, or torque_by_speed = [[speed, torque], ...]"
        self.check_one_of(remedy, "torque", "torque_by_speed")
        if self.torque_by_speed is not None and self.no_load_speed is not None:
            raise invalid("torque_by_speed says how the torque falls", "Remove it", "no_load_speed")
        if self.no_load_speed is not None and isinstance(self.torque, float) and self.torque < 0.0:
            remedy = "Clockwise write torque_by_speed = [[speed, torque], ...], speeds below 0"
            raise invalid("is of a torque above 0: this one would grow", remedy, "no_load_speed")


class PlanarTorque(FreeDriving, CrankTorque):
    """A torque acts on a free body."""

    interval: Interval | None = None
    """Time that replaces the revolution, s, for a body that swings or turns back. Without it the body has to turn."""

    @property
    def table(self) -> bool:  # type: ignore[override]
        """Whether its torque follows a curve over the angle."""
        return isinstance(self.torque, tuple)

    @property
    def straight(self) -> dict[str, Rows]:
        """Its table over the speed."""
        rows = self.torque_by_speed
        return {} if rows is None else {f"{self.name}_by_speed": rows}

    def curve(self, turns: int, interpolation: str) -> Pieces:
        """The curve that its torque follows; `turns`: until tables repeat."""
        assert isinstance(self.torque, tuple)
        return periodic(self.torque, 2.0 * math.pi * turns, interpolation)

    def _check(self) -> None:
        if by_interval(self) and self.turns != 1:
            raise invalid("interval replaces the turns", "Remove turns", "turns")


class PlanarFree(FreeDriving):
    """No drive: the mechanism is let go, and moves by its loads and its weight. A time replaces the revolution."""

    kind: Literal["free"]
    interval: Interval
    """Time that replaces the revolution, s: `transient_revolutions` and `averaged_revolutions` count such intervals."""
    initial_speed: Annotated[float, Quantity("rad/s")] = 0.0
    """Angular speed of the body at the start, rad/s, counter-clockwise; negative: clockwise."""

    turns: ClassVar[int] = 1


class PlanarRunUp(FreeDriving):
    """A body turns at a prescribed speed that depends on time, such as a run-up, independent of the torque that this
    requires."""

    kind: Literal["run-up"]
    speed_by_time: Annotated[Rows, by_time("rad/s", "speed")]
    """``[[time, speed], ...]``, s and rad/s, from 0 s on. Speeds are not negative, and the last one is positive. Values
    in between follow a monotone cubic with zero slope at both ends; after the last row the speed is constant."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Moment of inertia of a flywheel on the body, kg m2."""
    turns: Turns = 1
    """Turns per revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after this number of turns."""

    curves: ClassVar[tuple[str, ...]] = ("speed", "rise")

    @property
    def pieces(self) -> tuple[Pieces, ...]:
        """Those of its `curves`, up to the last row, where the speed stays."""
        speed = level(self.speed_by_time)
        return speed, speed.derivative()

    @property
    def initial_speed(self) -> float:
        """Where its table begins, rad/s."""
        return self.speed_by_time[0][1]

    @property
    def expected_speed(self) -> float:
        """The largest of its table, rad/s."""
        return max(speed for _, speed in self.speed_by_time)

    def _check(self) -> None:
        speeds = [speed for _, speed in self.speed_by_time]
        if min(speeds) < 0.0 or min(speeds[1:]) == 0.0:
            reason = "the speed falls to 0 or below, where no revolution would end"
            raise invalid(reason, "Give speeds above 0 from the second row on", "speed_by_time")


_Known = PlanarSpeed | PlanarHarmonic | PlanarTable | PlanarTorque | PlanarRunUp | PlanarFree
PlanarDrive = Annotated[_Known, Field(discriminator="kind")]
