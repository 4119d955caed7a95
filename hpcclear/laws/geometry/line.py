"""A round journal along the whole length of a round bearing.

The plane elastic problem of a disc in a hole without friction has one solution for each pair of Dundurs' parameters, once
loads are divided by E* c and depths by c. Formulae below are fitted to it by `analysis/line_contact.py`, over depths of up
to three clearances, some 74 degrees to either side. For small contacts the depth is that of Johnson's formula,
d = F/(pi E* L) (ln(4 pi E* L c/F) - 1).
"""

import math

from hpcclear.laws.declared import Geometry


def of_materials(dundurs_alpha, dundurs_beta, compliance, length):
    """Coefficients of the formulae for a pair of materials."""
    alpha, beta = dundurs_alpha, dundurs_beta
    scale = math.pi * length / compliance
    return {
        "top_1": 1.04679213 - 1.13100816 * beta - 0.105302339 * alpha,
        "top_2": 0.0331289663 - 0.424100534 * beta - 0.159197446 * alpha,
        "top_3": 2.9160585 - 4.89257065 * beta + 1.17330849 * alpha,
        "bottom_1": scale * (0.918015443 - 0.0496774583 * beta + 0.00112329808 * alpha),
        "bottom_2": scale * (-0.810023184 - 0.464998066 * beta - 0.147721643 * alpha),
        "bottom_3": scale * (2.08189637 - 0.486911418 * beta + 0.368597132 * alpha),
    }


def elastic(depth, clearance, top_1, top_2, top_3, bottom_1, bottom_2, bottom_3):
    """N."""
    wide = math.log((depth + clearance) / (depth + 1e-15 * clearance))
    bottom = (bottom_1 * wide + bottom_2) * wide + bottom_3
    return depth * bottom / (((wide + top_1) * wide + top_2) * wide + top_3)


def _load(force, compliance, length, clearance):
    """The root of F/(E* L c)."""
    return math.sqrt(force * compliance / (length * clearance))


def pressure(force, compliance, length, clearance, bearing_radius, dundurs_alpha, dundurs_beta):
    """Largest pressure, Pa; within 0.5 % of the plane solution."""
    alpha, beta = dundurs_alpha, dundurs_beta
    x = _load(force, compliance, length, clearance)
    first = 0.54026952 - 0.19484035 * beta + 0.03591337 * alpha
    second = 0.74206611 + 0.26795552 * beta + 0.10695721 * alpha
    below = 0.59575064 + 0.39660709 * beta + 0.03621671 * alpha
    hertz = x / math.sqrt(math.pi) * clearance / (compliance * bearing_radius)
    return hertz * (1.0 + first * x + second * x * x) / (1.0 + below * x)


def half_angle(force, compliance, length, clearance, dundurs_alpha, dundurs_beta):
    """Half of the angle of contact, rad; within 0.5 % of the plane solution."""
    alpha, beta = dundurs_alpha, dundurs_beta
    x = _load(force, compliance, length, clearance)
    first = 0.54434016 - 0.14530186 * beta + 0.04321472 * alpha
    second = 0.45985211 - 0.04393779 * beta + 0.16627391 * alpha
    below = 0.56184457 + 0.25276853 * beta + 0.07326521 * alpha
    return 2.0 * x / math.sqrt(math.pi) * (1.0 + below * x) / (1.0 + first * x + second * x * x)


GEOMETRY = Geometry(
    words="line contact of a journal along the length of its bearing",
    source="plane elasticity, Persson 1964 for loads and angles; Johnson 1985, Contact Mechanics, "
    "for the depth of small contacts",
    formula="F(d/c) E* L c, fitted to the plane problem within 1 %",
    valid="contacts of up to 70 degrees to either side; smooth elastic surfaces, rigid support, no bending of the pin",
    once=of_materials,
    numbers={
        "top_1": "", "top_2": "", "top_3": "",
        "bottom_1": "N/m", "bottom_2": "N/m", "bottom_3": "N/m",
    },
    elastic=elastic,
    deepest=lambda clearance: 2.0 * clearance,
    pressure=pressure,
    half_angle=half_angle,
    has_length=True,
)  # fmt: skip
