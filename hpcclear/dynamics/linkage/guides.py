"""Friction of guides, which their reaction sets, which in turn depends on what moves.

f = ratio |N| against the sliding, N = rest + a sum of unknowns. Where N needs no unknown, f is a known force. Elsewhere the
equations are solved without friction first; its sign of N decides that of f, and what f changes follows from the same
factors (one guide, a guide and its slider alone: as one would by hand).
"""

from collections.abc import Sequence

from hpcclear.dynamics.linkage.balance import Balance
from hpcclear.dynamics.linkage.closing import Closing, Row
from hpcclear.dynamics.linkage.elimination import Elimination, Matrix
from hpcclear.dynamics.linkage.expression import ONE, ZERO, Term, Writer, named, onto
from hpcclear.dynamics.linkage.kinematics import Column
from hpcclear.dynamics.linkage.parts import Slide


class Guide:
    """Friction of one guide.

    Attributes
    ----------
    place : int
        The unknown that holds the guide: its slider's coordinate, or the multiplier across it.
    normal : dict
        By how much its reaction changes with the unknowns.
    speed, force : Term
        Sliding speed, and friction against it.
    """

    force: Term
    ratio: Term

    def __init__(
        self, joint: Slide, balance: Balance, closing: Closing,
        columns: Sequence[Column], constraints: Sequence[Row],
    ) -> None:  # fmt: skip
        self.joint = joint
        self.writer: Writer = balance.writer
        forest = balance.forest
        number = {column: k for k, column in enumerate(columns)}
        n = len(columns)
        body = next((b for b, hang in forest.hangs.items() if hang.joint is joint), None)
        if body is not None:
            self.place = number[Column("slide", body)]
            self.influence = {self.place: ONE}
            self.speed = named(f"vslide_{body}")
            across = Column("across", body)
            self.normal = {k: balance.mass(across, one) for k, one in enumerate(columns)}
            self.normal |= {
                n + r: -row.others.get(across, ZERO) for r, row in enumerate(constraints)
            }
            self.rest = -balance.force(across)
        else:
            names = [row.name for row in constraints]
            self.place = n + names.index(f"{joint.name}_across")
            self.normal, self.rest = {self.place: ONE}, ZERO
            moved, self.speed = closing.sliding(joint)
            self.influence = {number[c]: term for c, term in moved.items() if c in number}
        self.normal = {k: term for k, term in self.normal.items() if term}

    def measure(self) -> None:
        """Write down friction over reaction, signed like the sliding speed."""
        write, name = self.writer, self.joint.name
        ramp = write.parameter(f"{name}_inverse_ramp")
        speed = write.text(self.speed * ramp)
        saturated = write.fresh(f"ramp_{name}")
        write.line(f"{saturated} = saturated({speed})")
        coefficient = write.parameter(f"{name}_coefficient")
        self.ratio = write.let(f"ratio_{name}", coefficient * named(saturated))

    def known(self, right: dict[int, Term]) -> None:
        """Friction of a reaction that depends on no unknown, taken off the right-hand side."""
        write, name = self.writer, self.joint.name
        self.force = named(write.fresh(f"rub_{name}"))
        text = f"{write.text(self.ratio)} * abs({write.text(self.rest)})"
        write.line(f"{self.force.name} = {text}")
        right[self.place] = right[self.place] - self.force

    def paired(self, block: list[int], matrix: Matrix, right: dict[int, Term]) -> dict[int, Term]:
        """A slider and one other coordinate: solved for N > 0, and for N < 0 where that sign does not hold."""
        write, name = self.writer, self.joint.name
        s = self.place
        (o,) = (k for k in block if k != s)
        a, b, c = matrix[o, o], matrix.get((o, s), ZERO), matrix[s, s]
        first = write.let(f"b_{o}", right[o])
        second = write.let(f"b_{s}", right[s])
        slope = self.normal.get(o, ZERO)
        rest = write.let(f"rest_{name}", self.rest, whole=True)

        def equations(ratio: Term) -> tuple[Term, Term, Term]:
            coupled = write.let("coupled", b + onto(ratio, slope))
            determinant = write.let("determinant", a * c - b * coupled)
            given = write.let("given", second - ratio * rest)
            return coupled, determinant, given

        _, determinant, given = equations(self.ratio)
        other = write.let("guess", (first * c - b * given) / determinant)
        flip = write.fresh("flip")
        write.line(f"{flip} = sign_of({write.text(rest + slope * other)})")
        ratio = write.let("ratio", self.ratio * named(flip))
        coupled, determinant, given = equations(ratio)
        other = write.let(f"z_{o}", (first * c - b * given) / determinant)
        slider = write.let(f"z_{s}", (a * given - coupled * first) / determinant)
        self.force = write.let(f"rub_{name}", ratio * (rest + slope * other))
        return {o: other, s: slider}


def coupled(
    guides: Sequence[Guide], factored: Elimination, found: dict[int, Term]
) -> dict[int, Term]:
    """The unknowns with the friction of guides whose reactions depend on them; `found`: without it."""
    write = factored.writer
    found = {k: write.let(f"free_{k}", term) for k, term in found.items()}
    moved = [
        {
            k: write.let(f"by_{guide.joint.name}_{k}", term)
            for k, term in factored.solve(
                {k: -(guide.ratio * term) for k, term in guide.influence.items()}
            ).items()
        }
        for guide in guides
    ]
    flips, pushes, matrix = [], [], []
    for guide in guides:
        push = guide.rest
        for k, slope in guide.normal.items():
            push = push + slope * found[k]
        push = write.let(f"push_{guide.joint.name}", push)
        flip = write.fresh(f"flip_{guide.joint.name}")
        write.line(f"{flip} = sign_of({write.text(push)})")
        flips.append(named(flip))
        pushes.append(push)
    for g, guide in enumerate(guides):
        row = []
        for h, by in enumerate(moved):
            change = ZERO
            for k, slope in guide.normal.items():
                change = change + slope * by[k]
            row.append((ONE if g == h else ZERO) - change * flips[h])
        matrix.append(row)
    sizes = [n * flip for n, flip in zip(_solved(write, matrix, pushes), flips, strict=True)]
    for guide, size, by in zip(guides, sizes, moved, strict=True):
        size = write.let(f"size_{guide.joint.name}", size)
        guide.force = write.let(f"rub_{guide.joint.name}", guide.ratio * size)
        found = {k: term + size * by[k] for k, term in found.items()}
    return found


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
