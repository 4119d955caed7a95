"""Laws whose elastic part is Hertz's: without loss, with a fixed damping factor, or damped by the coefficient of restitution,
F = K d^1.5 (1 + a d'/d'_0), each with a factor a(c_e) of its own."""

from hpcclear.laws.declared import ContactLaw, Parameter
from hpcclear.laws.hertz_contact import HERTZIAN, by_restitution


def elastic_alone():
    """Nothing but the elastic part."""
    return 1.0


def fixed_damping(rate, damping):
    """1 + chi d'."""
    return 1.0 + damping * rate


LAWS = {
    "hertz": ContactLaw(
        words="Hertz's elastic contact, without loss",
        source="Lankarani and Nikravesh 1990, doi:10.1115/1.2912617, for internal contact of spheres",
        formula="K d^1.5", valid="small contacts: up to 30 degrees to either side", factor=elastic_alone,
        **{**HERTZIAN, "damping": lambda: 0.0, "without_loss": ""},
    ),
    "hunt-crossley": ContactLaw(
        words="Hunt and Crossley's, with a fixed damping factor",
        source="Hunt and Crossley 1975, doi:10.1115/1.3423596", formula="K d^1.5 (1 + chi d')",
        valid="any impact speed; chi is a property of the contact, not of the impact",
        parameters=(
            Parameter(
                "damping", "s/m", "fixed damping factor chi", least=0, example="0.5 (s/m)", called="fixed damping factor"
            ),
        ),
        factor=fixed_damping, lossless=lambda values: values["damping"] == 0, **HERTZIAN,
    ),
    "flores": by_restitution(
        lambda c_e: 1.6 * (1.0 - c_e) / c_e, "8 (1 - c_e)/(5 c_e)",
        whose="Flores and others's", source="Flores et al. 2011, doi:10.1007/s11044-010-9237-4",
        valid="0 < c_e <= 1, soft contacts too", divides=True,
    ),
    "gonthier": by_restitution(
        lambda c_e: (1.0 - c_e**2) / c_e, "(1 - c_e^2)/c_e",
        whose="Gonthier and others's", source="Gonthier et al. 2004, doi:10.1023/B:MUBO.0000029392.21648.bc",
        valid="0 < c_e <= 1", divides=True,
    ),
    "herbert-mcwhannell": by_restitution(
        lambda c_e: 6.0 * (1.0 - c_e) / ((2.0 * c_e - 1.0) ** 2 + 3.0), "6 (1 - c_e)/((2 c_e - 1)^2 + 3)",
        whose="Herbert and McWhannell's", source="Herbert and McWhannell 1977, doi:10.1115/1.3439270",
        valid="0 <= c_e <= 1",
    ),
    "hu-guo": by_restitution(
        lambda c_e: 1.5 * (1.0 - c_e) / c_e, "3 (1 - c_e)/(2 c_e)",
        whose="Hu and Guo's", source="Hu and Guo 2015, doi:10.1007/s11012-015-0135-1",
        valid="0 < c_e <= 1", divides=True,
    ),
    "lankarani-nikravesh": by_restitution(
        lambda c_e: 0.75 * (1.0 - c_e**2), "3 (1 - c_e^2)/4",
        whose="Lankarani and Nikravesh's", source="Lankarani and Nikravesh 1990, doi:10.1115/1.2912617 (paper eq. 7)",
        valid="made for c_e near 1; the restitution is met exactly only in that limit",
    ),
    "lee-wang": by_restitution(
        lambda c_e: 0.75 * (1.0 - c_e), "3 (1 - c_e)/4",
        whose="Lee and Wang's", source="Lee and Wang 1983, doi:10.1115/1.3267402",
        valid="c_e near 1 or near 0",
    ),
}  # fmt: skip
