"""Oil in a bearing that is long beside its diameter: pressure is ambient at both ends of a half circle.

That lies around 2 w + e (e.w)/c^2. For pure wedge this is Sommerfeld's half film, for pure squeeze the half that is being
squeezed.
"""

import math

from hpcclear.base.jit import lane_function
from hpcclear.laws.declared import FilmLaw
from hpcclear.laws.reynolds import TINY, half_circle, turned_against


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
def force(par, row, scale, place, w, s2, i, W):
    """See `FilmLaw.force`."""
    ex, ey = place
    wx, wy = w
    pressed = ex * wx + ey * wy
    mx = 2.0 * wx + ex * pressed
    my = 2.0 * wy + ey * pressed
    inverse = 1.0 / math.sqrt(mx * mx + my * my + TINY)
    mx *= inverse
    my *= inverse
    along, across = long_impedance(
        ex * mx + ey * my, ey * mx - ex * my, s2, wx * mx + wy * my, wy * mx - wx * my
    )
    return turned_against(scale, along, across, mx, my)


LAW = FilmLaw(
    words="film of a long bearing, around which oil flows",
    source="Sommerfeld 1904",
    formula="12 mu L R^3/c^3 (...), half-Sommerfeld around 2 w + e (e.w)/c^2",
    valid="bearings from two diameters in length on",
    force=force,
    scale=lambda viscosity, film_length, bearing_radius, clearance: (
        12.0 * viscosity * film_length * (bearing_radius / clearance) ** 3
    ),
    lengths=(2.0, math.inf),
)
