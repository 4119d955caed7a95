"""Normal contact force in a clearance joint (paper eqs. 1-8).

Every law offered here has the form ``F = K d**1.5 (1 + factor)``, clipped at zero (a contact never pulls), with

- Hertz: factor 0;
- a fixed damping factor ``chi`` in s/m (Hunt-Crossley): ``chi d'``; no memory;
- a restitution coefficient ``c_e`` (all others): ``a(c_e) d' / d'_0``, ``d'_0`` the approach speed at the start of
  this contact, latched until it ends.

So a law is one damping coefficient, worked out once a sample outside the integration; what is compiled is
only which of the three forms applies. All quantities in SI units.
"""

import math
from collections.abc import Callable
from typing import Any, TypeVar

from hpcclear.base.arrays import Array
from hpcclear.base.bits import no_less
from hpcclear.base.jit import lane_function

Number = TypeVar("Number", float, Array)
"""A float, or an array of them."""


def reduced_compliance(youngs_modulus: Number, poisson_ratio: Number) -> Number:
    """Return h = (1 - nu^2)/E in 1/Pa (paper eq. 6)."""
    return (1.0 - poisson_ratio**2) / youngs_modulus


def contact_stiffness(
    h_bearing: Number, h_journal: Number, bearing_radius: Number, clearance: Number
) -> Number:
    """Return Hertz's K in N/m^1.5 of a journal in a bearing (paper eq. 4); floats or arrays in SI.

    Eq. 4 as printed lacks R_J and is not dimensionally consistent; this is the form of the cited
    source, Lankarani and Nikravesh 1990 (doi:10.1115/1.2912617), for internal contact of spheres.
    """
    journal_radius = bearing_radius - clearance
    shape = (bearing_radius * journal_radius / clearance) ** 0.5
    return 4.0 / (3.0 * (h_bearing + h_journal)) * shape


def lankarani_nikravesh(restitution: Number) -> Number:
    """Return a = 3 (1 - c_e^2)/4 (paper eq. 7; doi:10.1115/1.2912617).

    Made for c_e near 1; the restitution is met exactly only in that limit.
    """
    return 0.75 * (1.0 - restitution**2)


def flores(restitution: Number) -> Number:
    """Return a = 8 (1 - c_e)/(5 c_e) (Flores et al. 2011, doi:10.1007/s11044-010-9237-4).

    For 0 < c_e <= 1, soft contacts too.
    """
    return 1.6 * (1.0 - restitution) / restitution


def gonthier(restitution: Number) -> Number:
    """Return a = (1 - c_e^2)/c_e (Gonthier et al. 2004, doi:10.1023/B:MUBO.0000029392.21648.bc). For 0 < c_e <= 1."""
    return (1.0 - restitution**2) / restitution


def hu_guo(restitution: Number) -> Number:
    """Return a = 3 (1 - c_e)/(2 c_e) (Hu and Guo 2015, doi:10.1007/s11012-015-0135-1). For 0 < c_e <= 1."""
    return 1.5 * (1.0 - restitution) / restitution


def herbert_mcwhannell(restitution: Number) -> Number:
    """Return a = 6 (1 - c_e)/((2 c_e - 1)^2 + 3) (Herbert and McWhannell 1977, doi:10.1115/1.3439270).

    For 0 <= c_e <= 1.
    """
    return 6.0 * (1.0 - restitution) / ((2.0 * restitution - 1.0) ** 2 + 3.0)


def lee_wang(restitution: Number) -> Number:
    """Return a = 3 (1 - c_e)/4 (Lee and Wang 1983, doi:10.1115/1.3267402). For c_e near 1 or near 0."""
    return 0.75 * (1.0 - restitution)


LATCHED_LAWS: dict[str, Callable[[Any], Any]] = {
    "lankarani-nikravesh": lankarani_nikravesh,
    "flores": flores,
    "gonthier": gonthier,
    "hu-guo": hu_guo,
    "herbert-mcwhannell": herbert_mcwhannell,
    "lee-wang": lee_wang,
}
"""Laws with a restitution coefficient: name -> damping coefficient a(c_e), a pure number."""


@lane_function
def elastic_force(stiffness, penetration):
    """Hertz's elastic part K d^1.5 in N, for penetration d >= 0."""
    return stiffness * (penetration * math.sqrt(penetration))


@lane_function
def damping_factor(fixed, latched, damping, rate, inverse_impact_speed):
    """Damping over elastic force: chi d', a d'/d'_0 or 0 (`fixed` and `latched` are None when off)."""
    if latched is not None:
        return damping * rate * inverse_impact_speed
    elif fixed is not None:
        return damping * rate
    else:
        return 0.0


@lane_function
def normal_force(fixed, latched, stiffness, damping, penetration, rate, inverse_impact_speed):
    """Normal force in N for penetration d >= 0 in m and rate d' in m/s (paper eq. 7); never adhesive."""
    factor = 1.0 + damping_factor(fixed, latched, damping, rate, inverse_impact_speed)
    if fixed is not None or latched is not None:
        factor = no_less(factor, 0.0)
    return elastic_force(stiffness, penetration) * factor
