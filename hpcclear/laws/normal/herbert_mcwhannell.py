"""Herbert and McWhannell: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution

LAW = by_restitution(
    lambda restitution: 6.0 * (1.0 - restitution) / ((2.0 * restitution - 1.0) ** 2 + 3.0),
    words="Herbert and McWhannell's, damping by restitution",
    source="Herbert and McWhannell 1977, doi:10.1115/1.3439270",
    formula="6 (1 - c_e)/((2 c_e - 1)^2 + 3)",
    valid="0 <= c_e <= 1",
)
