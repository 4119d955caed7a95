"""What a load may use of the motion that it is written into (`hpcclear.scene.loads`)."""

from collections.abc import Callable, Mapping, Sized

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage import piecewise
from hpcclear.dynamics.linkage.balance import Balance, Pull, Twist
from hpcclear.dynamics.linkage.expression import ONE, ZERO, Term, Vector, Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics


class Acting:
    """The motion as one load sees it. Terms add, subtract, multiply and divide; places are ``body.point``.

    What is multiplied by `zero` leaves no trace in the motion's source.
    """

    zero, one = ZERO, ONE

    def __init__(
        self, load: str, kinematics: Kinematics, writer: Writer, balance: Balance,
        curve: Callable[[str], Term], places: Mapping[str, int],
    ) -> None:  # fmt: skip
        self._load, self._kinematics, self._writer, self._balance = (
            load, kinematics, writer, balance,
        )  # fmt: skip
        self._curve, self._places = curve, places

    # ---- what it is made of ----------------------------------------------------------------------
    def parameter(self, entry: str) -> Term:
        """One of the load's numbers, by its entry."""
        return self._writer.parameter(f"{self._load}_{entry}")

    def curve(self) -> Term:
        """What the load's curve says at the stage."""
        return self._curve(self._load)

    def angle(self, body: str) -> Term:
        """Angle of a body, rad."""
        return self._kinematics.angle(body)

    def spin(self, body: str) -> Term:
        """Angular velocity of a body, rad/s."""
        return self._kinematics.spin(self._kinematics.forest.frames[body])

    def apart(self, first: str, second: str) -> tuple[Vector, Vector]:
        """Position (m) and velocity (m/s) of a place relative to another."""
        kin = self._kinematics
        one, two = kin.point(first), kin.point(second)
        return kin.position(one) - kin.position(two), kin.velocity(one) - kin.velocity(two)

    def velocity(self, place: str) -> Vector:
        """Velocity of a place, m/s."""
        return self._kinematics.velocity(self._kinematics.point(place))

    def along_ground(self, body: str, vector: Vector) -> Vector:
        """Components along the ground's axes of a vector along the axes of a body."""
        kin = self._kinematics
        cosine, sine = kin.offset(body)
        own = Vector(cosine * vector.x - sine * vector.y, sine * vector.x + cosine * vector.y)
        return kin.rotated(kin.forest.frames[body], own)

    # ---- what is made of these -------------------------------------------------------------------
    def let(self, name: str, term: Term) -> Term:
        """A term by a name, worked out once."""
        return self._writer.let(name, term)

    def vector(self, name: str, x: Term, y: Term) -> Vector:
        """A vector by a name, each component worked out once."""
        return Vector(self.let(f"{name}_x", x), self.let(f"{name}_y", y))

    def call(
        self, function: Callable[..., object], *terms: Term, results: tuple[str, ...]
    ) -> tuple[Term, ...]:
        """What a function of numbers returns, by names: one without branches, of arithmetic, ``abs`` and ``np.sqrt``."""
        return self._writer.call(function, terms, [f"{name}_{self._load}" for name in results])

    def hinge(self, name: str, beyond: Term, slope: Term) -> Term:
        """`slope` times what is above 0 of a term."""
        return piecewise.hinge(self._writer, name, beyond, ZERO, slope)

    def piecewise(self, rows: Sized, place: Term, rate: Term) -> Term:
        """The value of a table of `Load.straight` at a place that changes at a rate; steps end at its rows.

        Its parameters are ``base.pieces.hinges`` of the load's name.
        """
        row = self._places.get(self._load)
        value = piecewise.term(self._writer, self._load, len(rows), place, row)
        if row is not None:
            self._writer.line(f"work[{row + at.MAX_CURVES} * W + i] = {self._writer.text(rate)}")
        return value

    # ---- what acts -------------------------------------------------------------------------------
    def push(self, place: str, force: Vector) -> None:
        """Have a force (N, along the ground's axes) act at a place."""
        self._balance.pulls.append(Pull(place, force))

    def push_apart(self, first: str, second: str, x: Term, y: Term) -> None:
        """Have a force act at the first place, and the opposite one at the second."""
        force = Vector(x, y)
        self._balance.pulls += [Pull(first, force), Pull(second, -force)]

    def power(self, place: str, force: Vector) -> Term:
        """What a force at a place gives, W."""
        velocity = self.velocity(place)
        return force.x * velocity.x + force.y * velocity.y

    def twist(self, body: str, torque: Term) -> None:
        """Have a torque (N m) act on a body."""
        self._balance.twists.append(Twist(body, torque))
