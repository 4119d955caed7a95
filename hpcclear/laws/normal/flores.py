"""Flores and others: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution


def factor(restitution):
    """Return a = 8 (1 - c_e)/(5 c_e)."""
    return 1.6 * (1.0 - restitution) / restitution


LAW = by_restitution(
    factor,
    words="Flores and others's, damping by restitution",
    source="Flores et al. 2011, doi:10.1007/s11044-010-9237-4",
    formula="8 (1 - c_e)/(5 c_e)",
    valid="0 < c_e <= 1, soft contacts too",
    divides=True,
)
