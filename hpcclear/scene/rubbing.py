"""Friction of joints without clearance, by their reactions."""

from typing import Annotated

from hpcclear.scene.fields import PositiveLength, Quantity, Speed, Table


class Rubbing(Table):
    """Friction of a guide."""

    coefficient: Annotated[float, Quantity("", least=0)]
    """Of Coulomb's law."""
    ramp_speed: Speed = 0.01
    """Sliding speed below which the force falls to zero with the speed, m/s."""


class RubbingPin(Rubbing):
    """Friction of a pin: a torque, coefficient times radius times the size of its reaction."""

    radius: PositiveLength
    """Of the pin, m."""
