"""A force between two points by a given law of their distance: hydraulic or pneumatic cylinder, gas spring, end stop, cable."""

from dataclasses import dataclass
from typing import Any, ClassVar

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.balance import Pull
from hpcclear.dynamics.linkage.expression import Term, Vector, named
from hpcclear.dynamics.linkage.loads import piecewise
from hpcclear.dynamics.linkage.loads.writing import Writing
from hpcclear.dynamics.linkage.parts import Acting


@dataclass(frozen=True)
class Cylinder(Acting):
    """A force in N that pushes both places apart, constant or rows (distance in m, force), and a damper in N s/m."""

    first: str
    second: str
    force: float | piecewise.Rows
    damping: float = 0.0
    kind: ClassVar[str] = "cylinder"

    @property
    def straight(self) -> dict[str, piecewise.Rows]:
        """The force, if it is a table."""
        return {self.name: self.force} if isinstance(self.force, tuple) else {}

    def numbers(self) -> dict[str, Any]:
        """Its parameters."""
        found = {f"{self.name}_damping": self.damping}
        if isinstance(self.force, tuple):
            return found | piecewise.numbers(self.name, self.force)
        return found | {f"{self.name}_force": self.force}

    def act(self, on: Writing) -> Term:
        """Opposite forces along the line of both places."""
        kin, write = on.kinematics, on.writer
        first, second = kin.point(self.first), kin.point(self.second)
        apart = kin.position(first) - kin.position(second)
        moving = kin.velocity(first) - kin.velocity(second)
        made = [write.fresh(f"{name}_{self.name}") for name in ("nx", "ny", "length", "rate")]
        texts = [write.text(one) for one in (*apart, *moving)]
        write.line(f"{', '.join(made)} = along({', '.join(texts)})")
        nx, ny, length, rate = map(named, made)
        if isinstance(self.force, tuple):
            row = on.places.get(self.name)
            push = piecewise.term(write, self.name, len(self.force), length, row)
            if row is not None:
                write.line(f"work[{row + at.MAX_CURVES} * W + i] = {made[-1]}")
        else:
            push = write.parameter(f"{self.name}_force")
        push = write.let(f"push_{self.name}", push - write.parameter(f"{self.name}_damping") * rate)
        force = Vector(push * nx, push * ny)
        on.balance.pulls += [Pull(self.first, force), Pull(self.second, -force)]
        return push * rate
