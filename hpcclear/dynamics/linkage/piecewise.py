"""Tables that run straight from row to row and stay level beyond: a sum of hinges, which lanes evaluate without a branch."""

from hpcclear.dynamics.linkage.expression import Term, Writer, named


def term(write: Writer, name: str, count: int, at: Term) -> Term:
    """The value of a table of so many rows, whose parameters `base.pieces.hinges` gives."""
    total = write.parameter(f"{name}_first")
    place = write.let(f"at_{name}", at, whole=True)
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
