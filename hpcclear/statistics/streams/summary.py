"""Summaries of samples: mean, standard deviation, extremes and histogram of every number, and how two of them are merged.

Samples are summed up by fixed blocks of indices, each as a binary tree over its samples in the order of their
indices: so a summary is the same bit for bit wherever the nodes of the tree were worked out.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcclear.base.arrays import Array, Integers
from hpcclear.base.outcome import FIELDS, Flag, Status

BLOCK = 4096
"""Samples in a block. Part of what makes results reproducible: another length merges in another order."""

LEAF = 32
"""Samples whose sums are taken at once. A block's summary is a binary tree over its leaves, so that any node of it can be
worked out anywhere: another length would give other last bits."""

BINS = 200
"""Bins of a histogram, besides one below and one above."""

QUANTITIES = ("objective", "objective_spread", "mean_gap", "peak_contact_force", "rhs_evaluations")
"""Fields of a record that are summarised."""


def rows_of(joints: int) -> list[tuple[str, int]]:
    """Every summarised number of records with so many joints: field, joint (0 for scalars)."""
    return [(n, k) for n in QUANTITIES for k in range(joints if FIELDS[n].per == "joint" else 1)]


@dataclass(frozen=True)
class Summary:
    """Statistics of some samples; of none, when made by `empty`."""

    count: Integers
    """Shape (rows,): finite numbers, for each of `rows_of`."""
    mean: Array
    squares: Array
    minimum: Array
    maximum: Array
    """mean, squares, minimum and maximum, shape (rows,): mean, sum of squared differences from it, extremes; SI."""
    histogram: Integers
    """Shape (rows, bins + 2): numbers below the edges, between each two, and at or above the last."""
    status: Integers
    """Shape (outcomes,): samples by `hpcclear.base.outcome.Status`."""
    flags: Integers
    """Shape (flags,): samples by `hpcclear.base.outcome.Flag`."""

    @property
    def deviation(self) -> Array:
        """Sample standard deviation, shape (rows,); NaN for fewer than two numbers."""
        freedom = np.where(self.count > 1, self.count - 1, 1)
        return np.where(self.count > 1, np.sqrt(self.squares / freedom), np.nan)


class Moments(NamedTuple):
    """Number of values, mean and sum of squared differences from it, arrays of one shape."""

    number: NDArray[Any]
    mean: NDArray[Any]
    squares: NDArray[Any]


def empty(rows: int, bins: int = BINS) -> Summary:
    """The summary of no samples, with so many numbers each."""
    return Summary(
        np.zeros(rows, np.int64),
        np.zeros(rows),
        np.zeros(rows),
        np.full(rows, np.inf),
        np.full(rows, -np.inf),
        np.zeros((rows, bins + 2), np.int64),
        np.zeros(len(Status), np.int64),
        np.zeros(len(Flag), np.int64),
    )


def columns(records: np.ndarray) -> Array:
    """The summarised numbers of records (m,), shape (rows, m); NaN where a sample failed."""
    pieces = [np.atleast_2d(records[name].T).astype(float) for name in QUANTITIES]
    values = np.concatenate(pieces)
    values[:, records["status"] != Status.OK] = np.nan
    return values


def histogram_edges(records: np.ndarray, bins: int = BINS) -> Array:
    """Edges that suit some first samples, shape (rows, bins + 1): their range and half as much on both sides."""
    numbers = columns(records)
    edges = np.empty((len(numbers), bins + 1))
    for row, values in enumerate(numbers):
        known = values[np.isfinite(values)]
        low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
        margin = max(0.5 * (high - low), 1e-6 * max(abs(low), abs(high)), 1e-300)
        edges[row] = np.linspace(low - margin, high + margin, bins + 1)
    return edges


def tree_length(samples: int) -> int:
    """Samples under the root of a tree for so many: a leaf times a power of two."""
    length = LEAF
    while length < samples:
        length *= 2
    return length


def _halved(values: Array) -> Array:
    """Sums over the last axis, whose length is a power of two, in an order that no shape and no processor changes."""
    while values.shape[-1] > 1:
        middle = values.shape[-1] // 2
        values = values[..., :middle] + values[..., middle:]
    return values[..., 0]


def _merged(first: Moments, second: Moments) -> Moments:
    """Count, mean and sum of squares of both; element by element."""
    count = first.number + second.number
    share = second.number / np.maximum(count, 1)
    apart = second.mean - first.mean
    squares = first.squares + second.squares + np.square(apart) * first.number * share
    return Moments(count, first.mean + apart * share, squares)


def _moments(values: Array, length: int) -> Moments:
    """Count, mean and squares of each row of (rows, m) numbers, NaN left out, as the tree of `length` gives them."""
    padded = np.full((len(values), length), np.nan)
    padded[:, : values.shape[1]] = values
    leaves = padded.reshape(len(values), -1, LEAF)
    known = np.isfinite(leaves)
    count = known.sum(axis=-1)
    mean = _halved(np.where(known, leaves, 0.0)) / np.maximum(count, 1)
    squares = _halved(np.square(np.where(known, leaves - mean[..., None], 0.0)))
    found = Moments(count, mean, squares)
    while found.number.shape[1] > 1:
        even, odd = ([x[:, k::2] for x in found] for k in (0, 1))
        found = _merged(Moments(*even), Moments(*odd))
    count, mean, squares = found
    return Moments(count[:, 0], mean[:, 0], squares[:, 0])


def summarise(records: np.ndarray, edges: Array, length: int | None = None) -> Summary:
    """Summary of records, shape (m,), in their order.

    Parameters
    ----------
    records : ndarray
        Neighbouring samples; where there are fewer than `length`, the design's last ones.
    edges : ndarray
        As `histogram_edges`.
    length : int, optional
        Samples under this node of the tree, `tree_length` of what there is by default.
    """
    result = empty(len(edges), edges.shape[1] - 1)
    values = columns(records)
    moments = _moments(values, tree_length(records.size) if length is None else length)
    result.count[:], result.mean[:], result.squares[:] = moments
    for row, numbers in enumerate(values):
        known = numbers[np.isfinite(numbers)]
        if known.size:
            result.minimum[row], result.maximum[row] = known.min(), known.max()
            cells = np.searchsorted(edges[row], known, side="right")
            result.histogram[row] = np.bincount(cells, minlength=edges.shape[1] + 1)
    result.status[:] = np.bincount(records["status"], minlength=len(Status))
    for k, flag in enumerate(Flag):
        result.flags[k] = np.count_nonzero(records["flags"] & int(flag))
    return result


def merge(first: Summary, second: Summary) -> Summary:
    """Summary of both (Chan, Golub and LeVeque 1983, doi:10.1080/00031305.1983.10483115)."""
    moments = _merged(
        Moments(first.count, first.mean, first.squares),
        Moments(second.count, second.mean, second.squares),
    )
    return Summary(
        *moments,
        np.minimum(first.minimum, second.minimum),
        np.maximum(first.maximum, second.maximum),
        first.histogram + second.histogram,
        first.status + second.status,
        first.flags + second.flags,
    )
