"""What happens inside a step: impacts to stop at, and gaps that change sign. Scalar code, run for few lanes."""

import math

from hpcclear.base.jit import scalar_function


@scalar_function
def hermite(d0, m0, d1, m1, s):
    """Cubic on [0, 1] with values d0, d1 and slopes m0, m1 at its ends, at s."""
    return d0 + s * (m0 + s * ((3.0 * (d1 - d0) - 2.0 * m0 - m1) + s * (2.0 * (d0 - d1) + m0 + m1)))


@scalar_function
def hermite_integral(d0, m0, d1, m1, s):
    """Integral of that cubic from 0 to s."""
    c2 = 3.0 * (d1 - d0) - 2.0 * m0 - m1
    c3 = 2.0 * (d0 - d1) + m0 + m1
    return s * (d0 + s * (0.5 * m0 + s * (c2 / 3.0 + s * 0.25 * c3)))


@scalar_function
def interior_peak(d0, m0, d1, m1):
    """Where in (0, 1) the cubic, rising at 0 and falling at 1, is largest."""
    a = 3.0 * (2.0 * (d0 - d1) + m0 + m1)
    b = 2.0 * (3.0 * (d1 - d0) - 2.0 * m0 - m1)
    discriminant = math.sqrt(max(b * b - 4.0 * a * m0, 0.0))
    # the root of a s^2 + b s + m0 at which the slope changes from + to -
    return min(max(2.0 * m0 / (discriminant - b), 0.0), 1.0) if discriminant > b else 0.5


@scalar_function
def root(d0, m0, d1, m1, end):
    """Where the cubic changes sign between 0 and `end`; Newton kept inside a shrinking bracket."""
    low, high = 0.0, end
    rising = hermite(d0, m0, d1, m1, end) > d0
    c2 = 3.0 * (d1 - d0) - 2.0 * m0 - m1
    c3 = 2.0 * (d0 - d1) + m0 + m1
    s = 0.5 * end
    for _ in range(60):
        value = hermite(d0, m0, d1, m1, s)
        if (value > 0.0) == rising:
            high = s
        else:
            low = s
        slope = m0 + s * (2.0 * c2 + s * 3.0 * c3)
        new = s - value / slope if slope != 0.0 else -1.0
        if not (low < new < high):
            new = 0.5 * (low + high)
        if abs(new - s) <= 1e-14 * end:
            return new
        s = new
    return s


@scalar_function
def impact_fraction(d0, m0, d1, m1, target):
    """Fraction of the step at which a gap in flight first reaches `target`; 2 if it does not, 0 if it starts there."""
    d0 -= target
    d1 -= target
    if d0 >= 0.0:
        return 0.0 if d1 > 0.0 else 2.0
    if d1 > 0.0:
        return root(d0, m0, d1, m1, 1.0)
    if m0 > 0.0 and m1 < 0.0:
        peak = interior_peak(d0, m0, d1, m1)
        if hermite(d0, m0, d1, m1, peak) > 0.0:
            return root(d0, m0, d1, m1, peak)
    return 2.0


@scalar_function
def absolute_integral(integral, d0, m0, d1, m1):
    """Integral of |d| over a step in which d changes sign once, from the integral of d.

    The shorter side comes from the cubic, the rest from the method's own quadrature, so that the kink of |d| does
    not cost its order.
    """
    s = root(d0, m0, d1, m1, 1.0)
    first = hermite_integral(d0, m0, d1, m1, s)
    return abs(first) + abs(integral - first)
