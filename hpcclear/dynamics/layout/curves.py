"""Tabulated curves as the kernel reads them: one array, whose head says where the numbers of each curve stand.

A uniform grid points to the piece that holds the left end of each of its intervals; so many halvings find the one that holds a
place, which are few however uneven the rows are, and the same in all lanes.
"""

from collections.abc import Sequence

import numpy as np

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import Pieces
from hpcclear.dynamics import layout as at

(
    GRID,  # where it begins
    LAST,  # number of its last interval
    STARTS,  # of the pieces
    LAST_PIECE,
    HALVINGS,
    CUBICS,
    BREAKS,  # where steps end, ascending
    BREAK_COUNT,  # 0: nowhere
    REPEATS,  # 1, or 0 of one that stays level beyond both ends
) = range(9)
HEAD = 9

MOST_INTERVALS = 1 << 16


def packed(curves: Sequence[Pieces], stops: Sequence[Array]) -> Array:
    """All curves in one array; `stops`: where steps end, of each, shares of its length."""
    head = np.zeros((at.MAX_CURVES, HEAD))
    parts, free = [], head.size
    for k, (curve, ends) in enumerate(zip(curves, stops, strict=True)):
        grid, halvings = _grid(curve.starts)
        places = []
        for part in (grid, curve.starts, curve.cubics.ravel(), ends):
            places.append(free)
            parts.append(part)
            free += len(part)
        head[k] = (
            places[0], len(grid) - 1, places[1], len(curve.starts) - 1, halvings, places[2], places[3], len(ends),
            curve.repeats,
        )  # fmt: skip
    return np.concatenate([head.ravel(), *parts])


def _grid(starts: Array) -> tuple[Array, int]:
    """The piece that holds the left end of each interval, and how many halvings find any other from there."""
    n = len(starts)
    if np.abs(starts * n - np.arange(n)).max() < 1e-9:
        return np.arange(n, dtype=float), 0
    best: tuple[int, Array] | None = None
    count = 16
    while best is None or (best[0] > 1 and count <= min(max(1024, 8 * n), MOST_INTERVALS)):
        held = np.searchsorted(starts, np.arange(count + 1) / count, side="right") - 1
        further = int(np.diff(held).max())
        halvings = further.bit_length()
        if best is None or halvings < best[0]:
            best = halvings, held[:-1].astype(float)
        count *= 2
    return best[1], best[0]
