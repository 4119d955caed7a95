"""Joints without clearance that need no line between walls, and what all joints share: materials and friction."""

from typing import Annotated, ClassVar, Literal

from hpcclear.scene.fields import Angle, PositiveLength, Quantity, Speed, Table


class Material(Table):
    """Elastic constants of one contact partner."""

    youngs_modulus: Annotated[float, Quantity("Pa", above=0)]
    """Young's modulus, Pa."""
    poisson_ratio: Annotated[float, Quantity("", above=-1, most=0.5)]
    """Poisson's ratio."""


class Materials(Table):
    """Materials of both partners of a contact."""

    bearing: Material
    journal: Material


class JointFriction(Table):
    """Friction of a guide."""

    coefficient: Annotated[float, Quantity("", least=0)]
    """Coefficient of friction of Coulomb's law."""
    ramp_speed: Speed = 0.01
    """Sliding speed below which the force decreases linearly to zero, m/s."""


class IdealPinFriction(JointFriction):
    """Friction of a pin: a torque, equal to coefficient times radius times reaction force."""

    radius: PositiveLength
    """Radius of the pin, m."""


class PlanarRevolute(Table):
    """A pin without clearance."""

    holds: ClassVar[int] = 2
    """Degrees of freedom that it removes."""

    name: str
    kind: Literal["revolute"]
    journal: str
    """``body.point``, or ``ground.point``."""
    bearing: str
    """``body.point``, or ``ground.point``."""
    friction: IdealPinFriction | None = None
    """Friction torque, proportional to the reaction force of the pin. Without it the pin is frictionless."""


class PlanarFixed(Table):
    """A body that is fixed to the ground."""

    holds: ClassVar[int] = 3
    """As of `PlanarRevolute`."""

    name: str
    kind: Literal["fixed"]
    point: str
    """``body.point`` that is fixed."""
    line: str
    """``ground.point`` to which it is fixed."""
    angle: Angle = 0.0
    """Angle of the body relative to the ground, rad."""
