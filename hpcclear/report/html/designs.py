"""The page's section on designs: those that a reader compares, each once, then the rest folded."""

from collections.abc import Mapping, Sequence

import numpy as np

from hpcclear.base.objectives import ENDS, ORDINALS
from hpcclear.report import alike
from hpcclear.report.constraints import constraints_of
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, PageTable, number
from hpcclear.report.merit import counts, is_plain, recommended, role
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results, Variable, each, text_in, texts_in

LIGHTER = 0.01
"""Relative difference of the varied masses above which another design is called the lightest."""


def roles(verified: Results) -> dict[str, dict[str, str]]:
    """Return the designs to compare (of kind ``verification``), by case, each distinct design once: their roles ("baseline",
    "lowest mean (alpha), recommended") by their names in the files.

    Baseline, ends of the front, the recommended design, and the one with the lowest sum of the varied masses, unless one of
    these is as light. Intermediate designs of the search are left out.
    """
    names = texts_in(verified, "design")
    best = recommended(verified)
    found = {}
    for case in dict.fromkeys(texts_in(verified, "case")):  # in the order of the file
        chosen: dict[str, list[str]] = {}
        for end in ("original", *ENDS):
            if f"{case} {end}" in names:
                own = verified.sel(design=f"{case} {end}")
                chosen.setdefault(_same(verified, own, chosen), []).append(_role(end, own))
        if best.startswith(f"{case} "):
            own = verified.sel(design=best)
            same = _same(verified, own, chosen)
            first = [] if same in chosen else [best.removeprefix(f"{case} ")]
            chosen.setdefault(same, first).append(role(verified))
        if light := _lightest(verified, case, list(chosen)):
            chosen[light] = [light.removeprefix(f"{case} "), "lightest"]
        found[case] = {name: ", ".join(words) for name, words in chosen.items()}
    return found


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
    good = (one for one in each(verified, "design") if counts(one) and alike.satisfies(one))
    weights = {text_in(one, "design"): sum(map(float, alike.masses(one))) for one in good}
    weights = {name: one for name, one in weights.items() if name.startswith(f"{case} ")}
    known = {name: weight for name, weight in weights.items() if np.isfinite(weight) and weight}
    if not known:
        return ""
    light = min(known, key=lambda name: known[name])
    least = min((known[name] for name in chosen if name in known), default=np.inf)
    return light if known[light] < (1.0 - LIGHTER) * least else ""


SIMULATED = (
    ("mean_true", "mean of f"),
    ("deviation_true", "std. deviation of f"),
    ("percentile", "95th percentile of f"),
    ("life_mean", "mean, own wear"),
    ("life_deviation", "std. deviation, own wear"),
)
"""Variables of kind ``verification`` by simulation, and the heads of their columns."""

_WORDS = "By simulation, ± half-width of the 95 % confidence interval. In brackets: the name in verification.nc."


def designs(verified: Results, content: Content) -> list[object]:
    """What was found, a table a case with each distinct design once."""
    shown = roles(verified)
    tables: list[object] = []
    for case, words in shown.items():
        caption = f"Case {case}: baseline and optimised designs".replace("  ", " ")
        tables += [table_of(verified, words, SIMULATED, caption)] if words else []
    if not tables:
        every = {name: name for name in texts_in(verified, "design")}
        tables = [table_of(verified, every, SIMULATED, "Designs")]
    remarks = str(verified.attrs.get("remarks", "none"))
    return [_WORDS, *tables, *([remarks] if remarks != "none" else [])]


def table_of(
    verified: Results, shown: Mapping[str, str], columns: Sequence[tuple[str, str]], caption: str
) -> PageTable:
    """A row for each design, by its name and what it is called; each column in one unit, empty ones left out."""
    chosen = verified.sel(design=list(shown))
    known = [(v, labels.words(v)) for v in labels.design_variables(chosen)]
    known += [(chosen[name], words) for name, words in columns if name in chosen]
    known = [(v, words) for v, words in known if bool(np.isfinite(v).any())]
    scales = [labels.of(variable) for variable, _ in known]
    header = ["design", *(s.label(words) for s, (_, words) in zip(scales, known, strict=True))]
    plain = is_plain(chosen.isel(design=0))
    asked = [name for name in ORDINALS if not plain and f"{name}_goal" in chosen]
    if asked:  # each case has its own, so the cells say what it is
        header += [*(f"objective {k + 1}" for k in range(len(asked))), "constraints"]
    rows = []
    for k, words in enumerate(shown.values()):
        one = chosen.isel(design=k)
        cells = (_cell(one[v.name], one, s) for s, (v, _) in zip(scales, known, strict=True))
        rows.append([words, *cells, *_goals(one, asked)])
    return PageTable(header, rows, caption)


def _goals(one: Results, names: Sequence[str]) -> list[object]:
    """Cells of objectives and constraints of a case, where these are not mean and standard deviation alone."""
    if not names:
        return []
    cells: list[object] = []
    for name in names:
        value, _ = labels.stated(*labels.estimate(one, name), text_in(one, f"{name}_unit"))
        words = text_in(one, f"{name}_goal")
        cells.append(f"{words}: {value}" if words else "")
    return [*cells, "; ".join(map(str, constraints_of(one))) or "none"]


def _cell(own: Variable, one: Results, scale: labels.Scale) -> str:
    """A value of a design, if it was simulated with the half-width of its confidence interval; of a choice its name."""
    if labels.options(own) and np.isfinite(own):
        return labels.value(own)
    value, low, high = np.array(labels.estimate(one, own.name.removesuffix("_true"))) * scale.factor
    if np.isfinite([value, low, high]).all():
        return Number(labels.paired(value, (high - low) / 2))
    open_ = np.isfinite(low) or np.isfinite(high)  # too few samples for one end
    return f"{number(value)}, interval not stated" if open_ else number(value)


PARTS = (SectionOf(20, "designs", "optimised", "Optimised designs", designs, "verification"),)
