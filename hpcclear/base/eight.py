"""Vectors of eight numbers as values of compiled code, for eight samples in a batch; here as Python computes with them.

The compiler makes vectors of short loops only where it can show that no store meets a load, which it cannot once a row's
place is a number that comes at run time; and every one of eight copies that are written out is read instead, which took
most of the time to compile. A vector is one value of compiled code, whatever rows it comes from (`hpcclear.base.lowering`).
Where registers hold fewer numbers LLVM splits it.
"""

import numpy as np

from hpcclear.base.arrays import Array

EIGHT = 8


def fetch(array: Array, row: int) -> Array:
    """Row of a flat array of doubles: what stands from 8 row on."""
    return array[EIGHT * row : EIGHT * row + EIGHT].copy()


def put(array: Array, row: int, vector: Array) -> None:
    """Put a vector into a row of a flat array of doubles."""
    array[EIGHT * row : EIGHT * row + EIGHT] = vector


def spread(number: float) -> Array:
    """A vector of eight times the same number."""
    return np.full(EIGHT, number)


def above(vector: Array, yes: Array, no: Array) -> Array:
    """Of two vectors, number by number, the first where a third is above 0, else the second."""
    return np.where(vector > 0.0, yes, no)


def size(vector: Array) -> Array:
    """A vector's numbers without their signs."""
    return np.abs(vector)
