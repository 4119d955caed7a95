"""Tables that run straight from row to row and stay level beyond: a sum of hinges, which lanes evaluate without a branch.

Their rows are parameters, as they may differ from sample to sample; steps end at them (`stepping.rows`).
"""

from collections.abc import Sized

from hpcclear.base.terms import Term, named
from hpcclear.dynamics.linkage.expression import Writer


def starts(name: str, rows: Sized) -> list[str]:
    """Names of the parameters where a table bends."""
    return [f"{name}_start_{k}" for k in range(len(rows))]


def term(write: Writer, name: str, count: int, where: Term, row: int | None) -> Term:
    """The value of a table of so many rows at a place, which is left in a row of the lanes if there is one for it.

    Its parameters are those of `base.pieces.hinges`.
    """
    total = write.parameter(f"{name}_first")
    place = write.let(f"at_{name}", where, whole=True)
    if row is not None:
        write.line(f"work[{row} * W + i] = {write.text(place)}")
    for k in range(count):
        start, bend = (write.parameter(f"{name}_{entry}_{k}") for entry in ("start", "bend"))
        total = total + hinge(write, f"{name}_{k}", place, start, bend)
    return total


def hinge(write: Writer, name: str, place: Term, start: Term, bend: Term) -> Term:
    """A line of slope `bend` beyond `start`, 0 before."""
    texts = [write.text(one) for one in (place, start, bend)]
    made = write.fresh(name)
    write.line(f"{made} = hinge({', '.join(texts)})")
    return named(made)
