"""Lankarani and Nikravesh: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution

LAW = by_restitution(
    lambda restitution: 0.75 * (1.0 - restitution**2),
    words="Lankarani and Nikravesh's, damping by restitution",
    source="Lankarani and Nikravesh 1990, doi:10.1115/1.2912617 (paper eq. 7)",
    formula="3 (1 - c_e^2)/4",
    valid="made for c_e near 1; the restitution is met exactly only in that limit",
)
