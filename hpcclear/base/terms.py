"""Terms of a motion, and the quantities of it that are there for what adds terms: loads, effects of joints, contacts.

Zeros disappear, signs move outwards, and nothing else is rearranged.
"""

from collections.abc import Callable, Iterator, Sized
from dataclasses import dataclass
from typing import ClassVar, Protocol


@dataclass(frozen=True)
class Term:
    """A sum, a product, a quotient, a name, zero or one; `fixed` if it holds parameters alone."""

    op: str
    args: tuple["Term", ...] = ()
    negative: bool = False
    fixed: bool = True
    name: str = ""

    def __bool__(self) -> bool:
        return self.op != "0"

    def __neg__(self) -> "Term":
        if not self:
            return self
        return Term(self.op, self.args, not self.negative, self.fixed, self.name)

    def __abs__(self) -> "Term":
        return -self if self.negative else self

    def __add__(self, other: "Term") -> "Term":
        if not (self and other):
            return self or other
        left = self.args if self.op == "+" and not self.negative else (self,)
        right: tuple[Term, ...] = (other,)
        if other.op == "+" and other.args[0].negative:  # a - (-b - c) is a + b + c
            right = tuple(-part for part in other.args) if other.negative else other.args
        return Term("+", left + right, fixed=self.fixed and other.fixed)

    def __sub__(self, other: "Term") -> "Term":
        return self + -other

    def __mul__(self, other: "Term") -> "Term":
        if not (self and other):
            return ZERO
        negative = self.negative != other.negative
        for one, two in ((self, other), (other, self)):
            if one.op == "1":
                return -abs(two) if negative else abs(two)
        return Term("*", (abs(self), abs(other)), negative, self.fixed and other.fixed)

    def __truediv__(self, other: "Term") -> "Term":
        if not self:
            return ZERO
        negative = self.negative != other.negative
        return Term("/", (abs(self), abs(other)), negative, self.fixed and other.fixed)


ZERO = Term("0")
ONE = Term("1")


@dataclass(frozen=True)
class Vector:
    """Two terms, along x and y."""

    x: Term
    y: Term

    def __iter__(self) -> Iterator[Term]:
        yield self.x
        yield self.y

    def __neg__(self) -> "Vector":
        return Vector(-self.x, -self.y)

    def __add__(self, other: "Vector") -> "Vector":
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: "Vector") -> "Vector":
        return Vector(self.x - other.x, self.y - other.y)

    def times(self, *factors: Term) -> "Vector":
        """By one factor after the other, from the right."""
        x, y = self.x, self.y
        for factor in factors:
            x, y = x * factor, y * factor
        return Vector(x, y)

    def across(self) -> "Vector":
        """Turned by a quarter."""
        return Vector(-self.y, self.x)


NOWHERE = Vector(ZERO, ZERO)


def named(name: str, fixed: bool = False) -> Term:
    """A name as a term."""
    return Term("name", fixed=fixed, name=name)


class Acting(Protocol):
    """The motion as one load sees it. Terms add, subtract, multiply and divide; places are ``body.point``.

    What is multiplied by `zero` leaves no trace in the motion's source.
    """

    zero: ClassVar[Term] = ZERO
    one: ClassVar[Term] = ONE

    # ---- what it is made of ----------------------------------------------------------------------
    def parameter(self, entry: str) -> Term:
        """One of the load's numbers, by its entry."""

    def curve(self) -> Term:
        """What the load's curve says at the stage."""

    def angle(self, body: str) -> Term:
        """Angle of a body, rad."""

    def spin(self, body: str) -> Term:
        """Angular velocity of a body, rad/s."""

    def apart(self, first: str, second: str) -> tuple[Vector, Vector]:
        """Position (m) and velocity (m/s) of a place relative to another."""

    def velocity(self, place: str) -> Vector:
        """Velocity of a place, m/s."""

    def along_ground(self, body: str, vector: Vector) -> Vector:
        """Components along the ground's axes of a vector along the axes of a body."""

    # ---- what is made of these -------------------------------------------------------------------
    def let(self, name: str, term: Term) -> Term:
        """A term by a name, worked out once."""

    def vector(self, name: str, x: Term, y: Term) -> Vector:
        """A vector by a name, each component worked out once."""
        return Vector(self.let(f"{name}_x", x), self.let(f"{name}_y", y))

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """What a function of numbers returns, by names: one without branches, of arithmetic, ``abs`` and ``np.sqrt``."""

    def hinge(self, name: str, beyond: Term, slope: Term) -> Term:
        """`slope` times what is above 0 of a term."""

    def piecewise(self, rows: Sized, place: Term, rate: Term) -> Term:
        """The value of a table of `Load.straight` at a place that changes at a rate; steps end at its rows.

        Its parameters are ``base.pieces.hinges`` of the load's name.
        """

    # ---- what acts -------------------------------------------------------------------------------
    def push(self, place: str, force: Vector) -> None:
        """Have a force (N, along the ground's axes) act at a place."""

    def push_apart(self, first: str, second: str, x: Term, y: Term) -> None:
        """Have a force act at the first place, and the opposite one at the second."""
        force = Vector(x, y)
        self.push(first, force)
        self.push(second, -force)

    def power(self, place: str, force: Vector) -> Term:
        """What a force at a place gives, W."""
        velocity = self.velocity(place)
        return force.x * velocity.x + force.y * velocity.y

    def twist(self, body: str, torque: Term) -> None:
        """Have a torque (N m) act on a body."""


class Touching(Protocol):
    """The motion as one contact of a joint sees it; terms as of `Acting`."""

    apart: Vector
    """Position of the journal's place relative to the bearing's, m."""
    clearance: Term
    """This and the radii: of the contact's `Shape`, m."""
    bearing_radius: Term
    journal_radius: Term

    @property
    def across(self) -> Vector:
        """Unit vector to the left of the joint's line."""

    def parameter(self, entry: str) -> Term:
        """One of the joint's numbers, by its entry."""

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """As `Acting.call`."""
