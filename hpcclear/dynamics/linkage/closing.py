"""Loops without clearance, and prescribed angles of Cartesian bodies: constraints with feedback (index 1).

Every constraint c obeys ``c'' = -2 alpha c' - beta^2 c`` (paper eq. 11). A row holds c's derivatives by the coordinates and
what c'' has to be besides them.
"""

from dataclasses import dataclass
from typing import NamedTuple

from hpcclear.base.terms import NOWHERE, ONE, ZERO, Term, Vector, named
from hpcclear.dynamics.linkage import parts
from hpcclear.dynamics.linkage.expression import Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics, Mover, Point
from hpcclear.dynamics.linkage.parts import GROUND, Drive, Joint, TableRow


class ClosureRow(NamedTuple):
    """One constraint: derivatives by columns, and the required sum of these times accelerations.

    `others`: derivatives by what is prescribed or held, for its reactions; `error` and `rate`: the constraint and its
    first derivative.
    """

    name: str
    columns: dict[Mover, Term]
    asked: Term
    others: dict[Mover, Term]
    error: Term
    rate: Term


@dataclass(frozen=True)
class Closing:
    """Writes the constraints of closures."""

    kinematics: Kinematics
    writer: Writer

    def rows(self, one: TableRow) -> list[ClosureRow]:
        """The constraints of a joint or of a drive."""
        if parts.is_pin(one):
            return self._pin(one)
        if parts.is_joint(one):
            assert one.kind != "fixed"
            return self._guide(one)[: one.holds]
        return [self._driven(one)]

    def _row(
        self, name: str, columns: dict[Mover, Term], rest: Term, rate: Term, error: Term
    ) -> ClosureRow:
        """`rest`: c'' without the coordinates' accelerations; `rate`, `error`: c' and c."""
        write, asked, prescribed = self.writer, -rest, self.kinematics.forest.prescribed
        free: dict[Mover, Term] = {}
        others: dict[Mover, Term] = {}
        for column, term in columns.items():
            turns = column.kind == "angle"
            given = column.kind == "across" or (turns and column.body in prescribed)
            if term:
                (others if given else free)[column] = term
            if turns and given:
                asked = asked - term * self.kinematics.turn(column.body)
        alpha2, beta2 = write.parameter("alpha2"), write.parameter("beta2")
        asked = asked - alpha2 * rate - beta2 * error
        return ClosureRow(name, free, asked, others, error, rate)

    def _pin(self, joint: Joint) -> list[ClosureRow]:
        kin = self.kinematics
        journal, bearing = kin.point(joint.journal), kin.point(joint.bearing)
        error = kin.position(journal) - kin.position(bearing)
        rate = self.rate(*parts.places_of(joint))
        rest = self.unforced(journal) - self.unforced(bearing)
        columns = self.between(*parts.places_of(joint))
        return [
            self._row(
                f"{joint.name}_{axis}", {c: getattr(v, axis) for c, v in columns.items()},
                *(getattr(v, axis) for v in (rest, rate, error)),
            )
            for axis in "xy"
        ]  # fmt: skip

    def between(self, first: str, second: str) -> dict[Mover, Vector]:
        """Derivatives of the difference of two places, along the ground's axes."""
        found: dict[Mover, Vector] = {}
        for place, ahead in ((first, True), (second, False)):
            for column, held in self.kinematics.columns(self.kinematics.point(place)).items():
                moved = self.kinematics.rotated(*held)
                found[column] = found.get(column, NOWHERE) + (moved if ahead else -moved)
        return found

    def rate(self, first: str, second: str) -> Vector:
        """Velocity of one place relative to another."""
        points = (self.kinematics.point(place) for place in (first, second))
        one, two = (self.kinematics.velocity(point) for point in points)
        return one - two

    def unforced(self, point: Point) -> Vector:
        """Acceleration of a point while no coordinate accelerates."""
        kin, found = self.kinematics, NOWHERE
        for frame, arm in point.arms.items():
            spin = kin.spin(frame)
            found = found - kin.rotated(frame, arm.times(spin, spin))
        for move in point.moves:
            if move.turns_along:
                speed = named(kin.speed_name(move.kind, move.body))
                rate = named("2.0") * speed * kin.spin(move.frame)
                found = found + kin.rotated(move.frame, move.direction.times(rate).across())
                found = found + kin.rotated(move.frame, move.changing.times(speed, speed))
        return found

    def _guide(self, joint: Joint) -> list[ClosureRow]:
        """Across the line, and the angle of the body to it."""
        kin, write = self.kinematics, self.writer
        forest = kin.forest
        body, carrier = (parts.split(place)[0] for place in parts.places_of(joint))
        own, other = forest.frames[body], forest.frames[carrier]
        along = self.direction(joint)
        normal = along.across()
        point, line = kin.point(joint.point), kin.point(joint.line)
        apart = kin.position(point) - kin.position(line)
        rate = self.rate(*parts.places_of(joint))
        rest = self.unforced(point) - self.unforced(line)
        spin = kin.spin(other)
        columns = {c: dot(v, normal) for c, v in self.between(*parts.places_of(joint)).items()}
        if other != GROUND:
            apart = Vector(*(write.let(f"apart_{joint.name}", part) for part in apart))
            turns = Mover("angle", other)
            columns[turns] = columns.get(turns, ZERO) - dot(apart, along)
        across = self._row(
            f"{joint.name}_across",
            columns,
            dot(rest, normal) - named("2.0") * spin * dot(rate, along) - spin * spin * dot(apart, normal),
            dot(rate, normal) - spin * dot(apart, along),
            dot(apart, normal),
        )  # fmt: skip
        c, s = kin.trig(own)
        tilted = s * along.x - c * along.y  # of the angle between body and line
        angles = {Mover("angle", own): ONE, Mover("angle", other): -ONE}
        angles = {column: term for column, term in angles.items() if column.body != GROUND}
        angle = self._row(f"{joint.name}_angle", angles, ZERO, kin.spin(own) - spin, tilted)
        return [across, angle]

    def sliding(self, joint: Joint) -> tuple[dict[Mover, Term], Term]:
        """Derivatives of the displacement along a guide that closes a loop, and the sliding speed."""
        kin, along = self.kinematics, self.direction(joint)
        normal = along.across()
        point, line = (kin.position(kin.point(place)) for place in parts.places_of(joint))
        aside = self.writer.let(f"aside_{joint.name}", dot(point - line, normal))
        moved = {c: dot(v, along) for c, v in self.between(*parts.places_of(joint)).items()}
        carrier = kin.forest.frames[parts.split(joint.line)[0]]
        if carrier != GROUND:
            turns = Mover("angle", carrier)
            moved[turns] = moved.get(turns, ZERO) + aside
        speed = dot(self.rate(*parts.places_of(joint)), along) + kin.spin(carrier) * aside
        moved = {column: term for column, term in moved.items() if term}
        return moved, self.writer.let(f"v_{joint.name}", speed)

    def direction(self, joint: Joint) -> Vector:
        """Unit vector of a guide's line, along the ground's axes."""
        carrier = parts.split(joint.line)[0]
        forest, write = self.kinematics.forest, self.writer
        held = Vector(ONE, ZERO)
        if forest.offsets[carrier] + joint.angle != 0.0:
            held = Vector(*(write.parameter(f"{joint.name}_{part}") for part in ("cos", "sin")))
        x, y = self.kinematics.rotated(forest.frames[carrier], held)
        return Vector(write.let(f"x_{joint.name}", x), write.let(f"y_{joint.name}", y))

    def run_up(self, drive: Drive, speed: Term, rise: Term) -> ClosureRow:
        """A free body's acceleration as its drive has it; what its speed is off by is fed back."""
        own = self.kinematics.forest.frames[drive.body]
        rate = self.kinematics.spin(own) - speed
        return self._row(f"{drive.name}_angle", {Mover("angle", own): ONE}, -rise, rate, ZERO)

    def _driven(self, drive: Drive) -> ClosureRow:
        kin, name = self.kinematics, f"{drive.name}_drive"
        angle, spin, turn = kin.driven(drive, name)
        own = kin.forest.frames[drive.body]
        error = named(f"angle_{own}") - angle
        if drive.kind == "constant-speed" and drive is not kin.forest.mechanism.period:
            # its angle does not restart with the period
            apart = self.writer.let(f"apart_{drive.name}", error)
            names = (f"s_{name}", f"c_{name}")
            error, _ = self.writer.when_needed(f"sincos({apart.name})", *names)
        rate = kin.spin(own) - spin
        return self._row(f"{drive.name}_angle", {Mover("angle", own): ONE}, -turn, rate, error)


def dot(a: Vector, b: Vector) -> Term:
    """Product of two vectors along the ground's axes."""
    return a.x * b.x + a.y * b.y
