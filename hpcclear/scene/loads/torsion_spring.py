"""A spring, a damper and end stops on the angle of a body, against the ground or another body."""

from typing import Annotated, ClassVar, Literal

from hpcclear.base.terms import Acting, Term
from hpcclear.scene.fields import Angle, Quantity, invalid
from hpcclear.scene.loads.declared import Load


class TorsionSpringLoad(Load):
    """A spring, a damper and end stops on the angle of a body."""

    kind: Literal["torsion-spring"]
    body: str
    """Body on which it acts."""
    other: str | None = None
    """Second body, on which the reaction acts; default: the ground."""
    stiffness: Annotated[float, Quantity("N*m/rad", least=0)] = 0.0
    """Stiffness, N m/rad."""
    angle: Angle = 0.0
    """Angle at which it exerts no torque, rad: from the x axis, or relative to the other body."""
    damping: Annotated[float, Quantity("N*m*s/rad", least=0)] = 0.0
    """Damping, N m s/rad."""
    lower: Angle | None = None
    """Lower stop, rad: below this angle `stop_stiffness` acts in addition."""
    upper: Angle | None = None
    """Upper stop, rad: above this angle `stop_stiffness` acts in addition."""
    stop_stiffness: Annotated[float, Quantity("N*m/rad", least=0)] = 0.0
    """Stiffness of the stops, N m/rad."""

    acts_by: ClassVar[tuple[str, ...]] = ("stiffness", "damping", "lower", "upper")

    def _check(self) -> None:
        if "angle" in self.model_fields_set and "stiffness" not in self.model_fields_set:
            raise invalid("is of a spring without stiffness", "Add stiffness or remove it", "angle")
        stops = self.lower is not None or self.upper is not None
        if stops != (self.stop_stiffness > 0.0):
            remedy = "Give lower or upper, and stop_stiffness above 0"
            raise invalid("stops and their stiffness go together", remedy, "stop_stiffness")
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise invalid("is not below the upper stop", "Swap both", "lower")

    @property
    def by_angle(self) -> bool:  # type: ignore[override]
        """Unless it is a damper alone."""
        return self.stiffness != 0.0 or self.stop_stiffness != 0.0

    def act(self, on: Acting) -> Term:
        """Torques on both bodies."""
        angle, rate = on.angle(self.body), on.spin(self.body)
        if self.other is not None:
            angle = angle - on.angle(self.other)
            rate = rate - on.spin(self.other)
        angle = on.let(f"angle_of_{self.name}", angle)
        spring = on.parameter("stiffness") * (angle - on.parameter("angle"))
        torque = -(spring + on.parameter("damping") * rate)
        for side in ("lower", "upper"):
            if getattr(self, side) is not None:
                stop, stiffness = on.parameter(side), on.parameter("stop_stiffness")
                beyond = angle - stop if side == "upper" else stop - angle
                stopped = on.hinge(f"stopped_{self.name}", beyond, stiffness)
                torque = torque - stopped if side == "upper" else torque + stopped
        torque = on.let(f"moment_of_{self.name}", torque)
        on.twist(self.body, torque)
        if self.other is not None:
            on.twist(self.other, -torque)
        return torque * rate
