"""Where points of a linkage are, how fast they move and what moves them, written in terms of a text.

A point is a sum of vectors, each held in a rotating frame: what does not change there is a parameter. So its velocity
has only products with the frames' angular velocities, and the mass matrix only cosines and sines of differences of angles.
"""

from collections.abc import Callable
from typing import NamedTuple

from hpcclear.base.terms import NOWHERE, ONE, ZERO, Term, Vector, named
from hpcclear.dynamics.linkage.bending import Bend
from hpcclear.dynamics.linkage.expression import Rows, Writer
from hpcclear.dynamics.linkage.parts import GROUND, Drive, split
from hpcclear.dynamics.linkage.trees import Forest

CENTER = "center"


class Move(NamedTuple):
    """A point moves along a direction in a frame as a coordinate changes; `kind`: "x", "y", "slide", "across" a guide, or of a
    mode of bending, whose direction changes with it."""

    kind: str
    body: str  # which the coordinate belongs to
    frame: str
    direction: Vector
    changing: Vector = NOWHERE

    @property
    def turns_along(self) -> bool:
        """Whether the direction turns with a frame while the coordinate changes."""
        return self.frame != GROUND and self.kind != "across"


class Point(NamedTuple):
    """Vectors by frame, from the ground on outwards, and what moves the point besides turning frames."""

    arms: dict[str, Vector]
    moves: tuple[Move, ...]


class Mover(NamedTuple):
    """What makes points move: the turning of a frame, or a move."""

    kind: str  # "angle" or a move's
    body: str  # the frame's, or whose coordinate it is


