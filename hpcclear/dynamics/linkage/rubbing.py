"""Friction of guides and pins, which their reactions set, which in turn depend on what moves.

f = ratio |R| against the sliding, R = rest + a sum of unknowns: one component of a guide, two of a pin. Where R needs no
unknown, f is a known force. Elsewhere the equations are solved without friction first, and what each f changes follows from
the same factors. With its direction u, |R| = u . R is linear; u follows from the R that was found, again and again. That is
Newton's method: errors of u are squared by each pass, from mu r / L on. A guide's u is a sign, and one pass is enough.
"""

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Protocol

from hpcclear.base.terms import NOWHERE, ONE, ZERO, Term, Vector, named
from hpcclear.dynamics.linkage.balance import Balance
from hpcclear.dynamics.linkage.closing import Closing, ClosureRow
from hpcclear.dynamics.linkage.elimination import Elimination, Matrix
from hpcclear.dynamics.linkage.expression import Writer, onto
from hpcclear.dynamics.linkage.kinematics import Mover
from hpcclear.dynamics.linkage.parts import GROUND, Joint, is_joint, is_pin, places_of, split

PASSES = 4  # of the directions of reactions: errors are 1e-12 where mu r is a quarter of the lengths of the bars


class Solving(Protocol):
    """What solves equations of motion: unknowns and multipliers by number."""

    balance: Balance
    closing: Closing
    columns: list[Mover]
    constraints: list[ClosureRow]


class Rubbing:
    """Friction of one joint: `speed` of sliding, `size` of the reaction, and the `force` against the sliding.

    `influence`: derivatives by columns of the sliding that friction acts against; `reaction`: components, each what needs no
    unknown, and factors of the unknowns.
    """

    ratio: Term
    size: Term
    force: Term
    speed: Term
    influence: dict[Mover, Term]
    reaction: list[tuple[Term, dict[int, Term]]]

    def __init__(self, joint: Joint, of: Solving) -> None:
        self.joint, self.of = joint, of
        self.writer: Writer = of.balance.writer
        self.number = {column: k for k, column in enumerate(of.columns)}
        self.rows = {row.name: len(of.columns) + r for r, row in enumerate(of.constraints)}
        forest = of.balance.forest
        self.body = next((b for b, hang in forest.hangs.items() if hang.joint is joint), None)

    @property
    def moved(self) -> dict[int, Term]:
        """The influence on unknowns."""
        return {self.number[c]: term for c, term in self.influence.items() if c in self.number}

    @property
    def depends(self) -> bool:
        """Whether its reaction depends on unknowns."""
        return any(slopes for _, slopes in self.reaction)

    @property
    def touched(self) -> list[int]:
        """Unknowns that it acts on or depends on."""
        return [*self.moved, *(k for _, slopes in self.reaction for k in slopes)]

    def directed(self, parts: list[Term]) -> list[Term]:
        """Direction of a reaction."""
        raise NotImplementedError

    def measure(self) -> None:
        """Write down friction over reaction, signed like the sliding speed."""
        write, name = self.writer, self.joint.name
        ramp = write.parameter(f"{name}_inverse_ramp")
        (saturated,) = write.call("saturated", (self.speed * ramp,), (f"ramp_{name}",))
        coefficient = write.parameter(f"{name}_coefficient")
        self.ratio = write.let(f"ratio_{name}", coefficient * saturated)

    def pushes(self, found: dict[int, Term]) -> list[Term]:
        """Components of the reaction where unknowns are these."""
        name = f"push_{self.joint.name}"
        parts = (_along(slopes, found, rest) for rest, slopes in self.reaction)
        return [self.writer.let(name, part) for part in parts]

    def changes(self, by: dict[int, Term]) -> list[Term]:
        """What the components gain with the unknowns, `by` of each."""
        name = f"change_{self.joint.name}"
        return [self.writer.let(name, _along(slopes, by, ZERO)) for _, slopes in self.reaction]

    def known(self, found: dict[int, Term]) -> None:
        """Friction of a reaction whose unknowns are known."""
        name, parts = self.joint.name, self.pushes(found)
        self.size = _dot(self.directed(parts), parts)
        self.force = self.writer.let(f"rub_{name}", self.ratio * self.size)


