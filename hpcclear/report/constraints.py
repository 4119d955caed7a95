"""Verdicts on the constraints of designs, in words; programs go by the numbers and codes of the file."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.verdict import Verdict, together
from hpcclear.report.figures.labels import quantity, stated
from hpcclear.results.content import Results, each, number_in, text_in

ABSENT = 3
"""Code of ``constraint_verdict`` where a case has fewer constraints than another."""

WORDS = {Verdict.FAILS: "violated", Verdict.UNDECIDED: "undecided", Verdict.HOLDS: "satisfied"}

OPEN = "the integration tolerance leaves it open"
"""Said of a constraint that no number of simulations would decide."""


class JudgedConstraint(NamedTuple):
    """A constraint of a design: what is bounded, its unit, its simulated value with the ends of its interval, the bound."""

    goal: str
    unit: str
    true: float
    lower: float
    upper: float
    most: float
    verdict: Verdict
    price: float
    """Simulations that would decide it: infinite where the tolerance leaves it open, NaN where that is not known."""

    @property
    def deciding(self) -> str:
        """What would decide it, in words; "" where that is not known."""
        if np.isinf(self.price):
            return OPEN
        return "" if np.isnan(self.price) else f"about {self.price:.0f} simulations would decide"

    @property
    def bounded(self) -> str:
        """Its bound, and the verdict."""
        return f"at most {quantity(self.most, self.unit)}: {WORDS[self.verdict]}"

    def __str__(self) -> str:
        """As "probability of f above 3 N = 0.01 (95 % CI 0.009 to 0.011), at most 0.05: satisfied"."""
        shown, ends = stated(self.true, self.lower, self.upper, self.unit)
        within = f" (95 % CI {ends})" if self.lower < self.upper else ""
        more = f" ({self.deciding})" if self.deciding else ""
        return f"{self.goal} = {shown}{within}, {self.bounded}{more}"


def constraints_of(one: Results) -> list[JudgedConstraint]:
    """Return the constraints of a design (of kind ``verification``)."""
    found = []
    for own in each(one, "constraint") if "constraint_verdict" in one else ():
        if (code := int(own["constraint_verdict"])) != ABSENT:
            names = ("true", "lower", "upper", "most", "price")
            true, lower, upper, most, price = (number_in(own, f"constraint_{n}") for n in names)
            words = text_in(own, "constraint_goal"), text_in(own, "constraint_unit")
            found.append(JudgedConstraint(*words, true, lower, upper, most, Verdict(code), price))
    return found


def verdict_of(one: Results) -> Verdict | None:
    """Return the verdict on all constraints of a design; None if its case has none."""
    codes = one["constraint_verdict"].values if "constraint_verdict" in one else np.array([])
    found = codes[codes != ABSENT].tolist()
    return together(found) if found else None
