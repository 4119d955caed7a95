"""What moves a planar linkage: drives of bodies, and loads on bodies and points."""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from hpcclear.scene.fields import (
    Count,
    Curve,
    CurveOf,
    MotionTable,
    Quantity,
    Table,
    check_one_of,
    invalid,
)
from hpcclear.scene.loads import CylinderLoad, DragLoad, Law, TorsionSpringLoad, by_time
from hpcclear.scene.places import Angle, PairTable

Turns = Annotated[int, Count(least=1, most=64)]


def check_start(drive: Any) -> None:
    """Refuse a drive that starts from rest without an expected speed.

    Raises
    ------
    PydanticCustomError
        Naming ``expected_speed``.
    """
    if drive.initial_speed == 0.0 and drive.expected_speed is None:
        raise invalid(
            "is needed where initial_speed = 0: the tolerances and the first step go by it",
            'Write about how fast it will turn, such as expected_speed = "1500 rpm"',
            key="expected_speed",
        )


def check_torque(drive: Any) -> None:
    """Refuse a drive without a torque, or with two; raises PydanticCustomError."""
    check_one_of(
        "torque",
        drive.torque,
        drive.torque_by_speed,
        "Write torque, or torque_by_speed = [[speed, torque], ...]",
    )
    if drive.torque_by_speed is not None and drive.no_load_speed is not None:
        raise invalid(
            "torque_by_speed says already how the torque falls", "Remove it",
            key="no_load_speed", value=drive.no_load_speed,
        )  # fmt: skip


def check_by(load: Any, entry: str) -> None:
    """Refuse a load whose table goes by two things, or has no table to go by them; raises PydanticCustomError."""
    timed = getattr(load, f"{entry}_by_time")
    if timed is not None and getattr(load, entry) is not None:
        raise invalid("is given twice", f"Keep {entry} or {entry}_by_time", f"{entry}_by_time")
    if load.angle_of is not None and not isinstance(getattr(load, entry), tuple):
        reason = f"there is no table of {entry} against an angle"
        raise invalid(reason, "Remove it", key="angle_of", value=load.angle_of)
    if load.repeats and timed is None:
        raise invalid(f"there is no {entry}_by_time", "Remove it", key="repeats", value=True)
    if load.repeats and (timed[0][0] != 0.0 or timed[0][1] != timed[-1][1]):
        raise invalid(
            "a table that repeats begins at 0 s, and ends at the value with which it begins",
            "Make its first and last value equal",
            key=f"{entry}_by_time",
        )


def speed_entry(drive: Any) -> str:
    """The entry of a drive that gives its speed: `speed`, or of a torque `expected_speed` or `initial_speed`."""
    if hasattr(drive, "speed"):
        return "speed"
    return "initial_speed" if drive.expected_speed is None else "expected_speed"


class PlanarSpeed(Table):
    """A body turns at a constant speed."""

    name: str
    kind: Literal["constant-speed"]
    body: str
    """That turns."""
    speed: Annotated[float, Quantity("rad/s", nonzero=True, why="there would be no motion")]
    """rad/s, counter-clockwise; negative: clockwise. "600 min^-1" means 600 revolutions a minute."""
    period: bool = False
    """Whether its turn is the revolution; the first drive is, where none says so."""
    turns: Turns = 1
    """Of a revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after as many turns; a `start_angle` of
    360 degrees or more begins in the second."""


class PlanarHarmonic(Table):
    """A body swings: mean + amplitude sin(2 pi frequency t + phase)."""

    name: str
    kind: Literal["harmonic"]
    body: str
    """That swings."""
    amplitude: Angle
    """rad."""
    frequency: Annotated[float, Quantity("Hz", above=0)]
    """Swings a second, Hz; of an angular speed such as "1200 rpm", its turns."""
    mean: Angle = 0.0
    """rad."""
    phase: Angle = 0.0
    """rad."""
    period: bool = False
    """Whether its swing is the revolution; the first drive is, where none says so."""


class PlanarTable(Table):
    """A body follows a table of angles."""

    name: str
    kind: Literal["table"]
    body: str
    """That is moved."""
    angle: Annotated[tuple[tuple[float, float], ...], MotionTable()]
    """``[[time, angle], ...]``, s and rad, from time 0. The motion repeats at the last time, where the angle is the first
    one, or a turn more or (clockwise) less. A cubic spline lies between, smooth where it repeats."""
    period: bool = False
    """Whether the table's span is the revolution; the first drive is, where none says so."""


class PlanarTorque(Table):
    """A torque acts on a free body."""

    name: str
    kind: Literal["torque"]
    body: str
    """That the torque turns, against the ground."""
    torque: Annotated[Curve, CurveOf("N*m", cycles=True)] | None = None
    """N m, constant or against the angle of the body that gives the period."""
    torque_by_speed: Annotated[Any, Law("rad/s", "N*m")] | None = None
    """In place of `torque`: ``[[speed, torque], ...]`` as of a motor with its pull-out torque, rad/s and N m, straight from row
    to row and level beyond."""
    no_load_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """Speed at which the torque has fallen to 0, in proportion, as that of a motor does, rad/s; left out, it does not fall."""
    initial_speed: Annotated[float, Quantity("rad/s", least=0)]
    """rad/s; 0 starts from rest."""
    expected_speed: Annotated[float, Quantity("rad/s", above=0)] | None = None
    """About how fast it will turn, rad/s, from rest needed: tolerances and the first step go by it; else by `initial_speed`."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Inertia that turns with the body, kg m2."""
    period: bool = False
    """Whether a turn of the body is the revolution; the first drive is, where none says so."""
    turns: Turns = 1
    """Of a revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after as many turns; a `start_angle` of
    360 degrees or more begins in the second."""

    @model_validator(mode="after")
    def _started(self) -> "PlanarTorque":
        check_start(self)
        check_torque(self)
        return self


