"""Load cases of one machine: every design is simulated at each of them, and f is the worst or a weighted mean."""

import numpy as np

from hpcclear.base.arrays import Records
from hpcclear.base.outcome import Status
from hpcclear.scene.points import Points
from hpcclear.scene.variables import Variable


def at_all(loads: Variable, points: Points) -> Points:
    """Designs (n, d) at all load cases, (n * cases, d), those of a design one behind the other."""
    options = np.array(loads.options)
    values = np.repeat(points.values, len(options), axis=0)
    values[:, points.names.index(loads.name)] = np.tile(options, len(points))
    return Points(points.names, values, points.paths)


def combined(records: Records, over: str | tuple[float, ...] | None, cases: int) -> Records:
    """A record for each design, (n,), of those at its load cases, (n * cases,): the one with the largest objective, whose place
    is taken by the mean where there are weights. One that failed counts as failed."""
    table = records.reshape(-1, cases)
    failed = table["status"] != Status.OK
    values = np.where(failed, np.inf, table["objective"])
    values = np.where(np.isnan(values), np.inf, values)
    rows = np.arange(len(table))
    found: Records = table[rows, values.argmax(axis=1)].copy()
    if over is not None and over != "worst":
        weights = np.array(over, dtype=float)
        mean = table["objective"] @ (weights / weights.sum())
        found["objective"] = np.where(failed.any(axis=1), found["objective"], mean)
    found["flags"] = np.bitwise_or.reduce(table["flags"], axis=1)
    found["rhs_evaluations"] = table["rhs_evaluations"].sum(axis=1)
    return found
