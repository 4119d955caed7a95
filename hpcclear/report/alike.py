"""Designs that are statistically indistinguishable from one, and the same design under another name."""

import numpy as np

from hpcclear.base.plain import counted
from hpcclear.base.verdict import Verdict
from hpcclear.report.constraints import verdict_of
from hpcclear.report.figures import labels
from hpcclear.results.content import Results, Variable, each, text_in, texts_in

SAME = 0.01
"""Relative difference up to which a variable of two designs is called the same."""

_BOOKKEEPING = ("averaged", "best", "candidate")

NAMED = 3
"""Designs named before the rest is counted."""


FLAT = 0.01
"""Relative difference of merit up to which other designs are listed beside the best."""


def flat(ours: Results, best: Results, merit: np.ndarray) -> str:
    """Return the designs whose merit (n,) is within `FLAT` of the best, in what they differ, and the lightest; "" if none."""
    if not satisfies(best):
        return ""  # there is no recommended design
    least = float(merit.min())
    near = np.isfinite(merit) & (merit - least <= FLAT * abs(least))
    own = [*again(ours, best), text_in(best, "design")]
    names = [str(name) for name in ours["design"].values[near] if str(name) not in own]
    if not names:
        return ""
    together = ours.isel(design=np.isin(ours["design"], [best["design"].item(), *names]))
    text = f"{_listed(names)}: criterion within {100 * FLAT:.0f} % of the recommended design"
    if found := spans(ours, best, names):
        text += f"; they differ in {found}"
    return text + _lightest(together, best)


def masses(verified: Results) -> list[Variable]:
    """Return the design variables that are masses."""
    every = (v for v in labels.design_variables(verified) if "of_random_inputs" not in v.attrs)
    return [one for one in every if one.attrs.get("units") == "kg"]


def _lightest(together: Results, best: Results) -> str:
    """The lightest of some designs by the sum of their masses, where it is lighter than the best."""
    if not (found := masses(together)):
        return ""
    whole = np.sum([one.values for one in found], axis=0)
    saved = sum(map(float, masses(best))) - float(np.nanmin(whole))
    if not saved > 1e-6:
        return ""
    name = str(together["design"].values[int(np.nanargmin(whole))])
    return f"; lightest: {name}, {labels.quantity(saved, 'kg', 2)} less"


def others(ours: Results, best: Results) -> list[str]:
    """Return other designs that are statistically indistinguishable from the best; all satisfy the constraints, or none is."""
    if not satisfies(best):
        return []
    bad = [text_in(one, "design") for one in each(ours, "design") if not satisfies(one)]
    twins = {*best["rival"].values[best["equivalence"].values == 1]} - {*again(ours, best), *bad}
    return [name for name in texts_in(ours, "design") if name in twins]


def satisfies(one: Results) -> bool:
    """Return whether a design significantly satisfies all constraints of its case."""
    return verdict_of(one) in (None, Verdict.HOLDS)


def _listed(names: list[str]) -> str:
    """The first names, and how many more; designs that the search only met on its way have none worth printing."""
    named = [name for name in names if not any(word in name.split() for word in _BOOKKEEPING)]
    shown, more = named[:NAMED], len(names) - len(named[:NAMED])
    if not shown:
        return f"{counted(more, 'other design')} of the search"
    return ", ".join(shown) + (f" and {more} more" if more > 0 else "")


def again(ours: Results, best: Results) -> list[str]:
    """Return other names of a design: all variables are the same numbers."""
    variables = labels.design_variables(ours)
    alike = np.full(ours.sizes["design"], bool(variables))  # of none nothing is known
    for variable in variables:
        own = float(best[variable.name])
        alike &= np.isclose(variable.values, own, rtol=1e-9, atol=0.0, equal_nan=True)
    names = (str(name) for name in ours["design"].values[alike])
    return [name for name in names if name != text_in(best, "design")]


def spans(ours: Results, best: Results, names: list[str], most: int | None = None) -> str:
    """Return the ranges of the variables, at most so many, in which these designs and the best differ."""
    alike, texts = ours.isel(design=np.isin(ours["design"], [best["design"].item(), *names])), []
    for variable in labels.design_variables(alike):
        low, high = float(np.min(variable)), float(np.max(variable))
        if high - low > SAME * abs(high):
            unit = str(variable.attrs["units"])
            texts.append(f"{labels.words(variable)} from {labels.between(low, high, unit)}")
    return ", ".join(texts[:most])
