"""Sets of non-dominated points: archive, spread, hypervolume. All objectives are minimised."""

from dataclasses import dataclass

import moocore
import numpy as np
from numpy.typing import NDArray

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.cached import cached


@dataclass(frozen=True)
class Front:
    """Result of a search: ``points (k, d)``, ``values (k, m)`` by rising first objective.

    `gain` is the share of the hypervolume won in the last tenth of the iterations, NaN if unknown. A
    search with little gain may still sit on a local front: compare several seeds.
    """

    points: Array
    values: Array
    gain: float


class Archive:
    """Non-dominated points met so far, at most `capacity` (but never fewer than objectives).

    `positions (k, d)` and `values (k, m)` belong together. When it is full the point with the
    nearest neighbour goes (objectives scaled to the archive's extent; between ties the second
    nearest decides); the best point of each objective stays. Of equal objective vectors the first
    one stays.
    """

    def __init__(self, capacity: int, positions: Array, values: Array) -> None:
        self.capacity = capacity
        self.positions = positions
        self.values = values

    def __len__(self) -> int:
        return len(self.values)

    def add(self, positions: Array, values: Array) -> None:
        """Merge feasible points with finite objectives."""
        if not len(values):
            return
        merged = np.concatenate([self.values.reshape(-1, values.shape[1]), values])
        where = np.concatenate([self.positions, positions])
        best = moocore.is_nondominated(merged)
        merged, where = merged[best], where[best]
        alive, _ = _thin(merged, max(self.capacity, values.shape[1]))
        self.positions, self.values = where[alive], merged[alive]

    def loneliness(self) -> Array:
        """Distance of each point to its nearest neighbour, objectives scaled to their extent."""
        return _thin(self.values, len(self.values))[1]

    def elite(self, size: int) -> tuple[NDArray[np.intp], Array]:
        """Rows of at most `size` members that spread best, and how much the front would lose without each.

        With two objectives that is hypervolume, without limit for the best of each; with others the distance to the
        nearest neighbour. Never fewer members than objectives.
        """
        size = max(size, self.values.shape[1])
        if self.values.shape[1] != 2:
            alive, lonely = _thin(self.values, size)
            return np.flatnonzero(alive), lonely
        rows = cut(self.values, size)
        order = np.argsort(self.values[rows, 0])
        first, second = self.values[rows[order]].T
        lost = np.full(len(rows), np.inf)
        lost[order[1:-1]] = (first[2:] - first[1:-1]) * (second[:-2] - second[1:-1])
        return rows, lost


def hypervolume(values: Array, reference: Array) -> float:
    """Hypervolume dominated by `values (k, m)` below `reference (m,)`. An empty set has none."""
    return float(moocore.hypervolume(values, reference)) if values.size else 0.0


def relative_gain(before: Array, now: Array) -> float:
    """Share of the hypervolume of `now (k, m)` that `before (j, m)` lacks; NaN if either is empty.

    Scaled to the extent of `now` (where it has none, to its size), reference point 1.1 times that.
    """
    if not (before.size and now.size):
        return float("nan")
    low, extent = now.min(axis=0), np.ptp(now, axis=0)
    extent = np.where(extent > 0.0, extent, np.abs(low))
    extent = np.where(extent > 0.0, extent, 1.0)
    reference = np.full(len(low), 1.1)
    final = hypervolume((now - low) / extent, reference)
    return 1.0 - hypervolume((before - low) / extent, reference) / final


def cut(values: Array, size: int) -> NDArray[np.intp]:
    """Indices of at most `size` rows of a non-dominated set, well spread.

    With two and three objectives the smallest hypervolume contribution is dropped each time
    (reference point 1.1 times the extent), with more the point with the nearest neighbour; the best
    of each objective stays.
    """
    count, objectives = values.shape
    if count <= size:
        return np.arange(count)
    if objectives == 2:
        return np.flatnonzero(_cut_two(values, size))
    if objectives > 3:  # exact contributions grow too dear
        return np.flatnonzero(_thin(values, size)[0])
    low = values.min(axis=0)
    extent = np.ptp(values, axis=0)
    unit = (values - low) / np.where(extent > 0.0, extent, 1.0)
    kept = np.arange(count)
    best = values.argmin(axis=0)
    while len(kept) > size:
        share = moocore.hv_contributions(unit[kept], np.full(objectives, 1.1))
        share[np.isin(kept, best)] = np.inf
        kept = np.delete(kept, share.argmin())
    return kept


