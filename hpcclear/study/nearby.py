"""Probabilities of failure over the designs next to one, from draws of designs and random inputs together.

Designs are drawn in a region about one, and a few random inputs of each, most of them where designs of the region fail
(`hpcclear.statistics.random.importance`). Together they show the reliability index all over the region
(`hpcclear.statistics.random.indices`) for the price of one design.
"""

import copy
from collections.abc import Callable, Generator, Sequence

import numpy as np

from hpcclear.base.arrays import Array, Booleans
from hpcclear.scene.cases import Case, Constraint
from hpcclear.scene.points import snapped
from hpcclear.statistics.random import importance, indices
from hpcclear.statistics.random.importance import Density
from hpcclear.statistics.random.tail import of_share
from hpcclear.study import rare, tried
from hpcclear.study.run import StudyRun

DESIGNS, CANDIDATES = 64, 1024
"""Designs of a region, and places that they are chosen of."""

REACH = 0.5
"""Indices from the edge within which these are, unless too few would be."""

FEWEST = 4
"""Failures for each random input, from which a density is fitted to them anew."""


Predict = Callable[[Array], Array]


def simulations(draws: Sequence[int], turns: int) -> int:
    """Simulations for a constraint in so many regions, at most, with so many draws of each design in the first ones and in
    all that follow."""
    regions = sum(draws) + (turns - len(draws)) * draws[-1]
    return importance.LEVELS * importance.PILOT + regions * DESIGNS


class Band:
    """The places of a region that are next to the edge, as far as is known.

    Parameters
    ----------
    region : array, shape (d, 2)
    guess : function
        By how much indices fall short, (n, d) to (n,).
    """

    def __init__(self, region: Array, guess: Predict, rng: np.random.Generator) -> None:
        self._region, self._guess = region, guess
        away = np.sort(abs(guess(self._drawn(rng))))
        self._reach = max(REACH, float(away[2 * DESIGNS]))
        self._size = float((away <= self._reach).mean()) * float(
            np.prod(np.maximum(np.diff(region, axis=1), 1e-12))
        )

    def draw(self, rng: np.random.Generator) -> Array:
        """`DESIGNS` places, (n, d)."""
        places = self._drawn(rng)
        near = np.argsort(abs(self._guess(places)) > self._reach, kind="stable")
        return places[near[:DESIGNS]]

    def density(self, places: Array) -> Array:
        """Density of the places drawn, (n, d) to (n,)."""
        inside = _within(places, self._region) & (abs(self._guess(places)) <= self._reach)
        return np.asarray(inside / self._size)

    def _drawn(self, rng: np.random.Generator) -> Array:
        unit = rng.random((CANDIDATES, len(self._region)))
        return np.asarray(self._region[:, 0] + unit * np.diff(self._region, axis=1)[:, 0])


