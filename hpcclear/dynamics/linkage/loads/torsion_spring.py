"""A spring, a damper and end stops on the angle of a body, against the ground or another body."""

from dataclasses import dataclass
from typing import Any, ClassVar

from hpcclear.dynamics.linkage.balance import Twist
from hpcclear.dynamics.linkage.expression import ZERO, Term, named
from hpcclear.dynamics.linkage.loads.writing import Writing
from hpcclear.dynamics.linkage.parts import Acting


@dataclass(frozen=True)
class TorsionSpring(Acting):
    """Stiffness in N m/rad about a free angle, damping in N m s/rad; beyond the stops, rad, another stiffness adds to it."""

    body: str
    other: str | None = None
    stiffness: float = 0.0
    angle: float = 0.0
    damping: float = 0.0
    lower: float | None = None
    upper: float | None = None
    stop_stiffness: float = 0.0
    kind: ClassVar[str] = "torsion-spring"

    @property
    def by_angle(self) -> bool:  # type: ignore[override]
        """Unless it is a damper alone."""
        return self.stiffness != 0.0 or self.stop_stiffness != 0.0

    def numbers(self) -> dict[str, Any]:
        """Its parameters."""
        found = {
            f"{self.name}_{entry}": getattr(self, entry)
            for entry in ("stiffness", "angle", "damping", "stop_stiffness")
        }
        stops = {f"{self.name}_{side}": getattr(self, side) for side in ("lower", "upper")}
        return found | {name: one for name, one in stops.items() if one is not None}

    def act(self, on: Writing) -> Term:
        """Moments on both bodies."""
        kin, write = on.kinematics, on.writer
        angle, rate = kin.angle(self.body), kin.spin(kin.forest.frames[self.body])
        if self.other is not None:
            angle = angle - kin.angle(self.other)
            rate = rate - kin.spin(kin.forest.frames[self.other])
        angle = write.let(f"angle_of_{self.name}", angle)
        numbers = {
            entry: write.parameter(f"{self.name}_{entry}")
            for entry in ("stiffness", "angle", "damping", "stop_stiffness")
        }
        moment = -(numbers["stiffness"] * (angle - numbers["angle"]) + numbers["damping"] * rate)
        for side in ("lower", "upper"):
            if getattr(self, side) is not None:
                stop = write.parameter(f"{self.name}_{side}")
                beyond = angle - stop if side == "upper" else stop - angle
                made = write.fresh(f"stopped_{self.name}")
                texts = write.text(beyond), write.text(numbers["stop_stiffness"])
                write.line(f"{made} = hinge({texts[0]}, 0.0, {texts[1]})")
                moment = moment - named(made) if side == "upper" else moment + named(made)
        moment = write.let(f"moment_of_{self.name}", moment)
        on.balance.twists.append(Twist(self.body, moment))
        if self.other is not None:
            on.balance.twists.append(Twist(self.other, -moment))
        return moment * rate if rate else ZERO
