"""Where tabulated curves of drives and loads are looked up, before a lane's text runs: by an angle, or by the time."""

from typing import NamedTuple

from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.expression import Writer, named
from hpcclear.dynamics.linkage.kinematics import Kinematics
from hpcclear.dynamics.linkage.parts import Drive, Load, RunUp, TableDrive, curves_of
from hpcclear.dynamics.linkage.rows import Rows
from hpcclear.dynamics.linkage.trees import Forest

CLOCK = f"(work[{at.BEGAN} * W + i] + work[{at.STAGE_TIME} * W + i])"


class LookUp(NamedTuple):
    """Statements, the function that reads the table after them, and the place that it is given."""

    before: tuple[str, ...]
    function: str
    place: str


class LookUps:
    """Those of a mechanism's curves, and the parameters that they read besides those of its text.

    Attributes
    ----------
    found : dict
        By the names of curves.
    rows, read, inputs
        As of `expression.Writer`.
    """

    def __init__(self, forest: Forest, rows: Rows, text: Writer) -> None:
        self._forest, self._rows = forest, rows
        self.rows, self._free = text.rows, text.free
        self.read: set[str] = set()
        self.inputs: dict[str, None] = {}
        m = forest.mechanism
        self.found = {
            name: self._of(one) for one in (*m.drives, *m.loads) for name in curves_of(one)
        }

    def _of(self, part: Drive | Load) -> LookUp:
        main = self._forest.mechanism.period
        if isinstance(part, TableDrive):
            share = main.seconds / part.seconds / main.turns
            text = f"par[{at.SPEED} * W + i] * work[{at.STAGE_TIME} * W + i] * {share!r}"
            return LookUp((), "table_value", text)
        if isinstance(part, RunUp):
            return LookUp((), "table_until", f"{CLOCK} * {1.0 / part.length!r}")
        by = getattr(part, "by", None)
        if by is None:
            return self._by_angle(main.body, main.turns)
        if not by.seconds:
            return self._by_angle(by.body, 1)
        length = at.TURN if by.repeats else 1.0
        function = "table_value" if by.repeats else "table_until"
        return LookUp((), function, f"{CLOCK} * {length / by.seconds!r}")

    def _by_angle(self, body: str, turns: int) -> LookUp:
        """The angle of a body from the x axis, divided by the turns after which the table repeats."""
        rows = self._rows
        write = Writer(self.rows, self._free, hoist=False)
        kin = Kinematics(
            self._forest, write, rows.coordinates, rows.velocities, rows.time, rows.curves
        )
        angle = kin.angle(body)
        if turns != 1:
            angle = angle * named(repr(1.0 / turns))
        text = write.text(angle)
        self.rows, self._free = write.rows, write.free
        self.read |= write.read
        self.inputs |= write.inputs
        return LookUp(tuple(write.lines), "table_value", text)
