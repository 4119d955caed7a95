"""Laws and rates of objectives compiled into the lanes: modules of their generated source, whose functions motions call."""

import hashlib
from functools import cache
from types import ModuleType

from hpcclear.base.generated import module_of
from hpcclear.base.objectives import Objective
from hpcclear.laws.declared import Law
from hpcclear.laws.objectives import text_of_rate
from hpcclear.laws.sources import text_of


class InLanes:
    """A law as effects name it: its functions, each with the arguments of `laws.sources`, and what steppers have to know of it.

    contact: ``force`` (N, cut at 0), ``elastic`` (N), ``kink``; friction: ``ratio``, ``deflection`` (m/s), ``low``, ``high``.
    """

    def __init__(self, text: str, title: str, facts: tuple[str, ...]) -> None:
        self._made_of = text, title, facts
        self.title, self.facts = title, facts
        self.name = f"law_{hashlib.sha256(text.encode()).hexdigest()[:12]}"
        module: ModuleType = module_of(self.name, text)
        for entry, function in vars(module).items():
            if entry.startswith("joint_"):
                setattr(self, entry.removeprefix("joint_"), function)

    latched = property(lambda self: self._is("latched"))
    bristled = property(lambda self: self._is("bristled"))
    whole = property(lambda self: self._is("whole"))
    largest = property(lambda self: self._is("largest"))
    of = property(lambda self: "whole" if self.whole else "joints")

    def _is(self, fact: str) -> int | None:
        return 1 if fact in self.facts else None

    def __repr__(self) -> str:
        return f"<{self.title} {self.name}>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, InLanes) and self._made_of == other._made_of

    def __hash__(self) -> int:
        return hash(self._made_of)

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return InLanes, self._made_of


@cache
def in_lanes(law: Law) -> InLanes:
    """A law ready to be written out. Raises LawError if a function has more in it than arithmetic."""
    facts = tuple(one for one in ("latched", "bristled") if getattr(law, one, False))
    return InLanes(text_of(law), law.name, facts)


@cache
def rate_in_lanes(objective: Objective) -> InLanes:
    """An objective's rate ready to be written out, as `text_of_rate` has it; LawError as there."""
    facts = {"whole": objective.whole, "largest": objective.made == "peak"}
    named = tuple(one for one, yes in facts.items() if yes)
    return InLanes(text_of_rate(objective), f"rate of {objective.name}", named)
