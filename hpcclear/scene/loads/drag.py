"""A torque against the rotation of a body, such as that of a fan or of oil that is stirred."""

from typing import Annotated, ClassVar, Literal

from hpcclear.base.terms import Acting, Term
from hpcclear.scene.fields import Quantity
from hpcclear.scene.loads.declared import Load


def drag(linear: float, quadratic: float, spin: float) -> float:
    """Torque against the rotation at a speed, N m."""
    return -(linear + quadratic * abs(spin)) * spin


class DragLoad(Load):
    """A torque that resists the rotation of a body."""

    kind: Literal["drag"]
    body: str
    """Body whose rotation relative to the ground is resisted."""
    linear: Annotated[float, Quantity("N*m*s/rad", least=0)] = 0.0
    """Torque per angular speed, N m s/rad."""
    quadratic: Annotated[float, Quantity("N*m*s**2/rad**2", least=0)] = 0.0
    """Torque per square of the angular speed, N m s2/rad2, as of a fan."""

    acts_by: ClassVar[tuple[str, ...]] = ("linear", "quadratic")

    def act(self, on: Acting) -> Term:
        """The torque."""
        spin, own = on.spin(self.body), (on.parameter("linear"), on.parameter("quadratic"))
        (torque,) = on.call(drag, *own, spin, results=("drag",))
        on.twist(self.body, torque)
        return torque * spin
