"""Tables that run straight from row to row and stay level beyond: a sum of hinges, which lanes evaluate without a branch."""

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


def term(write: Writer, name: str, count: int, at: Term) -> Term:
    """The value of a table of so many rows."""
    total = write.parameter(f"{name}_first")
    place = write.text(write.let(f"at_{name}", at, whole=True))
    for k in range(count):
        start, bend = (
            write.text(write.parameter(f"{name}_{entry}_{k}")) for entry in ("start", "bend")
        )
        made = write.fresh(f"{name}_{k}")
        write.line(f"{made} = hinge({place}, {start}, {bend})")
        total = total + named(made)
    return total
