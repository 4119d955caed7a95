"""A torque against the turning of a body, such as that of a fan or of oil that is stirred."""

from dataclasses import dataclass
from typing import Any, ClassVar

from hpcclear.dynamics.linkage.balance import Twist
from hpcclear.dynamics.linkage.expression import Term, named
from hpcclear.dynamics.linkage.loads.writing import Writing
from hpcclear.dynamics.linkage.parts import Acting


@dataclass(frozen=True)
class Drag(Acting):
    """In proportion to the speed (N m s) and to its square (N m s^2), against the ground."""

    body: str
    linear: float = 0.0
    quadratic: float = 0.0
    kind: ClassVar[str] = "drag"

    def numbers(self) -> dict[str, Any]:
        """Its parameters."""
        return {f"{self.name}_{entry}": getattr(self, entry) for entry in ("linear", "quadratic")}

    def act(self, on: Writing) -> Term:
        """The moment."""
        kin, write = on.kinematics, on.writer
        spin = kin.spin(kin.forest.frames[self.body])
        numbers = (write.parameter(f"{self.name}_{entry}") for entry in ("linear", "quadratic"))
        made = write.fresh(f"drag_{self.name}")
        write.line(f"{made} = drag({', '.join(write.text(one) for one in (*numbers, spin))})")
        on.balance.twists.append(Twist(self.body, named(made)))
        return named(made) * spin
