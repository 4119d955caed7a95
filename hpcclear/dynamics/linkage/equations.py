"""Equations of motion of any linkage, written into a text: what acts, and the accelerations and multipliers that follow."""

import keyword

from hpcclear.base.terms import ONE, ZERO, Term, Vector, named
from hpcclear.dynamics.linkage.acting import ContactWriter
from hpcclear.dynamics.linkage.balance import Balance, Pull, Twist
from hpcclear.dynamics.linkage.closing import Closing, ClosureRow
from hpcclear.dynamics.linkage.elements import functions
from hpcclear.dynamics.linkage.elimination import Elimination, Matrix, blocks
from hpcclear.dynamics.linkage.expression import On, Rows, Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics, Mover
from hpcclear.dynamics.linkage.mechanism import Mechanism
from hpcclear.dynamics.linkage.parts import GROUND, Contact, Drive, is_pin, split
from hpcclear.dynamics.linkage.rubbing import RubbingGuide, coupled, rubbing_of
from hpcclear.dynamics.linkage.trees import forest

RESERVED = (
    *keyword.kwlist, "effects", "joints", "work", "par", "i", "W", "at", "abs", "np", "sincos", "saturated", *functions(),
    "joint_force", "wall_force",
)  # fmt: skip
"""Names that a text has already, and that a value of a load or drive must not hide."""


