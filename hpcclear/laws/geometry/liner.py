"""A thin liner in a stiff bearing, as an elastic foundation: each place yields by itself."""

import math

from hpcclear.laws.declared import Geometry, Parameter


def of_liner(liner_thickness, liner_modulus, liner_poisson_ratio, bearing_radius, length):
    """Force per angle and depth: the modulus of a layer that cannot give way sideways, over its thickness."""
    nu = liner_poisson_ratio
    confined = liner_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return {"foundation": confined * bearing_radius * length / liner_thickness}


def half_angle(depth, clearance):
    """Half of the angle of contact, rad: cos = c/(c + d)."""
    return math.atan(math.sqrt(depth * (2.0 * clearance + depth)) / clearance)


def elastic(depth, clearance, foundation):
    """K ((c + d) angle - c sin angle), N."""
    root = math.sqrt(depth * (2.0 * clearance + depth))
    angle = math.atan(root / clearance)
    return foundation * ((clearance + depth) * angle - clearance * root / (clearance + depth))


def pressure(depth, foundation, bearing_radius, length):
    """Largest pressure, Pa: that of the deepest place."""
    return foundation * depth / (bearing_radius * length)


GEOMETRY = Geometry(
    words="thin liner in a stiff bearing, an elastic foundation",
    source="Winkler's foundation; Podra and Andersson 1997, doi:10.1016/S0043-1648(96)07468-6; "
    "Johnson 1985, Contact Mechanics, section 4.3",
    formula="K ((c + d) a - c sin a), cos a = c/(c + d)",
    valid="liners that are thin beside the width of contact, up to a tenth of their thickness",
    parameters=(
        Parameter("liner_thickness", "m", "thickness of the liner", above=0, example='"2 mm"'),
        Parameter("liner_modulus", "Pa", "Young's modulus of the liner", above=0, example='"3 GPa"'),
        Parameter("liner_poisson_ratio", "", "Poisson's ratio of the liner", 0.4, least=0, below=0.5),
    ),
    once=of_liner,
    numbers={"foundation": "N/m"},
    elastic=elastic,
    deepest=lambda liner_thickness: 0.1 * liner_thickness,
    pressure=pressure,
    half_angle=half_angle,
    has_length=True,
)  # fmt: skip
