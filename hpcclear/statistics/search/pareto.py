"""Sets of non-dominated points: archive, spread, hypervolume. All objectives are minimised."""

import ctypes
import math
from dataclasses import dataclass

import moocore
import numpy as np
from numpy.typing import NDArray

from hpcclear.base.arrays import Array, Booleans, Integers
from hpcclear.base.jit import scalar_function
from hpcclear.base.lowering.compiled import at_first_call


@dataclass(frozen=True)
class Front:
    """Result of a search: ``points (k, d)``, ``values (k, m)`` by rising first objective.

    `failed` counts points whose objectives were not finite, `infeasible` the others that broke a
    constraint; both are part of `evaluations`. `gain` is the share of the hypervolume won in the
    last tenth of the iterations, NaN if unknown; `settled` says that all iterations were done and
    the gain is below 1e-3. A settled search may still sit on a local front: compare several seeds.
    `remark` says this in words.
    """

    points: Array
    values: Array
    evaluations: int
    failed: int
    infeasible: int
    gain: float
    settled: bool
    remark: str


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
    """Hypervolume dominated by `values (k, m)` below `reference (m,)`; exact to five objectives.

    Beyond, moocore's approximation Rphi-FWE+, which is deterministic. An empty set has none.
    """
    if values.size == 0:
        return 0.0
    if len(reference) <= 5:
        return float(moocore.hypervolume(values, reference))
    return float(moocore.hv_approx(values, reference, method="Rphi-FWE+"))


def relative_gain(before: Array, now: Array) -> float:
    """Share of the hypervolume of `now (k, m)` that `before (j, m)` lacks; NaN if either is empty.

    Scaled to the extent of `now` (where it has none, to its size), reference point 1.1 times that.
    """
    if not (before.size and now.size):
        return float("nan")
    low = now.min(axis=0)
    extent = np.ptp(now, axis=0)
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


def _best_of_two(values: Array, size: int) -> Integers:
    """Rows of the largest area below the first row's second objective, from the last row to the first."""
    order, count = np.argsort(values[:, 0], kind="stable"), len(values)
    follower = np.zeros((size, count), np.int64)
    first, second = np.ascontiguousarray(values[order].T)
    _compiled_followers(first, second, np.full((size, count), -np.inf), follower)
    kept = np.zeros(size, np.int64)
    for k in range(1, size):
        kept[k] = follower[size - k, kept[k - 1]]
    return order[kept]


@scalar_function
def _followers(first, second, won, follower):
    """The row behind each row (size, n) with so many rows behind it; `won`: area from it to the last one, -inf at first."""
    size, count = len(follower), len(first)
    won[0, count - 1] = 0.0
    for chosen in range(1, size):
        for i in range(count - chosen):
            height = second[0] - second[i]
            for j in range(i + 1, count - chosen + 1):
                area = (first[j] - first[i]) * height + won[chosen - 1, j]
                if area > won[chosen, i]:
                    won[chosen, i] = area
                    follower[chosen, i] = j


def _cut_two(values: Array, size: int) -> Booleans:
    """Rows to keep of a two-objective front: the least rectangle between neighbours goes first.

    Scaling an objective scales all rectangles alike and both ends stay: no reference is needed.
    """
    order = np.argsort(values[:, 0], kind="stable")
    kept = np.arange(len(order))
    first, second = np.ascontiguousarray(values[order].T)
    left = _compiled_least_gone(first, second, kept, size)
    alive = np.zeros(len(order), np.bool_)
    alive[order[kept[:left]]] = True
    return alive


@scalar_function
def _least_gone(first, second, kept, size):
    """Move the rows that stay to the front of `kept`; how many they are."""
    count = len(kept)
    while count > size:
        gone, least = 1, math.inf
        for k in range(1, count - 1):
            a, b, c = kept[k - 1], kept[k], kept[k + 1]
            area = (first[c] - first[b]) * (second[a] - second[b])
            if area < least:
                gone, least = k, area
        count -= 1
        for k in range(gone, count):
            kept[k] = kept[k + 1]
    return count


def _thin(values: Array, capacity: int) -> tuple[Booleans, Array]:
    """Drop the most crowded rows until `capacity` are left; the best of each objective stays.

    Returns which rows are alive, and of these the distance to the nearest neighbour, objectives
    scaled to their extent.
    """
    count = len(values)
    extent = np.ptp(values, axis=0)
    columns = np.ascontiguousarray(values / np.where(extent > 0.0, extent, 1.0))
    pinned, alive = np.zeros(count, np.int64), np.ones(count, np.int64)
    pinned[values.argmin(axis=0)] = 1
    distance = np.empty((count, 2))
    neighbour = np.empty((count, 2), np.int64)
    square = np.zeros((count, count))
    _compiled_thinned(columns, square, pinned, alive, distance, neighbour, count - capacity)
    return alive == 1, np.sqrt(distance[alive == 1, 0])


@scalar_function
def _thinned(columns, square, pinned, alive, distance, neighbour, drops):
    """Mark `drops` rows as not alive; squares of the distances, and the two nearest rows with theirs, are kept on the way."""
    count = len(alive)
    for k in range(columns.shape[1]):
        for i in range(count):
            for j in range(i):
                step = columns[i, k] - columns[j, k]
                square[i, j] += step * step
    for i in range(count):
        square[i, i] = math.inf
        for j in range(i):
            square[j, i] = square[i, j]
    for i in range(count):
        _nearest(square, alive, i, distance, neighbour)
    for _ in range(drops):
        gone = -1
        for i in range(count):
            if alive[i] == 1 and pinned[i] == 0 and (gone < 0 or _closer(distance, i, gone)):
                gone = i
        alive[gone] = 0
        for i in range(count):
            if alive[i] == 1 and (neighbour[i, 0] == gone or neighbour[i, 1] == gone):
                _nearest(square, alive, i, distance, neighbour)


@scalar_function
def _closer(distance, i, j):
    tied = distance[i, 0] == distance[j, 0]
    return distance[i, 1] < distance[j, 1] if tied else distance[i, 0] < distance[j, 0]


@scalar_function
def _nearest(square, alive, i, distance, neighbour):
    """Write the two nearest living neighbours of row i."""
    distance[i, 0], distance[i, 1] = math.inf, math.inf
    neighbour[i, 0], neighbour[i, 1] = -1, -1
    for j in range(len(alive)):
        if alive[j] == 1 and j != i:
            if square[i, j] < distance[i, 0]:
                distance[i, 1], neighbour[i, 1] = distance[i, 0], neighbour[i, 0]
                distance[i, 0], neighbour[i, 0] = square[i, j], j
            elif square[i, j] < distance[i, 1]:
                distance[i, 1], neighbour[i, 1] = square[i, j], j


_compiled_followers, _compiled_least_gone, _compiled_thinned = (
    at_first_call(_followers), at_first_call(_least_gone, result=ctypes.c_int64), at_first_call(_thinned),
)  # fmt: skip
