"""What happens inside a step: impacts to stop at, and gaps that change sign. Scalar code, run for few lanes."""

import math

from hpcclear.base.jit import scalar_function
from hpcclear.dynamics import layout as at

KINK_REACH = 1e-3
"""Part of a step that a gap's zero may stand from either end: a kink of the force there does no harm, as its effect falls with
the 2.5th power, and what the gap does between the two is straight."""


@scalar_function
def gap_in_step(lane, W, work, p):
    """Joint p's gap at both ends of a lane's step, and its rates there times the step: d0, m0, d1, m1, of a cubic."""
    h = work[at.STEP * W + lane]
    return (
        work[(at.RATE_OLD + at.GAP + p) * W + lane],
        h * work[(at.RATE_OLD + at.GAP_RATE + p) * W + lane],
        work[(at.RATE_NOW + at.GAP + p) * W + lane],
        h * work[(at.RATE_NOW + at.GAP_RATE + p) * W + lane],
    )


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
    """Where the cubic changes sign between 0 and `end`: Halley's iteration from the chord on, kept inside a shrinking bracket.

    With derivatives f1, f2 and f3 a change e leaves an error of some ((f2/2f1)**2 + |f3/6f1|) e**3, which shows whether
    another would matter.
    """
    low, high = 0.0, end
    c2 = 3.0 * (d1 - d0) - 2.0 * m0 - m1
    c3 = 2.0 * (d0 - d1) + m0 + m1
    after = hermite(d0, m0, d1, m1, end)
    rising = after > d0
    s = end * (d0 / (d0 - after))
    if not (low < s < high):
        s = 0.5 * end
    for _ in range(60):
        value = d0 + s * (m0 + s * (c2 + s * c3))
        if (value > 0.0) == rising:
            high = s
        else:
            low = s
        inverse = 1.0 / (m0 + s * (2.0 * c2 + s * 3.0 * c3))
        bend = (c2 + 3.0 * s * c3) * inverse
        step = value * inverse
        change = step / (1.0 - step * bend)
        new = s - change
        if low <= new <= high and abs(step * bend) < 0.5:  # beyond, it would settle on an extremum
            left = (
                change * change * (bend * bend + abs(c3 * inverse))
            )  # of the change, if it is small
            if left <= 1e-6 and left * abs(change) <= 1e-16 * end:
                return new
        else:
            new = 0.5 * (low + high)
            if high - low <= 1e-14 * end:
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
def zero_at_start(d0, m0):
    """Whether the gap becomes 0 within `KINK_REACH` of the start of the step."""
    return d0 * d0 <= -KINK_REACH * m0 * d0


@scalar_function
def zero_at_end(d1, m1):
    """Whether it became 0 within `KINK_REACH` of the end."""
    return d1 * d1 <= KINK_REACH * m1 * d1


@scalar_function
def absolute_integral(integral, d0, m0, d1, m1):
    """Integral of |d| over a step in which d changes sign once, from the integral of d.

    The shorter side comes from the cubic, or a triangle, the rest from the method's own quadrature, so that the kink of |d|
    does not cost its order.
    """
    if zero_at_end(d1, m1):
        part = 0.5 * d1 * d1 / m1
    elif zero_at_start(d0, m0):
        part = -0.5 * d0 * d0 / m0
    else:
        part = hermite_integral(d0, m0, d1, m1, root(d0, m0, d1, m1, 1.0))
    return abs(part) + abs(integral - part)
