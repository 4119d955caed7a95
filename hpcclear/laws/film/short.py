"""Oil in a bearing that is short beside its diameter: pressure is positive around the direction of w."""

from hpcclear.base.jit import lane_function
from hpcclear.laws.declared import FilmLaw
from hpcclear.laws.reynolds import along_and_across, short_impedance, turned_against


@lane_function
def force(par, row, scale, place, w, s2, i, W):
    """See `FilmLaw.force`."""
    wx, wy = w
    a, b = along_and_across(place, w)
    along, across = short_impedance(a, b, s2)
    return turned_against(scale, along, across, wx, wy)


def scale(viscosity, film_length, bearing_radius, clearance):
    """N s/m."""
    return viscosity * bearing_radius * (film_length / clearance) ** 3


LAW = FilmLaw(
    words="film of a short bearing, from whose sides oil flows out",
    source="Ocvirk 1953, NACA TN 2808",
    formula="mu R L^3/c^3 (I_cc w + I_cs (n x w)), half-Sommerfeld",
    valid="bearings of up to one diameter in length",
    force=force,
    scale=scale,
    lengths=(0.0, 1.0),
)
