"""Force and moments of an oil film in a journal bearing, from the Reynolds equation.

With e the journal's centre relative to the bearing's and w = v - omega x e its velocity seen from axes that turn with the mean
omega of both spins, a film of thickness h = c - e.u(theta) is squeezed by w alone, whatever part of that is wedge
and whatever squeeze (Booker 1965, doi:10.1115/1.3650586). So a film is two functions of the eccentricity, over c, along w
and across it. Where pressure would be below ambient there is none (half-Sommerfeld, Guembel): it acts on half of the
circumference. All that is integrated there follows from

    Phi(a, b) = integral of 1/D, D = 1 - a cos - b sin, from -pi/2 to pi/2 = 2 psi/s,
    s^2 = 1 - a^2 - b^2, cos psi = -a/sqrt(1 - b^2),

by differentiation, as d psi/da = 1/s and d psi/db = a b/(s (1 - b^2)). No term divides by the eccentricity.

Which half that is, and what follows, each film of `laws.film` says.
"""

import math

from hpcclear.base.bits import no_less
from hpcclear.base.jit import lane_function

EIGHTH = math.tan(math.pi / 8.0)

TINY = 1e-300  # keeps the direction of a film at rest defined (and zero)


@lane_function
def small_arctan(t):
    """Arc tangent for |t| <= sqrt(2) - 1 = tan(pi/8), within an ulp: the polynomial of Sun's fdlibm (s_atan.c)."""
    z = t * t
    p = 1.62858201153657823623e-02
    p = p * z - 3.65315727442169155270e-02
    p = p * z + 4.97687799461593236017e-02
    p = p * z - 5.83357013379057348645e-02
    p = p * z + 6.66107313738753120669e-02
    p = p * z - 7.69187620504482999495e-02
    p = p * z + 9.09088713343650656196e-02
    p = p * z - 1.11111104054623557880e-01
    p = p * z + 1.42857142725034663711e-01
    p = p * z - 1.99999999998764832476e-01
    p = p * z + 3.33333333333329318027e-01
    return t - t * (z * p)


@lane_function
def half_circle_angle(a, s, r2):
    """psi from 0 to pi whose tangent is s/-a, for s > 0; and 1/`r2`, from the same quotient.

    That is of the smaller by the larger, or near their balance of their difference by their sum; chosen, in place of branches:
    roots and quotients are what a film's force costs.
    """
    size = abs(a)
    flat, steep = s <= EIGHTH * size, size <= EIGHTH * s
    over = size if flat else (-s if steep else s + size)
    under = s if flat else (size if steep else s - size)
    base = 0.0 if flat else (math.pi / 2.0 if steep else math.pi / 4.0)
    both = 1.0 / (over * r2)
    angle = base + small_arctan(under * (both * r2))
    return (angle if a <= 0.0 else math.pi - angle), both * over


@lane_function
def film_thickness(gap, clearance, floor):
    """Least film thickness over the clearance, for a `gap` |e| - c of the centres.

    It is the depth, 1 less the eccentricity over the clearance, from twice the `floor` on, the `floor` where surfaces touch,
    and a parabola between: so does the mean gap between surfaces whose heights are spread evenly.
    """
    inverse = 1.0 / (clearance * floor)  # one for both: quotients are what a film's force costs
    depth = -gap * (inverse * floor)
    inside = no_less(depth, 0.0)
    beyond = no_less(inside - 2.0 * floor, 0.0)
    near = inside - beyond
    return floor + near * near * (0.25 * inverse * clearance) + beyond


@lane_function
def half_circle(a, s2):
    """What integrals over the half circle are made of: 1/(a^2 + s^2), 1/s^2, 1/s^4 and psi/s^5."""
    s = math.sqrt(s2)
    q = 1.0 / s2
    q2 = q * q
    angle, inverse = half_circle_angle(a, s, s2 + a * a)
    return inverse, q, q2, angle * (q2 * q * s)


@lane_function
def short_impedance(a, b, s2):
    """Integrals of cos^2/D^3 and cos sin/D^3 over the half circle: the short film's force along w and across."""
    inverse, _, q2, turned = half_circle(a, s2)
    along = 3.0 * a * q2 + turned * (s2 + 3.0 * a * a)
    across = b * (2.0 + a * a * inverse) * q2 + 3.0 * a * b * turned
    return along, across


@lane_function
def along_and_across(eccentricity, w):
    """The eccentricity's components along w and across it, where w is not zero."""
    ex, ey = eccentricity
    wx, wy = w
    inverse = 1.0 / math.sqrt(wx * wx + wy * wy + TINY)
    return (ex * wx + ey * wy) * inverse, (ey * wx - ex * wy) * inverse


@lane_function
def turned_against(scale, along, across, wx, wy):
    """Force on the journal, N: against w by `along`, and across it, over `scale`."""
    return -scale * (along * wx - across * wy), -scale * (along * wy + across * wx)
