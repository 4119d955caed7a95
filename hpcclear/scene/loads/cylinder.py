"""A force between two points by a law of their distance: hydraulic or pneumatic cylinder, gas spring, end stop, cable."""

from typing import Annotated, Literal

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import hinges
from hpcclear.base.terms import Acting, Term
from hpcclear.scene.curves import Curve, Pairs
from hpcclear.scene.fields import Quantity
from hpcclear.scene.loads.declared import Load, along


class CylinderLoad(Load):
    """A force between two points by a law of their distance: cylinder, gas spring, end stop, cable."""

    kind: Literal["cylinder"]
    first: str
    """``body.point``, or ``ground.point``."""
    second: str
    """``body.point``, or ``ground.point``."""
    force: Annotated[Curve, Pairs("m", "N", ("distance", "force"), constant=True)]
    """Force that pushes both points apart (negative: together), N; constant or ``[[distance, force], ...]``."""
    damping: Annotated[float, Quantity("N*s/m", least=0)] = 0.0
    """Damping along the line between both points, N s/m."""

    @property
    def straight(self) -> dict[str, tuple[tuple[float, float], ...]]:
        """The force, if it is a table."""
        return {self.name: self.force} if isinstance(self.force, tuple) else {}

    def numbers(self) -> dict[str, Array | float]:
        """Its damping, and its force or where the table of it bends."""
        found = super().numbers()
        for name, rows in self.straight.items():
            found.update(hinges(name, rows))
        return found

    def act(self, on: Acting) -> Term:
        """Opposite forces along the line of both places."""
        apart, moving = on.apart(self.first, self.second)
        made = ("nx", "ny", "length", "rate")
        nx, ny, length, rate = on.call(along, *apart, *moving, results=made)
        if isinstance(self.force, tuple):
            push = on.piecewise(self.force, length, rate)
        else:
            push = on.parameter("force")
        push = on.let(f"push_{self.name}", push - on.parameter("damping") * rate)
        on.push_apart(self.first, self.second, push * nx, push * ny)
        return push * rate
