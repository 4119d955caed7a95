"""Lee and Wang: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution

LAW = by_restitution(
    lambda restitution: 0.75 * (1.0 - restitution),
    words="Lee and Wang's, damping by restitution",
    source="Lee and Wang 1983, doi:10.1115/1.3267402",
    formula="3 (1 - c_e)/4",
    valid="c_e near 1 or near 0",
)
