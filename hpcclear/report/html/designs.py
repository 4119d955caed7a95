"""The page's section on designs: those that a reader compares, each once, then the rest folded."""

from collections.abc import Mapping, Sequence

import numpy as np

from hpcclear.base.objectives import ORDINALS
from hpcclear.report import beside
from hpcclear.report.constraints import worded
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, PageTable, number
from hpcclear.report.merit import is_plain
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results, text_in, texts_in

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
    shown = beside.roles(verified)
    named = [one.design for each in shown.values() for one in each]
    tables: list[object] = [
        table_of(verified, {one.design: one.words for one in each}, SIMULATED, caption)
        for case, each in shown.items()
        if each and (caption := f"Case {case}: baseline and optimised designs".replace("  ", " "))
    ]
    if not named:
        every = {name: name for name in names_in(verified)}
        tables = [table_of(verified, every, SIMULATED, "Designs")]
    remarks = str(verified.attrs.get("remarks", "none"))
    parts: list[object] = [_WORDS, *tables, *([remarks] if remarks != "none" else [])]
    return parts


def names_in(verified: Results) -> list[str]:
    """Return the names of all designs."""
    return texts_in(verified, "design")


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
    asked = [] if is_plain(chosen.isel(design=0)) else _objectives(chosen)
    if asked:  # each case has its own, so the cells say what it is
        header += [*(f"objective {k + 1}" for k in range(len(asked))), "constraints"]
    rows = []
    for k, words in enumerate(shown.values()):
        row: list[object] = [words]
        for scale, (variable, _) in zip(scales, known, strict=True):
            if variable.attrs.get("options") and np.isfinite(variable[k]):
                row.append(labels.value(variable[k]))
                continue
            row.append(Number(_cell(chosen.isel(design=k), str(variable.name), scale)))
        rows.append([*row, *_goals(chosen.isel(design=k), asked)])
    return PageTable(header, rows, caption)


def _objectives(verified: Results) -> list[str]:
    return [name for name in ORDINALS if f"{name}_goal" in verified]


def _goals(one: Results, names: Sequence[str]) -> list[object]:
    """Cells of objectives and constraints of a case, where these are not mean and standard deviation alone."""
    if not names:
        return []
    cells: list[object] = []
    for name in names:
        value = labels.quantity(float(one[f"{name}_true"]), text_in(one, f"{name}_unit"))
        words = text_in(one, f"{name}_goal")
        cells.append(f"{words}: {value}" if words else "")
    return [*cells, "; ".join(worded(one)) or "none"]


def _cell(one: Results, name: str, scale: labels.Scale) -> str:
    """A value, if it was simulated with the half-width of its confidence interval."""
    value, low, high = np.array(labels.estimate(one, name.removesuffix("_true"))) * scale.factor
    return (
        labels.paired(value, (high - low) / 2) if np.isfinite([value, low]).all() else number(value)
    )


PARTS = (SectionOf(20, "designs", "optimised", "Optimised designs", designs, "verification"),)
