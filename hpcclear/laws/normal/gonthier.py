"""Gonthier and others: damping by the coefficient of restitution."""

from hpcclear.laws.hertz_contact import by_restitution

LAW = by_restitution(
    lambda restitution: (1.0 - restitution**2) / restitution,
    words="Gonthier and others's, damping by restitution",
    source="Gonthier et al. 2004, doi:10.1023/B:MUBO.0000029392.21648.bc",
    formula="(1 - c_e^2)/c_e",
    valid="0 < c_e <= 1",
    divides=True,
)
