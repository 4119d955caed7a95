"""Which design of a study is recommended: what designs of its case are compared by, and the verdicts on their constraints."""

import numpy as np

from hpcclear.base.objectives import ORDINALS
from hpcclear.report.figures import labels
from hpcclear.results.content import Results

SPAN = 2.0
"""Standard deviations above the mean that designs are compared by: some 98 of 100 machines stay below."""


def recommended(verified: Results) -> str:
    """Return the name of the recommended design; "" if no design was verified."""
    known = bool(np.isfinite(verified["mean_true"]).any())
    return str(best_of(ours_of(verified))["design"].item()) if known else ""


USUAL = ("mean of f", "deviation of f", "95th percentile of f")
"""Quantities that are printed of every design, whatever the objectives of its case."""


def goals_of(one: Results) -> list[str]:
    """Objectives of the case of a design, where the file has them: "first", "second", and further ones."""
    return [name for name in ORDINALS if f"{name}_goal" in one and str(one[f"{name}_goal"].item())]


def leading_goals(verified: Results) -> list[str]:
    """Objectives of the case that the answer is about, in words; none if no design was verified or the file lacks them."""
    if not any(counts(verified.isel(design=k)) for k in range(verified.sizes["design"])):
        return []
    first = ours_of(verified).isel(design=0)
    return [str(first[f"{name}_goal"].item()) for name in goals_of(first)]


VERDICTS = {"broken": "violated", "cannot be told": "undecided", "kept": "satisfied"}
"""How a file states the verdict on a constraint, the worst first, and what is printed."""


OPEN = "the integration tolerance leaves it open"
"""Said of a constraint that no number of simulations would decide."""


def is_plain(one: Results) -> bool:
    """Return whether the objectives of its case are mean and standard deviation, without constraints."""
    if "first_goal" not in one:
        return True
    asked = tuple(str(one[f"{name}_goal"].item()) for name in goals_of(one))
    return asked == USUAL[:2] and not str(one["constraints"].item())


def standing(text: str) -> str:
    """Return the worst verdict on a design's constraints, in the words of the file."""
    for word in VERDICTS:
        if f": {word}" in text:
            return word
    return ""


def ours_of(verified: Results) -> Results:
    """Designs of the case in which most is random, the baseline design among them, without those of a publication."""
    rows = [k for k in range(verified.sizes["design"]) if counts(verified.isel(design=k))]
    if "case" in verified:
        cases = [str(case) for case in verified["case"].to_numpy()]
        chosen = cases[max(rows, key=lambda k: (_random_inputs(verified, k), k))]
        rows = [k for k in rows if cases[k] == chosen]
    return verified.isel(design=rows)


def _random_inputs(verified: Results, k: int) -> int:
    return len(str(verified["random"].to_numpy()[k]).split()) if "random" in verified else 0


def counts(one: Results) -> bool:
    """Return whether a design was simulated and is no design of a publication."""
    finite = np.isfinite(float(one["mean_true"])) and np.isfinite(float(one["deviation_true"]))
    return finite and not labels.is_printed(one)


def baseline_of(ours: Results) -> Results | None:
    """The baseline design, if it is among them."""
    for k, name in enumerate(ours["design"].to_numpy()):
        if str(name).rpartition(" ")[2] == "original":
            return ours.isel(design=k)
    return None


def best_of(ours: Results) -> Results:
    """The recommended design, of `ours_of`."""
    return ours.isel(design=int(judged(ours).argmin()))


def judged(ours: Results) -> np.ndarray:
    """Merit of the designs of a case, (designs,): infinite for those that satisfy its constraints less well than others."""
    if is_plain(ours.isel(design=0)):
        return ours["mean_true"].to_numpy() + SPAN * ours["deviation_true"].to_numpy()
    order = ("", "kept", "cannot be told", "broken")
    ranks = np.array([order.index(standing(str(one))) for one in ours["constraints"].to_numpy()])
    merit = ours["first_true"].to_numpy()
    level = ranks == ranks.min()
    if ranks.min() > 1 and "constraint_excess" in ours:  # none is surely within: the nearest
        excess = ours["constraint_excess"].to_numpy()
        within = level & (excess <= 0.0)
        level, merit = (within, merit) if within.any() else (level, excess)
    return np.where(level, merit, np.inf)


def merit(ours: Results, best: Results) -> str:
    """What `judged` goes by, in words."""
    if is_plain(best):
        return f"lowest mean + {SPAN:g} standard deviations of f"
    words = f"lowest {labels.statistic(str(best['first_goal'].item()))}"
    found = standing(str(best["constraints"].item()))
    if found == "broken":
        return "smallest violation of the constraints"
    if found == "cannot be told":
        inside = float(best.get("constraint_excess", np.nan)) <= 0.0
        return (
            f"{words} where estimates satisfy the constraints,"
            if inside
            else "smallest estimated violation of the constraints"
        )
    return f"{words} within the constraints" if found else words
