"""Small dense systems, real and complex, inside one flat buffer: inverted with row exchanges.

Too small for LAPACK: its calls would cost more than the arithmetic. Inverted instead of factorised, since a product with an
inverse is a sum of its columns, each a vector, where substitution goes number by number; what Newton's iteration loses by
it in accuracy it corrects. Complex numbers are held as real and imaginary parts, which keeps their multiplication free of the
checks for infinities.

A matrix is given by its n columns, each in `memory.BLOCKS` rows of eight of which `blocks` are used, and so is its inverse,
which takes its place. Elimination by rows (Gauss and Jordan) of a matrix whose rows are these columns makes the rows of its
inverse: the columns of the other's.
"""

from hpcclear.base.eight import fetch, put
from hpcclear.base.jit import lane_function, scalar_function
from hpcclear.dynamics.implicit import memory as mem
from hpcclear.dynamics.implicit.memory import BLOCKS, LANES


@scalar_function
def exchange_rows(blocks, m, a, k, other):
    """Exchange rows k and `other` of the matrix that starts at row `a`."""
    for b in range(blocks):
        one, two = a + k * BLOCKS + b, a + other * BLOCKS + b
        first, second = fetch(m, one), fetch(m, two)
        put(m, one, second)
        put(m, two, first)


@scalar_function
def exchange_places(n, m, a, k, other):
    """Exchange the numbers at places k and `other` of all rows."""
    for r in range(n):
        row = (a + r * BLOCKS) * LANES
        m[row + k], m[row + other] = m[row + other], m[row + k]


@lane_function
def unit_row(k, b):
    """Row of `memory.MARK` that has a 1 at place k of a row's block b."""
    place = k - b * LANES
    return place if 0 <= place < LANES else LANES


@scalar_function
def restore_places(n, m, a, pivot):
    """What exchanged rows of a matrix mean for its inverse: the same of its places, last ones first."""
    for s in range(n):
        k = n - 1 - s
        other = int(m[pivot * LANES + k])
        if other != k:
            exchange_places(n, m, a, k, other)


@lane_function
def eliminate(n, blocks, m, a, pivot, k):
    """Step k of the inversion of the real matrix at row `a`. Returns False where the pivot is zero or not a number."""
    best = k
    for r in range(k + 1, n):
        if abs(m[(a + r * BLOCKS) * LANES + k]) > abs(m[(a + best * BLOCKS) * LANES + k]):
            best = r
    m[pivot * LANES + k] = best
    if best != k:
        exchange_rows(blocks, m, a, k, best)
    number = m[(a + k * BLOCKS) * LANES + k]
    inverse = 1.0 / number
    for b in range(blocks):
        i, unit = a + k * BLOCKS + b, unit_row(k, b)
        row = fetch(m, i) * fetch(m, mem.HOLE + unit) + fetch(m, mem.MARK + unit)
        put(m, i, row * inverse)
    for r in range(n):
        factor = m[(a + r * BLOCKS) * LANES + k]
        if r != k:
            for b in range(blocks):
                i, j = a + r * BLOCKS + b, a + k * BLOCKS + b
                kept = fetch(m, i) * fetch(m, mem.HOLE + unit_row(k, b))
                put(m, i, kept - factor * fetch(m, j))
    return abs(number) > 0.0


@lane_function
def scale_complex(blocks, m, a, c, k, re, im):
    """Row k over its pivot, whose reciprocal is re + i im and takes its place."""
    for b in range(blocks):
        i, unit = k * BLOCKS + b, unit_row(k, b)
        hole = fetch(m, mem.HOLE + unit)
        u, v = fetch(m, a + i) * hole + fetch(m, mem.MARK + unit), fetch(m, c + i) * hole
        put(m, a + i, u * re - v * im)
        put(m, c + i, u * im + v * re)


@lane_function
def subtract_complex(blocks, m, a, c, r, k):
    """Subtract from row r row k, times what stood at its place k."""
    place = r * BLOCKS * LANES + k
    re, im = m[a * LANES + place], m[c * LANES + place]
    for b in range(blocks):
        i, j = r * BLOCKS + b, k * BLOCKS + b
        hole = fetch(m, mem.HOLE + unit_row(k, b))
        u, v = fetch(m, a + j), fetch(m, c + j)
        put(m, a + i, fetch(m, a + i) * hole - re * u + im * v)
        put(m, c + i, fetch(m, c + i) * hole - re * v - im * u)


@lane_function
def eliminate_complex(n, blocks, m, a, c, pivot, k):
    """Step k of the inversion of the complex matrix with real parts at row `a`, imaginary ones at row `c`; as `eliminate`."""
    best, largest = k, -1.0
    for r in range(k, n):
        place = r * BLOCKS * LANES + k
        here = abs(m[a * LANES + place]) + abs(m[c * LANES + place])
        if here > largest:
            best, largest = r, here
    m[pivot * LANES + k] = best
    if best != k:
        exchange_rows(blocks, m, a, k, best)
        exchange_rows(blocks, m, c, k, best)
    place = k * BLOCKS * LANES + k
    re, im = m[a * LANES + place], m[c * LANES + place]
    square = re * re + im * im
    scale_complex(blocks, m, a, c, k, re / square, -im / square)
    for r in range(n):
        if r != k:
            subtract_complex(blocks, m, a, c, r, k)
    return square > 0.0


@scalar_function
def invert_both(n, blocks, m):
    """Invert the real matrix of a step and the complex one, side by side: neither waits for the other's quotients.

    Returns False where one is singular or holds what is no number.
    """
    good = True
    for k in range(n):
        real = eliminate(n, blocks, m, mem.REAL, mem.PIVOT, k)
        other = eliminate_complex(
            n, blocks, m, mem.COMPLEX_RE, mem.COMPLEX_IM, mem.COMPLEX_PIVOT, k
        )
        good = good and real and other
    restore_places(n, m, mem.REAL, mem.PIVOT)
    restore_places(n, m, mem.COMPLEX_RE, mem.COMPLEX_PIVOT)
    restore_places(n, m, mem.COMPLEX_IM, mem.COMPLEX_PIVOT)
    return good
