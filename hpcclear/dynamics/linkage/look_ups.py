"""Where tabulated curves of drives and loads are looked up, before a lane's text runs: by an angle, or by the time."""

from typing import NamedTuple

from hpcclear.base.terms import named
from hpcclear.dynamics import layout as at
from hpcclear.dynamics.linkage.expression import Writer
from hpcclear.dynamics.linkage.kinematics import Kinematics
from hpcclear.dynamics.linkage.parts import TableRow
from hpcclear.dynamics.linkage.rows import Rows
from hpcclear.dynamics.linkage.trees import Forest

CLOCK = f"(work[{at.BEGAN} * W + i] + work[{at.STAGE_TIME} * W + i])"


def curves_of(part: TableRow) -> list[str]:
    """Names of the tabulated curves that a drive or load has."""
    return [f"{part.name}.{one}" for one in part.curves] or [part.name] * part.table


class LookUp(NamedTuple):
    """Statements, and after them the place, a share of the table's length, and its rate, 1/s."""

    before: tuple[str, ...]
    place: str
    rate: str


class LookUps:
    """Those of a mechanism's curves (`found`, by their names), and the parameters that they read besides those of its text.

    `rows`, `read` and `inputs` are as of `expression.Writer`.
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

    def _of(self, part: TableRow) -> LookUp:
        main = self._forest.mechanism.period
        if part.kind == "table":
            share = main.seconds / part.seconds / main.turns / at.TURN
            rate = f"par[{at.SPEED} * W + i] * {share!r}"
            return LookUp((), f"{rate} * work[{at.STAGE_TIME} * W + i]", rate)
        if part.kind == "run-up":
            return _by_time(part.speed_by_time[-1][0])
        if not hasattr(part, "prescribed") and part.seconds:
            return _by_time(part.seconds)
        if (body := getattr(part, "angle_of", None)) is not None:
            return self._by_angle(body, 1)
        return self._by_angle(main.body, main.turns)

    def _by_angle(self, body: str, turns: int) -> LookUp:
        """The angle of a body from the x axis, divided by the turns after which the table repeats."""
        rows = self._rows
        write = Writer(self.rows, self._free, hoist=False)
        kin = Kinematics(
            self._forest, write, rows.coordinates, rows.velocities, rows.time, rows.curves
        )
        share = named(repr(1.0 / (at.TURN * turns)))
        text = write.text(kin.angle(body) * share)
        rate = write.text(kin.spin(self._forest.frames[body]) * share)
        self.rows, self._free = write.rows, write.free
        self.read |= write.read
        self.inputs |= write.inputs
        return LookUp(tuple(write.lines), text, rate)


def _by_time(seconds: float) -> LookUp:
    """The time since the start of the sample, divided by that after which the table repeats or stays level."""
    rate = repr(1.0 / seconds)
    return LookUp((), f"{CLOCK} * {rate}", rate)
