"""A spring and damper between two points, on both sides of its length or on one."""

from typing import Annotated, Literal

import numpy as np

from hpcclear.base.terms import Acting, Term
from hpcclear.scene.fields import Quantity, invalid
from hpcclear.scene.loads.declared import Load, along


def one_sided(side: float, stiffness: float, damping: float, beyond: float, rate: float) -> float:
    """Tension, N, of a spring that acts beyond its length (`side` 1) or within it (-1) alone, and never against itself."""
    size = stiffness * (side * beyond) + damping * side * rate
    size = 0.5 * (size + abs(size))
    return side * size * (0.5 + 0.5 * np.sign(side * beyond))


class SpringLoad(Load):
    """A spring and damper between two points."""

    kind: Literal["spring"]
    first: str
    """``body.point``, or ``ground.point``."""
    second: str
    """``body.point``, or ``ground.point``."""
    stiffness: Annotated[float, Quantity("N/m", least=0)]
    """Stiffness, N/m."""
    length: Annotated[float, Quantity("m", least=0)] = 0.0
    """Length at which the spring exerts no force, m."""
    damping: Annotated[float, Quantity("N*s/m", least=0)] = 0.0
    """Damping along the line between both points, N s/m."""
    acts: Literal["both", "pushing", "pulling"] = "both"
    """Range in which the spring acts: "both" sides of its length; "pushing": only when shorter, as a buffer or end
    stop; "pulling": only when longer, as a rope."""

    def _check(self) -> None:
        if self.acts == "pushing" and self.length == 0.0:
            reason = "is missing, and a pushing spring acts below it alone"
            raise invalid(reason, "Give the length at which it begins to push", "length", None)

    def act(self, on: Acting) -> Term:
        """Opposite forces along the line of both places."""
        apart, moving = on.apart(self.first, self.second)
        made = ("nx", "ny", "length", "rate")
        nx, ny, length, rate = on.call(along, *apart, *moving, results=made)
        stiffness, damping = on.parameter("stiffness"), on.parameter("damping")
        beyond = length - on.parameter("length")
        tension = stiffness * beyond + damping * rate
        if self.acts != "both":
            side = -on.one if self.acts == "pushing" else on.one
            terms = side, stiffness, damping, beyond, rate
            (tension,) = on.call(one_sided, *terms, results=("tension",))
        tension = on.let(f"tension_{self.name}", tension)
        on.push_apart(self.first, self.second, -tension * nx, -tension * ny)
        return -tension * rate
