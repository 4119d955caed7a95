"""A torque on a body."""

from typing import Annotated, ClassVar, Literal

from hpcclear.base.arrays import Array
from hpcclear.base.pieces import Rows
from hpcclear.base.terms import Acting, Term
from hpcclear.scene.curves import Curve, by_angle, by_time
from hpcclear.scene.loads.declared import SizedLoad


class TorqueLoad(SizedLoad):
    """A torque on a body."""

    kind: Literal["torque"]
    body: str
    """Body on which the torque acts; the reaction acts on the ground."""
    torque: Annotated[Curve, by_angle("N*m")] | None = None
    """Torque, N m; constant, or a table against the angle of the body that defines the period."""
    torque_by_time: Annotated[Rows, by_time("N*m")] | None = None
    """Instead of `torque`: ``[[time, torque], ...]``, s and N m, from 0 s on; smooth between the rows, constant after the
    last."""

    size_entry: ClassVar[str] = "torque"
    unit: ClassVar[str] = "N*m"

    def _check(self) -> None:
        remedy = "Write torque, or torque_by_time = [[time, torque], ...]"
        self.check_one_of(remedy, "torque", "torque_by_time")

    def numbers(self) -> dict[str, Array | float]:
        """Its size."""
        return {f"{self.name}_torque": self.constant}

    def act(self, on: Acting) -> Term:
        """The torque on its body."""
        now = on.curve() if self.table else on.one
        torque = on.let(self.name, on.parameter("torque") * now)
        on.twist(self.body, torque)
        return torque * on.spin(self.body)
