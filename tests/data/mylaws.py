"""Laws that nobody of this package wrote."""

import math

from hpcclear import ContactLaw, FrictionLaw, Parameter


def zhiying_once(restitution):
    c = 0.75 * (1 - restitution**2) * math.exp(2 * (1 - restitution))
    return {"c": c}


def zhiying(depth, rate, impact_speed, stiffness, c):
    return stiffness * depth**1.5 * (1 + c * rate / impact_speed)


ZhiyingQishao = ContactLaw(
    words="Zhiying and Qishao's, damping by restitution",
    source="Zhiying and Qishao 2006",
    parameters=(Parameter("restitution", "", "coefficient of restitution", least=0, most=1),),
    once=zhiying_once,
    numbers={"c": ""},
    force=zhiying,
)


def grown(depth, rate, force_at, depth_at, exponent, chi):
    return force_at * (depth / depth_at) ** exponent * (1 + chi * rate)


def grown_energy(depth, force_at, depth_at, exponent):
    return force_at * depth_at / (exponent + 1) * (depth / depth_at) ** (exponent + 1)


Power = ContactLaw(
    words="a power of the depth",
    parameters=(
        Parameter("force_at", "N", "force at the reference depth", above=0),
        Parameter("depth_at", "m", "reference depth", 1e-5, above=0),
        Parameter("exponent", "", "of the depth", 1.2, above=0),
        Parameter("chi", "s/m", "damping factor", 0.3, least=0),
    ),
    force=grown,
    energy=grown_energy,
)


def exponential(depth, rate, force_at, depth_at, chi):
    return force_at * (math.exp(depth / depth_at) - 1) * (1 + chi * rate)


Exponential = ContactLaw(
    words="exponential of the depth",
    parameters=(
        Parameter("force_at", "N", "force", above=0),
        Parameter("depth_at", "m", "depth", 5e-5, above=0),
        Parameter("chi", "s/m", "damping factor", 0.3, least=0),
    ),
    force=exponential,
)


def falling(speed, coefficient, static_coefficient, stribeck_speed, ramp_speed):
    held = coefficient + (static_coefficient - coefficient) * math.exp(-abs(speed) / stribeck_speed)
    return held * math.tanh(speed / ramp_speed)


MyStribeck = FrictionLaw(
    words="Stribeck's curve with a smooth start",
    parameters=(
        Parameter("coefficient", "", "of fast sliding", least=0),
        Parameter("static_coefficient", "", "near rest", least=0),
        Parameter("stribeck_speed", "m/s", "where it falls", above=0),
        Parameter("ramp_speed", "m/s", "of the start", 0.02, above=0),
    ),
    ratio=falling,
)