class Kinematics:
    """Points, velocities and accelerations of a forest, as terms; of the `rows` those of the stage in `work` count."""

    def __init__(self, forest: Forest, writer: Writer, rows: Rows) -> None:
        self.forest, self.writer = forest, writer
        self._curves = rows.curves
        self._points: dict[str, Point] = {}
        self._spins: dict[str, Term] = {}
        self._accelerations: dict[str, Term] = {}
        for k, one in enumerate(forest.coordinates):
            writer.when_needed(f"work[{rows.coordinates + k} * W + i]", one.name)
            writer.when_needed(f"work[{rows.velocities + k} * W + i]", self.speed_name(*one))
        writer.when_needed(f"work[{rows.time} * W + i]", "time")
        for frame in dict.fromkeys(forest.frames.values()):
            if frame != GROUND:
                self._turn(frame)
        bending = [body for body in forest.mechanism.bodies if body.bending is not None]
        self.bends = {body.name: Bend(body, writer) for body in bending}

    @staticmethod
    def speed_name(kind: str, body: str) -> str:
        """Name of a coordinate's velocity."""
        return f"spin_{body}" if kind == "angle" else f"v{kind}_{body}"

    # ---- frames ---------------------------------------------------------------------------------
    def _turn(self, frame: str) -> None:
        """Angle, angular velocity and acceleration of a frame."""
        angle = named(f"angle_{frame}")
        drive = self.forest.prescribed.get(frame)
        if drive is None:
            self._spins[frame] = named(f"spin_{frame}")
            self._accelerations[frame] = ZERO
        else:
            angle, spin, acceleration = self.driven(drive, frame)
            self._spins[frame], self._accelerations[frame] = spin, acceleration
        names = (f"s_{frame}", f"c_{frame}")
        self.writer.when_needed(f"sincos(angle_{frame})", *names, needs=(angle,))

    def driven(self, drive: Drive, frame: str) -> tuple[Term, Term, Term]:
        """Angle, angular velocity and acceleration that a drive prescribes."""
        write, name = self.writer, f"angle_{frame}"
        time = named("time")
        if drive.kind not in ("harmonic", "table"):  # the latter where it starts
            speed = write.parameter(f"{drive.name}_speed")
            start = self.forest.mechanism.body(drive.body).start_angle
            start = start - self.forest.offsets[drive.body]
            started = self._number(f"{frame}_start", start)
            text = f"{drive.name}_speed * time"
            needs: tuple[Term, ...] = (speed, time)
            if started:
                text, needs = f"{frame}_start + {text}", (started, speed, time)
            (angle,) = write.when_needed(text, name, needs=needs)
            return angle, speed, ZERO
        if drive.kind == "table":
            return self._tabulated(drive, frame)
        entries = ("mean", "amplitude", "rate", "phase")
        mean, amplitude, rate, shift = (write.parameter(f"{drive.name}_{e}") for e in entries)
        phase = f"{rate.name} * time + {shift.name}"
        names = (f"s_phase_{frame}", f"c_phase_{frame}")
        sine, cosine = write.when_needed(f"sincos({phase})", *names, needs=(rate, time, shift))
        given = ", ".join(one.name for one in (mean, amplitude, rate, sine, cosine))
        needs, found = (mean, amplitude, rate, sine), (name, f"spin_{frame}", f"turn_{frame}")
        angle, spin, turn = write.when_needed(f"harmonic({given})", *found, needs=needs)
        return angle, spin, turn

    def _tabulated(self, drive: Drive, frame: str) -> tuple[Term, Term, Term]:
        write, time = self.writer, named("time")
        parts = [f"{part}_{drive.name}" for part in ("given_angle", "given_spin", "given_turn")]
        rows = [self._curves.get(f"{drive.name}.{part}") for part in ("angle", "spin", "turn")]
        if None in rows:
            write.when_needed(f"table_of_{drive.name}(time)", *parts, needs=(time,))
        else:
            for part, row in zip(parts, rows, strict=True):
                write.when_needed(f"work[{row} * W + i]", part)
        angle, spin, turn = map(named, parts)
        gained = self._number(f"{drive.name}_rate", drive.advance)
        shift = self._number(f"{drive.name}_shift", self.forest.offsets[drive.body])
        name, text, needs = f"angle_{frame}", angle.name, [angle]
        if gained:
            text, needs = f"{text} + {gained.name} * time", [*needs, gained, time]
        if shift:
            text, needs = f"{text} - {shift.name}", [*needs, shift]
        (angle,) = write.when_needed(text, name, needs=tuple(needs))
        return angle, spin + gained, turn

    def angle(self, body: str) -> Term:
        """Angle of a body that turns, from the x axis."""
        offset = self._number(f"{body}_offset", self.forest.offsets[body])
        return named(f"angle_{self.forest.frames[body]}") + offset

    def trig(self, frame: str) -> Vector:
        """Cosine and sine of a frame's angle."""
        if frame == GROUND:
            return Vector(ONE, ZERO)
        return Vector(named(f"c_{frame}"), named(f"s_{frame}"))

    def spin(self, frame: str) -> Term:
        """Angular velocity of a frame."""
        return ZERO if frame == GROUND else self._spins[frame]

    def turn(self, frame: str) -> Term:
        """Angular acceleration that a drive prescribes."""
        return ZERO if frame == GROUND else self._accelerations[frame]

    # ---- points ---------------------------------------------------------------------------------
    def _number(self, name: str, value: float) -> Term:
        """A parameter, or zero where the mechanism has zero."""
        return ZERO if value == 0.0 else self.writer.parameter(name)

    def arm(self, body: str, start: str, end: str) -> Vector:
        """From one point of a body to another, in the body's frame; the parameters are positive lengths."""
        m = self.forest.mechanism.body(body)
        a, b = (m.center if point == CENTER else m.points[point] for point in (start, end))
        x, y = (
            self._number(f"{body}_{start}_{end}_{axis}", b[k] - a[k])
            if b[k] >= a[k]
            else -self._number(f"{body}_{end}_{start}_{axis}", a[k] - b[k])
            for k, axis in enumerate(("x", "y"))
        )
        if ends := self._shortened(body, start, end):
            shorter = self.bends[body].shortening()
            x = x - shorter if ends > 0 else x + shorter
        cosine, sine = self.offset(body)
        return Vector(cosine * x - sine * y, sine * x + cosine * y)

    def _shortened(self, body: str, start: str, end: str) -> int:
        """Whether bending takes away from an arm (1) or adds to it (-1): a bar's end b comes nearer."""
        return (end == "b") - (start == "b") if body in self.bends else 0

    def _reached(self, start: Point, frame: str, body: str, ends: tuple[str, str]) -> Point:
        """A body's point from another one, and what bending between them moves."""
        point = _extended(start, frame, self.arm(body, *ends))
        sign = self._shortened(body, *ends)
        if not sign:
            return point
        bend, moves = self.bends[body], list(point.moves)
        for mode, kind in zip(bend.modes, bend.kinds, strict=True):
            first, second = (-term if sign > 0 else term for term in bend.nearer(mode))
            moves.append(Move(kind, body, frame, Vector(first, ZERO), Vector(second, ZERO)))
        return Point(point.arms, tuple(moves))

    def end_spin(self, place: str) -> Term:
        """Angular velocity of a body, of a bar that bends that of its end."""
        body, point = split(place)
        spin = self.spin(self.forest.frames[body])
        return self.bends[body].end_spin(spin, point) if body in self.bends else spin

    def offset(self, body: str) -> Vector:
        """Cosine and sine of the angle by which a body is turned against its frame."""
        if self.forest.offsets[body] == 0.0:
            return Vector(ONE, ZERO)
        write = self.writer
        return Vector(write.parameter(f"{body}_offset_cos"), write.parameter(f"{body}_offset_sin"))

    def center(self, body: str) -> Point:
        """Mass centre of a body."""
        return self.point(f"{body}.{CENTER}")

    def point(self, place: str) -> Point:
        """A place as arms and moves."""
        if place not in self._points:
            self._points[place] = self._found(place)
        return self._points[place]

    def _found(self, place: str) -> Point:
        body, point = split(place)
        forest = self.forest
        if body == GROUND:
            both = zip("xy", forest.mechanism.ground[point], strict=True)
            fixed = Vector(*(self._number(f"ground_{point}_{axis}", one) for axis, one in both))
            return Point({GROUND: fixed} if any(fixed) else {}, ())
        hang, frame = forest.hangs[body], forest.frames[body]
        if hang.joint is None:
            axes = {"x": Vector(ONE, ZERO), "y": Vector(ZERO, ONE)}
            moves = tuple(Move(kind, body, GROUND, along) for kind, along in axes.items())
            root = Point({GROUND: Vector(named(f"x_{body}"), named(f"y_{body}"))}, moves)
            return self._reached(root, frame, body, (CENTER, point))
        parent = self.point(hang.parent)
        if hang.joint.kind == "slide":
            along = self.offset(split(hang.joint.point)[0])
            if hang.own != hang.joint.point:
                along = -along
            s = named(f"slide_{body}")
            moved = _extended(parent, frame, along.times(s))
            guide = (Move("slide", body, frame, along), Move("across", body, frame, along.across()))
            parent = Point(moved.arms, (*moved.moves, *guide))
        return self._reached(parent, frame, body, (split(hang.own)[1], point))

    def rotated(self, frame: str, vector: Vector) -> Vector:
        """A vector of a frame along the ground's axes."""
        if frame == GROUND:
            return vector
        (cosine, sine), (x, y) = self.trig(frame), vector
        return Vector(x * cosine - y * sine, x * sine + y * cosine)

    def position(self, point: Point) -> Vector:
        """Where a point is, along the ground's axes."""
        return sum((self.rotated(frame, arm) for frame, arm in point.arms.items()), NOWHERE)

    def _moving(self, point: Point, frame: str) -> list[tuple[Move, Term]]:
        """Moves of a point in a frame, and their speeds."""
        moves = [move for move in point.moves if move.frame == frame and move.kind != "across"]
        return [(one, named(self.speed_name(one.kind, one.body))) for one in moves]

    def velocity(self, point: Point) -> Vector:
        """How fast it moves."""
        found = NOWHERE
        for frame in dict.fromkeys((*(m.frame for m in point.moves), *point.arms)):
            for move, speed in self._moving(point, frame):
                found = found + self.rotated(frame, move.direction).times(speed)
            arm = point.arms.get(frame, NOWHERE)
            found = found + self.rotated(frame, arm.times(self.spin(frame)).across())
        return found

    def acceleration(self, point: Point, second: Callable[[Mover], Term]) -> Vector:
        """How its velocity changes; `second`: the acceleration of a coordinate, and of a frame that no drive turns."""
        found, prescribed = NOWHERE, self.forest.prescribed
        for frame in dict.fromkeys((*(m.frame for m in point.moves), *point.arms)):
            spin = self.spin(frame)
            turn = self.turn(frame) if frame in prescribed else second(Mover("angle", frame))
            for move, speed in self._moving(point, frame):
                rate = second(Mover(move.kind, move.body))
                twice = spin * speed + spin * speed  # Coriolis
                moved = move.direction.times(rate) + move.direction.times(twice).across()
                moved = moved + move.changing.times(speed, speed)
                found = found + self.rotated(frame, moved)
            arm = point.arms.get(frame, NOWHERE)
            turned = arm.times(turn).across() - arm.times(spin, spin)
            found = found + self.rotated(frame, turned)
        return found

    def columns(self, point: Point) -> dict[Mover, tuple[str, Vector]]:
        """Derivatives of a point by all that moves it: frame, and vector in it."""
        arms = [(f, arm) for f, arm in point.arms.items() if f != GROUND and self.forest.turning(f)]
        found = {Mover("angle", frame): (frame, arm.across()) for frame, arm in arms}
        return found | {Mover(m.kind, m.body): (m.frame, m.direction) for m in point.moves}


def _extended(point: Point, frame: str, arm: Vector) -> Point:
    if not any(arm):
        return point
    return Point(point.arms | {frame: point.arms.get(frame, NOWHERE) + arm}, point.moves)
