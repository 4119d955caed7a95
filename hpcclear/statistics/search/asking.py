"""Searches through `ask` and `tell`: what is required of them, how they are carried out, and the front of what they met.

Whatever a search keeps for itself, the front is made here, alike for all: the archive of the feasible designs that no other
one dominates, cut to the size requested (`pareto.cut`; `pareto.best_subset` where constraints were broken). A design whose
objectives are not all finite is infeasible, without limit if no violation was given.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from hpcclear.base.arrays import Array
from hpcclear.base.errors import InputError
from hpcclear.plugins.sources import in_use
from hpcclear.statistics.search.pareto import Archive, Front, best_subset, cut, relative_gain

KEY = "study.swarm.algorithm"

Function = Callable[[Array], ArrayLike | tuple[ArrayLike, ArrayLike]]
"""Designs (n, d) to objectives (n, m), all minimised; or a tuple of them and violations (n,) or (n, c), > 0 where broken."""


@dataclass(frozen=True)
class SwarmSettings:
    """Settings of the swarm. The defaults are the one documented setting; what a study sets of them its scene has checked."""

    particles: int = 100
    c1: float = 1.8  # pull to the particle's own best
    c2: float = 1.8  # pull to its leader
    inertia_first: float = 1.2  # w_max of eq. 23
    inertia_last: float = 0.1  # w_min of eq. 23
    speed_limit: float = 0.5  # of each variable's range, per iteration
    mutation_share: float = 0.2
    mutation_index: float = 20.0  # of the polynomial distribution; larger is nearer
    archive_capacity: int = 400
    tournament: int = 3


@dataclass(frozen=True)
class SearchTask:
    """What a search is made for."""

    bounds: Array
    """Lower and upper bound of each variable, shape (d, 2)."""
    objectives: int
    """All are minimised; 0 where their number is seen at the first evaluation."""
    rng: np.random.Generator
    """Its only source of random numbers."""
    iterations: int
    """Evaluations, in units of `particles`."""
    settings: SwarmSettings
    """Those of the swarm, `particles` among them."""

    @property
    def particles(self) -> int:
        """Designs at a time; a search may request more or fewer."""
        return self.settings.particles

    @property
    def evaluations(self) -> int:
        """Evaluations in all; what is requested beyond is not evaluated."""
        return self.iterations * self.particles


class Search(Protocol):
    """A search that requests designs and receives their objectives."""

    def ask(self) -> Array | None:
        """Designs to evaluate next, (n, d), within the bounds; None or none: it has come to its end."""

    def tell(self, designs: Array, objectives: Array, constraints: Array) -> None:
        """Take objectives (n, m), not finite where they failed, and total violations (n,), 0 where no constraint is broken."""


def made(maker: Callable[[SearchTask], Any], name: str, task: SearchTask) -> Search:
    """Return the search with this name. Raises InputError if it does not take the task, or lacks `ask` or `tell`."""
    with in_use(KEY, name, "could not be made of a task"):
        search = maker(task)
    missing = [one for one in ("ask", "tell") if not callable(getattr(search, one, None))]
    if missing:
        remedy = "Give it ask() and tell(designs, objectives, constraints)"
        raise InputError(KEY, name, f"has no {' and no '.join(missing)}", remedy)
    return search


def minimise(
    search: Search, function: Function, task: SearchTask, size: int, name: str = ""
) -> Front:
    """Carry out a search that was made for the task; the front has at most `size` points, and `name` is for messages.

    Raises InputError: the search failed, requests what is no design within the bounds, or `size` is less than the number of
    objectives.
    """
    met = _Met(task)
    while met.evaluations < task.evaluations:
        designs = _asked(search, name, task.bounds)[: task.evaluations - met.evaluations]
        if len(designs) == 0:
            break
        values, broken = _judged(function(designs), len(designs))
        met.add(designs, values, broken)
        with in_use(KEY, name, "failed in tell"):
            search.tell(designs, values, broken)
    return met.front(size)


class _Met:
    """What a search has met."""

    def __init__(self, task: SearchTask) -> None:
        self.objectives = task.objectives
        nothing = np.empty((0, len(task.bounds))), np.empty((0, task.objectives))
        self.archive = Archive(task.settings.archive_capacity, *nothing)
        self.earlier = self.archive.values
        self.evaluations = 0
        self._constrained = False  # whether a design broke a constraint
        self._late = (task.iterations - max(1, task.iterations // 10)) * task.particles

    def add(self, designs: Array, values: Array, broken: Array) -> None:
        """Take in evaluated designs."""
        self.objectives = values.shape[1]
        feasible = broken == 0.0
        self.archive.add(designs[feasible], values[feasible])
        self.evaluations += len(designs)
        self._constrained |= bool((np.isfinite(values).all(axis=1) & ~feasible).any())
        if self.evaluations <= self._late:
            self.earlier = self.archive.values

    def front(self, size: int) -> Front:
        """The best that was met."""
        values, objectives = self.archive.values.reshape(-1, self.objectives), self.objectives
        if size < objectives:
            raise InputError("size", size, f"a front of {objectives} objectives", "Request more.")
        kept = (best_subset if self._constrained else cut)(values, size)
        if len(kept):
            kept = kept[np.lexsort(values[kept].T[::-1])]
        gain = relative_gain(self.earlier, values)
        return Front(self.archive.positions[kept], values[kept], gain)


def _asked(search: Search, name: str, bounds: Array) -> Array:
    """Designs that a search requests, shape (n, d); none where it has come to its end."""
    remedy = f"Let ask() return designs of shape (n, {len(bounds)}) within the bounds of the task"
    with in_use(KEY, name, "failed in ask"):
        found = search.ask()
        designs = np.empty((0, len(bounds))) if found is None else np.array(found, dtype=float)
    if designs.ndim != 2 or designs.shape[1] != len(bounds):
        reason = f"returned an array of shape {designs.shape}, not (n, {len(bounds)})"
        raise InputError(KEY, name, reason, remedy)
    good = (designs >= bounds[:, 0]) & (designs <= bounds[:, 1])  # False for NaN
    if not good.all():
        row, column = np.argwhere(~good)[0]
        low, high = bounds[column]
        reason = f"requested {designs[row, column]:.9g} in variable {column + 1}, outside [{low:.9g}, {high:.9g}]"
        raise InputError(KEY, name, reason, remedy)
    return designs


def _judged(found: ArrayLike | tuple[ArrayLike, ArrayLike], count: int) -> tuple[Array, Array]:
    """Objectives (n, m) and total violations (n,), infinite where neither is known."""
    values, given = found if isinstance(found, tuple) else (found, np.zeros(count))
    table = np.array(values, dtype=float)
    table = table[:, None] if table.ndim == 1 else table
    broken = np.array(given, dtype=float)
    if table.ndim != 2 or len(table) != count or table.shape[1] == 0 or len(broken) != count:
        shapes = (table.shape, broken.shape)
        raise InputError("objectives, violations", shapes, "wrong shape", f"Give {count} rows.")
    broken = np.where(np.isnan(broken), np.inf, np.maximum(broken, 0.0))
    total = broken.reshape(count, -1).sum(axis=1)
    # a model that skips the objectives of an infeasible point still gives its violation
    failed = ~np.isfinite(table).all(axis=1)
    return table, np.where(failed & (total == 0.0), np.inf, total)
