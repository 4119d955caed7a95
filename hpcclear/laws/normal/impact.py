"""Adams' IMPACT function: a power of the depth, and damping that grows to its greatest value over a depth."""

from hpcclear.laws.declared import ContactLaw, Parameter
from hpcclear.laws.geometry.power import elastic, energy, swing


def share(depth, full_depth):
    """Of the greatest damping: Adams' STEP from 0 to 1, a cubic."""
    u = min(depth / full_depth, 1.0)
    return u * u * (3.0 - 2.0 * u)


def force(depth, rate, force_at, depth_at, exponent, greatest_damping, full_depth):
    """N."""
    damping = greatest_damping * share(depth, full_depth)
    return elastic(depth, force_at, depth_at, exponent) + damping * rate


LAW = ContactLaw(
    words="one's own stiffness, exponent and greatest damping with the depth where it is reached",
    source="MSC Adams/Solver, function IMPACT; damping from 0 on, as Hunt and Crossley 1975, doi:10.1115/1.3423596",
    formula="F_0 (d/d_0)^n + c STEP(d, 0, 0, d_c, 1) d'",
    valid="what the numbers were fitted to",
    parameters=(
        Parameter("force_at", "N", "force at the reference depth", above=0, example='"1 kN"'),
        Parameter("depth_at", "m", "reference depth", above=0, example='"2 um"'),
        Parameter("exponent", "", "exponent of the depth", above=0, example="1.5"),
        Parameter("greatest_damping", "N*s/m", "largest damping", least=0, example='"50 N*s/m"'),
        Parameter("full_depth", "m", "depth from which the damping has its largest value", above=0, example='"1 um"'),
    ),
    force=force,
    elastic=elastic,
    energy=energy,
    swing=swing,
    exponent=lambda exponent: exponent,
)  # fmt: skip
