"""LuGre friction: bristles that stick and give way."""

import math

from hpcclear.laws.declared import FrictionLaw, Parameter

_TINY = 1e-300  # keeps bristles that hold nothing from being divided by it

LEAST_RATIO = 1e-3
"""Friction over normal force that the bristles' tolerances stand for where it is less."""


def stribeck(speed, coefficient, static_coefficient, inverse_speed):
    """Stribeck's curve: friction over normal force, static at rest, `coefficient` far beyond the speed 1/`inverse_speed`."""
    x = speed * inverse_speed
    return coefficient + (static_coefficient - coefficient) * math.exp(-(x * x))


def deflection(deflection, speed, coefficient, static_coefficient, inverse_speed, bristles):
    """Rate of the bristles' deflection, m/s.

    They are drawn along with the sliding speed and give way as they come near what Stribeck's curve holds over `bristles`,
    where steady sliding keeps them. In flight too the deflection forgets what was within a few times the length on which they
    give way, and no force jumps when contact begins.
    """
    held = stribeck(speed, coefficient, static_coefficient, inverse_speed)
    return speed - bristles * abs(speed) * deflection / (held + _TINY)


def ratio(deflection, deflection_rate, speed, bristles, damper, viscous_coefficient):
    """Tangential over normal force: the bristles' spring, their damper, and what goes with the speed."""
    return bristles * deflection + damper * deflection_rate + viscous_coefficient * speed


def once(static_coefficient, stribeck_speed, bristle_stiffness, bristle_damping):
    """Bristles of a joint without friction hold nothing: neither their spring nor their damper is there."""
    holds = (static_coefficient > 0.0) * 1.0
    return {
        "inverse_speed": 1.0 / stribeck_speed,
        "bristles": holds * bristle_stiffness,
        "damper": holds * bristle_damping,
    }


def check(values):
    """Friction falls with speed."""
    coefficient, static = values["coefficient"], values["static_coefficient"]
    if coefficient == 0.0 < static:
        return (
            "friction at rest alone is no law: bristles would give way at once",
            "Write a coefficient above 0, or static_coefficient = 0 for no friction",
            "coefficient",
        )
    if static < coefficient:
        return (
            f"must be at least the coefficient of sliding ({coefficient:g}): friction falls with speed",
            "Write the larger of both coefficients here",
            "static_coefficient",
        )
    return None


def simpler(values, gentle):
    """Coulomb's law, which does not stick."""
    speed = max(values["stribeck_speed"], gentle(values["coefficient"]))
    coulomb = {"law": "coulomb", "coefficient": values["coefficient"], "ramp_speed": speed}
    yield "sticking in joints", coulomb


LAW = FrictionLaw(
    words="LuGre's bristles, which stick",
    source="Canudas de Wit and others 1995, doi:10.1109/9.376053",
    formula="s_0 z + s_1 z' + s_2 v, z' = v - s_0 |v| z / g(v), g = c_f + (c_s - c_f) exp(-(v/v_s)^2)",
    valid="sticking and sliding; friction falls with speed",
    parameters=(
        Parameter("coefficient", "", "coefficient of friction of fast sliding", least=0, example="0.01"),
        Parameter(
            "static_coefficient", "",
            "coefficient of friction from which surfaces at rest begin to slide, at least the coefficient",
            least=0, example="0.015",
        ),
        Parameter(
            "stribeck_speed", "m/s",
            "sliding speed at which friction has fallen from the static coefficient by 63 %",
            above=0, example="0.01 (m/s)",
        ),
        Parameter(
            "bristle_stiffness", "1/m",
            "sigma_0: friction / normal force per metre of bristle deflection",
            above=0, example="1e5 (1/m)",
        ),
        Parameter("bristle_damping", "s/m", "sigma_1: friction / normal force per rate of deflection", 0.0, least=0),
        Parameter("viscous_coefficient", "s/m", "sigma_2: friction / normal force per sliding speed", 0.0, least=0),
    ),
    once=once,
    numbers={"inverse_speed": "s/m", "bristles": "1/m", "damper": "s/m"},
    ratio=ratio,
    deflection=deflection,
    largest=lambda static_coefficient, bristle_stiffness: max(static_coefficient, LEAST_RATIO) / bristle_stiffness,
    inverse_ramp=lambda: 0.0,  # bristles hold at any speed
    steepness=lambda: 0.0,
    check=check,
    simpler=simpler,
    elsewhere=dict.fromkeys(
        ("ramp_speed", "speeds"),
        (
            "the law 'lugre' has no ramp: bristles hold at any speed",
            "Write stribeck_speed = 0.01 (m/s) and bristle_stiffness = 1e5 (1/m) instead",
        ),
    ),
)  # fmt: skip
