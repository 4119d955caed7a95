"""Values that context variables have within a block."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypeVar

Value = TypeVar("Value")


@contextmanager
def holding(variable: ContextVar[Value], value: Value) -> Iterator[None]:
    """Give a context variable this value within the block."""
    token = variable.set(value)
    try:
        yield
    finally:
        variable.reset(token)