class PlanarRunUp(Table):
    """A body turns at speeds against the time, such as those of a run-up, whatever torque that takes."""

    name: str
    kind: Literal["run-up"]
    body: str
    """That turns."""
    speed_by_time: Annotated[Any, by_time("rad/s")]
    """``[[time, speed], ...]``, s and rad/s, from 0 s on, never below 0, at last above it. A monotone cubic lies between; it
    begins and ends level, and beyond the table the speed stays as it is."""
    flywheel_inertia: Annotated[float, Quantity("kg*m**2", least=0)] = 0.0
    """Inertia that turns with the body, kg m2."""
    period: bool = False
    """Whether a turn of the body is the revolution; the first drive is, where none says so."""
    turns: Turns = 1
    """Of a revolution: 2 for the 720 degrees of a four-stroke engine. Tables repeat after as many turns."""

    @model_validator(mode="after")
    def _forward(self) -> "PlanarRunUp":
        speeds = [speed for _, speed in self.speed_by_time]
        if min(speeds) < 0.0 or min(speeds[1:]) == 0.0:
            raise invalid(
                "the speed falls to 0 or below, where no revolution would end",
                "Give speeds above 0 from the second row on",
                key="speed_by_time",
            )
        return self


PlanarDrive = Annotated[
    PlanarSpeed | PlanarHarmonic | PlanarTable | PlanarTorque | PlanarRunUp,
    Field(discriminator="kind"),
]


class Components(PairTable):
    """A force by its components along the ground's axes; ``[x, y]`` is the same."""

    x: Annotated[float, Quantity("N")]
    """N."""
    y: Annotated[float, Quantity("N")]
    """N."""


class ForceLoad(Table):
    """A force at a point: by its components along the ground's axes, or by size and direction."""

    name: str
    kind: Literal["force"]
    place: str
    """``body.point`` that the force acts on."""
    force: Components | None = None
    size: Annotated[Curve, CurveOf("N", cycles=True)] | None = None
    """N along `direction`, constant or against the angle of the body that gives the period: from the x axis, counter-clockwise,
    `start_angle` included, whichever way it turns."""
    size_by_time: Annotated[Any, by_time("N")] | None = None
    """In place of `size`: ``[[time, size], ...]``, s and N, from 0 s on, smooth between the rows and level beyond."""
    repeats: Annotated[bool, Field(strict=True)] = False
    """Whether that table begins anew at its last time."""
    angle_of: str | None = None
    """Another body whose angle the table of `size` goes by; it repeats with every turn of it."""
    direction: Angle = 0.0
    """From the ground's x axis, rad."""
    follows: Annotated[bool, Field(strict=True)] = False
    """Whether the force turns with the body: components and direction are then those in its own axes."""

    @model_validator(mode="after")
    def _one_of_both(self) -> "ForceLoad":
        force = None if self.force is None else [self.force.x, self.force.y]
        size = self.size if self.size is not None else self.size_by_time
        check_one_of("force", force, size, "Write force = [x, y], or size and direction")
        check_by(self, "size")
        return self


class TorqueLoad(Table):
    """A torque on a body."""

    name: str
    kind: Literal["torque"]
    body: str
    """That the torque acts on, against the ground."""
    torque: Annotated[Curve, CurveOf("N*m", cycles=True)] | None = None
    """N m, constant or against the angle of the body that gives the period."""
    torque_by_time: Annotated[Any, by_time("N*m")] | None = None
    """In place of `torque`: ``[[time, torque], ...]``, s and N m, from 0 s on, smooth between the rows and level beyond."""
    repeats: Annotated[bool, Field(strict=True)] = False
    """Whether that table begins anew at its last time."""
    angle_of: str | None = None
    """Another body whose angle the table of `torque` goes by; it repeats with every turn of it."""

    @model_validator(mode="after")
    def _by_one(self) -> "TorqueLoad":
        check_by(self, "torque")
        remedy = "Write torque, or torque_by_time = [[time, torque], ...]"
        check_one_of("torque", self.torque, self.torque_by_time, remedy)
        return self


class SpringLoad(Table):
    """A spring and damper between two points."""

    name: str
    kind: Literal["spring"]
    first: str
    """``body.point``, or ``ground.point``."""
    second: str
    """``body.point``, or ``ground.point``."""
    stiffness: Annotated[float, Quantity("N/m", least=0)]
    """N/m."""
    length: Annotated[float, Quantity("m", least=0)] = 0.0
    """At which it pulls and pushes nothing, m."""
    damping: Annotated[float, Quantity("N*s/m", least=0)] = 0.0
    """N s/m, along the line between both points."""
    acts: Literal["both", "pushing", "pulling"] = "both"
    """Whether it acts on both sides of its length, only within it, as a buffer or an end stop, or only beyond it, as a rope."""


PlanarLoad = Annotated[
    ForceLoad | TorqueLoad | SpringLoad | TorsionSpringLoad | CylinderLoad | DragLoad,
    Field(discriminator="kind"),
]
