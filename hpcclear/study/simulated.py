"""The designs that a search has simulated, and what they come to: by few simulations, and by what a surrogate says of more (as
a control variate; source: `hpcclear.study.guesses`).
"""

import math
from collections.abc import Sequence
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.scene.cases import Case, Constraint
from hpcclear.scene.domain import to_coordinates
from hpcclear.statistics.random.replicates import spread
from hpcclear.study import goals, truth
from hpcclear.study.budget import FIRST
from hpcclear.study.failures import excess_of
from hpcclear.study.guesses import Guesses
from hpcclear.study.optimisation import Choice, choices
from hpcclear.study.run import StudyRun

Asked = tuple[Array, Array]
"""Objectives and constraints of a design with standard errors, (2, k), and what replicates shift them, (k, replicates)."""

BETTER = 0.3
"""Error by long sequences over that by as many points of short ones, at least: two sequences may agree by chance."""

GROWN = 1.25
"""Times as many designs from which what the surrogate explains is estimated anew."""


class Simulated:
    """Designs of a case in their order, `choices`, with their simulations, `made`, as `hpcclear.study.truth.made` returns
    them."""

    def __init__(
        self, run: StudyRun, case: Case, guesses: Guesses, start: Sequence[Choice]
    ) -> None:
        self._run, self._case, self._guesses = run, case, guesses
        self.choices = list(start)
        self.made = [truth.nothing(run)] * len(self.choices)
        self._at = {False: dict[tuple[int, ...], Asked](), True: dict[tuple[int, ...], Asked]()}
        self._halves = dict[tuple[int, ...], Array]()
        self._guessed: dict[int, Array] = {}
        self._less = dict[tuple[int, ...], Asked]()
        self._slopes = dict[int, Array]()
        self._parts = dict[tuple[int, int, int], tuple[Array, Array]]()
        self._rungs = dict[int, int]()

    def __len__(self) -> int:
        return len(self.choices)

    @property
    def sizes(self) -> Array:
        """Points of each replicate of each design, (n,)."""
        return np.array([one.shape[2] for one in self.made])

    def add(self, points: Array) -> list[int]:
        """Numbers of new designs at sampling coordinates, (n, d)."""
        fresh = choices(self._run, self._case.name, points)
        self.choices += fresh
        self.made += [truth.nothing(self._run)] * len(fresh)
        return list(range(len(self.choices) - len(fresh), len(self.choices)))

    def take(self, row: int, values: Array) -> None:
        """Further simulations of a design, (k, replicates, n)."""
        self.made[row] = np.concatenate([self.made[row], values], axis=2)
        self._rungs.clear()

    def places(self, bounds: Array) -> Array:
        """Sampling coordinates of all designs, (n, d), within bounds, (d, 2), but for round-off."""
        names = self._run.study.design_variables(self._case.name)
        designs = np.array([list(one.design.values()) for one in self.choices])
        return np.clip(to_coordinates(self._run.scene, names, designs), *bounds.T)

    def known(self) -> Array:
        """What all designs come to, and standard errors, (n, 2, k), with the bias of as many simulations as the longest has."""
        sizes = self.sizes
        found = np.array([self.of(row, length)[0] for row, length in enumerate(sizes)])
        found[:, 0] -= self._bias() * (1.0 / sizes - 1.0 / sizes.max())[:, None]
        return found

    def _bias(self) -> Array:
        """Bias of values over the inverse number of points, (k,). It is seen in the later halves of long designs, since what is
        lengthened was chosen for its first points."""
        steps = []
        for row in np.flatnonzero(self.sizes >= 4 * FIRST).tolist():
            size = int(self.sizes[row])
            for begin in range(size // 2, size, 2 * FIRST):
                middle, end = begin + FIRST, begin + 2 * FIRST
                halves = self.of(row, middle, begin)[0][0] + self.of(row, end, middle)[0][0]
                steps.append(halves / 2.0 - self.of(row, end, begin)[0][0])
        there = np.isfinite(steps)
        total = np.where(there, steps, 0.0).sum(axis=0) / np.maximum(there.sum(axis=0), 1)
        return 2.0 * FIRST * total

    def error(self, row: int, direction: Array) -> float:
        """Standard error of a design in a direction of the objectives; infinite of one that failed."""
        shifts = self.of(row, self.made[row].shape[2])[1][: len(direction)]
        return float(np.nan_to_num(spread((direction @ shifts)[None]), nan=np.inf)[0])

    def shifts(self) -> Array:
        """By how much each replicate shifts what all designs come to, (k, n, replicates)."""
        each = [self.of(row, length)[1] for row, length in enumerate(self.sizes)]
        return np.moveaxis(np.array(each), 1, 0)

    def of(self, row: int, end: int, begin: int = 0) -> Asked:
        """A design by some points of each replicate, less what the surrogate says that more points would change."""
        length = end - begin
        key = row, begin, end, self._rung(1), self._rung(length)
        if key not in self._less:
            (found, shifts), slopes = self._asked(row, end, begin), self._explained()
            left, better = self._left(length, slopes)
            errors = found[1] - (1.0 - left) * spread(shifts)
            value = found[0]
            if self._guesses:
                guess = partial(self._asked, row, guessed=True)
                (few, its), (many, their) = guess(end, begin), guess(self._guesses.length)
                value = value - slopes * (few - many)[0]
                shifts = shifts - slopes[:, None] * (its - their)
            self._less[key] = np.array([value, errors]), better[:, None] * shifts
        return self._less[key]

    def _rung(self, length: int) -> int:
        """How many designs have so many points of each replicate, in steps of `GROWN`."""
        if length not in self._rungs:
            count = int((self.sizes >= length).sum())
            self._rungs[length] = int(math.log(count) / math.log(GROWN))
        return self._rungs[length]

    def _left(self, length: int, slopes: Array) -> tuple[Array, Array]:
        """Part of the errors by so many points that is left of those by as many of short sequences, and the same of what the
        surrogate does not explain, (k,) each. Both are estimated from all designs together, because the replicates of one
        design are too few for it."""
        key = length, self._rung(1), self._rung(length)
        if key not in self._parts:
            own, nets = (left, halves) = self._shifts(length, length), self._apart(length, length)
            if self._guesses:
                more = length, self._guesses.length
                its, their = (self._shifts(length, n, True) for n in more)
                left = own - slopes[:, None] * (its - their)
                its, their = (self._apart(length, n, True) for n in more)
                nets = halves - slopes * (its - their)
            of_own, of_left, of_nets = *map(_sizes, (own, left)), np.linalg.norm(nets, axis=0)
            better = np.clip(of_nets / np.where(of_left > 0.0, of_left, np.inf), BETTER, 1.0)
            self._parts[key] = better * of_left / np.where(of_own > 0.0, of_own, np.inf), better
        return self._parts[key]

    def _explained(self) -> Array:
        """How much of what the surrogate shifts is also in the simulations, by the first points of all designs, (k,)."""
        key = self._rung(1)
        if key not in self._slopes:
            ours = self._shifts(1, FIRST)
            theirs = self._shifts(1, FIRST, guessed=True) if self._guesses else np.zeros_like(ours)
            squares = (theirs**2).sum(axis=(0, 2))
            both = (ours * theirs).sum(axis=(0, 2))
            self._slopes[key] = both / np.where(squares > 0.0, squares, np.inf)
        return self._slopes[key]

    def _shifts(self, least: int, length: int, guessed: bool = False) -> Array:
        """Shifts of all designs that have so many points of each replicate at least, 0 of those that failed."""
        rows = np.flatnonzero(self.sizes >= least).tolist()
        return np.nan_to_num([self._asked(k, length, guessed=guessed)[1] for k in rows])

    def _apart(self, least: int, length: int, guessed: bool = False) -> Array:
        """Half of what the two sequences of the same designs say differently, (designs, k)."""
        rows = np.flatnonzero(self.sizes >= least).tolist()
        return np.nan_to_num([self._half(k, length, guessed) for k in rows])

    def _half(self, row: int, length: int, guessed: bool) -> Array:
        """The same of one design, (k,): of probabilities by what their parts shift, for one sequence alone shows few."""
        key = guessed, row, length
        if key not in self._halves:
            shifts = self._asked(row, length, guessed=guessed)[1]
            made = (self._guessed if guessed else self.made)[row][..., :length]
            found = shifts.reshape(len(shifts), truth.NETS, -1).mean(axis=2)
            for k, goal in enumerate((*self._case.goals, *self._case.kept)):
                if goal.statistic in ("mean", "deviation", "quantile"):
                    parts = made[goal.place].reshape(truth.NETS, -1)
                    size = (abs(goal.most) or 1.0) if isinstance(goal, Constraint) else 1.0
                    found[k] = goals.guessed(goal, parts, {}) / size
            self._halves[key] = (found[:, 0] - found[:, 1]) / 2.0
        return self._halves[key]

    def _asked(self, row: int, end: int, begin: int = 0, guessed: bool = False) -> Asked:
        """A design by some points of each replicate, simulated or by the surrogate."""
        kept, choice = self._at[guessed], self.choices[row]
        if (row, begin, end) not in kept:
            if guessed and row not in self._guessed:
                self._guessed[row] = self._guesses.of(choice, self._guesses.length)
            made = (self._guessed if guessed else self.made)[row][..., begin:end]
            asked, design = self._case.goals, choice.design
            values = [goals.goal_value(goal, made, design, 0.95) for goal in asked]
            rows = [(one.value, one.error, one.shifts) for one in values]
            rows += [excess_of(goal, made, design) for goal in self._case.kept]
            found = np.array([one[:2] for one in rows]).T
            kept[row, begin, end] = found, np.array([one[2] for one in rows])
        return kept[row, begin, end]


def _sizes(shifts: Array) -> Array:
    """Standard errors of all designs together, of what parts shift, (designs, k, parts) to (k,)."""
    each = [spread(one) for one in np.moveaxis(shifts, 1, 0)]
    return np.asarray(np.linalg.norm(each, axis=1))
