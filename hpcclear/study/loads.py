"""Load cases of one machine: every design is simulated at each of them, and f is the worst or a weighted mean."""

import numpy as np

from hpcclear.base.arrays import Array, Records
from hpcclear.base.outcome import Status
from hpcclear.scene.points import Points
from hpcclear.scene.variables import StudyVariable


def at_all(loads: StudyVariable, points: Points) -> Points:
    """Designs (n, d) at all load cases, (n * cases, d), those of a design one behind the other."""
    options = np.array(loads.options)
    values = np.repeat(points.values, len(options), axis=0)
    values[:, points.names.index(loads.name)] = np.tile(options, len(points))
    return Points(points.names, values, points.paths)


def combined(records: Records, responses: Array, loads: StudyVariable) -> tuple[Records, Array]:
    """A record for each design, (n,), of those at its load cases, (n * cases,), and its responses, (k, n), of theirs.

    Each response is the largest or the weighted mean of the load cases; the record is that with the largest objective, whose
    place is taken by what is made of them. A design that failed at one of them counts as failed.
    """
    cases = len(loads.options or ())
    table, each = records.reshape(-1, cases), responses.reshape(len(responses), -1, cases)
    failed = table["status"] != Status.OK
    values = np.where(failed | np.isnan(each[0]), np.inf, each[0])
    found: Records = table[np.arange(len(table)), values.argmax(axis=1)].copy()
    if loads.over == "worst":
        made = each.max(axis=2)
    else:
        weights = np.array(loads.over, dtype=float)
        made = each @ (weights / weights.sum())
    made = np.where(failed.any(axis=1), np.nan, made)
    found["objective"] = np.where(failed.any(axis=1), found["objective"], made[0])
    found["flags"] = np.bitwise_or.reduce(table["flags"], axis=1)
    found["rhs_evaluations"] = table["rhs_evaluations"].sum(axis=1)
    return found, made