class MotionEquations:
    """Forces, mass matrix and constraints of a mechanism, and their solution, term by term.

    `constraints` close loops, and are to be set before they are solved; `losses`: powers that contacts take, W.
    """

    constraints: list[ClosureRow]

    def __init__(self, mechanism: Mechanism, on: On, rows: Rows, cartesian: bool, hoist: bool):
        self.mechanism, self.on, self.rows = mechanism, on, rows
        self.forest = forest(mechanism, cartesian)
        self.writer = Writer(rows.parameters, rows.free, hoist, RESERVED)
        self.kinematics = Kinematics(self.forest, self.writer, rows)
        self.balance = Balance(self.forest, self.kinematics, self.writer, on.gravity)
        self.closing = Closing(self.kinematics, self.writer)
        self.columns = [Mover(one.kind, one.body) for one in self.forest.coordinates]
        self.number = {column: k for k, column in enumerate(self.columns)}
        self.losses: list[Term] = []

    # ---- forces ---------------------------------------------------------------------------------
    def contact(self, k: int, contact: Contact) -> None:
        """Call of a contact's geometry: journal relative to bearing, and what the contact exerts on both."""
        kin, write, is_round = self.kinematics, self.writer, contact.joint.round
        places = contact.journal, contact.bearing
        journal, bearing = map(kin.point, places)
        apart = kin.position(journal) - kin.position(bearing)
        moving = kin.velocity(journal) - kin.velocity(bearing)
        spins = [kin.end_spin(place) for place in places]
        relative = [write.text(term) for term in (*apart, *moving, *spins)]
        if not (self.on.friction or self.on.waves):  # which are no faster by it
            relative[4:] = ["None" if spin is ZERO else write.text(spin) for spin in spins]
        if is_round:
            function, frame = "joint_force", self._turns(contact)
        else:
            terms = ContactWriter(self.closing, k, contact, apart)
            touching = contact.joint.touch(terms, contact.part)
            function, frame = "wall_force", f"({', '.join(map(write.text, touching))})"
        made = [write.fresh(f"{name}_{contact.word}") for name in ("fx", "fy", "mb", "mj", "loss")]
        given = f"joints[{k}], ({', '.join(relative)}), {frame}"
        call = f"{function}(effects, work, par, {given}, i, W)"
        write.line(f"{', '.join(made)} = {call}")
        fx, fy, on_bearing, on_journal, loss = map(named, made)
        force = Vector(fx, fy)
        self.balance.pulls += [Pull(contact.journal, -force), Pull(contact.bearing, force)]
        turning = self.on.friction or self.on.waves
        for place, moment, turned in (
            (contact.journal, on_journal, turning),
            (contact.bearing, on_bearing, turning or not is_round),
        ):
            body, point = split(place)
            if turned and body != GROUND:
                self.balance.twists.append(Twist(body, moment, point))
        self.losses.append(loss)

    def _turns(self, contact: Contact) -> str:
        """Cosines and sines of the angles of both bodies, which waves around their surfaces turn with."""
        kin, found = self.kinematics, []
        if not self.on.waves:
            return "None"
        for place in (contact.bearing, contact.journal):
            body = split(place)[0]
            own = Vector(ONE, ZERO) if body == GROUND else kin.offset(body)
            found += [*kin.rotated(self.forest.frames[body], own)]
        return f"({', '.join(self.writer.text(term) for term in found)})"

    def turned(self, name: str) -> Term:
        """What the curve of a drive or load says at the stage."""
        row, word = self.rows.curves[name], f"turned_{name.replace('.', '_')}"
        (turned,) = self.writer.when_needed(f"work[{row} * W + i]", word)
        return turned

    def torque(self, drive: Drive) -> tuple[Mover, Term]:
        """What a drive exerts, and along which column."""
        write, frame = self.writer, self.forest.frames[drive.body]
        column, speed = Mover("angle", frame), self.kinematics.spin(frame)
        for name, rows in drive.straight.items():
            torque = write.table(name, len(rows), speed, self.rows.places.get(name))
            return column, write.let(drive.name, torque)
        torque = write.parameter(f"{drive.name}_torque")
        if drive.table:
            torque = write.let(drive.name, torque * self.turned(drive.name))
        if drive.no_load_speed is not None:
            fall = write.parameter(f"{drive.name}_fall") * speed
            torque = write.let(f"{drive.name}_falling", torque * (ONE - fall))
        return column, torque

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

    def solved(self, torques: list[tuple[Mover, Term]]) -> dict[int, Term]:
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
        ties = {(one.touched[0], k) for one in self.early for k in one.touched}
        found: dict[int, Term] = {}
        for block in blocks(range(n + len(self.constraints)), matrix, ties):
            found |= self._block(block, matrix, right, n)
        return {k: self._accelerated(k, term) for k, term in sorted(found.items())}

    def _accelerated(self, k: int, term: Term) -> Term:
        """Write an acceleration down where the stepper reads it."""
        if k >= len(self.columns):
            r = k - len(self.columns)
            value = self.writer.let(f"hold_{self.constraints[r].name}", term)
            if self.rows.holds is not None:
                self.writer.store(self.rows.holds + r, value)
            return value
        name = self.forest.coordinates[k].name
        value = self.writer.let(f"a_{name}", term, whole=True)
        written = value
        if self.columns[k].kind == "y" and self.columns[k].body in self.balance.falling:
            written = value - self.writer.parameter("gravity")
        self.writer.store(self.rows.accelerations + k, written)
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
        """Multipliers of pins in a free linkage, which may become singular, with those of the same pin in the block.

        What is driven at a given speed may not get stuck unheard at a dead centre, so nothing is eased there.
        """
        if not self.mechanism.free:
            return {}
        numbers = {row.name: r for r, row in enumerate(self.constraints, len(self.columns))}
        pins = [one.name for one in self.forest.closures if is_pin(one)]
        pairs = [{numbers[f"{name}_{axis}"] for axis in "xy"} for name in pins]
        both = [sorted(pair.intersection(block)) for pair in pairs]
        return {r: one for one in both for r in one}

    def reaction(self, column: Mover, found: dict[int, Term]) -> Term:
        """What has to act along a column that is prescribed."""
        masses = (self.balance.mass(column, one) * found[k] for k, one in enumerate(self.columns))
        total = sum(masses, ZERO)
        for r, row in enumerate(self.constraints, len(self.columns)):
            total = total - row.others.get(column, ZERO) * found[r]
        for rub in self.rubbing:
            if column in rub.influence:
                total = total + rub.force * rub.influence[column]
        return total - self.balance.force(column)
