"""Laws and rates of objectives compiled into the lanes: modules of their generated source, whose functions motions call."""

import hashlib
from dataclasses import dataclass
from functools import cache
from types import ModuleType

from hpcclear.base.generated import module_of
from hpcclear.base.objectives import Objective
from hpcclear.laws.declared import Law
from hpcclear.laws.objectives import text_of_rate
from hpcclear.laws.sources import text_of


@dataclass(unsafe_hash=True, repr=False)
class InLanes:
    """A law as effects name it: its functions, each with the arguments of `laws.sources`, and what steppers have to know of it.

    contact: ``force`` (N, cut at 0), ``elastic`` (N), ``kink``; friction: ``ratio``, ``deflection`` (m/s), ``low``, ``high``.
    """

    text: str
    title: str
    facts: tuple[str, ...]

    def __post_init__(self) -> None:
        known = "latched", "bristled", "whole", "largest"
        flags = (1 if one in self.facts else None for one in known)
        self.latched, self.bristled, self.whole, self.largest = flags
        self.name = f"law_{hashlib.sha256(self.text.encode()).hexdigest()[:12]}"
        module: ModuleType = module_of(self.name, self.text)
        for entry, function in vars(module).items():
            if entry.startswith("joint_"):
                setattr(self, entry.removeprefix("joint_"), function)

    def __repr__(self) -> str:
        return f"<{self.title} {self.name}>"

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return InLanes, (self.text, self.title, self.facts)


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
