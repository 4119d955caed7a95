"""Balances of a linkage: for each coordinate, or direction that a joint holds, its row of the mass matrix and its force.

A row is d'Alembert's principle along a column of `kinematics.Kinematics`: masses times accelerations, less forces. Rows
of coordinates are solved; those of prescribed angles and guides give moments and reactions afterwards.
"""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from hpcclear.base.terms import NOWHERE, ONE, ZERO, Term, Vector, named
from hpcclear.dynamics.linkage.expression import Writer
from hpcclear.dynamics.linkage.kinematics import CENTER, Kinematics, Move, Mover, Point
from hpcclear.dynamics.linkage.parts import GROUND, Body, is_joint, places_of, split
from hpcclear.dynamics.linkage.trees import Forest

Held = tuple[str, Vector]  # a vector held in a frame


class Pull(NamedTuple):
    """A force on a place: known terms along the ground's axes."""

    place: str
    force: Vector


class Twist(NamedTuple):
    """A moment on a body; `point`: where, of a bar that bends."""

    body: str
    moment: Term
    point: str = ""


class Balance:
    """Mass matrix and forces of a forest; forces are added to `pulls` and `twists` before a row is requested."""

    def __init__(self, forest: Forest, kinematics: Kinematics, writer: Writer, gravity: bool):
        self.forest = forest
        self.kinematics = kinematics
        self.writer = writer
        self.gravity = gravity
        self.pulls: list[Pull] = []
        self.twists: list[Twist] = []
        self._order = {GROUND: -1} | {b.name: k for k, b in enumerate(forest.mechanism.bodies)}
        self.falling = _falling(forest) if gravity else set()

    # ---- masses ---------------------------------------------------------------------------------
    def mass_of(self, body: Body) -> Term:
        """Mass of a body."""
        return self.writer.parameter(f"{body.name}_mass")

    def moment_of(self, body: Body) -> Vector:
        """Mass times the arm from the ground's pin to the mass centre."""
        own = split(self.forest.hangs[body.name].own)[1]
        arm = self.kinematics.arm(body.name, own, CENTER)
        names = (f"{body.name}_moment_{axis}" for axis in ("x", "y"))
        x, y = (self.writer.parameter(n) if a else ZERO for n, a in zip(names, arm, strict=True))
        return Vector(x, y)

    def mass(self, first: Mover, second: Mover) -> Term:
        """Entry of the mass matrix."""
        if {first.kind, second.kind} == {"slide", "across"} and first.body == second.body:
            return ZERO
        total, pairs = ZERO, []
        for body in self.forest.mechanism.bodies:
            turns = Mover("angle", self.forest.frames[body.name])
            if first == second == turns:
                about = "pivot_inertia" if self.forest.on_ground(body.name) else "inertia"
                total = total + self.writer.parameter(f"{body.name}_{about}")
            if self.forest.on_ground(body.name):
                continue
            columns = self.kinematics.columns(self.kinematics.center(body.name))
            if first in columns and second in columns:
                if first == second and first.kind in ("x", "y", "slide", "across"):
                    total = total + self.mass_of(body)
                else:
                    pairs.append((self.mass_of(body), columns[first], columns[second]))
            if body.name in self.kinematics.bends:
                moved = self.moved_by(body.name)
                for one, two in ((first, second), (second, first)):
                    if one in columns and two in moved:
                        pairs.append((ONE, columns[one], moved[two]))
                total = total + self._bent_mass(body.name, first, second)
        return total + self.inner(pairs)

    def moved_by(self, body: str) -> dict[Mover, Held]:
        """Derivatives of a bent bar's first moment (`bending`) by all that changes it."""
        bend, frame = self.kinematics.bends[body], self.forest.frames[body]
        found = {Mover("angle", frame): (frame, bend.moved().across())}
        modes = zip(bend.kinds, bend.modes, strict=True)
        return found | {Mover(kind, body): (frame, bend.moved_by(k)) for kind, k in modes}

    def _bent_mass(self, body: str, first: Mover, second: Mover) -> Term:
        """What bending adds to an entry of the mass matrix, besides products of first moment and mass centre."""
        bend, turns = self.kinematics.bends[body], Mover("angle", self.forest.frames[body])
        if first == second == turns:
            return bend.spun()
        modes = {Mover(kind, body): k for kind, k in zip(bend.kinds, bend.modes, strict=True)}
        if first in modes and first == second:
            return bend.number("mass")  # M/2, of every mode
        for one, two in ((first, second), (second, first)):
            if one == turns and two in modes:
                return bend.number(f"turned_{modes[two]}")  # X: by how much its rate is a turning
        return ZERO

    def inner(self, pairs: Iterable[tuple[Term, Held, Held]], rates: tuple[Term, ...] = ()) -> Term:
        """Sum of mass times the products of two vectors held in frames, times rates."""
        dots: dict[tuple[str, str], Term] = {}
        areas: dict[tuple[str, str], Term] = {}
        moments: dict[tuple[str, Vector], Vector] = {}
        for mass, one, two in pairs:
            if self._order[one[0]] < self._order[two[0]]:
                one, two = two, one
            (late, a), (early, b) = one, two
            if early == GROUND and late != GROUND:
                held = Vector(mass * a.x, mass * a.y)
                moments[late, b] = moments.get((late, b), NOWHERE) + held
                continue
            key = (early, late)
            dots[key] = dots.get(key, ZERO) + mass * a.x * b.x + mass * a.y * b.y
            areas[key] = areas.get(key, ZERO) + (mass * a.y * b.x - mass * a.x * b.y)
        total = ZERO
        for (frame, along), moment in moments.items():
            x, y = self.kinematics.rotated(frame, moment)
            total = total + _times(x, rates) * along.x + _times(y, rates) * along.y
        for (early, late), dot in dots.items():
            if early == late:
                total = total + _times(dot, rates)
                continue
            # by cosine and sine of the difference of the frames' angles
            (c, s), (ct, st) = self.kinematics.trig(early), self.kinematics.trig(late)
            if dot:
                cosine = self.writer.let(f"c_{early}_{late}", c * ct + s * st)
                total = total + _times(dot, rates) * cosine
            if area := areas[early, late]:
                sine = self.writer.let(f"s_{early}_{late}", s * ct - c * st)
                total = total + _times(area, rates) * sine
        return total

    # ---- forces ---------------------------------------------------------------------------------
    def force(self, column: Mover) -> Term:
        """What moves along a column: pulls and moments, gravity, and what turning frames require."""
        total = ZERO
        for pull in self.pulls:
            found = self.kinematics.columns(self.kinematics.point(pull.place)).get(column)
            if found is not None:
                total = total + self.along(found, pull.force)
        for twist in self.twists:
            if column == ("angle", self.forest.frames[twist.body]):
                total = total + twist.moment
            bend = self.kinematics.bends.get(twist.body)
            if bend is not None and column.body == twist.body and column.kind in bend.kinds:
                mode = 1 + bend.kinds.index(column.kind)
                total = total + bend.slope(mode, twist.point) * twist.moment
        return total + self._weight(column) + self._turning(column) + self._bent(column)

    def _bent(self, column: Mover) -> Term:
        """What acts within a bent bar: on its turning, and on its modes."""
        for body, bend in self.kinematics.bends.items():
            frame = self.forest.frames[body]
            if column == ("angle", frame):
                return bend.braking(self.kinematics.spin(frame))
            if column.body == body and column.kind in bend.kinds:
                mode = 1 + bend.kinds.index(column.kind)
                return bend.restoring(mode, self.kinematics.spin(frame))
        return ZERO

    def along(self, held: Held, force: Vector) -> Term:
        """A force along a vector held in a frame; the signs go into the difference, as one would write it."""
        frame, (ax, ay) = held
        fx, fy = force
        if frame == GROUND:
            return fx * ax + fy * ay
        if fx.negative and fy.negative:
            ax, ay, fx, fy = -ax, -ay, -fx, -fy
        c, s = self.kinematics.trig(frame)
        across = s * fx - c * fy if ay.negative else c * fy - s * fx
        return abs(ay) * across + ax * (c * fx + s * fy)

    def _weight(self, column: Mover) -> Term:
        """Gravity acts towards -y; a tree that nothing holds falls as a whole, which is added to its root alone."""
        if not self.gravity:
            return ZERO
        held: dict[str, Vector] = {}
        for body in self.forest.mechanism.bodies:
            if body.name in self.falling:
                continue
            if self.forest.on_ground(body.name):
                if column == ("angle", body.name):
                    turned = self.moment_of(body).across()
                    held[body.name] = held.get(body.name, NOWHERE) + turned
                continue
            columns = self.kinematics.columns(self.kinematics.center(body.name))
            if column in columns:
                frame, (ax, ay) = columns[column]
                mass = self.mass_of(body)
                held[frame] = held.get(frame, NOWHERE) + Vector(mass * ax, mass * ay)
            if body.name in self.kinematics.bends:
                frame, moved = self.moved_by(body.name).get(column, (GROUND, NOWHERE))
                held[frame] = held.get(frame, NOWHERE) + moved
        whole = sum((self.kinematics.rotated(*one).y for one in held.items()), ZERO)
        return -(whole * self.writer.parameter("gravity"))

    def _turning(self, column: Mover) -> Term:
        """What centripetal, Coriolis and prescribed accelerations require."""
        pairs: dict[tuple[Term, ...], list[tuple[Term, Held, Held]]] = {}
        known = ZERO
        for body in self.forest.mechanism.bodies:
            if self.forest.on_ground(body.name):
                continue
            point = self.kinematics.center(body.name)
            columns = self.kinematics.columns(point)
            if column in columns:
                mine, mass = columns[column], self.mass_of(body)
                for frame, arm in point.arms.items():
                    if frame == GROUND or column == ("angle", frame):
                        continue
                    spin = self.kinematics.spin(frame)
                    pairs.setdefault((spin, spin), []).append((mass, mine, (frame, arm)))
                for rates, held in self.coriolis(point.moves):
                    pairs.setdefault(rates, []).append((-mass, mine, held))
            if body.name in self.kinematics.bends:
                for rates, both in self._thrown(body.name, point, columns, column):
                    pairs.setdefault(rates, []).append(both)
        for frame in self.forest.prescribed:
            if turn := self.kinematics.turn(frame):
                known = known + self.mass(column, Mover("angle", frame)) * turn
        return sum((self.inner(found, rates) for rates, found in pairs.items()), ZERO) - known

    def _thrown(
        self, body: str, point: Point, columns: dict[Mover, Held], column: Mover
    ) -> Iterator[tuple[tuple[Term, ...], tuple[Term, Held, Held]]]:
        """The same of a bent bar's first moment: its own acceleration along the mass centre's column, and the mass centre's
        along its own."""
        kin = self.kinematics
        bend, frame = kin.bends[body], self.forest.frames[body]
        spin, own = kin.spin(frame), self.moved_by(body)
        if column in columns:
            mine = columns[column]
            yield (spin, spin), (ONE, mine, (frame, bend.moved()))
            yield (named("2.0"), spin), (-ONE, mine, (frame, bend.moving()))
            yield (), (-ONE, mine, (frame, Vector(bend.gathering(), ZERO)))
        if column in own:
            for other, arm in point.arms.items():
                if other != GROUND:
                    rate = kin.spin(other)
                    yield (rate, rate), (ONE, own[column], (other, arm))
            for rates, held in self.coriolis(point.moves):
                yield rates, (-ONE, own[column], held)

    def coriolis(self, moves: Iterable[Move]) -> Iterator[tuple[tuple[Term, ...], Held]]:
        """Rates and vectors of 2 v w of what moves in turning frames, and of v^2 where its direction changes."""
        for move in moves:
            if move.turns_along:
                speed = named(self.kinematics.speed_name(move.kind, move.body))
                rates = (named("2.0"), speed, self.kinematics.spin(move.frame))
                yield rates, (move.frame, move.direction.across())
                if any(move.changing):
                    yield (speed, speed), (move.frame, move.changing)


def _times(term: Term, rates: tuple[Term, ...]) -> Term:
    for rate in rates:
        term = term * rate
    return term


def root_of(forest: Forest, body: str) -> str:
    """The body, or the ground, that a body's tree hangs on."""
    while body != GROUND and forest.hangs[body].joint is not None:
        body = split(forest.hangs[body].parent)[0]
    return body


def _falling(forest: Forest) -> set[str]:
    """Bodies of trees that hang on a free body and close no loop."""
    roots = {body: root_of(forest, body) for body in forest.hangs}
    held = {GROUND}
    for one in forest.closures:
        names = [split(p)[0] for p in places_of(one)] if is_joint(one) else [one.body]
        held |= {roots.get(name, GROUND) for name in names}
    return {body for body, root in roots.items() if root not in held}
