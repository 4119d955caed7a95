"""A force that was measured or computed elsewhere, as a power of the depth."""

from hpcclear.laws.declared import Geometry, Parameter


def elastic(depth, force_at, depth_at, exponent):
    """N."""
    return force_at * (depth / depth_at) ** exponent


def energy(depth, force_at, depth_at, exponent):
    """J."""
    return force_at * depth_at * (depth / depth_at) ** (exponent + 1.0) / (exponent + 1.0)


def swing(force, force_at, depth_at, exponent):
    """Stiffness where the elastic part is ``force``, N/m."""
    return exponent * force_at / depth_at * (force / force_at) ** (1.0 - 1.0 / exponent)


GEOMETRY = Geometry(
    words="a power of the depth, from one's own measurement or finite elements",
    formula="F_0 (d/d_0)^n",
    valid="depths over which the curve was fitted",
    parameters=(
        Parameter("force_at", "N", "force at the reference depth", above=0, example='"1 kN"'),
        Parameter("depth_at", "m", "reference depth", above=0, example='"2 um"'),
        Parameter("exponent", "", "exponent of the depth", above=0, example="1.1"),
    ),
    elastic=elastic,
    energy=energy,
    swing=swing,
    exponent=lambda exponent: exponent,
)
