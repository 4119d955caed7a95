"""The page's section on a paper: its claims, its designs, and how its text can be read."""

import numpy as np

from hpcclear.base.verdict import Verdict
from hpcclear.report.figures import labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.designs import SIMULATED, table_of
from hpcclear.report.html.markup import PageTable, number
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results, each, text_in

_BADGES = {
    Verdict.HOLDS: {"words": "✓ holds", "kind": "holds"},
    Verdict.FAILS: {"words": "✗ does not hold", "kind": "fails"},
    Verdict.UNDECIDED: {"words": "? undecided", "kind": "open"},
}

_PRINTED = (("mean_paper", "printed: mean"), ("deviation_paper", "printed: std. deviation"))
"""Variables of kind ``verification``, and the heads of their columns."""


def readings(found: Results) -> list[object]:
    """How far the paper's designs are from what it prints, under the possible readings of its text."""
    far = found["distance"].values
    if not np.isfinite(far).any():
        return []
    ends = {"nearest": np.nanargmin(far), "farthest": np.nanargmax(far)}
    names = found["reading"].values
    texts = (f"{word} ({number(far[k], 3)}): {names[k]}" for word, k in ends.items())
    by = "by the root mean square of ln(mean / printed mean)"
    return [f"Of {len(far)} readings of the paper's text, {by}: {'; '.join(texts)}."]


def claims(found: Results) -> list[object]:
    """The paper's claims with our verdicts, the numbers of them first."""
    verdicts = found["verdict"].values.tolist()
    counts = [verdicts.count(verdict) for verdict in Verdict]
    held = f"Of {len(verdicts)} claims {counts[0]} hold on this data, {counts[1]} do not, {counts[2]} are undecided."
    badges = [_BADGES[Verdict(verdict)] for verdict in verdicts]
    texts = [f"{int(one['claim'])}. {text_in(one, 'text')}" for one in each(found, "claim")]
    title = "Claims of the paper; claims.nc has the numbers that decide"
    return [held, PageTable(["claim", "verdict"], zip(texts, badges, strict=True), title)]


def designs_of_a_paper(verified: Results) -> list[object]:
    """Words and table of the designs that a publication prints; nothing without any."""
    if "mean_paper" not in verified:
        return []
    printed = [text_in(k, "design") for k in each(verified, "design") if labels.is_printed(k)]
    unlike = "match neither the standard deviation nor the variance of f in this model"
    words = f"The printed standard deviations {unlike}; nothing was fitted to them."
    columns = (*SIMULATED[:2], *_PRINTED)
    title = "Table 4: designs of the paper, by simulation with 95 % half-widths and as printed"
    return [words, table_of(verified, dict(zip(printed, printed, strict=True)), columns, title)]


def paper(content: Content) -> list[object]:
    """The paper's claims, its designs and how its text can be read; nothing for a study of another scene."""
    makers = {"claims": claims, "verification": designs_of_a_paper, "readings": readings}
    parts = (make(content.files[kind]) for kind, make in makers.items() if kind in content.files)
    return [one for part in parts for one in part]


PARTS = (SectionOf(10, "paper", "claims", "Claims and printed designs", paper),)
