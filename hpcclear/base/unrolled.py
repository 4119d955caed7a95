"""Short loops that compiled code has written out: ``for k in written_out(ITEMS)`` becomes one copy of its body for each item.

The compiler vectorises neither a loop over coordinates inside a loop over lanes nor a short one of its own (104 ns against
62 ns for a bank of eight states), and a loop over rates must test of each whether its effect is on, which is pruned only
where it is written out (`base.lowering.statements`).
"""

from collections.abc import Iterable
from typing import TypeVar

Item = TypeVar("Item")


def written_out(items: Iterable[Item]) -> Iterable[Item]:
    """Mark a loop over `items`, an expression of module globals or a range of numbers that are known."""
    return items
