"""Verdicts on the constraints of designs, in words; programs go by the numbers and codes of the file."""

from collections.abc import Iterator

import numpy as np

from hpcclear.base.verdict import Verdict, together
from hpcclear.report.figures.labels import between, quantity
from hpcclear.results.content import Results, each

ABSENT = 3
"""Code of ``constraint_verdict`` where a case has fewer constraints than another."""

WORDS = {Verdict.FAILS: "violated", Verdict.UNDECIDED: "undecided", Verdict.HOLDS: "satisfied"}

OPEN = "the integration tolerance leaves it open"
"""Said of a constraint that no number of simulations would decide."""


def verdict_of(one: Results) -> Verdict | None:
    """Return the verdict on all constraints of a design (of kind ``verification``); None if its case has none."""
    codes = one["constraint_verdict"].to_numpy() if "constraint_verdict" in one else np.array([])
    found = codes[codes != ABSENT].tolist()
    return together(found) if found else None


def prices_of(one: Results) -> list[float]:
    """Return the simulations that would decide each undecided constraint of a design; infinite where the tolerance leaves it
    open; those that are not known are left out."""
    prices = one["constraint_price"].to_numpy() if "constraint_price" in one else np.array([])
    return [float(price) for price in prices[~np.isnan(prices)]]


def worded(one: Results) -> Iterator[str]:
    """Yield constraints of a design: "probability of f above 3 N = 0.01 (95 % CI 0.009 to 0.011), at most 0.05: satisfied"."""
    if "constraint_verdict" not in one:
        return
    for own in each(one, "constraint"):
        if int(own["constraint_verdict"]) == ABSENT:
            continue
        unit = str(own["constraint_unit"].item())
        value, low, high, most, price = (
            float(own[f"constraint_{name}"]) for name in ("true", "lower", "upper", "most", "price")
        )
        text = f"{own['constraint_goal'].item()} = {quantity(value, unit)}"
        text += f" (95 % CI {between(low, high, unit)})" if low < high else ""
        verdict = Verdict(int(own["constraint_verdict"]))
        text += f", at most {quantity(most, unit)}: {WORDS[verdict]}"
        if np.isinf(price):
            text += f" ({OPEN})"
        elif np.isfinite(price):
            text += f" (about {price:.0f} simulations would decide)"
        yield text
