"""Tables that run straight from row to row and stay level beyond: a sum of hinges, which lanes evaluate without a branch.

Their rows are parameters, as they may differ from sample to sample; steps end at them (`stepping.rows`).
"""

from typing import Any

import numpy as np

from hpcclear.dynamics.linkage.expression import Term, Writer, named

Rows = tuple[tuple[float, float], ...]


def numbers(name: str, rows: Rows) -> dict[str, Any]:
    """Parameters of a table by name: its first value, and where it bends by how much."""
    x, y = np.array(rows).T
    slopes = np.diff(y) / np.diff(x)
    bends = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
    found = {f"{name}_first": float(y[0])}
    for k, (start, bend) in enumerate(zip(x, bends, strict=True)):
        found |= {f"{name}_start_{k}": float(start), f"{name}_bend_{k}": float(bend)}
    return found


def starts(name: str, rows: Rows) -> list[str]:
    """Names of the parameters where a table bends."""
    return [f"{name}_start_{k}" for k in range(len(rows))]


def term(write: Writer, name: str, count: int, where: Term, row: int | None) -> Term:
    """The value of a table of so many rows at a place, which is left in a row of the lanes if there is one for it."""
    total = write.parameter(f"{name}_first")
    place = write.text(write.let(f"at_{name}", where, whole=True))
    if row is not None:
        write.line(f"work[{row} * W + i] = {place}")
    for k in range(count):
        start, bend = (
            write.text(write.parameter(f"{name}_{entry}_{k}")) for entry in ("start", "bend")
        )
        made = write.fresh(f"{name}_{k}")
        write.line(f"{made} = hinge({place}, {start}, {bend})")
        total = total + named(made)
    return total