class RubbingGuide(Rubbing):
    """Friction of a guide; `place`: the unknown that holds it, its slider's coordinate or the multiplier across it."""

    def __init__(self, joint: Joint, of: Solving) -> None:
        super().__init__(joint, of)
        balance, body, n = of.balance, self.body, len(of.columns)
        if body is not None:
            self.place = self.number[Mover("slide", body)]
            self.influence = {Mover("slide", body): ONE}
            self.speed = named(f"vslide_{body}")
            across = Mover("across", body)
            slopes = {k: balance.mass(across, one) for k, one in enumerate(of.columns)}
            slopes |= {n + r: -row.others.get(across, ZERO) for r, row in enumerate(of.constraints)}
            rest = -balance.force(across)
        else:
            self.place = self.rows[f"{joint.name}_across"]
            slopes, rest = {self.place: ONE}, ZERO
            self.influence, self.speed = of.closing.sliding(joint)
        self.reaction = [(rest, {k: term for k, term in slopes.items() if term})]

    def directed(self, parts: list[Term]) -> list[Term]:
        """A sign."""
        return [*self.writer.call("sign_of", parts[:1], (f"flip_{self.joint.name}",))]

    def paired(self, block: list[int], matrix: Matrix, right: dict[int, Term]) -> dict[int, Term]:
        """A slider and one other coordinate: solved for N > 0, and for N < 0 where that sign does not hold."""
        write, name = self.writer, self.joint.name
        s = self.place
        (o,) = (k for k in block if k != s)
        a, b, c = matrix[o, o], matrix.get((o, s), ZERO), matrix[s, s]
        first = write.let(f"b_{o}", right[o])
        second = write.let(f"b_{s}", right[s])
        ((rest, slopes),) = self.reaction
        slope, rest = slopes.get(o, ZERO), write.let(f"rest_{name}", rest, whole=True)

        def equations(ratio: Term) -> tuple[Term, Term, Term]:
            coupled = write.let("coupled", b + onto(ratio, slope))
            determinant = write.let("determinant", a * c - b * coupled)
            given = write.let("given", second - ratio * rest)
            return coupled, determinant, given

        _, determinant, given = equations(self.ratio)
        other = write.let("guess", (first * c - b * given) / determinant)
        (flip,) = write.call("sign_of", (rest + slope * other,), ("flip",))
        ratio = write.let("ratio", self.ratio * flip)
        coupled, determinant, given = equations(ratio)
        other = write.let(f"z_{o}", (first * c - b * given) / determinant)
        slider = write.let(f"z_{s}", (a * given - coupled * first) / determinant)
        self.force = write.let(f"rub_{name}", ratio * (rest + slope * other))
        return {o: other, s: slider}


class RubbingPin(Rubbing):
    """Friction of a pin: both parameters hold its radius, so that sliding is turning here.

    In a tree its reaction is what the bodies beyond it require: inertia and weight, less the forces on them.
    """

    def __init__(self, joint: Joint, of: Solving) -> None:
        super().__init__(joint, of)
        kin = of.balance.kinematics
        journal, bearing = (kin.forest.frames[split(place)[0]] for place in places_of(joint))
        turns = {Mover("angle", journal): ONE, Mover("angle", bearing): -ONE}
        self.influence = {column: term for column, term in turns.items() if column.body != GROUND}
        self.turns = journal != bearing
        self.speed = kin.spin(journal) - kin.spin(bearing)
        self.beyond = set() if self.body is None else _beyond(of.balance, self.body)

    @cached_property
    def reaction(self) -> list[tuple[Term, dict[int, Term]]]:  # type: ignore[override]
        """Multipliers; in a tree, mass times acceleration of what is beyond, less the forces on it."""
        if self.body is None:
            rows = [self.rows[f"{self.joint.name}_{axis}"] for axis in "xy"]
            return [(ZERO, {row: ONE}) for row in rows]
        balance, kin = self.of.balance, self.of.balance.kinematics
        rest = NOWHERE
        slopes: dict[int, Vector] = {}
        for body in kin.forest.mechanism.bodies:
            if body.name not in self.beyond:
                continue
            center, mass = kin.center(body.name), balance.mass_of(body)
            moved = kin.acceleration(center, lambda _: ZERO)
            if balance.gravity and body.name not in balance.falling:
                moved = moved + Vector(ZERO, self.writer.parameter("gravity"))
            rest = rest + moved.times(mass)
            for column, held in kin.columns(center).items():
                if column in self.number:
                    k, part = self.number[column], kin.rotated(*held).times(mass)
                    slopes[k] = slopes.get(k, NOWHERE) + part
        for pull in balance.pulls:
            if split(pull.place)[0] in self.beyond:
                rest = rest - pull.force
        taken = (pair for closure in kin.forest.closures for pair in self._held(closure))
        slopes |= {self.rows[name]: direction for name, direction in taken}
        found = []
        for axis in "xy":
            own = self.writer.let(f"rest_{self.joint.name}", getattr(rest, axis))
            found.append((own, {k: part for k, v in slopes.items() if (part := getattr(v, axis))}))
        return found

    def _held(self, closure: Joint) -> list[tuple[str, Vector]]:
        """By constraint of a joint that closes a loop: the force that it takes off what is beyond."""
        if not is_joint(closure) or closure.kind in ("slide", "fixed"):
            return []  # what is left over of trees are pins and slots
        first, second = (split(place)[0] in self.beyond for place in places_of(closure))
        if first == second:
            return []
        sign = -ONE if first else ONE
        if closure.holds == 1:
            across = self.of.closing.direction(closure).across()
            return [(f"{closure.name}_across", across.times(sign))]
        axes = {"x": Vector(sign, ZERO), "y": Vector(ZERO, sign)}
        return [(f"{closure.name}_{axis}", one) for axis, one in axes.items()]

    def directed(self, parts: list[Term]) -> list[Term]:
        """A unit vector."""
        names = (f"{part}_{self.joint.name}" for part in ("ux", "uy"))
        return [*self.writer.call("unit_vector", parts, names)]


