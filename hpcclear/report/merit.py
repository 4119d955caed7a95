"""Which design of a study is recommended: what designs of its case are compared by, and the verdicts on their constraints."""

import numpy as np

from hpcclear.base.objectives import ORDINALS, Usual
from hpcclear.base.verdict import Verdict, best
from hpcclear.report.alike import satisfies
from hpcclear.report.constraints import verdict_of
from hpcclear.report.figures import labels
from hpcclear.results.content import Results, each, number_in, text_in, texts_in

SPAN = 2.0
"""Standard deviations above the mean that designs are compared by: some 98 of 100 machines stay below."""


def recommended(verified: Results) -> str:
    """Return the name of the recommended design; "" if no design was verified."""
    return text_in(best_of(ours_of(verified)), "design") if any_counts(verified) else ""


def role(verified: Results) -> str:
    """Return what the design of `recommended` is called: "nearest" where none is certain to satisfy the constraints."""
    name = recommended(verified)
    return "nearest" if name and not satisfies(verified.sel(design=name)) else "recommended"


def goals_of(one: Results) -> list[str]:
    """Objectives of the case of a design, where the file has them: "first", "second", and further ones."""
    return [name for name in ORDINALS if f"{name}_goal" in one and text_in(one, f"{name}_goal")]


def leading_goals(verified: Results) -> list[str]:
    """Objectives of the case that the answer is about, in words; none if no design was verified or the file lacks them."""
    if not any_counts(verified):
        return []
    first = ours_of(verified).isel(design=0)
    return [text_in(first, f"{name}_goal") for name in goals_of(first)]


def usual_of(one: Results, name: str) -> Usual:
    """Which of the statistics that are reported of every design an objective of a design's case is."""
    return Usual(int(one[f"{name}_usual"])) if f"{name}_usual" in one else Usual.OTHER


def is_plain(one: Results) -> bool:
    """Return whether the objectives of its case are mean and standard deviation, without constraints."""
    if "first_goal" not in one:
        return True
    asked = [usual_of(one, name) for name in goals_of(one)]
    return asked == [Usual.MEAN, Usual.DEVIATION] and verdict_of(one) is None


def ours_of(verified: Results) -> Results:
    """Designs of the case in which most is random, the baseline design among them, without those of a publication."""
    rows = [k for k, one in enumerate(each(verified, "design")) if counts(one)]
    cases, random = (texts_in(verified, name) for name in ("case", "random"))
    chosen = cases[max(rows, key=lambda k: (len(random[k].split()), k))]
    return verified.isel(design=[k for k in rows if cases[k] == chosen])


def counts(one: Results) -> bool:
    """Return whether a design was simulated and is no design of a publication."""
    finite = np.isfinite(float(one["mean_true"])) and np.isfinite(float(one["deviation_true"]))
    return finite and not labels.is_printed(one)


def any_counts(verified: Results) -> bool:
    """Return whether any design does: without one there is no recommended one."""
    return any(map(counts, each(verified, "design")))


def baseline_of(ours: Results) -> Results | None:
    """The baseline design, if it is among them."""
    return next(filter(labels.is_baseline, each(ours, "design")), None)


def best_of(ours: Results) -> Results:
    """The recommended design, of `ours_of`."""
    return ours.isel(design=int(judged(ours).argmin()))


def judged(ours: Results) -> np.ndarray:
    """Merit of the designs of a case, (designs,): infinite for those that satisfy its constraints less well than others."""
    if is_plain(ours.isel(design=0)):
        return ours["mean_true"].values + SPAN * ours["deviation_true"].values
    verdicts = map(verdict_of, each(ours, "design"))
    found, level = best([Verdict.HOLDS if one is None else one for one in verdicts])
    merit = ours["first_true"].values
    if found is not Verdict.HOLDS:
        # none is surely within: the nearest
        excess = ours["constraint_excess"].values
        within = level & (excess <= 0.0)
        level, merit = (within, merit) if within.any() else (level, excess)
    return np.where(level, merit, np.inf)


def merit(best: Results) -> str:
    """What `judged` goes by, in words."""
    if is_plain(best):
        return f"lowest mean + {SPAN:g} standard deviations of f"
    words, found = f"lowest {text_in(best, 'first_goal')}", verdict_of(best)
    if found is Verdict.FAILS:
        return "smallest violation of the constraints"
    if found is Verdict.UNDECIDED:
        if number_in(best, "constraint_excess") <= 0.0:
            return f"{words} where estimates satisfy the constraints,"
        return "smallest estimated violation of the constraints"
    return words if found is None else f"{words} within the constraints"
