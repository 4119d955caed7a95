"""Hu and Guo: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution

LAW = by_restitution(
    lambda restitution: 1.5 * (1.0 - restitution) / restitution,
    words="Hu and Guo's, damping by restitution",
    source="Hu and Guo 2015, doi:10.1007/s11012-015-0135-1",
    formula="3 (1 - c_e)/(2 c_e)",
    valid="0 < c_e <= 1",
    divides=True,
)
