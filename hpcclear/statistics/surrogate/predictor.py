"""Compiled sums of kernels: Kriging means, and of the squared exponential their moments over tensor rules.

Everything runs along the training points, the one long dimension, so that a design's result does
not depend on which other designs are in the batch. The polynomial exponential of `hpcclear.base.exponentials` lets LLVM keep
these loops in vector registers.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.exponentials import falling
from hpcclear.base.jit import apart, scalar_function
from hpcclear.base.lowering.compiled import at_first_call

REORDER = {"contract", "reassoc", "nsz", "arcp"}
"""Fast-math flags for sums only: without them LLVM keeps a sum's order and cannot vectorise it."""

STEEPEST = 300.0
"""Exponents are cut here: exp(-300) = 5e-131 is as good as 0 and no (slow) denormal number."""

LANES = 8
"""Training points are padded to a multiple of this, so that vectorised loops have no tail."""


@scalar_function
def gaussian(square):
    """exp(-square / 2) for square >= 0, to a few ulp; branch-free, so that loops over it vectorise."""
    return falling(0.5 * square, STEEPEST)


@scalar_function
def matern(square):
    """Matern 5/2 for the squared distance >= 0, as accurate and as free of branches as `gaussian`."""
    step = np.sqrt(5.0 * square)
    return (1.0 + step + step * step / 3.0) * falling(step, STEEPEST)


@scalar_function
def _squares_row(scaled, lengths, dims, coordinates, row):
    """Fill `row` with squared distances over the inputs `dims`, a place against all training points."""
    count = len(row)
    for i in range(count):
        row[i] = 0.0
    for k in range(len(dims)):
        place = coordinates[k] / lengths[dims[k]]
        inputs = scaled[dims[k]]
        for i in range(count):
            step = place - inputs[i]
            row[i] += step * step


@apart
@partial(scalar_function, fastmath={"contract"})
def _kernel_row(scaled, lengths, dims, coordinates, row):
    """The same with the squared exponential of these distances."""
    _squares_row(scaled, lengths, dims, coordinates, row)
    for i in range(len(row)):
        row[i] = gaussian(row[i])


@apart
@partial(scalar_function, fastmath={"contract"})
def _matern_row(scaled, lengths, dims, coordinates, row):
    """The same with the Matern function."""
    _squares_row(scaled, lengths, dims, coordinates, row)
    for i in range(len(row)):
        row[i] = matern(row[i])


@apart
@partial(scalar_function, fastmath=REORDER)
def _dot(a, b):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@scalar_function
def _kernel_sum(unit, scaled, lengths, dims, weights, level, row, out):
    for j in range(len(out)):
        _kernel_row(scaled, lengths, dims, unit[j], row)
        out[j] = level + _dot(weights, row)


@scalar_function
def _matern_sum(unit, scaled, lengths, dims, weights, level, row, out):
    for j in range(len(out)):
        _matern_row(scaled, lengths, dims, unit[j], row)
        out[j] = level + _dot(weights, row)


_SUMS = {gaussian: at_first_call(_kernel_sum), matern: at_first_call(_matern_sum)}


def kernel_sum(
    kernel: Callable[..., object],
    unit: Array,
    scaled: Array,
    lengths: Array,
    weights: Array,
    level: float,
) -> Array:
    """Kriging means ``level + sum_i weights_i k(x, x_i)`` at places (n, d) in the unit cube, (n,); `gaussian` or `matern`.

    `scaled` (d, p): training points in the unit cube over the length scales `lengths` (d,), padded (`pad`); `weights` (p,):
    in the units of the answer.
    """
    row, out = np.empty(weights.size), np.empty(len(unit))
    unit, dims = np.ascontiguousarray(unit), np.arange(lengths.size)
    _SUMS[kernel](unit, scaled, lengths, dims, weights, float(level), row, out)
    return out


def pad(points: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points ``(n, d)``, weights ``(n,)`` as ``(d, p)`` and ``(p,)``, p a multiple of `LANES`."""
    count, dims = points.shape
    padded = -(-count // LANES) * LANES
    transposed, filled = np.zeros((dims, padded)), np.zeros(padded)
    transposed[:, :count], filled[:count] = points.T, weights
    return transposed, filled


@scalar_function
def _multiply(a, b, out):
    for i in range(len(out)):
        out[i] = a[i] * b[i]


@apart
@partial(scalar_function, fastmath=REORDER)
def _four_dots(table, first, row, out, at):
    """``out[at + k] = table[first + k] @ row`` for k < 4; four sums share each load of `row`."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    t0, t1, t2, t3 = table[first], table[first + 1], table[first + 2], table[first + 3]
    for i in range(len(row)):
        a += t0[i] * row[i]
        b += t1[i] * row[i]
        c += t2[i] * row[i]
        d += t3[i] * row[i]
    out[at], out[at + 1], out[at + 2], out[at + 3] = a, b, c, d


@apart
@partial(scalar_function, fastmath=REORDER)
def _weighted_moments(values, weights):
    """Mean, and variance about it: the difference E[f^2] - E[f]^2 would cancel."""
    mean, variance = 0.0, 0.0
    for k in range(len(values)):
        mean += weights[k] * values[k]
    for k in range(len(values)):
        step = values[k] - mean
        variance += weights[k] * (step * step)
    return mean, variance


@scalar_function
def _tensor_moments(
    places, shares, counts, starts, dims, steady, steady_shares, scaled, lengths,
    table, stack, digits, first, chance, values, weights, out,
):  # fmt: skip
    groups, still = len(counts), len(steady_shares)
    total = len(values) // still
    for j in range(len(out)):
        at, place = 0, places[j]
        for k in range(groups):
            width = starts[k + 1] - starts[k]
            inputs = dims[starts[k] : starts[k + 1]]
            for node in range(first[k], first[k + 1]):
                _kernel_row(scaled, lengths, inputs, place[at : at + width], table[node])
                at += width
        for k in range(groups):
            digits[k] = 0
        changed = 0
        for node in range(total):
            for k in range(changed, groups):
                line = first[k] + digits[k]
                _multiply(stack[k], table[line], stack[k + 1])
                chance[k + 1] = chance[k] * shares[j, line]
            for q in range(0, still, 4):
                _four_dots(steady, q, stack[groups], values, node * still + q)
            for q in range(still):
                weights[node * still + q] = chance[groups] * steady_shares[q]
            changed = groups - 1
            while changed > 0 and digits[changed] == counts[changed] - 1:
                digits[changed] = 0
                changed -= 1
            digits[changed] += 1
        out[j, 0], out[j, 1] = _weighted_moments(values, weights)


_compiled_moments = at_first_call(_tensor_moments)


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
    groups, size = counts.size, scaled.shape[1]
    tables = np.empty((counts.sum(), size)), np.ones((groups + 1, size))
    digits, first = np.zeros(groups, np.int64), np.cumsum([0, *counts])
    chance, out = np.ones(groups + 1), np.empty((len(places), 2))
    sums = np.empty((2, int(np.prod(counts)) * len(steady)))
    given = map(np.ascontiguousarray, (places, shares, counts, starts, dims, steady, steady_shares))
    _compiled_moments(*given, scaled, lengths, *tables, digits, first, chance, *sums, out)
    return out
