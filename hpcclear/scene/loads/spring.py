"""A spring and damper between two points, on both sides of its length or on one."""

from typing import Annotated, Any, Literal

import numpy as np

from hpcclear.scene.fields import Quantity
from hpcclear.scene.loads.declared import Load


def spring_force(
    stiffness: float, damping: float, length: float, ex: float, ey: float, vx: float, vy: float
) -> tuple[float, float, float]:
    """Force of a spring and damper on its first place, whose offset and velocity from the second are given.

    Returns both components in N, and the power that both ends are given in W (what it stores and loses, negative).
    """
    square = (
        ex * ex + ey * ey + 1e-300
    )  # keeps the direction of a spring without length defined (and zero)
    inverse = 1.0 / np.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    rate = vx * nx + vy * ny
    tension = stiffness * (square * inverse - length) + damping * rate
    return -tension * nx, -tension * ny, -tension * rate


def one_sided(
    side: float,
    stiffness: float,
    damping: float,
    length: float,
    ex: float,
    ey: float,
    vx: float,
    vy: float,
) -> tuple[float, float, float]:
    """The same of a spring that acts on one side of its length: beyond it (`side` 1) or within it (-1); it never pulls back."""
    square = ex * ex + ey * ey + 1e-300
    inverse = 1.0 / np.sqrt(square)
    nx = ex * inverse
    ny = ey * inverse
    rate = vx * nx + vy * ny
    beyond = side * (square * inverse - length)
    size = stiffness * beyond + damping * side * rate
    size = 0.5 * (size + abs(size))
    tension = side * size * (0.5 + 0.5 * np.sign(beyond))
    return -tension * nx, -tension * ny, -tension * rate


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

    def act(self, on: Any) -> Any:
        """Opposite forces along the line of both places."""
        apart, moving = on.apart(self.first, self.second)
        entries = ("stiffness", "damping", "length")
        terms = (*map(on.parameter, entries), *apart, *moving)
        made = ("fx", "fy", "power")
        if self.acts == "both":
            fx, fy, power = on.call(spring_force, *terms, results=made)
        else:
            side = -on.one if self.acts == "pushing" else on.one
            fx, fy, power = on.call(one_sided, side, *terms, results=made)
        on.push_apart(self.first, self.second, fx, fy)
        return power
