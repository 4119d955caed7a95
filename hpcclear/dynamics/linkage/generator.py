"""The motion of one lane of any linkage as a text: what a numba function of it does, and what one reads to understand it.

The text reads coordinates and velocities of the stage, calls the contact law of each joint with clearance, and writes
accelerations, gaps, forces and powers; an effect that is off is not in it. It is written in the order kinematics,
contact, kinematics, contact, sums, which keeps few numbers alive at a time.
"""

import keyword
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.contacts.registry import GEOMETRIES
from hpcclear.dynamics.linkage import piecewise
from hpcclear.dynamics.linkage.acting import Acting
from hpcclear.dynamics.linkage.balance import Balance, Pull, Twist
from hpcclear.dynamics.linkage.closing import Closing, dot
from hpcclear.dynamics.linkage.elements import functions
from hpcclear.dynamics.linkage.elimination import Elimination, Matrix, blocks
from hpcclear.dynamics.linkage.expression import NOWHERE, ONE, ZERO, Term, Vector, Writer, named
from hpcclear.dynamics.linkage.kinematics import Kinematics, Mover
from hpcclear.dynamics.linkage.look_ups import LookUp, LookUps
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import (
    GROUND,
    Aligned,
    Contact,
    Drive,
    Release,
    Revolute,
    RunUp,
    Slide,
    TorqueDrive,
    split,
    straight_of,
)
from hpcclear.dynamics.linkage.rows import Rows
from hpcclear.dynamics.linkage.rubbing import (
    RubbingGuide,
    RubbingPin,
    coupled,
    rubbing_of,
    ties_of,
)
from hpcclear.dynamics.linkage.trees import Forest, forest

RESERVED = (
    *keyword.kwlist, "effects", "joints", "work", "par", "i", "W", "at", "abs", "np", "sincos", "saturated", *functions(),
    *(one.function for one in GEOMETRIES.values()),
)  # fmt: skip
"""Names that a text has already, and that a value of a load or drive must not hide."""


class On(NamedTuple):
    """Which effects and outputs a text has, besides the mechanism's own loads and drives."""

    friction: bool = False  # in the joints with clearance: of contact or of a film
    gravity: bool = False
    energies: bool = False  # energy balance
    series: bool = False  # drive moment, for time series
    responses: bool = False  # drive moment and what is followed
    impacts: bool = False  # force on the frame
    pins: bool = False  # forces of ideal pins
    follow: str = ""  # a guided body, or body.point
    objective: str = ""  # its rate: "joints", or "whole" of the mechanism
    waves: bool = False  # surfaces of the joints with clearance are out of round


@dataclass(frozen=True)
class Motion:
    """A text and what it needs."""

    source: str
    """Of the function ``lane(effects, joints, work, par, i, W)``."""
    forest: Forest
    parameters: dict[str, int]
    """Rows of `par` by name."""
    derived: dict[str, str]
    """Texts of the derived parameters, by name, in parameters of `inputs`."""
    inputs: tuple[str, ...]
    """Names that `numbers.values` gives a number to."""
    constraints: tuple[str, ...]
    """Names of the multipliers."""
    curves: Mapping[str, int] = field(default_factory=dict)
    """Rows of tabulated values, by drive or load."""
    look_ups: Mapping[str, LookUp] = field(default_factory=dict)
    """Where each of them is looked up; those that move bodies first, since the angle of loads may be theirs."""
    functions: Mapping[str, Callable[..., object]] = field(default_factory=dict)
    """Functions of loads by name, ordinary Python, that the text calls besides those of `elements`."""


def generate(
    mechanism: Mechanism, on: On, rows: Rows, *, cartesian: bool = False, hoist: bool = True
) -> Motion:
    """The text of a mechanism's motion.

    Parameters
    ----------
    mechanism : Mechanism
        A number that is zero in it is zero in every sample.
    cartesian : bool
        Every body by itself, ideal joints and prescribed angles as constraints with feedback (paper eq. 11).
    hoist : bool
        Whether what holds parameters alone is worked out once a sample.
    """
    return _Generator(mechanism, on, rows, cartesian, hoist).motion()


