"""Procedures that request simulations: generators that yield requests, receive the results, and return their findings."""

from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from typing import TypeVar

Asked = TypeVar("Asked")
Answer = TypeVar("Answer")
Found = TypeVar("Found")


def answered(asking: Generator[Asked, Answer, Found], answer: Callable[[Asked], Answer]) -> Found:
    """What a procedure finds when all it requests is answered; raises what `answer` does."""
    return all_answered([asking], lambda wanted: [answer(wanted[0])])[0]


def all_answered(
    asking: Sequence[Generator[Asked, Answer, Found]],
    answer: Callable[[Mapping[int, Asked]], Iterable[Answer]],
) -> list[Found]:
    """What each of several procedures finds; `answer` gets what those that go on request, by their numbers, at a time."""
    wanted, found = dict[int, Asked](), dict[int, Found]()
    answers: Mapping[int, Answer | None] = dict.fromkeys(range(len(asking)))
    while answers:
        wanted = {}
        for k, one in answers.items():
            try:
                wanted[k] = next(asking[k]) if one is None else asking[k].send(one)
            except StopIteration as end:
                found[k] = end.value
        answers = dict(zip(wanted, answer(wanted), strict=True)) if wanted else {}
    return [found[k] for k in range(len(asking))]
