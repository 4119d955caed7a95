"""Friction of joints without clearance, by their reactions."""

from typing import Annotated

from hpcclear.scene.fields import PositiveLength, Quantity, Speed, Table


class Rubbing(Table):
    """Friction of a guide."""

    coefficient: Annotated[float, Quantity("", least=0)]
    """Coefficient of friction of Coulomb's law."""
    ramp_speed: Speed = 0.01
    """Sliding speed below which the force decreases linearly to zero, m/s."""


class RubbingPin(Rubbing):
    """Friction of a pin: a torque, equal to coefficient times radius times reaction force."""

    radius: PositiveLength
    """Radius of the pin, m."""
