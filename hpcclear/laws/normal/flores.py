"""Flores and others: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution

LAW = by_restitution(
    lambda restitution: 1.6 * (1.0 - restitution) / restitution,
    words="Flores and others's, damping by restitution",
    source="Flores et al. 2011, doi:10.1007/s11044-010-9237-4",
    formula="8 (1 - c_e)/(5 c_e)",
    valid="0 < c_e <= 1, soft contacts too",
    divides=True,
)
