"""Hertz's contact, and the family of laws F = K d^1.5 (1 + a(c_e) d'/d'_0) that has it for its elastic part."""

import math
from collections.abc import Sequence
from typing import Any, TypeVar

from hpcclear.base.arrays import Array
from hpcclear.laws.declared import ContactLaw, Function, Parameter

Number = TypeVar("Number", float, Array)  # a float, or an array of them


def reduced_compliance(youngs_modulus: Number, poisson_ratio: Number) -> Number:
    """Return h = (1 - nu^2)/E in 1/Pa (paper eq. 6)."""
    return (1.0 - poisson_ratio**2) / youngs_modulus


def dundurs(moduli: Sequence[Array], ratios: Sequence[Array]) -> tuple[Array, Array]:
    """Dundurs' parameters alpha, beta of journal against bearing, in plane strain; (bearing's, journal's) moduli and ratios.

    Dundurs 1969, doi:10.1115/1.3564739.
    """
    h_bearing, h_journal = map(reduced_compliance, moduli, ratios)
    both = zip(moduli, ratios, strict=True)
    g_bearing, g_journal = ((1.0 - 2.0 * nu) * (1.0 + nu) / modulus for modulus, nu in both)
    total = h_bearing + h_journal
    return (h_bearing - h_journal) / total, 0.5 * (g_bearing - g_journal) / total


def sphere_stiffness(h_bearing: Number, h_journal: Number, radius: Number) -> Number:
    """Return Hertz's K in N/m^1.5 of a sphere on a plane, or of what is as stiff as one."""
    return 4.0 / (3.0 * (h_bearing + h_journal)) * radius**0.5


def elastic(depth, stiffness):
    """Hertz's K d^1.5 in N."""
    return stiffness * (depth * math.sqrt(depth))


def energy(depth, stiffness):
    """What it stores, J."""
    return 0.4 * stiffness * depth**2.5


def swing(force, stiffness):
    """Its stiffness where it is ``force``, N/m."""
    return 1.5 * stiffness ** (2 / 3) * force ** (1 / 3)


HERTZIAN: dict[str, Any] = {
    "elastic": elastic, "energy": energy, "swing": swing, "exponent": lambda: 1.5, "damping": lambda damping: damping,
    "without_loss": "hertz",
}  # fmt: skip
"""What all laws have whose elastic part is Hertz's."""


def latched_factor(rate, inverse_impact_speed, damping):
    """1 + a d'/d'_0."""
    return 1.0 + damping * rate * inverse_impact_speed


RESTITUTION = Parameter(
    "restitution", "", "coefficient of restitution", least=0, most=1, example="0.9"
)


def _above_zero(values):
    if values["restitution"] == 0:
        reason = "the damping of this law divides by the restitution, so 0 has no meaning"
        return reason, 'Use a value above 0, or the law "lankarani-nikravesh"', "restitution"
    return None


def by_restitution(
    factor: Function, *, words: str, source: str, formula: str, valid: str, divides: bool = False
) -> ContactLaw:
    """The law with a damping coefficient a(c_e), a pure number; `divides`: by c_e, for which 0 then has no meaning."""
    return ContactLaw(
        words=words,
        source=source,
        formula=f"K d^1.5 (1 + a d'/d'_0), a = {formula}",
        valid=valid,
        parameters=(RESTITUTION,),
        once=lambda restitution: {"damping": factor(restitution)},
        numbers={"damping": ""},
        factor=latched_factor,
        check=_above_zero if divides else None,
        lossless=lambda values: values["restitution"] >= 1,
        **HERTZIAN,
    )
