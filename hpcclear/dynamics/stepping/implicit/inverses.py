"""Inverses of eight small matrices batched, real and complex: a matrix to each column of rows of eight.

Rows are exchanged in each matrix for itself: compared with the pivot's row one after the other, and taken instead where they
are larger. No column's numbers depend on another's.
"""

from hpcclear.base.eight import above, fetch, put, size, spread
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics.stepping.implicit.memory import EXCHANGED, N


@lane_function
def exchange(m, flag, one, other):
    """Exchange two rows of eight where `flag` is 1."""
    first, second = fetch(m, one), fetch(m, other)
    put(m, one, above(flag, second, first))
    put(m, other, above(flag, first, second))


@lane_function
def weight(m, first, imaginary, place):
    """How large a number of the matrix is."""
    total = size(fetch(m, first + place))
    if imaginary is not None:
        total = total + size(fetch(m, imaginary + place))
    return total


@lane_function
def choose_pivot(n, m, first, imaginary, k):
    """Bring the largest number of what is left of column k to its place, by exchanges of rows that are kept."""
    for r in range(k + 1, n):
        more = weight(m, first, imaginary, r * N + k) - weight(m, first, imaginary, k * N + k)
        flag = above(more, spread(1.0), spread(0.0))
        put(m, EXCHANGED + k * N + r, flag)
        for c in range(n):
            exchange(m, flag, first + k * N + c, first + r * N + c)
            if imaginary is not None:
                exchange(m, flag, imaginary + k * N + c, imaginary + r * N + c)


@lane_function
def restore_columns(n, m, first):
    """What exchanged rows of a matrix mean for its inverse: the same of its columns, last ones first."""
    for k in range(n - 1, -1, -1):
        for r in range(n - 1, k, -1):
            flag = fetch(m, EXCHANGED + k * N + r)
            for c in range(n):
                exchange(m, flag, first + c * N + k, first + c * N + r)


@scalar_function
def invert_real(n, m, first):
    """Invert the real matrices from row `first` on in their places; no numbers come out of one that is singular."""
    for k in range(n):
        choose_pivot(n, m, first, None, k)
        inverse = 1.0 / fetch(m, first + k * N + k)
        put(m, first + k * N + k, spread(1.0))
        for c in range(n):
            put(m, first + k * N + c, fetch(m, first + k * N + c) * inverse)
        for r in range(n):
            if r != k:
                factor = fetch(m, first + r * N + k)
                put(m, first + r * N + k, spread(0.0))
                for c in range(n):
                    place = first + r * N + c
                    put(m, place, fetch(m, place) - factor * fetch(m, first + k * N + c))
    restore_columns(n, m, first)


@lane_function
def subtract(n, m, first, imaginary, k, r):
    """Subtract from row r of the complex matrices row k, times what stood at its place k."""
    re, im = fetch(m, first + r * N + k), fetch(m, imaginary + r * N + k)
    put(m, first + r * N + k, spread(0.0))
    put(m, imaginary + r * N + k, spread(0.0))
    for c in range(n):
        here, there = r * N + c, k * N + c
        u, v = fetch(m, first + there), fetch(m, imaginary + there)
        put(m, first + here, fetch(m, first + here) - re * u + im * v)
        put(m, imaginary + here, fetch(m, imaginary + here) - re * v - im * u)


@scalar_function
def invert_complex(n, m, first, imaginary):
    """Invert the complex matrices whose real parts stand from row `first` on, likewise."""
    for k in range(n):
        choose_pivot(n, m, first, imaginary, k)
        a, b = fetch(m, first + k * N + k), fetch(m, imaginary + k * N + k)
        inverse = 1.0 / (a * a + b * b)
        re, im = a * inverse, spread(0.0) - b * inverse
        put(m, first + k * N + k, spread(1.0))
        put(m, imaginary + k * N + k, spread(0.0))
        for c in range(n):
            place = k * N + c
            u, v = fetch(m, first + place), fetch(m, imaginary + place)
            put(m, first + place, u * re - v * im)
            put(m, imaginary + place, u * im + v * re)
        for r in range(n):
            if r != k:
                subtract(n, m, first, imaginary, k, r)
    restore_columns(n, m, first)
    restore_columns(n, m, imaginary)
