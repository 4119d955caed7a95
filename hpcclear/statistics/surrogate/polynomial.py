"""Polynomials of several inputs, term by term: a term is the row of its exponents."""

from itertools import combinations_with_replacement
from math import comb

import numpy as np

from hpcclear.base.arrays import Array, Integers


def n_terms(n_inputs: int, order: int) -> int:
    """Number of terms of a polynomial of total order `order` in `n_inputs` inputs."""
    return comb(n_inputs + order, order)


def exponents_up_to(n_inputs: int, order: int) -> Integers:
    """Exponents of all terms up to a total order, shape (t, d), the constant first."""
    inputs = range(n_inputs)
    chosen = (c for k in range(order + 1) for c in combinations_with_replacement(inputs, k))
    return np.array([[c.count(j) for j in range(n_inputs)] for c in chosen], dtype=np.int64)


def monomials(z: Array, exponents: Integers) -> Array:
    """All terms, exponents (t, d), at scaled points (n, d): shape (n, t)."""
    terms = np.ones((len(z), len(exponents)))
    for j in range(z.shape[1]):  # input by input: no array of n x t x d
        terms *= z[:, j, np.newaxis] ** exponents[:, j]
    return terms


def slopes(z: Array, exponents: Integers, j: int) -> Array:
    """Derivatives of all terms with respect to scaled input j, shape (n, t)."""
    lowered = exponents.copy()
    lowered[:, j] = np.maximum(exponents[:, j] - 1, 0)
    return exponents[:, j] * monomials(z, lowered)
