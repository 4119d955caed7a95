"""Multi-objective particle swarm (the paper's eqs. 22-23) with an archive of the best designs.

The swarm is the paper's: learning factors c1 = c2 = 1.8, inertia weight falling linearly from 1.2
to 0.1, r1 and r2 one random number each per particle. What the paper leaves open is fixed here, one
setting for all problems:

- **Archive**: the feasible non-dominated points met, thinned where crowded (`pareto.Archive`).
- **Leaders** (P_g): tournaments of `tournament` archive members; the least crowded member wins.
- **Personal best** (P): the newest point, unless the old one dominates or equals it.
- **Bounds**: speeds clipped at `speed_limit` of each range; a particle that leaves is put on the
  bound and that component of its velocity is reversed.
- **Mutation** (an addition: the paper's text does without): on average `mutation_share` of the
  particles continue from a child of two archive members (the leader and another, coordinates
  mixed at random) with polynomial mutation (Deb & Goyal 1996) in one coordinate on average. Their
  velocity is kept. It keeps the swarm from collapsing to one point and pays off most with many
  variables; `mutation_share=0` leaves eqs. 22-23 alone.
- **Constraints** (Deb 2000, doi:10.1016/S0045-7825(99)00389-8): feasible beats infeasible, among
  infeasible points the smaller total violation wins. Only feasible points enter the archive.
  Once one was broken the feasible region may be thin or in pieces, which flying past it misses, and the front
  may lie on its borders: then `BROKEN_SHARE` of the particles continue from children, of which `BROKEN_ANEW` get
  one coordinate anew from its whole range. Half of them are made by simulated binary crossover, half by steps along the front
  (`children`); before any feasible point is known, as without constraints, of the least violating. Leaders and parents are as
  many members of the archive as there are particles (`Archive.elite`); the one that the front would lose most without wins.

The front of what it met is made by `hpcclear.statistics.search.asking`, as for every search.
All objectives are minimised. Positions live in the unit cube, so variables may differ in scale.
"""

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.statistics.search import asking, children
from hpcclear.statistics.search.asking import Function, SearchTask, SwarmSettings
from hpcclear.statistics.search.pareto import Archive, Front

BROKEN_SHARE = 0.85
"""Share of the particles that continue from children where constraints were broken, if any do."""
BROKEN_ANEW = 0.3
"""Share of these children that get a coordinate anew."""


class ParticleSwarm:
    """A particle swarm that requests points to evaluate and receives their objectives.

    `bounds` (d, 2): lower and upper bound of each variable; `iterations`: number of `tell` calls, which sets the slope of the
    inertia weight (k_max of eq. 23); `rng`: owned by the swarm from here on.
    """

    def __init__(
        self,
        bounds: ArrayLike,
        iterations: int,
        rng: np.random.Generator,
        *,
        settings: SwarmSettings = SwarmSettings(),
    ) -> None:
        self.settings = settings
        self._lower, self._upper = np.array(bounds, dtype=float).T
        self.iterations = iterations
        self.iteration = 0
        self._rng = rng
        self._constrained = False  # whether a design broke a constraint
        shape = (self.settings.particles, len(self._lower))
        self._positions: Array = rng.random(shape)
        self._velocities: Array = np.zeros(shape)
        self._personal_positions: Array = self._positions.copy()
        self._personal_values: Array = np.empty((shape[0], 0))
        self._personal_violations: Array = np.full(shape[0], np.inf)
        self._archive = Archive(
            self.settings.archive_capacity, np.empty((0, shape[1])), np.empty((0, 0))
        )

    def ask(self) -> Array:
        """Points to evaluate, shape (particles, d); the same ones until `tell` is called."""
        unit = self._positions
        # this form meets both bounds exactly; the clip removes the last rounding error inside
        return np.clip(self._lower * (1.0 - unit) + self._upper * unit, self._lower, self._upper)

    def tell(self, designs: Array, objectives: Array, constraints: Array) -> None:
        """Take the objectives of the designs requested (`hpcclear.statistics.search.asking.Search`) and move on."""
        self._constrained |= bool((np.isfinite(objectives).all(axis=1) & (constraints > 0.0)).any())
        self._remember(objectives, constraints)
        feasible = constraints == 0.0
        self._archive.add(self._positions[feasible], objectives[feasible])
        self.iteration += 1
        if self.iteration < self.iterations:
            self._move()

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
        if not self._constrained:
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
        if self._constrained and share:
            share = max(share, BROKEN_SHARE)
        chosen = np.flatnonzero(rng.random(particles) < share)
        partner = elite[rng.integers(len(elite), size=len(chosen))]
        if self._constrained and len(self._archive):
            across = children.crossed(leader[chosen], partner, rng)
            along = children.stepped(elite, places, winner[chosen], rng)
            born = np.where(rng.random((len(chosen), 1)) < 0.5, across, along)
        else:
            born = children.mixed(leader[chosen], partner, rng)
        born = children.mutated(born, s.mutation_index, rng)
        if self._constrained:
            born = children.renewed(born, BROKEN_ANEW, rng)
        self._positions[chosen] = born


def swarm(task: SearchTask) -> ParticleSwarm:
    """The swarm of a task."""
    return ParticleSwarm(task.bounds, task.iterations, task.rng, settings=task.settings)


def minimise(
    function: Function,
    bounds: ArrayLike,
    *,
    iterations: int,
    rng: np.random.Generator,
    size: int = 100,
    settings: SwarmSettings = SwarmSettings(),
) -> Front:
    """Run a swarm to its end (`hpcclear.statistics.search.asking.minimise`); other parameters and errors: `ParticleSwarm`."""
    task = SearchTask(np.array(bounds, dtype=float), 0, rng, iterations, settings)
    return asking.minimise(swarm(task), function, task, size)
