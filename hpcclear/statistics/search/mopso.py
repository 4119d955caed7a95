"""Multi-objective particle swarm (the paper's eqs. 22-23) with an archive of the best designs.

The swarm is the paper's: learning factors c1 = c2 = 1.8, inertia weight falling linearly from 1.2
to 0.1, r1 and r2 one random number each per particle. What the paper leaves open is fixed here, one
setting for all problems:

- **Archive**: the feasible non-dominated points met, thinned where crowded (`pareto.Archive`).
- **Leaders** (P_g): tournaments of `tournament` archive members; the loneliest one wins.
- **Personal best** (P): the newest point, unless the old one dominates or equals it.
- **Bounds**: speeds clipped at `speed_limit` of each range; a particle that leaves is put on the
  bound and that component of its velocity is reversed.
- **Mutation** (an addition: the paper's text does without): on average `mutation_share` of the
  particles continue from a child of two archive members (the leader and another, coordinates
  mixed at random) with polynomial mutation (Deb & Goyal 1996) in one coordinate on average. Their
  velocity is kept. It keeps the swarm from collapsing to one point and pays off most with many
  variables; `mutation_share=0` leaves eqs. 22-23 alone.
- **Constraints** (Deb 2000, doi:10.1016/S0045-7825(99)00389-8): feasible beats infeasible, among
  infeasible points the smaller total violation wins. A point whose objectives are not all finite
  is infeasible, without limit if no violation was given. Only feasible points enter the archive.
  Once one was broken the feasible region may be thin or in pieces, which flying past it misses, and the front
  may lie on its borders: then `BROKEN_SHARE` of the particles continue from children, of which `BROKEN_ANEW` get
  one coordinate anew from its whole range. Half of them are made by simulated binary crossover, half by steps along the front
  (`children`); before any feasible point is known, as without constraints, of the least violating. Leaders and parents are as
  many members of the archive as there are particles (`Archive.elite`); the one that the front would lose most without wins.
- **Front**: the archive cut to the size asked for (`pareto.cut`; `pareto.best_subset` where constraints were broken).

All objectives are minimised. Positions live in the unit cube, so variables may differ in scale.
"""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.statistics.search import children
from hpcclear.statistics.search import generator_state as rng_state
from hpcclear.statistics.search.pareto import (
    Archive,
    Front,
    best_subset,
    cut,
    hypervolume,
    relative_gain,
)
from hpcclear.statistics.search.settings import SwarmSettings, checked_bounds, whole

_SETTLED = 1e-3  # relative hypervolume gain over the last tenth of the iterations
BROKEN_SHARE = 0.85
"""Share of the particles that continue from children where constraints were broken, if any do."""
BROKEN_ANEW = 0.3
"""Share of these children that get a coordinate anew."""

_ARRAYS = (
    "positions",
    "velocities",
    "personal_positions",
    "personal_values",
    "personal_violations",
    "earlier_values",
    "history",
    "lower",
    "upper",
    "reference",
)
_COUNTS = ("iterations", "iteration", "evaluations", "failed", "infeasible")