class Nearby:
    """Draws of designs and random inputs of a case whose constraints are probabilities of failure.

    Parameters
    ----------
    bounds : array, shape (d, 2)
        Of design variables, in sampling coordinates.
    """

    def __init__(self, run: StudyRun, case: Case, bounds: Array, rng: np.random.Generator) -> None:
        self._run, self._case, self._bounds, self._rng = run, case, bounds, rng
        self._names = run.study.design_variables(case.name)
        self._goals: list[Constraint] = [goal for goal in case.kept if not goal.exact]
        self._drawn: list[tuple[Band, Density, int]] = []
        self._densities: list[Density] = []
        self._models: list[Predict] = []
        self._at, self.places = np.empty((2, 0, len(bounds)))
        self._u = np.empty((0, len(case.random)))
        self._f = np.empty((1 + len(run.study.further), 0))
        self.region = self._used = bounds
        self._centre = bounds.mean(axis=1)

    def draw(self, centre: Array, reach: float, guess: Predict, draws: int) -> None:
        """Draw designs about one, (d,), up to a part of each range away and as near the edge as `guess` knows, which is as
        `shortfall`; and simulate `draws` of each for each constraint."""
        away = reach * (self._bounds[:, 1] - self._bounds[:, 0])
        region = np.column_stack([centre - away, centre + away])
        region = np.clip(region, self._bounds[:, :1], self._bounds[:, 1:])
        band = Band(region, guess, self._rng)
        if not self._densities:
            self._densities = [self._prepared(goal, band) for goal in self._goals]
        else:
            self._densities = [
                self._renewed(goal, density)
                for goal, density in zip(self._goals, self._densities, strict=True)
            ]
        for density in self._densities:
            u = density.draw(DESIGNS * draws, self._rng)
            at, places, f = self._simulated(band, u)
            self._drawn.append((band, density, draws))
            self._at = np.concatenate([self._at, at])
            self.places = np.concatenate([self.places, places])
            self._u, self._f = np.concatenate([self._u, u]), np.concatenate([self._f, f], axis=1)
        self.region, self._centre = region, centre
        self._used = np.column_stack([centre - 2.0 * away, centre + 2.0 * away])
        self._models = []
        for goal in self._goals:
            places, _, failing = self._known(goal)
            self._models.append(indices.fitted(self._scaled(places), failing, goal.most))

    def shortfall(self, points: Array) -> Array:
        """By how much indices fall short of what the constraints need, the worst of them, (n, d) to (n,); at most 0 where
        all are kept."""
        scaled = self._scaled(points)
        each = [
            of_share(goal.most) - one(scaled)
            for goal, one in zip(self._goals, self._models, strict=True)
        ]
        return np.asarray(np.max(each, axis=0))

    def at_end(self, place: Array) -> bool:
        """Whether a design, (d,), lies at an end of the last region, beyond which there is more."""
        near = abs(place[:, None] - self.region) < 0.02 * np.diff(self.region, axis=1)
        return bool((near & (self.region != self._bounds)).any())

    def error(self, draws: int) -> float:
        """Relative standard error of a probability of failure in the last region by so many draws of its density, the largest
        over the constraints."""
        found = []
        for goal, density in zip(self._goals, self._densities, strict=True):
            _, u, failing = self._known(goal)
            squares = (
                len(u) * (failing * density.weights(u)).sum()
            )  # of weights by that density, as failing weighs draws
            found.append(squares / failing.sum() ** 2 - 1.0 if failing.any() else np.inf)
        return float(np.sqrt(max(max(found), 0.0) / draws))

    def fixed(self) -> Predict:
        """`shortfall` as it is now, whatever is drawn later."""
        return copy.copy(self).shortfall

    def _scaled(self, points: Array) -> Array:
        return np.asarray((points - self._centre) / (self._bounds[:, 1] - self._bounds[:, 0]))

    def _known(self, goal: Constraint) -> tuple[Array, Array, Array]:
        """Designs in the last region, random inputs, and weights of those that fail, else 0, of draws that are known."""
        assert goal.limit is not None  # by validation
        f = self._f[max(goal.place - 1, 0)]
        rows = np.isfinite(f) & _within(self._at, self._used)
        at, u = self._at[rows], self._u[rows]
        share, ratio = np.zeros((2, len(at)))
        for band, density, count in self._drawn:  # each place has draws of several densities
            part = count * band.density(at)
            share += part
            ratio += part / density.weights(u)
        failing = (f[rows] > goal.limit) & (ratio > 0.0)
        return self.places[rows], u, np.where(failing, share / np.maximum(ratio, 1e-300), 0.0)

    def _renewed(self, goal: Constraint, before: Density) -> Density:
        """The density of failures in the region, if there are enough."""
        _, u, failing = self._known(goal)
        fails = failing > 0.0
        if fails.sum() < FEWEST * u.shape[1]:
            return before
        return importance.fitted(u[fails], failing[fails])

    def _prepared(self, goal: Constraint, band: Band) -> Density:
        """The density of failures in a band of which nothing is known."""
        assert goal.limit is not None  # by validation
        going = importance.pilot(len(self._case.random), goal.limit, self._rng, 0.05 * goal.most)
        return _answered(going, lambda u: self._simulated(band, u)[2][max(goal.place - 1, 0)])

    def _simulated(self, band: Band, u: Array) -> tuple[Array, Array, Array]:
        """For random inputs, (n, k): places in a band, (n, d), the designs next to them, and responses of these, (k, n)."""
        at = band.draw(self._rng)
        places = snapped(self._run.study, self._names, at)
        choices = tried.choices(self._run, self._case.name, places)
        asked = list(zip(choices, np.split(u, DESIGNS), strict=True))
        f = np.concatenate(rare.simulated(self._run, asked, "edge"), axis=1)
        many = len(u) // DESIGNS
        return np.repeat(at, many, axis=0), np.repeat(places, many, axis=0), f


def _answered(going: Generator[Array, Array, Density], f: Predict) -> Density:
    """What a procedure returns that requests values of a function."""
    try:
        u = next(going)
        while True:
            u = going.send(f(u))
    except StopIteration as end:
        return end.value


def _within(places: Array, region: Array) -> Booleans:
    """Which places lie in a region, (n,)."""
    return np.asarray(((places >= region[:, 0]) & (places <= region[:, 1])).all(axis=1))
