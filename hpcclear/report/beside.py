"""Designs of each case to compare, each distinct design once: baseline, ends of the front, recommended, lightest."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from hpcclear.base.objectives import ENDS, ORDINALS, Usual
from hpcclear.report import alike
from hpcclear.report.answer import bounds, unit_of
from hpcclear.report.constraints import WORDS, verdict_of
from hpcclear.report.figures import labels
from hpcclear.report.merit import (
    counts,
    goals_of,
    recommended,
    usual_of,
)
from hpcclear.results.content import Results

BESIDE = ("original", *ENDS[:2])
"""Designs that every case with a baseline has."""

LIGHTER = 0.01
"""Relative difference of the varied masses above which another design is called the lightest."""

_ROWS = {
    "mean": "mean_true",
    "std. deviation": "deviation_true",
    "95th percentile": "percentile",
    "mean, own wear": "life_mean",
    "std. dev., own wear": "life_deviation",
}
"""Lines of the table of a case, and the variables they show."""


class Role(NamedTuple):
    """A design of a case, and what it is."""

    design: str
    """Name in the files."""
    words: str
    """Its roles: "baseline", "lowest mean (alpha), recommended"."""


def roles(verified: Results) -> dict[str, list[Role]]:
    """Return the designs to compare, by case, each distinct design once.

    Parameters
    ----------
    verified : xarray.Dataset
        Kind ``verification``.

    Returns
    -------
    dict of str to list of Role
        Baseline, ends of the front, the recommended design, and the one with the lowest sum of the varied masses, unless one
        of these is as light. Intermediate designs of the search are left out.
    """
    names = [str(name) for name in verified["design"].to_numpy()]
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
        return list(dict.fromkeys(map(str, verified["case"].to_numpy())))
    ends = [name.rpartition(" ") for name in names]
    return list(dict.fromkeys(case for case, _, end in ends if end == "original"))


def _same(verified: Results, own: Results, chosen: dict[str, list[str]]) -> str:
    """The chosen design with the same variables, else its own name."""
    twins = alike.again(verified, own)
    return next((name for name in chosen if name in twins), str(own["design"].item()))


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
        for k in range(verified.sizes["design"])
        if counts(one := verified.isel(design=k))
        and str(one["design"].item()).startswith(f"{case} ")
        and alike.satisfies(one)
    ]
    weights = {str(one["design"].item()): sum(map(float, alike.masses(one))) for one in own}
    known = {name: weight for name, weight in weights.items() if np.isfinite(weight) and weight}
    if not known:
        return ""
    light = min(known, key=lambda name: known[name])
    least = min((known[name] for name in chosen if name in known), default=np.inf)
    return light if known[light] < (1.0 - LIGHTER) * least else ""


def beside_original(
    verified: Results,
) -> Iterator[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Yield each case with a baseline, the headers of its table, and its lines.

    A line is a quantity and its value for each design of `roles`, with half-width and change from the baseline.
    """
    names = {str(name) for name in verified["design"].to_numpy()}
    for case, shown in roles(verified).items():
        if not {f"{case} {end}" for end in BESIDE} <= names:
            continue
        designs = [verified.sel(design=one.design) for one in shown]
        lines = [
            (words, *(_against(one, designs[0], name) for one in designs))
            for words, name in _ROWS.items()
            if name in verified or not name.startswith("life_")
        ]
        for name in _asked(designs[0]):
            words = str(designs[0][f"{name}_goal"].item()).removesuffix(" of f")
            lines.append((words, *(_against(one, designs[0], f"{name}_true") for one in designs)))
        if "first_goal" in verified:
            found = map(verdict_of, designs)
            lines.append(("constraints", *("none" if v is None else WORDS[v] for v in found)))
        lines.append(("active bounds", "", *(bounds(one) for one in designs[1:])))
        yield case, tuple(one.words for one in shown), lines


def _against(one: Results, original: Results, name: str) -> str:
    """A simulated value, its half-width, and its change from the baseline's."""
    if name not in one or not np.isfinite(float(one[name])):
        return "not known"
    value, stem = float(one[name]), name.removesuffix("_true")
    unit = unit_of(one, name)
    text = labels.quantity(value, unit)
    if not unit:  # a share or a formula
        ends = [float(one[f"{stem}_{end}"]) for end in ("lower", "upper")]
        return text if ends[0] == ends[1] else f"{text} ({ends[0]:.2g} to {ends[1]:.2g})"
    if f"{stem}_upper" in one and value:
        half = (float(one[f"{stem}_upper"]) - float(one[f"{stem}_lower"])) / 2.0
        text += f" ±{abs(half / value):.2%}" if np.isfinite(half) else ", interval not known"
    if one["design"].item() == original["design"].item():
        return text
    before = float(original[name])
    return f"{text} {value / before - 1.0:+.0%}" if before else text


def _asked(one: Results) -> list[str]:
    """Objectives of the case of a design that have no line anyway: "first", "second"."""
    return [name for name in goals_of(one) if usual_of(one, name) is Usual.OTHER]
