"""Force and moments of an oil film in a journal bearing, from the Reynolds equation.

With e the journal's centre relative to the bearing's and w = v - omega x e its velocity seen from axes that turn with the mean
omega of both spins, a film of thickness h = c - e.u(theta) is squeezed by w alone, whatever part of that is wedge
and whatever squeeze (Booker 1965, doi:10.1115/1.3650586). So a film is two functions of the eccentricity, over c, along w
and across it. Where pressure would be below ambient there is none (half-Sommerfeld, Guembel): it acts on half of the
circumference. All that is integrated there follows from

    Phi(a, b) = integral of 1/D, D = 1 - a cos - b sin, from -pi/2 to pi/2 = 2 psi/s,
    s^2 = 1 - a^2 - b^2, cos psi = -a/sqrt(1 - b^2),

by differentiation, as d psi/da = 1/s and d psi/db = a b/(s (1 - b^2)). No term divides by the eccentricity.

- Short bearing (Ocvirk 1953, NACA TN 2808): pressure is positive around the direction of w.
- Finite bearing: as a short one, but for factors by which Reynolds' equation in both directions differs (`dynamics.bearing`).
- Long bearing (Sommerfeld 1904): at both ends of the half circle that is ambient; it lies around 2 w + e (e.w)/c^2. For pure
  wedge this is Sommerfeld's half film, for pure squeeze the half that is being squeezed.
"""

import math

from hpcclear.base.bits import no_less
from hpcclear.base.jit import lane_function

LEAST_S = 0.19899748742132398
"""s at an eccentricity of 0.98, up to which finite bearings are fitted."""

EIGHTH = math.tan(math.pi / 8.0)
HALF_TURN = math.pi

_TINY = 1e-300  # keeps the direction of a film at rest defined (and zero)


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
    base = 0.0 if flat else (HALF_TURN / 2.0 if steep else HALF_TURN / 4.0)
    both = 1.0 / (over * r2)
    angle = base + small_arctan(under * (both * r2))
    return (angle if a <= 0.0 else HALF_TURN - angle), both * over


@lane_function
def half_angle_sine(a, s, r):
    """sin(psi/2) for r = sqrt(a^2 + s^2)."""
    far = r + abs(a)
    less = far if a <= 0.0 else s * s / far  # r - a = r (1 + cos psi)
    return s / math.sqrt(2.0 * r * less)


@lane_function
def film_thickness(gap, clearance, floor):
    """Least film thickness over the clearance, for a `gap` |e| - c of the centres.

    It is the depth, 1 less the eccentricity over the clearance, from twice the `floor` on, and the floor where surfaces touch,
    a parabola between: so does the mean gap between surfaces whose heights are spread evenly.
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
def long_impedance(a, b, s2, along, across):
    """Force of the long film along its middle and across, over 12 mu L R^3/c^3, on the half circle around the first axis; w has
    the components `along` and `across`. Turned against w: minus what is returned.

    From R dp/dtheta = 12 mu R^3/h^3 (w.t + C), whose C makes the pressure periodic, by parts.
    """
    inverse, q, q2, turned = half_circle(a, s2)
    # of Phi: its first derivatives, and half of the second
    first_a = 2.0 * (q + a * turned * s2)
    over = a * inverse
    first_b = 2.0 * b * (over * q + turned * s2)
    aa = 3.0 * a * q2 + turned * (s2 + 3.0 * a * a)
    ab = b * (2.0 + a * over) * q2 + 3.0 * a * b * turned
    bb = over * q + turned * s2 + b * b * (over * (3.0 * q2 + 2.0 * q * inverse) + 3.0 * turned)
    cosine = first_a + a * aa + b * ab  # integrals of cos/D^3, sin/D^3
    sine = first_b + a * ab + b * bb
    constant = -3.0 * (a * across - b * along) / (3.0 - s2)
    return along * bb - across * ab - constant * sine, across * aa - along * ab + constant * cosine


@lane_function
def along_and_across(eccentricity, w):
    """The eccentricity's components along w and across it, where w is not zero."""
    ex, ey = eccentricity
    wx, wy = w
    inverse = 1.0 / math.sqrt(wx * wx + wy * wy + _TINY)
    return (ex * wx + ey * wy) * inverse, (ey * wx - ex * wy) * inverse


@lane_function
def short_force(flag, scale, eccentricity, w, s2):
    """Force on the journal, N, of a short film; `scale`: mu R L^3/c^3; eccentricity over c, w in m/s; 0 with it off."""
    if flag is not None:
        wx, wy = w
        a, b = along_and_across(eccentricity, w)
        along, across = short_impedance(a, b, s2)
        return -scale * (along * wx - across * wy), -scale * (along * wy + across * wx)
    else:
        return 0.0, 0.0


@lane_function
def long_force(flag, scale, eccentricity, w, s2):
    """As `short_force`, of a long film; `scale`: 12 mu L R^3/c^3."""
    if flag is not None:
        ex, ey = eccentricity
        wx, wy = w
        pressed = ex * wx + ey * wy
        mx = 2.0 * wx + ex * pressed
        my = 2.0 * wy + ey * pressed
        inverse = 1.0 / math.sqrt(mx * mx + my * my + _TINY)
        mx *= inverse
        my *= inverse
        along, across = long_impedance(
            ex * mx + ey * my, ey * mx - ex * my, s2, wx * mx + wy * my, wy * mx - wx * my
        )
        return -scale * (along * mx - across * my), -scale * (along * my + across * mx)
    else:
        return 0.0, 0.0


@lane_function
def finite_scales(a, s2):
    """s and sin(psi/2) as the polynomials of finite bearings take them, from -1 to 1; s no less than is fitted."""
    s = math.sqrt(s2)
    sine = half_angle_sine(a, s, math.sqrt(s2 + a * a))
    return (2.0 * max(s, LEAST_S) - (1.0 + LEAST_S)) / (1.0 - LEAST_S), 2.0 * sine - 1.0
