"""Tabulated curves as the kernel reads them: one array, whose head says where the numbers of each curve stand.

Uniform intervals of the length hold two cubics each, before and behind the row within, so that a value takes one comparison. Of
rows that are too dense for that, every cell is one piece, and halvings find it from where an interval begins.
"""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.pieces import Pieces
from hpcclear.dynamics import layout as at

(
    INTERVALS,  # how many
    CELLS,  # where they begin
    LAST_CELL,
    HALVINGS,  # 0 where each interval is a cell
    GRID,  # where the cells stand that hold the left ends of the intervals, if there are halvings
    BREAKS,  # where steps end, ascending
    BREAK_COUNT,  # 0: nowhere
    REPEATS,  # 1, or 0 of one that stays level beyond both ends
    IN_PARAMETERS,  # 1 where the rows are parameters of the sample, and BREAKS says in which of their rows they stand
) = range(9)
HEAD = 9

CELL = 9
"""Numbers of a cell: the row, a share of the length; the cubics before and behind it, by powers of the distance from it."""

PLACES = (1 << 32) - 1
"""All bits of a place in the array: taken with it, the compiler sees that it is not below 0."""

MOST_INTERVALS = 1 << 16
FEW_INTERVALS = 4096  # so many are tried at least before there are halvings


def packed(
    curves: Sequence[Pieces], stops: Sequence[Array], bends: Sequence[Sequence[int]] = ()
) -> Array:
    """All curves in one array.

    `stops`: where steps end, of each, shares of its length. `bends`: of tables that are not looked up here but end steps, and
    follow the curves, the rows of the parameters where they bend.
    """
    head = np.zeros((at.MAX_CURVES, HEAD))
    parts, free = [], head.size
    for k, (curve, ends) in enumerate(zip(curves, stops, strict=True)):
        intervals = _intervals(curve.starts)
        cells, grid, halvings = _cells(curve, intervals), np.zeros(0), 0
        if intervals == 0:
            grid, halvings = _grid(curve.starts)
        places = []
        for part in (cells.ravel(), grid, ends):
            places.append(free)
            parts.append(part)
            free += len(part)
        head[k] = (
            intervals or len(grid), places[0], len(cells) - 1, halvings, places[1], places[2], len(ends), curve.repeats, 0,
        )  # fmt: skip
    for k, rows in enumerate(bends, len(curves)):
        head[k, [BREAKS, BREAK_COUNT, IN_PARAMETERS]] = free, len(rows), 1
        parts.append(np.array(rows, float))
        free += len(rows)
    return np.concatenate([head.ravel(), *parts])


def _interval_of(starts: Array, count: int) -> Integers:
    """Which of so many intervals each piece begins in; within round-off of an end, in the next."""
    return np.minimum((starts * count + 1e-10).astype(int), count - 1)


def _intervals(starts: Array) -> int:
    """The least number of intervals that hold one row each at most; 0 if that takes too many."""
    n = len(starts)
    most = min(max(FEW_INTERVALS, 2 * n), MOST_INTERVALS)
    doubled = (1 << k for k in range(max(n - 1, 0).bit_length(), most.bit_length()))
    return next((one for one in (n, *doubled) if np.diff(_interval_of(starts, one)).all()), 0)


def _cells(curve: Pieces, intervals: int) -> Array:
    """Cells (m, CELL): of each interval, or of each piece."""
    if intervals == 0:
        return np.column_stack([curve.starts, curve.cubics, curve.cubics])
    left = np.arange(intervals) / intervals
    inside = _interval_of(curve.starts, intervals)
    behind = np.searchsorted(inside, np.arange(intervals), side="right") - 1
    begins = inside[behind] == np.arange(intervals)
    row = np.where(begins, curve.starts[behind], left)
    before = np.maximum(behind - begins, 0)
    parts = (curve.moved(k, row - curve.starts[k]) for k in (before, behind))
    return np.column_stack([row, *parts])


def _grid(starts: Array) -> tuple[Array, int]:
    """The piece that holds the left end of each interval, and how many halvings find any other from there."""
    best: tuple[int, Array] | None = None
    count, most = 16, min(max(1024, 8 * len(starts)), MOST_INTERVALS)
    while best is None or (best[0] > 1 and count <= most):
        held = np.searchsorted(starts, np.arange(count + 1) / count, side="right") - 1
        halvings = int(np.diff(held).max()).bit_length()
        if best is None or halvings < best[0]:
            best = halvings, held[:-1].astype(float)
        count *= 2
    return best[1], best[0]
