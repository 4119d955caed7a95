"""Procedures that request simulations: generators that yield requests, receive the results, and return their findings."""

from collections.abc import Callable, Generator
from typing import TypeVar

Asked = TypeVar("Asked")
Answer = TypeVar("Answer")
Found = TypeVar("Found")


def answered(asking: Generator[Asked, Answer, Found], answer: Callable[[Asked], Answer]) -> Found:
    """What a procedure finds when all it requests is answered; raises what `answer` does."""
    asked = next(asking)
    while True:
        answered = answer(asked)
        try:
            asked = asking.send(answered)
        except StopIteration as end:
            found: Found = end.value
            return found
