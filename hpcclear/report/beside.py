"""Designs of each case to compare, each distinct design once: baseline, ends of the front, recommended, lightest."""

from typing import NamedTuple

import numpy as np

from hpcclear.base.objectives import ENDS, ORDINALS
from hpcclear.report import alike
from hpcclear.report.merit import counts, recommended
from hpcclear.results.content import Results, each, text_in, texts_in

LIGHTER = 0.01
"""Relative difference of the varied masses above which another design is called the lightest."""


class Role(NamedTuple):
    """A design of a case, and what it is."""

    design: str
    """Name in the files."""
    words: str
    """Its roles: "baseline", "lowest mean (alpha), recommended"."""


def roles(verified: Results) -> dict[str, list[Role]]:
    """Return the designs to compare (of kind ``verification``), by case, each distinct design once.

    Baseline, ends of the front, the recommended design, and the one with the lowest sum of the varied masses, unless one of
    these is as light. Intermediate designs of the search are left out.
    """
    names = texts_in(verified, "design")
    best = recommended(verified)
    found = {}
    for case in _cases(verified, names):
        chosen: dict[str, list[str]] = {}
        for end in ("original", *ENDS):
            if f"{case} {end}" in names:
                own = verified.sel(design=f"{case} {end}")
                chosen.setdefault(_same(verified, own, chosen), []).append(_role(end, own))
        if best.startswith(f"{case} "):
            own = verified.sel(design=best)
            same = _same(verified, own, chosen)
            first = [] if same in chosen else [best.removeprefix(f"{case} ")]
            chosen.setdefault(same, first).append("recommended")
        if light := _lightest(verified, case, list(chosen)):
            chosen[light] = [light.removeprefix(f"{case} "), "lightest"]
        found[case] = [Role(name, ", ".join(words)) for name, words in chosen.items()]
    return found


def _cases(verified: Results, names: list[str]) -> list[str]:
    """Cases, in the order of the file."""
    if "case" in verified:
        return list(dict.fromkeys(texts_in(verified, "case")))
    ends = [name.rpartition(" ") for name in names]
    return list(dict.fromkeys(case for case, _, end in ends if end == "original"))


def _same(verified: Results, own: Results, chosen: dict[str, list[str]]) -> str:
    """The chosen design with the same variables, else its own name."""
    twins = alike.again(verified, own)
    return next((name for name in chosen if name in twins), text_in(own, "design"))


def _role(end: str, own: Results) -> str:
    """What an end of a front is called, with its name in the files."""
    if end == "original":
        return "baseline"
    place = ENDS.index(end)
    name = f"{ORDINALS[place]}_goal"
    goal = str(own[name].item()) if name in own else ("mean", "standard deviation")[place]
    words = goal.removesuffix(" of f").replace("standard deviation", "std. dev.")
    return f"lowest {words} ({end})"


def _lightest(verified: Results, case: str, chosen: list[str]) -> str:
    """The design of a case with the lowest sum of masses within its constraints; "" if one of the chosen is as light."""
    own = [
        one
        for one in each(verified, "design")
        if counts(one) and text_in(one, "design").startswith(f"{case} ") and alike.satisfies(one)
    ]
    weights = {text_in(one, "design"): sum(map(float, alike.masses(one))) for one in own}
    known = {name: weight for name, weight in weights.items() if np.isfinite(weight) and weight}
    if not known:
        return ""
    light = min(known, key=lambda name: known[name])
    least = min((known[name] for name in chosen if name in known), default=np.inf)
    return light if known[light] < (1.0 - LIGHTER) * least else ""
