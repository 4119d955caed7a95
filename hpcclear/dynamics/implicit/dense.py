"""Small dense systems, real and complex, inside one flat buffer: factorised with row exchanges, solved in place.

Too small for LAPACK (n <= 9): its calls would cost more than the arithmetic. Complex numbers are held as real and
imaginary parts, which keeps their multiplication free of the checks for infinities. Matrices are ``m[a + r n + c]``.
"""

from hpcclear.base.jit import scalar_function


@scalar_function
def exchange_rows(n, m, a, k, other):
    """Exchange rows k and `other` of the matrix that starts at `a`."""
    for c in range(n):
        m[a + k * n + c], m[a + other * n + c] = m[a + other * n + c], m[a + k * n + c]


@scalar_function
def factorise(n, m, a, pivot):
    """LU factors of a real matrix in place, reciprocals of the pivots on the diagonal; row exchanges from `pivot` on.

    Returns False where a pivot is zero or not a number.
    """
    for k in range(n):
        best = k
        for r in range(k + 1, n):
            if abs(m[a + r * n + k]) > abs(m[a + best * n + k]):
                best = r
        m[pivot + k] = best
        if best != k:
            exchange_rows(n, m, a, k, best)
        if not abs(m[a + k * n + k]) > 0.0:
            return False
        inverse = 1.0 / m[a + k * n + k]
        m[a + k * n + k] = inverse
        for r in range(k + 1, n):
            factor = m[a + r * n + k] * inverse
            m[a + r * n + k] = factor
            for c in range(k + 1, n):
                m[a + r * n + c] -= factor * m[a + k * n + c]
    return True


@scalar_function
def solve(n, m, a, pivot, x):
    """Solve in place for n numbers from `x` on, with the factors of `factorise`."""
    for k in range(n):
        other = int(m[pivot + k])
        m[x + k], m[x + other] = m[x + other], m[x + k]
    for r in range(1, n):
        total = m[x + r]
        for c in range(r):
            total -= m[a + r * n + c] * m[x + c]
        m[x + r] = total
    for s in range(n):
        r = n - 1 - s
        total = m[x + r]
        for c in range(r + 1, n):
            total -= m[a + r * n + c] * m[x + c]
        m[x + r] = total * m[a + r * n + r]


@scalar_function
def factorise_complex(n, m, a, b, pivot):
    """LU factors of the complex matrix with real parts from `a` on and imaginary parts from `b` on; as `factorise`."""
    for k in range(n):
        best = k
        for r in range(k + 1, n):
            here = abs(m[a + r * n + k]) + abs(m[b + r * n + k])
            if here > abs(m[a + best * n + k]) + abs(m[b + best * n + k]):
                best = r
        m[pivot + k] = best
        if best != k:
            exchange_rows(n, m, a, k, best)
            exchange_rows(n, m, b, k, best)
        pa = m[a + k * n + k]
        pb = m[b + k * n + k]
        square = pa * pa + pb * pb
        if not square > 0.0:
            return False
        pa = pa / square
        pb = -pb / square
        m[a + k * n + k] = pa
        m[b + k * n + k] = pb
        for r in range(k + 1, n):
            j = r * n + k
            fa = m[a + j] * pa - m[b + j] * pb
            fb = m[a + j] * pb + m[b + j] * pa
            m[a + j] = fa
            m[b + j] = fb
            for c in range(k + 1, n):
                m[a + r * n + c] -= fa * m[a + k * n + c] - fb * m[b + k * n + c]
                m[b + r * n + c] -= fa * m[b + k * n + c] + fb * m[a + k * n + c]
    return True


@scalar_function
def solve_complex(n, m, a, b, pivot, x, y):
    """Solve in place for x + i y, with the factors of `factorise_complex`."""
    for k in range(n):
        other = int(m[pivot + k])
        m[x + k], m[x + other] = m[x + other], m[x + k]
        m[y + k], m[y + other] = m[y + other], m[y + k]
    for r in range(1, n):
        u = m[x + r]
        v = m[y + r]
        for c in range(r):
            j = r * n + c
            u -= m[a + j] * m[x + c] - m[b + j] * m[y + c]
            v -= m[a + j] * m[y + c] + m[b + j] * m[x + c]
        m[x + r] = u
        m[y + r] = v
    for s in range(n):
        r = n - 1 - s
        u = m[x + r]
        v = m[y + r]
        for c in range(r + 1, n):
            j = r * n + c
            u -= m[a + j] * m[x + c] - m[b + j] * m[y + c]
            v -= m[a + j] * m[y + c] + m[b + j] * m[x + c]
        j = r * n + r
        m[x + r] = m[a + j] * u - m[b + j] * v
        m[y + r] = m[a + j] * v + m[b + j] * u
