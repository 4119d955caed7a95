"""Procedures that ask: generators that yield what they want to know, are sent the answer, and return what they found."""

from collections.abc import Callable, Generator
from typing import TypeVar

Asked = TypeVar("Asked")
Answer = TypeVar("Answer")
Found = TypeVar("Found")


def answered(asking: Generator[Asked, Answer, Found], answer: Callable[[Asked], Answer]) -> Found:
    """What a procedure finds when all it requests is answered; raises what `answer` does."""
    asked = next(asking)
    while True:
        told = answer(asked)
        try:
            asked = asking.send(told)
        except StopIteration as end:
            found: Found = end.value
            return found
