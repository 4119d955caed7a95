"""The motion of one lane of any linkage as a text: what a numba function of it does, and what one reads to understand it.

The text reads coordinates and velocities of the stage, calls the contact law of each joint with clearance, and writes
accelerations, gaps, forces and powers; an effect that is off is not in it. It is written in the order kinematics,
contact, kinematics, contact, sums, which keeps few numbers alive at a time.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from hpcclear.base.terms import NOWHERE, ZERO, Term, Vector, named
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.acting import LoadWriter
from hpcclear.dynamics.linkage.closing import dot
from hpcclear.dynamics.linkage.equations import MotionEquations
from hpcclear.dynamics.linkage.expression import On, Rows, Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics, Mover
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import Drive, Joint, TableRow, split
from hpcclear.dynamics.linkage.rubbing import RubbingPin
from hpcclear.dynamics.linkage.trees import Forest

CLOCK = f"(work[{at.BEGAN} * W + i] + work[{at.STAGE_TIME} * W + i])"


def curves_of(part: TableRow) -> list[str]:
    """Names of the tabulated curves that a drive or load has."""
    return [f"{part.name}.{one}" for one in part.curves] or [part.name] * part.table


class LookUp(NamedTuple):
    """Statements, and after them the place, a share of the table's length, and its rate, 1/s."""

    before: tuple[str, ...]
    place: str
    rate: str


class LookUps:
    """Those of a mechanism's curves (`found`, by their names), and the parameters that they read besides those of its text.

    `rows` and `read` are as of `expression.Writer`.
    """

    def __init__(self, forest: Forest, rows: Rows, text: Writer) -> None:
        self._forest, self._rows = forest, rows
        self.rows, self._free = text.rows, text.free
        self.read: set[str] = set()
        parts = (*forest.mechanism.drives, *forest.mechanism.loads)
        self.found = {name: self._of(one) for one in parts for name in curves_of(one)}

    def _of(self, part: TableRow) -> LookUp:
        main = self._forest.mechanism.period
        if part.kind == "table":
            share = main.seconds / part.seconds / main.turns / at.TURN
            rate = f"par[{at.SPEED} * W + i] * {share!r}"
            return LookUp((), f"{rate} * work[{at.STAGE_TIME} * W + i]", rate)
        if part.kind == "run-up":
            return _by_time(part.speed_by_time[-1][0])
        if not hasattr(part, "prescribed") and part.seconds:
            return _by_time(part.seconds)
        if (body := getattr(part, "angle_of", None)) is not None:
            return self._by_angle(body, 1)
        return self._by_angle(main.body, main.turns)

    def _by_angle(self, body: str, turns: int) -> LookUp:
        """The angle of a body from the x axis, divided by the turns after which the table repeats."""
        rows = self._rows
        write = Writer(self.rows, self._free, hoist=False)
        kin = Kinematics(self._forest, write, rows)
        share = named(repr(1.0 / (at.TURN * turns)))
        text = write.text(kin.angle(body) * share)
        rate = write.text(kin.spin(self._forest.frames[body]) * share)
        self.rows, self._free = write.rows, write.free
        self.read |= write.read
        return LookUp(tuple(write.lines), text, rate)


def _by_time(seconds: float) -> LookUp:
    """The time since the start of the sample, divided by that after which the table repeats or stays level."""
    rate = repr(1.0 / seconds)
    return LookUp((), f"{CLOCK} * {rate}", rate)


@dataclass(frozen=True)
class Motion:
    """A text and what it needs."""

    source: str  # of the function ``lane(effects, joints, work, par, i, W)``
    forest: Forest
    parameters: dict[str, int]  # rows of `par` by name
    derived: dict[str, str]  # texts of the derived parameters, by name; see `numbers.row_of`
    constraints: tuple[str, ...]  # names of the multipliers
    # rows of tabulated values, by drive or load
    curves: Mapping[str, int] = field(default_factory=dict)
    # where each is looked up; those that move bodies first, since the angle of loads may be theirs
    look_ups: Mapping[str, LookUp] = field(default_factory=dict)
    # of loads by name, ordinary Python, that the text calls besides those of `elements`
    functions: Mapping[str, Callable[..., object]] = field(default_factory=dict)


def generate(
    mechanism: Mechanism, on: On, rows: Rows, *, cartesian: bool = False, hoist: bool = True
) -> Motion:
    """The text of a mechanism's motion; a number that is zero in it is zero in every sample.

    `cartesian`: every body by itself, ideal joints and prescribed angles as constraints with feedback (paper eq. 11);
    `hoist`: what holds parameters alone is worked out once a sample.
    """
    return _Generator(mechanism, on, rows, cartesian, hoist).motion()


