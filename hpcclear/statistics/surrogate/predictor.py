"""Compiled sums of kernels: Kriging means, and of the squared exponential their moments over tensor rules.

Everything runs along the training points, the one long dimension, so that a design's result does
not depend on which other designs are in the batch. Numba has no vectorised exponential of its own;
the polynomial one of `hpcclear.base.exponentials` lets LLVM keep these loops in vector registers.
"""

from functools import partial

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.cached import cached
from hpcclear.base.exponentials import falling

REORDER = {"contract", "reassoc", "nsz", "arcp"}
"""Fast-math flags for sums only: without them LLVM keeps a sum's order and cannot vectorise it."""

STEEPEST = 300.0
"""Exponents are cut here: exp(-300) = 5e-131 is as good as 0 and no (slow) denormal number."""

LANES = 8
"""Training points are padded to a multiple of this, so that vectorised loops have no tail."""


@partial(cached, fastmath={"contract"})
def gaussian(square: float) -> float:
    """exp(-square / 2) for square >= 0, to a few ulp; branch-free, so that loops over it vectorise."""
    return float(falling(0.5 * square, STEEPEST))


@partial(cached, fastmath={"contract"})
def matern(square: float) -> float:
    """Matern 5/2 for the squared distance >= 0, as accurate and as free of branches as `gaussian`."""
    step = np.sqrt(5.0 * square)
    return float((1.0 + step + step * step / 3.0) * falling(step, STEEPEST))


@partial(cached, fastmath={"contract"})
def _kernel_row(
    scaled: Array, lengths: Array, dims: Integers, coordinates: Array, smooth: bool, row: Array
) -> None:
    """Fill `row` with the kernel over the inputs `dims`, a place against all training points: `gaussian` if smooth, or
    `matern`."""
    count = row.size
    row[:] = 0.0
    for k in range(dims.size):
        place = coordinates[k] / lengths[dims[k]]
        inputs = scaled[dims[k]]
        for i in range(count):
            step = place - inputs[i]
            row[i] += step * step
    if smooth:
        for i in range(count):
            row[i] = gaussian(row[i])
    else:
        for i in range(count):
            row[i] = matern(row[i])


@partial(cached, fastmath=REORDER)
def _dot(a: Array, b: Array) -> float:
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@cached
def kernel_sum(
    unit: Array, scaled: Array, lengths: Array, weights: Array, level: float, smooth: bool
) -> Array:
    """Kriging means ``level + sum_i weights_i k(x, x_i)`` at places (n, d) in the unit cube, (n,).

    `smooth`: whether k is the squared exponential, or the Matern function of order 5/2; `scaled` (d, p): training points in
    the unit cube over the length scales `lengths` (d,), padded (`pad`); `weights` (p,): in the units of the answer.
    """
    dims = np.arange(lengths.size)
    row = np.empty(weights.size)
    out = np.empty(unit.shape[0])
    for j in range(unit.shape[0]):
        _kernel_row(scaled, lengths, dims, unit[j], smooth, row)
        out[j] = level + _dot(weights, row)
    return out


def pad(points: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points ``(n, d)``, weights ``(n,)`` as ``(d, p)`` and ``(p,)``, p a multiple of `LANES`."""
    count, dims = points.shape
    padded = -(-count // LANES) * LANES
    transposed, filled = np.zeros((dims, padded)), np.zeros(padded)
    transposed[:, :count], filled[:count] = points.T, weights
    return transposed, filled


@cached
def _multiply(a: Array, b: Array, out: Array) -> None:
    for i in range(out.size):  # written out: an array expression would allocate
        out[i] = a[i] * b[i]


@partial(cached, fastmath=REORDER)
def _four_dots(table: Array, first: int, row: Array, out: Array, at: int) -> None:
    """``out[at + k] = table[first + k] @ row`` for k < 4; four sums share each load of `row`."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    t0, t1, t2, t3 = table[first], table[first + 1], table[first + 2], table[first + 3]
    for i in range(row.size):
        a += t0[i] * row[i]
        b += t1[i] * row[i]
        c += t2[i] * row[i]
        d += t3[i] * row[i]
    out[at], out[at + 1], out[at + 2], out[at + 3] = a, b, c, d


@partial(cached, fastmath=REORDER)
def _weighted_moments(values: Array, weights: Array) -> tuple[float, float]:
    """Mean, and variance about it: the difference E[f^2] - E[f]^2 would cancel."""
    mean, variance = 0.0, 0.0
    for k in range(values.size):
        mean += weights[k] * values[k]
    for k in range(values.size):
        variance += weights[k] * (values[k] - mean) ** 2
    return mean, variance


@cached
def tensor_moments(
    places: Array, shares: Array, counts: Integers, starts: Integers, dims: Integers, steady: Array, steady_shares: Array,
    scaled: Array, lengths: Array,
) -> Array:  # fmt: skip
    """Mean and variance (n, 2) of ``sum_i weights_i k(x, x_i)`` over tensor rules, one rule a design.

    The kernel is a product over groups of inputs, so a rule of N1 x N2 x ... nodes needs only
    N1 + N2 + ... kernel rows; the tensor is formed by multiplying rows and ends in dot products.
    What does not move with the design comes ready-made in `steady`.

    `places` (n, r), in the unit cube: for each group, for each of its nodes, the group's coordinates; `shares` (n, s):
    probability of each node of each group, each group's add up to 1; `counts` (g,): nodes of each group, of sum s. Group k
    holds the inputs ``dims[starts[k] : starts[k + 1]]``. `steady` (q, p): weights of the training points times the kernel
    rows of the q steady nodes (padded to a multiple of 4); `steady_shares` (q,): their probabilities (0 for padding). Others
    as in `kernel_sum`.
    """
    groups, size, still = counts.size, scaled.shape[1], steady.shape[0]
    table, stack = np.empty((counts.sum(), size)), np.empty((groups, size))
    digits, first = np.zeros(groups, np.int64), np.zeros(groups + 1, np.int64)
    first[1:] = np.cumsum(counts)
    total = 1
    for k in range(groups):
        total *= counts[k]
    chance = np.empty(groups)
    values, weights = np.empty(total * still), np.empty(total * still)
    out = np.empty((places.shape[0], 2))
    for j in range(places.shape[0]):
        at = 0
        for k in range(groups):
            width = starts[k + 1] - starts[k]
            inputs = dims[starts[k] : starts[k + 1]]
            for node in range(first[k], first[k + 1]):
                _kernel_row(scaled, lengths, inputs, places[j, at : at + width], True, table[node])
                at += width
        digits[:] = 0
        changed = 0
        for node in range(total):
            for k in range(changed, groups):
                line = first[k] + digits[k]
                if k == 0:
                    stack[0] = table[line]
                    chance[0] = shares[j, line]
                else:
                    _multiply(stack[k - 1], table[line], stack[k])
                    chance[k] = chance[k - 1] * shares[j, line]
            product = stack[groups - 1]
            for q in range(0, still, 4):
                _four_dots(steady, q, product, values, node * still + q)
            for q in range(still):
                weights[node * still + q] = chance[groups - 1] * steady_shares[q]
            changed = groups - 1
            while changed > 0 and digits[changed] == counts[changed] - 1:
                digits[changed] = 0
                changed -= 1
            digits[changed] += 1
        out[j] = _weighted_moments(values, weights)
    return out
