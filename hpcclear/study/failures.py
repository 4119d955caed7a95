"""Probabilities of failure of the designs of a search, as reliability indices that a model can follow.

Where few or none of a design's simulations fail its index comes from the largest values of f
(`hpcclear.statistics.random.tail`). Designs near the threshold get further draws, most of them where such designs fail
(`hpcclear.statistics.random.importance`): a hundred show a probability of 1e-4 to a fifth of itself. They steer the search and
decide nothing.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import bdtrc, ndtri

from hpcclear.base.arrays import Array
from hpcclear.scene.cases import Case, Constraint
from hpcclear.scene.stages import REPLICATES
from hpcclear.scene.study import Study
from hpcclear.statistics.random import importance
from hpcclear.statistics.random.importance import Density
from hpcclear.statistics.random.replicates import FEWEST, spread
from hpcclear.statistics.random.tail import of_share
from hpcclear.study import goals, rare
from hpcclear.study.optimisation import Choice
from hpcclear.study.run import StudyRun

PLENTY = 0.2
"""Probability that plain samples show as well as weighted ones."""

CLOSE, FEW, PILOT, ENOUGH = 1.0, 8, 256, 4
"""Indices from the threshold within which designs get weighted draws; these of each repeat; draws of each level of their pilot;
failures for each random input from which a density is fitted anew."""

MISSED = 1e-4
"""Chance of as many failures in plain simulations as there are, by the weighted draws, below which these are not believed."""

HITS, FAR, BEYOND = 3, 4.0, 0.1
"""Failures from which on their share is an index, else the largest values are; shortfall of an index beyond which the order
counts alone; standard error of an index from the largest values, as much again for each unit that it lies beyond them all."""


def failures_of(study: Study, case: Case) -> list[Constraint]:
    """Probabilities of a case that get weighted draws."""
    if study.verification.draws is not None:
        return []
    return [one for one in case.kept if one.statistic == "exceedance" and 0.0 < one.most < PLENTY]


class WeightedDraws(NamedTuple):
    """Weighted draws of a design for one of its constraints: standard normals (n, inputs), weights of those that fail (n,)."""

    constraint: int
    u: Array
    weights: Array


class Failures:
    """Weighted draws of the designs of a case for its probabilities of failure, `goals`.

    `densities`: what is drawn from for each of them, once they are prepared; `drawn`: draws of designs by their numbers.
    """

    def __init__(self, run: StudyRun, case: Case, rng: np.random.Generator) -> None:
        self._run, self._rng, self._inputs = run, rng, len(case.random)
        self.goals, self.densities = failures_of(run.study, case), list[Density]()
        self.drawn: dict[int, list[WeightedDraws]] = {}

    def prepare(self, choice: Choice) -> None:
        """Find the densities of the failures of a design of which nothing is known."""
        for goal in self.goals:
            assert goal.limit is not None  # by validation
            sizes = 0.05 * goal.most, PILOT
            pilot = importance.pilot(self._inputs, goal.limit, self._rng, *sizes)
            asked = [rare.Failing(choice, goal)]
            self.densities += rare.answer(self._run, asked, [pilot], "search")

    def draw(self, choices: Sequence[Choice], rows: Sequence[int], length: int) -> None:
        """Take so many weighted draws of each repeat of some designs: the same of all."""
        for k, goal in enumerate(self.goals if rows else ()):
            u = self.densities[k].draw(length * importance.REPEATS, self._rng)
            weights, where = self.densities[k].weights(u), [(choices[row], u) for row in rows]
            for row, values in zip(rows, rare.simulated(self._run, where, "search"), strict=True):
                failing = values[max(goal.place - 1, 0)] > goal.limit
                block = WeightedDraws(k, u, np.where(failing, weights, 0.0))
                self.drawn.setdefault(row, []).append(block)
            self.densities[k] = self._renewed(k)

    def drawn_of(self, row: int) -> int:
        """Draws of each repeat that a design has for each constraint."""
        own = self.drawn[row]
        return sum(len(one.u) for one in own) // (len(self.goals) * importance.REPEATS)

    def excess(
        self, row: int, k: int, value: float, error: float, made: Array | None = None
    ) -> tuple[float, float]:
        """`excess_of` a design by its weighted draws. The given value and error where no draw fails, or where so many of the
        plain simulations `made` do that the density misses a way to fail."""
        own = [one.weights for one in self.drawn[row] if one.constraint == k]
        each = np.hstack([one.reshape(importance.REPEATS, -1) for one in own]).mean(axis=1)
        share, goal = float(each.mean()), self.goals[k]
        if not 0.0 < share < 1.0:
            return value, error
        if made is not None:
            f = made[goal.place][np.isfinite(made[goal.place])]
            failing = int((f > goal.limit).sum())
            if failing >= HITS and bdtrc(failing - 1, len(f), share) < MISSED:
                return value, error
        return _index_of(goal, share, float(spread((each - share)[None])[0]))

    def _renewed(self, k: int) -> Density:
        """The density of the failures of all designs near the threshold, each as important, if there are enough."""
        found = list[tuple[Array, Array]]()
        for row, its in self.drawn.items():
            if abs(self.excess(row, k, FAR, 0.0)[0]) < CLOSE:
                own = [one for one in its if one.constraint == k]
                u, weights = (np.concatenate([one[n] for one in own]) for n in (1, 2))
                found.append((u[weights > 0.0], weights[weights > 0.0] / weights.sum()))
        if sum(len(u) for u, _ in found) < ENOUGH * self._inputs:
            return self.densities[k]
        return importance.fitted(*(np.concatenate(part) for part in zip(*found, strict=True)))


class Excess(NamedTuple):
    """By how much a constraint is broken, its standard error, and what each replicate shifts it, (r,)."""

    value: float
    error: float
    shifts: Array


def excess_of(goal: Constraint, made: Array, design: Mapping[str, float]) -> Excess:
    """By how much a design breaks a constraint by its simulations, (responses, replicates, n): relative to the threshold, or
    of a probability in reliability indices."""
    one = goals.goal_value(goal, made, design, 0.95)
    if goal.statistic != "exceedance":
        scale = abs(goal.most) or 1.0
        shifts = one.shifts / scale
        return Excess((one.value - goal.most) / scale, float(spread(shifts[None])[0]), shifts)
    f = made[goal.place][np.isfinite(made[goal.place])]
    part = len(f) // REPLICATES
    if part < 1 or len(f) < FEWEST:
        return Excess(np.nan, np.nan, np.full(REPLICATES, np.nan))
    if HITS <= (f > goal.limit).sum() <= len(f) - HITS:
        value, error = _index_of(goal, one.value, own := one.error)
        return Excess(value, error, one.shifts * (error / own if own > 0.0 else 0.0))
    parts = f[: part * REPLICATES].reshape(REPLICATES, part)
    without = np.array([np.delete(parts, k, axis=0).ravel() for k in range(REPLICATES)])
    value = float(goals.shortfall(goal, goal.most, f[None])[0])
    each = goals.shortfall(goal, goal.most, without)
    shifts = (REPLICATES - 1) * (each.mean() - each)  # jackknife
    beyond = max(of_share(goal.most) - value + float(ndtri(1.0 / len(f))), 0.0)
    value = min(value, FAR * (1.0 + np.log(max(value / FAR, 1.0))))  # far off: which way is better
    error = float(spread(shifts[None])[0]) + BEYOND * (1.0 + beyond)
    return Excess(max(float(value), -FAR), error, shifts)


def _index_of(goal: Constraint, share: float, error: float) -> tuple[float, float]:
    """By how much the reliability index of a probability falls short of what a constraint needs, and its standard error."""
    index = of_share(share)
    density = np.exp(-0.5 * index**2) / np.sqrt(2.0 * np.pi)
    return of_share(goal.most) - index, max(float(error / max(density, 1e-300)), 1e-3)