class _Generator(MotionEquations):
    """Writes a whole motion: equations, and what effects and outputs require besides."""

    def motion(self) -> Motion:
        for k, contact in enumerate(self.mechanism.contacts):
            self.contact(k, contact)
        self.load_power = ZERO
        for load in self.mechanism.loads:
            acting = LoadWriter(
                load.name, self.kinematics, self.writer, self.balance, self.turned,
                self.rows.places,
            )  # fmt: skip
            self.load_power = self.load_power + load.act(acting)
        drives = self.mechanism.drives
        torques = [self.torque(drive) for drive in drives if drive.kind == "torque"]
        self.constraints = [row for one in self.forest.closures for row in self.closing.rows(one)]
        for drive in drives:
            if drive.kind == "run-up":
                given = (self.turned(f"{drive.name}.{part}") for part in drive.curves)
                self.constraints.append(self.closing.run_up(drive, *given))
        found = self.solved(torques)
        self._store(found, dict(torques))
        lines = "\n".join(f"    {line}" for line in (self._described(), *self.writer.lines))
        look_ups = LookUps(self.forest, self.rows, self.writer)
        read = self.writer.read | look_ups.read
        names = {k: row for k, row in look_ups.rows.items() if k in read}
        return Motion(
            f"def lane(effects, joints, work, par, i, W):\n{lines}\n",
            self.forest,
            names,
            self.writer.derived,
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

    # ---- what is written down besides ------------------------------------------------------------
    def _store(self, found: dict[int, Term], torques: dict[Mover, Term]) -> None:
        on, write = self.on, self.writer
        for drive in self.mechanism.drives:
            for name in drive.straight:  # the rate of a speed is known last
                if name in self.rows.places:
                    angle = self.number[Mover("angle", self.forest.frames[drive.body])]
                    row = self.rows.places[name] + at.MAX_CURVES
                    write.store(row, found[angle])
        if on.energies or on.series or on.responses or on.objective or on.pins:
            for rub in self.late:
                rub.measure()
                rub.known(found)
            moments = [self._moment(drive, found, torques) for drive in self._drives()]
            if on.series or on.responses or on.objective:
                self._rate(at.DRIVE_MOMENT, moments[0])
        if on.energies:
            spins = [self.kinematics.spin(self.forest.frames[one.body]) for one in self._drives()]
            products = (moment * spin for moment, spin in zip(moments, spins, strict=True))
            power = write.let("power", sum(products, ZERO))
            self._rate(at.DRIVE_POWER, power)
            row = self.rows.rates + at.ABS_DRIVE_POWER
            write.line(f"work[{row} * W + i] = abs({write.text(power)})")
            rubbed = (rub.force * rub.speed for rub in self.rubbing)
            bent = (bend.loss() for bend in self.kinematics.bends.values())
            self._rate(at.DISSIPATION, sum((*self.losses, *rubbed, *bent), ZERO))
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
        for k, joint in enumerate(j for j in self.mechanism.joints if j.kind == "revolute"):
            pin = RubbingPin(joint, self)
            on_bearing = pin.body is not None and pin.body != split(joint.journal)[0]
            for axis, part in enumerate(pin.pushes(found)):
                row = at.PINS + axis * at.MAX_PINS + k
                self.writer.store(row, -part if on_bearing else part)

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
            where = f"{row}" if whole else f"({row} + joints[{k}].place)"
            call = f"effects.objective.rate(work, par, {joint}, {drive}, i, W)"
            self.writer.line(f"work[{where} * W + i] = {call}")

    def _second(self, found: dict[int, Term], column: Mover) -> Term:
        """Acceleration of a coordinate, by its column; 0 of what is none."""
        term = found[self.number[column]] if column in self.number else ZERO
        if column.kind == "y" and column.body in self.balance.falling:
            return term - self.writer.parameter("gravity")
        return term

    def _shaking(self, found: dict[int, Term]) -> None:
        """Force of the mechanism on its frame, weight included, of rigid bodies only.

        Loads act between bodies and the frame, so that of all forces inertia and weight are left.
        """
        kin, write, second = self.kinematics, self.writer, partial(self._second, found)
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
        second = partial(self._second, found)
        kin, follow = self.kinematics, self.on.follow
        if "." not in follow:
            if (k := self.number.get(Mover("slide", follow))) is not None:
                along = found[k]
            else:
                guide = guide_of(self.mechanism, follow)
                moved = kin.acceleration(kin.point(guide.point), second)
                along = self.writer.let("followed", dot(moved, self.closing.direction(guide)))
            self._rate(at.FOLLOWED_ACCELERATION, along)
            if self.on.responses:
                self._rate(at.FOLLOWED_SQUARE, along * along)
            return
        both = zip("xy", kin.acceleration(kin.point(follow), second), strict=True)
        x, y = (self.writer.let(f"followed_{axis}", term) for axis, term in both)
        self._rate(at.FOLLOWED_ACCELERATION, x)
        self._rate(at.FOLLOWED_ACROSS, y)
        self._rate(at.FOLLOWED_SQUARE, x * x + y * y)

    def _drives(self) -> list[Drive]:
        main = self.mechanism.period
        return [main, *(drive for drive in self.mechanism.drives if drive is not main)]

    def _moment(self, drive: Drive, found: dict[int, Term], torques: dict[Mover, Term]) -> Term:
        """Moment of a drive: what is given, or what the prescribed angle requires."""
        if drive.kind == "free":
            return ZERO
        column = Mover("angle", self.forest.frames[drive.body])
        if column in torques:
            return torques[column]
        names = [row.name for row in self.constraints]
        if f"{drive.name}_angle" in names:
            return found[len(self.columns) + names.index(f"{drive.name}_angle")]
        return self.writer.let("moment", self.reaction(column, found), whole=True)

    def _rate(self, row: int, term: Term) -> None:
        self.writer.store(self.rows.rates + row, term)


def guide_of(mechanism: Mechanism, body: str) -> Joint:
    """The guide that a body's place moves along."""
    guides = [joint for joint in mechanism.joints if joint.kind == "slide"]
    return next(joint for joint in guides if split(joint.point)[0] == body)
