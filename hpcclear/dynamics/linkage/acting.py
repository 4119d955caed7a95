"""What loads and geometries of contact may use of the motion that they are written into (`base.terms`), written into a text."""

from collections.abc import Callable, Mapping, Sized
from dataclasses import dataclass

from hpcclear.base.terms import ZERO, Acting, Term, Touching, Vector, named
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.balance import Balance, Pull, Twist
from hpcclear.dynamics.linkage.closing import Closing
from hpcclear.dynamics.linkage.expression import Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics
from hpcclear.dynamics.linkage.parts import Contact


@dataclass
class LoadWriter(Acting):
    """The terms of one load."""

    _load: str
    _kinematics: Kinematics
    _writer: Writer
    _balance: Balance
    _curve: Callable[[str], Term]
    _places: Mapping[str, int]

    def parameter(self, entry: str) -> Term:
        """Named ``LOAD_ENTRY``."""
        return self._writer.parameter(f"{self._load}_{entry}")

    def curve(self) -> Term:
        """Looked up by the stepper."""
        return self._curve(self._load)

    def angle(self, body: str) -> Term:
        """A sum of coordinates."""
        return self._kinematics.angle(body)

    def spin(self, body: str) -> Term:
        """Of the frame of the body."""
        return self._kinematics.spin(self._kinematics.forest.frames[body])

    def apart(self, first: str, second: str) -> tuple[Vector, Vector]:
        """Differences."""
        kin = self._kinematics
        one, two = kin.point(first), kin.point(second)
        return kin.position(one) - kin.position(two), kin.velocity(one) - kin.velocity(two)

    def velocity(self, place: str) -> Vector:
        """Of the body's point."""
        return self._kinematics.velocity(self._kinematics.point(place))

    def along_ground(self, body: str, vector: Vector) -> Vector:
        """Turned by the body within its frame, then with the frame."""
        kin = self._kinematics
        cosine, sine = kin.offset(body)
        own = Vector(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y)
        return kin.rotated(kin.forest.frames[body], own)

    def let(self, name: str, term: Term) -> Term:
        """A statement."""
        return self._writer.let(name, term)

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """A statement, with the load in the names of its results."""
        return self._writer.call(function, terms, [f"{name}_{self._load}" for name in results])

    def hinge(self, name: str, beyond: Term, slope: Term) -> Term:
        """A statement."""
        return self._writer.hinge(name, beyond, ZERO, slope)

    def piecewise(self, rows: Sized, place: Term, rate: Term) -> Term:
        """Leaves place and rate in rows of the lanes, where steps end at the rows of the table."""
        row = self._places.get(self._load)
        value = self._writer.table(self._load, len(rows), place, row)
        if row is not None:
            self._writer.store(row + at.MAX_CURVES, rate)
        return value

    def push(self, place: str, force: Vector) -> None:
        """On the balance of forces."""
        self._balance.pulls.append(Pull(place, force))

    def twist(self, body: str, torque: Term) -> None:
        """On the balance of forces."""
        self._balance.twists.append(Twist(body, torque))


class ContactWriter(Touching):
    """The terms of one contact."""

    def __init__(self, closing: Closing, k: int, contact: Contact, apart: Vector) -> None:
        self._closing, self._contact, self.apart = closing, contact, apart
        rows = at.CLEARANCE, at.BEARING_RADIUS, at.JOURNAL_RADIUS
        numbers = [named(f"par[(joints[{k}].block + {row}) * W + i]") for row in rows]
        self.clearance, self.bearing_radius, self.journal_radius = numbers

    @property
    def across(self) -> Vector:
        """Of the line in the frame of its body."""
        return self._closing.direction(self._contact.joint).across()

    def parameter(self, entry: str) -> Term:
        """Named ``JOINT_ENTRY``."""
        return self._closing.writer.parameter(f"{self._contact.joint.name}_{entry}")

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """A statement, with the contact in the names of its results."""
        names = [f"{name}_{self._contact.word}" for name in results]
        return self._closing.writer.call(function, terms, names)