class ParticleSwarm:
    """A particle swarm that asks for points to evaluate and is told their objectives.

    Parameters
    ----------
    bounds : array_like, shape (d, 2)
        Lower and upper bound of each variable.
    iterations : int
        Number of `tell` calls; sets the slope of the inertia weight (k_max of eq. 23).
    rng : numpy.random.Generator
        Owned by the swarm from here on.
    settings : SwarmSettings, optional
    start : array_like, shape (k, d), optional
        Known designs that replace the first k random particles.
    reference : array_like, shape (m,), optional
        Reference point of the hypervolume in `history`; without it no history is kept.

    Raises
    ------
    InputError
        For bounds that are not finite or cross, or start points outside them.
    """

    def __init__(
        self,
        bounds: ArrayLike,
        iterations: int,
        rng: np.random.Generator,
        *,
        settings: SwarmSettings | None = None,
        start: ArrayLike | None = None,
        reference: ArrayLike | None = None,
    ) -> None:
        whole("iterations", iterations)
        self.settings = SwarmSettings() if settings is None else settings
        self._lower, self._upper = checked_bounds(bounds)
        self.iterations = int(iterations)
        self.iteration = 0
        self.evaluations = self.failed = self.infeasible = 0
        self._rng = rng
        self._reference = (
            np.empty(0) if reference is None else np.atleast_1d(np.array(reference, dtype=float))
        )
        shape = (self.settings.particles, len(self._lower))
        self._positions: Array = rng.random(shape)
        if start is not None:
            self._place(np.array(start, dtype=float))
        self._velocities: Array = np.zeros(shape)
        self._personal_positions: Array = self._positions.copy()
        self._personal_values: Array = np.empty((shape[0], 0))
        self._personal_violations: Array = np.full(shape[0], np.inf)
        self._archive = Archive(
            self.settings.archive_capacity, np.empty((0, shape[1])), np.empty((0, 0))
        )
        self._earlier_values: Array = np.empty((0, 0))
        self._history: Array = np.empty(0)

    @property
    def done(self) -> bool:
        """Whether all iterations have been told."""
        return self.iteration >= self.iterations

    def ask(self) -> Array:
        """Points to evaluate, shape (particles, d); the same ones until `tell` is called."""
        return self._points(self._positions)

    def tell(self, values: ArrayLike, violations: ArrayLike | None = None) -> None:
        """Take the objectives of the points asked for and move the swarm on.

        Parameters
        ----------
        values : array_like, shape (n, m)
            Objectives, minimised; a row with a number that is not finite is infeasible.
        violations : array_like, shape (n,) or (n, c), optional
            Constraint violations, > 0 where broken; c constraints are summed. NaN is infinite.

        Raises
        ------
        InputError
            For wrong shapes, or when all iterations are done.
        """
        if self.done:
            raise InputError(
                "iterations",
                self.iterations,
                "the swarm has had all its iterations",
                "Start another one with start=front.points.",
            )
        told, total = self._checked(values, violations)
        self._remember(told, total)
        feasible = total == 0.0
        self._archive.add(self._positions[feasible], told[feasible])
        self.iteration += 1
        if len(self._reference):
            grown = hypervolume(self._archive.values, self._reference)
            self._history = np.append(self._history, grown)
        if self.iteration == self.iterations - max(1, self.iterations // 10):
            self._earlier_values = self._archive.values.copy()
        if not self.done:
            self._move()

    def front(self, size: int = 100) -> Front:
        """The best points so far, at most `size` (not below the number of objectives)."""
        objectives = self._archive.values.shape[1]
        if size < max(1, objectives):
            raise InputError("size", size, f"a front of {objectives} objectives", "Ask for more.")
        kept = (best_subset if self.infeasible else cut)(self._archive.values, size)
        if len(kept):
            kept = kept[np.lexsort(self._archive.values[kept].T[::-1])]
        gain = self._gain()
        return Front(
            points=self._points(self._archive.positions[kept]),
            values=self._archive.values[kept],
            evaluations=self.evaluations,
            failed=self.failed,
            infeasible=self.infeasible,
            history=self._history.copy(),
            gain=gain,
            settled=bool(self.done and gain < _SETTLED),
            remark=self._remark(gain),
        )

    def state(self) -> dict[str, np.ndarray]:
        """Everything the swarm knows, random generator included, as plain arrays (no objects)."""
        state = {name: getattr(self, f"_{name}").copy() for name in _ARRAYS}
        state["archive_positions"] = self._archive.positions.copy()
        state["archive_values"] = self._archive.values.copy()
        state["counts"] = np.array([getattr(self, name) for name in _COUNTS], dtype=np.int64)
        state["settings"] = np.array([float(value) for value in asdict(self.settings).values()])
        state["generator"] = rng_state.to_array(self._rng)
        return state

    @classmethod
    def from_state(cls, state: Mapping[str, np.ndarray]) -> Self:
        """A swarm that goes on, bit for bit, where the one that gave `state` stood."""
        names = {*_ARRAYS, "archive_positions", "archive_values", "counts", "settings", "generator"}
        if names - set(state):
            found = sorted(state)
            raise InputError(
                "swarm state", found, "entries missing", "Save all of ParticleSwarm.state()."
            )
        swarm = cls.__new__(cls)  # the constructor would draw from the generator
        swarm._rng = rng_state.from_array(state["generator"])
        kinds = [type(value) for value in asdict(SwarmSettings()).values()]
        told = zip(kinds, state["settings"], strict=True)
        swarm.settings = SwarmSettings(*(kind(value) for kind, value in told))
        for name, count in zip(_COUNTS, state["counts"], strict=True):
            setattr(swarm, name, int(count))
        for name in _ARRAYS:
            setattr(swarm, f"_{name}", np.array(state[name], dtype=float))
        swarm._archive = Archive(
            swarm.settings.archive_capacity,
            np.array(state["archive_positions"], dtype=float),
            np.array(state["archive_values"], dtype=float),
        )
        shape = (swarm.settings.particles, len(swarm._lower))
        if {swarm._positions.shape, swarm._velocities.shape} != {shape}:
            raise InputError("swarm state", shape, "shapes differ", "Give what state() gave.")
        return swarm

    def _place(self, start: Array) -> None:
        """Put known designs in the place of the first particles."""
        known = np.atleast_2d(start)
        if known.shape[1] != len(self._lower) or len(known) > len(self._positions):
            remedy = f"Give at most {len(self._positions)} points of {len(self._lower)} variables."
            raise InputError("start", known.shape, "wrong shape", remedy)
        if not np.all((known >= self._lower) & (known <= self._upper)):
            raise InputError("start", known.tolist(), "outside the bounds", "Widen the bounds.")
        self._positions[: len(known)] = (known - self._lower) / (self._upper - self._lower)

    def _points(self, unit: Array) -> Array:
        # this form meets both bounds exactly; the clip removes the last rounding error inside
        return np.clip(self._lower * (1.0 - unit) + self._upper * unit, self._lower, self._upper)

    def _checked(self, values: ArrayLike, violations: ArrayLike | None) -> tuple[Array, Array]:
        """Objectives (n, m) and total violation (n,), infinite where the objectives failed."""
        told = np.array(values, dtype=float)
        told = told[:, None] if told.ndim == 1 else told
        particles, known = self._personal_values.shape
        if told.ndim != 2 or len(told) != particles or told.shape[1] != (known or told.shape[1]):
            remedy = f"Give ({particles}, {known or 'm'}) objectives."
            raise InputError("values", told.shape, "wrong shape", remedy)
        if len(self._reference) not in (0, told.shape[1]) or told.shape[1] == 0:
            found = (len(self._reference), told.shape[1])
            raise InputError("reference, values", found, "lengths differ", "Give m >= 1 of each.")
        total = np.zeros(particles)
        if violations is not None:
            broken = np.array(violations, dtype=float)
            if broken.shape[:1] != (particles,):
                raise InputError("violations", broken.shape, "wrong shape", "Give a row per point.")
            broken = np.where(np.isnan(broken), np.inf, np.maximum(broken, 0.0))
            total = broken.reshape(particles, -1).sum(axis=1)
        failed = ~np.isfinite(told).all(axis=1)
        self.evaluations += particles
        self.failed += int(failed.sum())
        self.infeasible += int((~failed & (total > 0.0)).sum())
        # a model that skips the objectives of an infeasible point still gives its violation
        return told, np.where(failed & (total == 0.0), np.inf, total)

    def _remember(self, values: Array, total: Array) -> None:
        """Update the personal bests: the new point unless the old one is better or equal."""
        if self._personal_values.shape[1] == 0:
            self._personal_values = np.full_like(values, np.nan)
        old, old_total = self._personal_values, self._personal_violations
        both_feasible = (old_total == 0.0) & (total == 0.0)
        taken = ~((old_total < total) | (both_feasible & (old <= values).all(axis=1)))
        self._personal_positions[taken] = self._positions[taken]
        self._personal_values[taken] = values[taken]
        self._personal_violations[taken] = total[taken]

    def _leaders(self) -> tuple[Array, Array, Array]:
        """Positions that guide, where they stand in objectives, and their merit.

        Without an archive, the personal bests, where they are, and how little they violate.
        """
        archive = self._archive
        if not len(archive):
            own = self._personal_positions
            return own, own, -self._personal_violations
        if not self.infeasible:
            return archive.positions, archive.values, archive.loneliness()
        rows, merit = archive.elite(len(self._positions))
        values = archive.values[rows]
        extent = np.ptp(values, axis=0)
        return archive.positions[rows], values / np.where(extent > 0.0, extent, 1.0), merit

    def _move(self) -> None:
        """Equations 22 and 23, bounds and children."""
        s, rng = self.settings, self._rng
        particles = len(self._positions)
        elite, places, merit = self._leaders()
        drawn = rng.integers(len(elite), size=(particles, s.tournament))
        winner = drawn[np.arange(particles), merit[drawn].argmax(axis=1)]
        leader = elite[winner]

        fall = (s.inertia_first - s.inertia_last) * self.iteration / self.iterations
        r1, r2 = rng.random((2, particles, 1))  # one number a particle, as eq. 22 has it
        speed = (
            (s.inertia_first - fall) * self._velocities
            + s.c1 * r1 * (self._personal_positions - self._positions)
            + s.c2 * r2 * (leader - self._positions)
        )
        speed = np.clip(speed, -s.speed_limit, s.speed_limit)
        moved = self._positions + speed
        left = (moved < 0.0) | (moved > 1.0)
        self._velocities = np.where(left, -speed, speed)
        self._positions = np.clip(moved, 0.0, 1.0)

        share = s.mutation_share
        if self.infeasible and share:
            share = max(share, BROKEN_SHARE)
        chosen = np.flatnonzero(rng.random(particles) < share)
        partner = elite[rng.integers(len(elite), size=len(chosen))]
        if self.infeasible and len(self._archive):
            across = children.crossed(leader[chosen], partner, rng)
            along = children.stepped(elite, places, winner[chosen], rng)
            born = np.where(rng.random((len(chosen), 1)) < 0.5, across, along)
        else:
            born = children.mixed(leader[chosen], partner, rng)
        born = children.mutated(born, s.mutation_index, rng)
        if self.infeasible:
            born = children.renewed(born, BROKEN_ANEW, rng)
        self._positions[chosen] = born

    def _gain(self) -> float:
        """Share of the hypervolume won in the last tenth of the iterations."""
        if not self.done:
            return float("nan")
        return relative_gain(self._earlier_values, self._archive.values)

    def _remark(self, gain: float) -> str:
        if not len(self._archive):
            least = float(self._personal_violations.min())
            return f"no feasible point in {self.evaluations} evaluations; least violation {least:g}"
        if not self.done:
            text = f"not finished: {self.iteration} of {self.iterations} iterations"
        elif np.isnan(gain):
            text = "cannot tell whether settled: nothing feasible before the last iterations"
        else:
            word = "settled" if gain < _SETTLED else "still improving, give it more iterations"
            text = f"{word}: the last tenth of the iterations won {gain:.1e} of the hypervolume"
        if len(self._archive) == 1 and self._archive.values.shape[1] > 1:
            text += "; one point only: the objectives do not conflict, or the swarm collapsed"
        if self.failed:
            text += f"; {self.failed} of {self.evaluations} points failed"
        return text


def minimise(
    function: Callable[[Array], ArrayLike | tuple[ArrayLike, ArrayLike]],
    bounds: ArrayLike,
    *,
    iterations: int,
    rng: np.random.Generator,
    size: int = 100,
    settings: SwarmSettings | None = None,
    start: ArrayLike | None = None,
    reference: ArrayLike | None = None,
) -> Front:
    """Run a swarm to its end.

    `function` takes points (n, d) and returns objectives (n, m), or a tuple of them and violations
    (see `ParticleSwarm.tell`). `size` is the largest number of points in the front. The other parameters
    and the errors raised are those of `ParticleSwarm`.
    """
    swarm = ParticleSwarm(
        bounds, iterations, rng, settings=settings, start=start, reference=reference
    )
    while not swarm.done:
        told = function(swarm.ask())
        if isinstance(told, tuple):
            swarm.tell(*told)
        else:
            swarm.tell(told)
    return swarm.front(size)