def rubbing_of(of: Solving) -> list[Rubbing]:
    """Friction of all joints that have it, but for pins between bodies that never turn against each other."""
    found: list[Rubbing] = []
    for joint in of.balance.forest.mechanism.joints:
        if getattr(joint, "friction", None) is None:
            continue
        if joint.kind == "slide":
            found.append(RubbingGuide(joint, of))
        elif is_pin(joint):
            pin = RubbingPin(joint, of)
            found += [pin] if pin.turns else []
    return found


def _beyond(balance: Balance, body: str) -> set[str]:
    """A body and all that hang on it."""
    found = {body}
    for other, hang in balance.forest.hangs.items():  # parents before children
        if hang.joint is not None and split(hang.parent)[0] in found:
            found.add(other)
    return found


def coupled(
    rubbing: Sequence[Rubbing], factored: Elimination, found: dict[int, Term]
) -> dict[int, Term]:
    """The unknowns with the friction of joints whose reactions depend on them; `found`: without it."""
    write = factored.writer
    found = {k: write.let(f"free_{k}", term) for k, term in found.items()}
    moved = []
    for one in rubbing:
        by = factored.solve({k: -(one.ratio * term) for k, term in one.moved.items()})
        moved.append({k: write.let(f"by_{one.joint.name}_{k}", t) for k, t in by.items()})
    free = [one.pushes(found) for one in rubbing]
    changes = [[one.changes(by) for by in moved] for one in rubbing]
    sizes = _sizes(rubbing, free, changes)
    for one, size, by in zip(rubbing, sizes, moved, strict=True):
        one.size = write.let(f"size_{one.joint.name}", size)
        one.force = write.let(f"rub_{one.joint.name}", one.ratio * one.size)
        found = {k: term + one.size * by[k] for k, term in found.items()}
    return found


def _sizes(
    rubbing: Sequence[Rubbing], free: list[list[Term]], changes: list[list[list[Term]]]
) -> list[Term]:
    """Sizes of reactions; `free`: their components without friction, `changes`: those of one by the size of another."""
    write, parts = rubbing[0].writer, free
    sizes: list[Term] = []
    passes = PASSES if any(len(one) > 1 for one in free) else 1
    for turn in range(passes):
        if turn:
            parts = [
                [_plus(part, [one[c] for one in row], sizes) for c, part in enumerate(own)]
                for own, row in zip(free, changes, strict=True)
            ]
        directions = [one.directed(own) for one, own in zip(rubbing, parts, strict=True)]
        matrix = [
            [(ONE if g == h else ZERO) - _dot(own, change) for h, change in enumerate(row)]
            for g, (own, row) in enumerate(zip(directions, changes, strict=True))
        ]
        right = [_dot(one, own) for one, own in zip(directions, free, strict=True)]
        sizes = _solved(write, matrix, right)
    return sizes


def _along(slopes: dict[int, Term], unknowns: dict[int, Term], start: Term) -> Term:
    """Factors of unknowns times these, added to a term."""
    return _plus(start, slopes.values(), (unknowns[k] for k in slopes))


def _plus(start: Term, factors: Iterable[Term], terms: Iterable[Term]) -> Term:
    for factor, term in zip(factors, terms, strict=True):
        start = start + factor * term
    return start


def _dot(one: Iterable[Term], other: Iterable[Term]) -> Term:
    return _plus(ZERO, one, other)


def _solved(write: Writer, matrix: list[list[Term]], right: list[Term]) -> list[Term]:
    """A few equations near the identity, by Gauss without pivoting."""
    matrix, right, m = [list(row) for row in matrix], list(right), len(right)
    for p in range(m):
        inverse = write.let("inverse", ONE / matrix[p][p])
        for i in range(p + 1, m):
            factor = write.let("factor", matrix[i][p] * inverse)
            matrix[i] = [
                write.let("entry", b - factor * a) if j > p else ZERO
                for j, (a, b) in enumerate(zip(matrix[p], matrix[i], strict=True))
            ]
            right[i] = write.let("side", right[i] - factor * right[p])
        matrix[p] = [*matrix[p], inverse]
    found: list[Term] = [ZERO] * m
    for p in reversed(range(m)):
        value = right[p]
        for j in range(p + 1, m):
            value = value - matrix[p][j] * found[j]
        found[p] = write.let("reaction", value * matrix[p][m])
    return found
