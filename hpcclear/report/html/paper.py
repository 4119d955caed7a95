"""The page's section on a paper: its claims, its designs, and how its text can be read."""

from hpcclear.base.objectives import ENDS
from hpcclear.base.verdict import Verdict
from hpcclear.report import beside
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.designs import SIMULATED, names_in, table_of
from hpcclear.report.html.markup import Number, PageTable, number
from hpcclear.report.parts import SectionOf

_BADGES = {
    Verdict.HOLDS: {"words": "✓ holds", "kind": "holds"},
    Verdict.FAILS: {"words": "✗ does not hold", "kind": "fails"},
    Verdict.UNDECIDED: {"words": "? undecided", "kind": "open"},
}

_PRINTED = (("mean_paper", "printed: mean"), ("deviation_paper", "printed: std. deviation"))
"""Variables of kind ``verification``, and the heads of their columns."""


def readings(content: Content) -> list[object] | None:
    """The paper's designs under the possible readings of its text."""
    found = content.get("readings")
    if found is None:
        return None
    scale = labels.of(found["mean"])
    names = [str(name) for name in found["design"].to_numpy()]
    header = ["reading", *(scale.label(name) for name in names), "distance"]
    rows: list[list[object]] = []
    if "mean_paper" in found:
        printed = [number(float(value) * scale.factor) for value in found["mean_paper"].to_numpy()]
        rows.append(["printed in the paper", *printed, Number("–")])
    for k in range(found.sizes["reading"]):
        one = found.isel(reading=k)
        cells = [number(float(value) * scale.factor) for value in one["mean"].to_numpy()]
        distance = number(float(one["distance"]), 3) if "distance" in one else Number("–")
        rows.append([one["reading"].item(), *cells, distance])
    words = (
        "Mean of f of the paper's own designs, by how its text is read; the distance is the root mean square of "
        "ln(mean / printed mean)."
    )
    return [words, PageTable(header, rows, "Effect of ambiguities in the paper")]


def claims(content: Content) -> list[object] | None:
    """The paper's claims with our verdicts, the numbers of them first."""
    found = content.get("claims")
    if found is None:
        return None
    verdicts = found["verdict"].to_numpy().tolist()
    counts = [verdicts.count(verdict) for verdict in Verdict]
    held = (
        f"Of the paper's {len(verdicts)} claims that were tested, {counts[0]} hold on this data, {counts[1]} do not, and "
        f"{counts[2]} are undecided."
    )
    rows = []
    for k in range(found.sizes["claim"]):
        one = found.isel(claim=k)
        badge = _BADGES[Verdict(int(one["verdict"]))]
        rows.append([f"{int(one['claim'])}. {one['text'].item()}", badge])
    title = "Claims of the paper, tested on this data; claims.nc has the numbers that decide"
    return [held, PageTable(["claim", "verdict"], rows, title)]


def designs_of_a_paper(content: Content) -> list[object]:
    """Words and table of the designs that a publication prints, beside the optimised ones; nothing without any."""
    verified = content.get("verification")
    if verified is None or not content.is_compared:
        return []
    ends = [f"{case} {end}" for case in beside.roles(verified) for end in ENDS]
    printed = [name for name in names_in(verified) if labels.is_printed(verified.sel(design=name))]
    names = [name for name in names_in(verified) if name in ends or name in printed]
    words = (
        "Mean and standard deviation of f: by simulation with 95 % half-widths, and as the paper prints them in its Table 4. "
        "The printed standard deviations match neither the standard deviation nor the variance of f in this model; "
        "nothing was fitted to them."
    )
    columns = (*SIMULATED[:2], *_PRINTED)
    table = table_of(
        verified, {name: name for name in names}, columns, "Table 4: this study and the paper"
    )
    return [words, table]


def paper(content: Content) -> list[object] | None:
    """The paper's claims, its designs and how its text can be read; None for a study of another scene."""
    parts = [claims(content), designs_of_a_paper(content), readings(content)]
    return [one for part in parts for one in part or ()] or None


PARTS = (SectionOf(10, "paper", "claims", "Claims and printed designs", paper),)
