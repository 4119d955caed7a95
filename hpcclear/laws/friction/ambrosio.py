"""Ambrosio's friction: none below one speed, full above another."""

import math

from hpcclear.laws.declared import FrictionLaw, Parameter


def ratio(speed, coefficient, dead_speed, inverse_ramp):
    """Zero up to ``dead_speed`` v0, then a ramp over v1 - v0 = 1/inverse_ramp."""
    ramp = (abs(speed) - dead_speed) * inverse_ramp
    return math.copysign(coefficient * max(min(ramp, 1.0), 0.0), speed)


def low(speed, dead_speed, inverse_ramp):
    """Where the ramp begins."""
    return (abs(speed) - dead_speed) * inverse_ramp


def high(speed, dead_speed, inverse_ramp):
    """Where it ends."""
    return (abs(speed) - dead_speed) * inverse_ramp - 1.0


def check(values):
    """The speeds have to rise."""
    if not values["speeds"][0] < values["speeds"][1]:
        return "the first speed must be below the second", "Write them in rising order", "speeds"
    return None


def simpler(values, gentle):
    """A wider ramp, which explicit steps follow."""
    first, second = values["speeds"]
    speed = gentle(values["coefficient"])
    if second < 0.5 * speed:
        yield "steepness of friction", {"speeds": [first / second * speed, speed]}


LAW = FrictionLaw(
    words="Ambrosio's, with two speeds",
    source="Ambrosio 2003, doi:10.1007/978-94-007-0203-5_4 (paper eq. 10)",
    formula="c_f clip((|v| - v_0)/(v_1 - v_0)) sign v",
    valid="sliding faster than the second speed",
    parameters=(
        Parameter("coefficient", "", "coefficient of friction", least=0, example="0.01"),
        Parameter(
            "speeds", "m/s", "no friction below the first speed, full friction above the second", least=0,
            example="[0.001, 0.01] (m/s)", count=2,
        ),
    ),
    once=lambda speeds: {"dead_speed": speeds[0], "inverse_ramp": 1.0 / (speeds[1] - speeds[0])},
    numbers={"dead_speed": "m/s", "inverse_ramp": "s/m"},
    ratio=ratio,
    kinks=(low, high),
    inverse_ramp=lambda inverse_ramp: inverse_ramp,
    steepness=lambda coefficient, inverse_ramp: coefficient * inverse_ramp,
    check=check,
    simpler=simpler,
    elsewhere={
        "ramp_speed": ("the law 'ambrosio' has two speeds", "Write speeds = [0.001, 0.01] (m/s) instead")
    },
)  # fmt: skip