class _Generator:
    def __init__(self, mechanism: Mechanism, on: On, rows: Rows, cartesian: bool, hoist: bool):
        self.mechanism, self.on, self.rows = mechanism, on, rows
        self.forest = forest(mechanism, cartesian)
        self.writer = Writer(rows.parameters, rows.free, hoist, RESERVED)
        self.kinematics = Kinematics(
            self.forest, self.writer, rows.coordinates, rows.velocities, rows.time, rows.curves
        )
        self.balance = Balance(self.forest, self.kinematics, self.writer, on.gravity)
        self.closing = Closing(self.kinematics, self.writer)
        self.columns = [Mover(one.kind, one.body) for one in self.forest.coordinates]
        self.number = {column: k for k, column in enumerate(self.columns)}
        self.losses: list[Term] = []
        self.load_power = ZERO

    def motion(self) -> Motion:
        for k, contact in enumerate(self.mechanism.contacts):
            self._contact(k, contact)
        for load in self.mechanism.loads:
            acting = Acting(
                load.name, self.kinematics, self.writer, self.balance, self._turned,
                self.rows.places,
            )  # fmt: skip
            self.load_power = self.load_power + load.act(acting)
        free = [d for d in self.mechanism.drives if isinstance(d, TorqueDrive)]
        torques = [self._torque(d) for d in free if not isinstance(d, (RunUp, Release))]
        self.constraints = [row for one in self.forest.closures for row in self.closing.rows(one)]
        for drive in free:
            if isinstance(drive, RunUp):
                given = (self._turned(f"{drive.name}.{part}") for part in drive.curves)
                self.constraints.append(self.closing.run_up(drive, *given))
        found = self._solved(torques)
        self._store(found, dict(torques))
        lines = "\n".join(f"    {line}" for line in (self._described(), *self.writer.lines))
        look_ups = LookUps(self.forest, self.rows, self.writer)
        read = self.writer.read | look_ups.read
        names = {k: row for k, row in look_ups.rows.items() if k in read}
        return Motion(
            f"def lane(effects, joints, work, par, i, W):\n{lines}\n",
            self.forest,
            names,
            {name: text for name, text in self.writer.derived.items() if name in names},
            tuple(self.writer.inputs | look_ups.inputs),
            tuple(row.name for row in self.constraints),
            self.rows.curves,
            look_ups.found,
            self.writer.functions,
        )

    def _described(self) -> str:
        """First line of the text: what is integrated, where the contacts are, what closes loops."""
        parts = {
            "coordinates": [one.name for one in self.forest.coordinates],
            "joints with clearance": [contact.name for contact in self.mechanism.contacts],
            "constraints": [row.name for row in self.constraints],
        }
        said = "; ".join(f"{what} {', '.join(names)}" for what, names in parts.items() if names)
        return f'"""Accelerations of lane i: {said}."""'

    # ---- forces ---------------------------------------------------------------------------------
    def _contact(self, k: int, contact: Contact) -> None:
        """Call of a contact's geometry: journal relative to bearing, and what the contact exerts on both."""
        kin, write, geometry = self.kinematics, self.writer, contact.geometry
        places = contact.journal, contact.bearing
        journal, bearing = map(kin.point, places)
        apart = kin.position(journal) - kin.position(bearing)
        moving = kin.velocity(journal) - kin.velocity(bearing)
        spins = [kin.end_spin(place) for place in places]
        relative = [write.text(term) for term in (*apart, *moving, *spins)]
        if not (self.on.friction or self.on.waves):  # which are no faster by it
            relative[4:] = ["None" if spin is ZERO else write.text(spin) for spin in spins]
        frame = self._frame(contact)
        made = [write.fresh(f"{name}_{contact.word}") for name in ("fx", "fy", "mb", "mj", "loss")]
        given = f"joints[{k}], ({', '.join(relative)}), {frame}"
        call = f"{geometry.function}(effects, work, par, {given}, i, W)"
        write.line(f"{', '.join(made)} = {call}")
        fx, fy, on_bearing, on_journal, loss = map(named, made)
        force = Vector(fx, fy)
        self.balance.pulls += [Pull(contact.journal, -force), Pull(contact.bearing, force)]
        turning = self.on.friction or self.on.waves
        for place, moment, turned in (
            (contact.journal, on_journal, turning),
            (contact.bearing, on_bearing, turning or geometry.along_a_line),
        ):
            body, point = split(place)
            if turned and body != GROUND:
                self.balance.twists.append(Twist(body, moment, point))
        self.losses.append(loss)

    def _frame(self, contact: Contact) -> str:
        """What a geometry requires besides: the unit vector from a guide's line to the face, or cosines and sines of the
        angles of both bodies, which waves around their surfaces turn with."""
        kin, found = self.kinematics, []
        if contact.geometry.along_a_line:
            assert isinstance(contact.joint, Aligned)
            across = self.closing.direction(contact.joint).across()
            found = [*(across if contact.side > 0.0 else -across)]
            return f"({', '.join(self.writer.text(term) for term in found)})"
        if not self.on.waves:
            return "None"
        for place in (contact.bearing, contact.journal):
            body = split(place)[0]
            own = Vector(ONE, ZERO) if body == GROUND else kin.offset(body)
            found += [*kin.rotated(self.forest.frames[body], own)]
        return f"({', '.join(self.writer.text(term) for term in found)})"

    def _turned(self, name: str) -> Term:
        """What the curve of a drive or load says at the stage."""
        turned = f"turned_{name.replace('.', '_')}"
        self.writer.when_needed((turned,), f"{turned} = work[{self.rows.curves[name]} * W + i]")
        return named(turned)

    def _torque(self, drive: TorqueDrive) -> tuple[Mover, Term]:
        write = self.writer
        if drive.by_speed is not None:
            speed = self.kinematics.spin(self.forest.frames[drive.body])
            name = f"{drive.name}_by_speed"
            row = self.rows.places.get(name)
            torque = piecewise.term(write, name, len(drive.by_speed), speed, row)
            return Mover("angle", self.forest.frames[drive.body]), write.let(drive.name, torque)
        torque = write.parameter(f"{drive.name}_torque")
        if drive.table:
            torque = write.let(drive.name, torque * self._turned(drive.name))
        if drive.no_load_speed is not None:
            speed = self.kinematics.spin(self.forest.frames[drive.body])
            fall = write.parameter(f"{drive.name}_fall") * speed
            torque = write.let(f"{drive.name}_falling", torque * (ONE - fall))
        return Mover("angle", self.forest.frames[drive.body]), torque

    # ---- accelerations --------------------------------------------------------------------------
    def inverse(self, term: Term) -> Term | None:
        """Reciprocal of a mass or an inertia, which is a parameter."""
        entry = next((e for e in ("_mass", "_inertia") if term.name.endswith(e)), "")
        if not (term.fixed and entry) or "_inverse_" in term.name:
            return None
        name = term.name.removesuffix(entry) + "_inverse" + entry
        # a body's own have always been parameters; one about a pin is divided by unless it may be hoisted
        known = self.writer.hoist or not term.name.endswith("_pivot_inertia")
        return self.writer.parameter(name) if known else None

    def _solved(self, torques: list[tuple[Mover, Term]]) -> dict[int, Term]:
        """Accelerations of the coordinates, then multipliers, by number."""
        n = len(self.columns)
        matrix: Matrix = {}
        for k, one in enumerate(self.columns):
            for j, two in enumerate(self.columns[: k + 1]):
                if term := self.balance.mass(one, two):
                    term = self.writer.let(f"m_{j}_{k}", term)
                    matrix[k, j] = matrix[j, k] = term
        for r, row in enumerate(self.constraints, n):
            for column, term in row.columns.items():
                k = self.number[column]
                held = self.writer.let(f"j_{row.name}_{k}", term)
                matrix[k, r] = matrix[r, k] = -held
        right = {k: self.balance.force(column) for k, column in enumerate(self.columns)}
        for column, torque in torques:
            right[self.number[column]] = right[self.number[column]] + torque
        right |= {r: -row.asked for r, row in enumerate(self.constraints, n)}
        self.rubbing = rubbing_of(self)
        # friction that moves nothing is worked out last, by those texts that ask for moments or losses
        self.late = [one for one in self.rubbing if not one.moved]
        self.early = [one for one in self.rubbing if one.moved]
        found: dict[int, Term] = {}
        for block in blocks(range(n + len(self.constraints)), matrix, ties_of(self.early)):
            found |= self._block(block, matrix, right, n)
        return {k: self._accelerated(k, term) for k, term in sorted(found.items())}

    def _accelerated(self, k: int, term: Term) -> Term:
        """Write an acceleration down where the stepper reads it."""
        if k >= len(self.columns):
            r = k - len(self.columns)
            value = self.writer.let(f"hold_{self.constraints[r].name}", term)
            if self.rows.holds is not None:
                text = self.writer.text(value)
                self.writer.line(f"work[{self.rows.holds + r} * W + i] = {text}")
            return value
        name = self.forest.coordinates[k].name
        value = self.writer.let(f"a_{name}", term, whole=True)
        row = self.rows.accelerations + k
        written = value
        if self.columns[k].kind == "y" and self.columns[k].body in self.balance.falling:
            written = value - self.writer.parameter("gravity")
        self.writer.line(f"work[{row} * W + i] = {self.writer.text(written)}")
        return value

    def _block(
        self, block: list[int], matrix: Matrix, right: dict[int, Term], n: int
    ) -> dict[int, Term]:
        rubbing = [one for one in self.early if one.touched[0] in block]
        held = sum(k >= n for k in block)
        for one in rubbing:
            one.measure()
            if not one.depends:
                one.known({})
                for k, term in one.moved.items():
                    right[k] = right[k] - one.force * term
        moving = [one for one in rubbing if one.depends]
        if len(block) == 2 and not held and len(moving) == 1:
            (guide,) = moving
            if isinstance(guide, RubbingGuide):
                return guide.paired(block, matrix, right)
        factored = Elimination(self.writer, matrix, block, held, self.inverse, self._passed(block))
        found = factored.solve(right)
        return coupled(moving, factored, found) if moving else found

    def _passed(self, block: list[int]) -> dict[int, list[int]]:
        """Multipliers of pins in a free linkage, which may become singular, with those of the same pin.

        What is driven at a given speed may not get stuck unheard at a dead centre, so nothing is eased there.
        """
        if not self.mechanism.free:
            return {}
        n = len(self.columns)
        pins: dict[str, tuple[str, str]] = {}
        for one in self.forest.closures:
            if isinstance(one, Revolute):
                names = (f"{one.name}_x", f"{one.name}_y")
                pins |= dict.fromkeys(names, names)
        numbers = {row.name: r for r, row in enumerate(self.constraints, n)}
        return {
            numbers[name]: [numbers[one] for one in both]
            for name, both in pins.items()
            if numbers[name] in block
        }

    # ---- what is written down besides ------------------------------------------------------------
    def _store(self, found: dict[int, Term], torques: dict[Mover, Term]) -> None:
        on, write = self.on, self.writer
        for drive in self.mechanism.drives:
            for name in straight_of(drive):  # the rate of a speed is known last
                if name in self.rows.places:
                    angle = self.number[Mover("angle", self.forest.frames[drive.body])]
                    row = self.rows.places[name] + at.MAX_CURVES
                    write.line(f"work[{row} * W + i] = {write.text(found[angle])}")
        if on.energies or on.series or on.responses or on.objective or on.pins:
            for rub in self.late:
                rub.measure()
                rub.known(found)
            moments = [self._moment(drive, found, torques) for drive in self._drives()]
            if on.series or on.responses or on.objective:
                self._rate(at.DRIVE_MOMENT, moments[0])
        if on.energies:
            power = ZERO
            for drive, moment in zip(self._drives(), moments, strict=True):
                power = power + moment * self.kinematics.spin(self.forest.frames[drive.body])
            power = write.let("power", power)
            self._rate(at.DRIVE_POWER, power)
            write.line(
                f"work[{self.rows.rates + at.ABS_DRIVE_POWER} * W + i] = abs({write.text(power)})"
            )
            loss = ZERO
            for one in self.losses:
                loss = loss + one
            for rub in self.rubbing:
                loss = loss + rub.force * rub.speed
            for bend in self.kinematics.bends.values():
                loss = loss + bend.loss()
            self._rate(at.DISSIPATION, loss)
            self._rate(at.LOAD_POWER, self.load_power)
        if on.follow and (on.series or on.responses or on.objective):
            self._follow(found)
        if on.impacts and not self.kinematics.bends:
            self._shaking(found)
        if on.pins and not self.kinematics.bends:
            self._pins(found)
        if on.objective:
            self._objective()

    def _pins(self, found: dict[int, Term]) -> None:
        """Forces of the ideal pins on their journals' bodies."""
        for k, joint in enumerate(j for j in self.mechanism.joints if type(j) is Revolute):
            pin = RubbingPin(joint, self)
            on_bearing = pin.body is not None and pin.body != split(joint.journal)[0]
            for axis, part in enumerate(pin.pushes(found)):
                force = self.writer.text(-part if on_bearing else part)
                row = at.PINS + axis * at.MAX_PINS + k
                self.writer.line(f"work[{row} * W + i] = {force}")

    def _objective(self) -> None:
        """Calls of the objective's rate, which reads the rates that were written before."""
        kin, body = self.kinematics, self.mechanism.period.body
        frame = self.forest.frames[body]
        terms = (*kin.rotated(frame, kin.offset(body)), kin.spin(frame))
        drive = ", ".join(map(self.writer.text, terms))
        whole = self.on.objective == "whole"
        for k in range(1 if whole else len(self.mechanism.contacts)):
            row = self.rows.rates + at.OBJECTIVE_RATES
            joint = "None" if whole else f"joints[{k}]"
            where = f"{row}" if whole else f"({self.rows.rates} + joints[{k}].objective_rate)"
            call = f"effects.objective.rate(work, par, {joint}, {drive}, i, W)"
            self.writer.line(f"work[{where} * W + i] = {call}")

    def _second(self, found: dict[int, Term]) -> Callable[[Mover], Term]:
        """Accelerations of coordinates, by their columns; 0 of what is none."""

        def second(column: Mover) -> Term:
            term = found[self.number[column]] if column in self.number else ZERO
            if column.kind == "y" and column.body in self.balance.falling:
                return term - self.writer.parameter("gravity")
            return term

        return second

    def _shaking(self, found: dict[int, Term]) -> None:
        """Force of the mechanism on its frame, weight included, of rigid bodies only.

        Loads act between bodies and the frame, so that of all forces inertia and weight are left.
        """
        kin, write, second = self.kinematics, self.writer, self._second(found)
        total = NOWHERE
        for body in self.mechanism.bodies:
            moved = kin.acceleration(kin.center(body.name), second)
            if self.on.gravity:
                moved = moved + Vector(ZERO, write.parameter("gravity"))
            total = total - moved.times(self.balance.mass_of(body))
        x, y = (write.let(f"frame_{axis}", term) for axis, term in zip("xy", total, strict=True))
        self._rate(at.FRAME_X, x)
        self._rate(at.FRAME_Y, y)
        self._rate(at.FRAME_SQUARE, x * x + y * y)

    def _follow(self, found: dict[int, Term]) -> None:
        """Acceleration of a guided body along its guide, or of the followed point along both axes, and its square."""
        second = self._second(found)
        kin, follow = self.kinematics, self.on.follow
        if "." not in follow:
            if (k := self.number.get(Mover("slide", follow))) is not None:
                along = found[k]
            else:
                guide = _guide_of(self.mechanism, follow)
                moved = kin.acceleration(kin.point(guide.point), second)
                along = self.writer.let("followed", dot(moved, self.closing.direction(guide)))
            self._rate(at.FOLLOWED_ACCELERATION, along)
            if self.on.responses:
                self._rate(at.FOLLOWED_SQUARE, along * along)
            return
        x, y = (
            self.writer.let(f"followed_{axis}", term)
            for axis, term in zip("xy", kin.acceleration(kin.point(follow), second), strict=True)
        )
        self._rate(at.FOLLOWED_ACCELERATION, x)
        self._rate(at.FOLLOWED_ACROSS, y)
        self._rate(at.FOLLOWED_SQUARE, x * x + y * y)

    def _drives(self) -> list[Drive]:
        main = self.mechanism.period
        return [main, *(drive for drive in self.mechanism.drives if drive is not main)]

    def _moment(self, drive: Drive, found: dict[int, Term], torques: dict[Mover, Term]) -> Term:
        """Moment of a drive: what is given, or what the prescribed angle requires."""
        if isinstance(drive, Release):
            return ZERO
        column = Mover("angle", self.forest.frames[drive.body])
        if column in torques:
            return torques[column]
        names = [row.name for row in self.constraints]
        if f"{drive.name}_angle" in names:
            return found[len(self.columns) + names.index(f"{drive.name}_angle")]
        return self.writer.let("moment", self.reaction(column, found), whole=True)

    def reaction(self, column: Mover, found: dict[int, Term]) -> Term:
        """What has to act along a column that is prescribed."""
        total = ZERO
        for k, one in enumerate(self.columns):
            total = total + self.balance.mass(column, one) * found[k]
        for r, row in enumerate(self.constraints, len(self.columns)):
            total = total - row.others.get(column, ZERO) * found[r]
        for rub in self.rubbing:
            if column in rub.influence:
                total = total + rub.force * rub.influence[column]
        return total - self.balance.force(column)

    def _rate(self, row: int, term: Term) -> None:
        text = self.writer.text(term)
        self.writer.line(f"work[{self.rows.rates + row} * W + i] = {text}")


def _guide_of(mechanism: Mechanism, body: str) -> Slide:
    """The guide that a body's place moves along."""
    guides = [joint for joint in mechanism.joints if isinstance(joint, Slide)]
    return next(joint for joint in guides if split(joint.point)[0] == body)