def best_subset(values: Array, size: int) -> NDArray[np.intp]:
    """Indices of the `size` rows of a non-dominated set whose hypervolume is largest, the best of each objective among them.

    Exact for two objectives, by the plain dynamic program (Kuhn et al. 2016, Evolutionary Computation 24(3), 411), of which
    `cut` lacks 1e-4 to 4e-4; with others it is `cut`.
    """
    if values.shape[1] != 2 or not 2 <= size < len(values):
        return cut(values, size)
    return np.sort(_best_of_two(values, size))


@cached
def _best_of_two(values: Array, size: int) -> Integers:
    """Rows of the largest area below the first row's second objective, from the last row to the first."""
    order = np.argsort(values[:, 0])
    first, second = values[order, 0], values[order, 1]
    count = len(order)
    won = np.full(count, -np.inf)  # from row i to the last one with as many rows as were chosen
    won[-1] = 0.0
    follower = np.zeros((size, count), np.int64)
    for chosen in range(1, size):
        longer = np.full(count, -np.inf)
        for i in range(count - chosen):
            height = second[0] - second[i]
            for j in range(i + 1, count - chosen + 1):
                area = (first[j] - first[i]) * height + won[j]
                if area > longer[i]:
                    longer[i] = area
                    follower[chosen, i] = j
        won = longer
    kept = np.zeros(size, np.int64)
    for k in range(1, size):
        kept[k] = follower[size - k, kept[k - 1]]
    return order[kept]


@cached
def _cut_two(values: Array, size: int) -> Booleans:
    """Rows to keep of a two-objective front: the least rectangle between neighbours goes first.

    Scaling an objective scales all rectangles alike and both ends stay: no reference is needed.
    """
    order = np.argsort(values[:, 0])
    alive = np.ones(len(values), np.bool_)
    while len(order) > size:
        first, second = values[order, 0], values[order, 1]
        area = (first[2:] - first[1:-1]) * (second[:-2] - second[1:-1])
        gone = 1 + np.argmin(area)
        alive[order[gone]] = False
        order = np.concatenate((order[:gone], order[gone + 1 :]))
    return alive


@cached
def _thin(values: Array, capacity: int) -> tuple[Booleans, Array]:
    """Drop the most crowded rows until `capacity` are left; the best of each objective stays.

    Returns which rows are alive, and of these the distance to the nearest neighbour, objectives
    scaled to their extent.
    """
    count, objectives = values.shape
    square = np.zeros((count, count))
    pinned = np.zeros(count, np.bool_)
    for k in range(objectives):
        column = values[:, k].copy()
        pinned[np.argmin(column)] = True
        extent = column.max() - column.min()
        if extent > 0.0:
            column = column / extent
        for i in range(count):
            for j in range(i):
                square[i, j] += (column[i] - column[j]) ** 2
    alive = np.ones(count, np.bool_)
    distance = np.full((count, 2), np.inf)
    neighbour = np.full((count, 2), -1)
    for i in range(count):
        square[i, i] = np.inf
        for j in range(i):
            square[j, i] = square[i, j]
    for i in range(count):
        _nearest(square, alive, i, distance, neighbour)
    for _ in range(count - capacity):
        gone = -1
        for i in range(count):
            if not alive[i] or pinned[i]:
                continue
            own = distance[i, 0], distance[i, 1]
            if gone < 0 or own < (distance[gone, 0], distance[gone, 1]):
                gone = i
        alive[gone] = False
        for i in range(count):
            if alive[i] and (neighbour[i, 0] == gone or neighbour[i, 1] == gone):
                _nearest(square, alive, i, distance, neighbour)
    return alive, np.sqrt(distance[alive, 0])


@cached
def _nearest(square: Array, alive: Booleans, i: int, distance: Array, neighbour: Integers) -> None:
    """Write the two nearest living neighbours of row i."""
    distance[i, :] = np.inf
    neighbour[i, :] = -1
    for j in range(len(alive)):
        if alive[j] and j != i:
            if square[i, j] < distance[i, 0]:
                distance[i, 1], neighbour[i, 1] = distance[i, 0], neighbour[i, 0]
                distance[i, 0], neighbour[i, 0] = square[i, j], j
            elif square[i, j] < distance[i, 1]:
                distance[i, 1], neighbour[i, 1] = square[i, j], j
