"""Coulomb's friction with a ramp about rest."""

from hpcclear.laws.declared import FrictionLaw, Parameter


def ratio(speed, coefficient, inverse_ramp):
    """A linear ramp, full at ``|v| = 1/inverse_ramp``."""
    return coefficient * max(min(speed * inverse_ramp, 1.0), -1.0)


def low(speed, inverse_ramp):
    """Where the ramp begins."""
    return speed * inverse_ramp + 1.0


def high(speed, inverse_ramp):
    """Where it ends."""
    return speed * inverse_ramp - 1.0


def simpler(values, gentle):
    """A wider ramp, which explicit steps follow."""
    speed = gentle(values["coefficient"])
    if values["ramp_speed"] < 0.5 * speed:
        yield "steepness of friction", {"ramp_speed": speed}


LAW = FrictionLaw(
    words="Coulomb's, with a linear ramp about rest",
    source="paper eq. 9",
    formula="c_f clip(v / v_r)",
    valid="sliding faster than the ramp speed; within it surfaces creep and do not stick",
    parameters=(
        Parameter("coefficient", "", "coefficient of friction", least=0, example="0.01"),
        Parameter("ramp_speed", "m/s", "sliding speed below which the force falls linearly to 0", 0.01, above=0),
    ),
    once=lambda ramp_speed: {"inverse_ramp": 1.0 / ramp_speed},
    numbers={"inverse_ramp": "s/m"},
    ratio=ratio,
    kinks=(low, high),
    inverse_ramp=lambda inverse_ramp: inverse_ramp,
    steepness=lambda coefficient, inverse_ramp: coefficient * inverse_ramp,
    simpler=simpler,
    elsewhere={"speeds": ("the law 'coulomb' has one ramp speed", "Write ramp_speed = 0.01 (m/s) instead")},
)  # fmt: skip
