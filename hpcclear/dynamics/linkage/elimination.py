"""Symmetric linear equations solved once, in terms: blocks apart, one and two by hand, more by L D L' in least-degree order.

Multipliers follow the coordinates that they hold: their pivots are -J M^-1 J', which vanishes at true singularities only.
A free linkage gets through these by its inertia: see `elements.held_inverse`.
"""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence

from hpcclear.base.terms import ONE, ZERO, Term
from hpcclear.dynamics.linkage.expression import Writer

Matrix = dict[tuple[int, int], Term]
Vector = dict[int, Term]


def blocks(
    unknowns: Iterable[int], matrix: Matrix, ties: Collection[tuple[int, int]] = ()
) -> list[list[int]]:
    """Which unknowns depend on one another, in their order; `ties`: further pairs that do."""
    left, found = list(unknowns), []
    while left:
        block, waiting = [], [left[0]]
        while waiting:
            here = waiting.pop()
            if here in left:
                left.remove(here)
                block.append(here)
                tied = [k for k in left if (here, k) in ties or (k, here) in ties]
                waiting += [k for k in left if matrix.get((here, k), ZERO) or k in tied]
        found.append(sorted(block))
    return found


class Elimination:
    """The equations of one block, factored; `solve` takes right-hand sides.

    `matrix` has entries (i, j), both halves, none where they are zero. The coordinates come first in the `block`; its last
    `held` unknowns are multipliers. `inverse`: a term's reciprocal, as a parameter where there is one. `passed`: multipliers
    whose pivots are kept from vanishing, each with the multipliers of its joint.
    """

    def __init__(
        self, writer: Writer, matrix: Matrix, block: list[int], held: int,
        inverse: Callable[[Term], Term | None], passed: Mapping[int, Sequence[int]],
    ) -> None:  # fmt: skip
        self.writer = writer
        self.block = block
        self.inverse = inverse
        self.passed = passed
        places = [(i, j) for i in block for j in block if i <= j and matrix.get((i, j), ZERO)]
        self.entries = {(i, j): writer.let(f"k_{i}_{j}", matrix[i, j]) for i, j in places}
        self.small = len(block) <= 2 and not held
        self.pivots: list[tuple[int, Term, dict[int, Term], dict[int, Term]]] = []
        if self.small and len(block) == 2:
            one, two = block
            a, b, c = self.at(one, one), self.at(one, two), self.at(two, two)
            self._pair = writer.let("inverse", ONE / (a * c - b * b))
        elif not self.small:
            self._factor(block[: len(block) - held], block[len(block) - held :])

    def at(self, i: int, j: int) -> Term:
        """Entry of the matrix."""
        return self.entries.get((min(i, j), max(i, j)), ZERO)

    def _factor(self, coordinates: list[int], multipliers: list[int]) -> None:
        """Pivots, with the fewest neighbours first: the coordinates, then the multipliers."""
        work = dict(self.entries)

        def neighbours(p: int) -> list[int]:
            return [k for k in left if k != p and work.get((min(k, p), max(k, p)), ZERO)]

        left = [*coordinates, *multipliers]
        scales: dict[int, Term] = {}
        for group in (coordinates, multipliers):
            group = list(group)
            if group and group == multipliers:
                scales = self._scales(work)
            while group:
                pivot = min(group, key=lambda p: (len(neighbours(p)), p))
                group.remove(pivot)
                near = neighbours(pivot)
                left.remove(pivot)
                diagonal = work[pivot, pivot]
                inverse = self._inverse(pivot, diagonal, scales.get(pivot))
                row = {k: work[min(k, pivot), max(k, pivot)] for k in near}
                scaled = {k: self.writer.let(f"l_{k}_{pivot}", row[k] * inverse) for k in near}
                for i in near:
                    for j in near:
                        if i <= j:
                            value = work.get((i, j), ZERO) - scaled[i] * row[j]
                            work[i, j] = self.writer.let(f"k_{i}_{j}", value)
                self.pivots.append((pivot, inverse, row, scaled))

    def _scales(self, work: Matrix) -> dict[int, Term]:
        """What each pivot that may vanish is compared with: the sum of its joint's, before any of them is taken."""
        return {
            pivot: self.writer.let(f"scale_{joint[0]}", sum((work[k, k] for k in joint), ZERO))
            for pivot, joint in self.passed.items()
        }

    def _inverse(self, pivot: int, diagonal: Term, scale: Term | None) -> Term:
        if scale is not None:
            (held,) = self.writer.call("held_inverse", (diagonal, scale), (f"inverse_{pivot}",))
            return held
        known = self.inverse(diagonal)
        return self.writer.let(f"inverse_{pivot}", ONE / diagonal) if known is None else known

    def solve(self, right: Vector) -> Vector:
        """The unknowns for one right-hand side, as terms that still have to be named."""
        if self.small:
            return self._small(right)
        b = {k: self.writer.let(f"b_{k}", right.get(k, ZERO)) for k in self.block}
        for pivot, _, _, scaled in self.pivots:
            for k, factor in scaled.items():
                b[k] = self.writer.let(f"b_{k}", b[k] - factor * b[pivot])
        found: Vector = {}
        for pivot, inverse, row, _ in reversed(self.pivots):
            value = b[pivot]
            for k, entry in row.items():
                value = value - entry * found[k]
            found[pivot] = self.writer.let(f"z_{pivot}", value * inverse)
        return found

    def _small(self, right: Vector) -> Vector:
        b = {k: right.get(k, ZERO) for k in self.block}
        if len(self.block) == 1:
            (one,) = self.block
            diagonal = self.at(one, one)
            inverse = self.inverse(diagonal)
            if inverse is None and self.writer.hoist and diagonal.fixed:
                inverse = ONE / diagonal
            return {one: b[one] / diagonal if inverse is None else b[one] * inverse}
        one, two = self.block
        b = {k: self.writer.let(f"b_{k}", term) for k, term in b.items()}
        a11, a12, a22 = self.at(one, one), self.at(one, two), self.at(two, two)
        return {
            one: (b[one] * a22 - a12 * b[two]) * self._pair,
            two: (a11 * b[two] - a12 * b[one]) * self._pair,
        }
