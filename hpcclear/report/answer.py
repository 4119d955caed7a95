"""The result of a study in a dozen lines, from its files alone: recommended design, its confidence, next steps.

The command prints them at its end, and they head the page.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from hpcclear.base.objectives import Usual
from hpcclear.base.outcome import Flag
from hpcclear.base.verdict import Verdict
from hpcclear.report import alike
from hpcclear.report.constraints import prices_of, verdict_of, worded
from hpcclear.report.figures import labels
from hpcclear.report.merit import (
    baseline_of,
    best_of,
    goals_of,
    is_plain,
    judged,
    merit,
    ours_of,
    usual_of,
)
from hpcclear.report.parts import LinesOf, Recommended, declared
from hpcclear.report.spread import Line
from hpcclear.results.content import Results

MANY = 0.05
"""Share of samples outside the range of Hertz contact above which that is the first of the next steps."""

FAR = 0.2
"""Relative error of the surrogate above which more samples are advised."""


def answer(files: Mapping[str, Results], place: str) -> list[Line]:
    """Return the lines, the most important first; none if no design was verified.

    Parameters
    ----------
    files : mapping of str to xarray.Dataset
        Result files by their kind.
    place : str
        Directory they are in, as the reader knows it; "" on the page itself.
    """
    verified = files.get("verification")
    if verified is None or not np.isfinite(verified["mean_true"]).any():
        return []
    ours = ours_of(verified)
    of, parts = Recommended(files, ours, best_of(ours)), declared(LinesOf)
    steps = [text for part in parts for text in part.steps(of)]
    steps.append(
        f"hpcclear report {place}"
        if place
        else "click its mark on the front below for its response"
    )
    return [
        *(line for part in parts for line in part.lines(of)),
        Line("next steps", "; ".join(steps)),
    ]


def _head(of: Recommended) -> Iterator[Line]:
    """The recommended design, and what was simulated of it."""
    ours, best = of.ours, of.best
    original = baseline_of(ours)
    yield Line("recommended", _named(best))
    criterion = (
        f"{merit(ours, best)} of {ours.sizes['design']} simulated designs, case {_case(best)}"
    )
    yield Line("criterion", f"{criterion}; f: {labels.objective(ours)}")
    yield Line("values", _values(best))
    yield Line("mean", _moment(best, "mean", original))
    yield Line("std. deviation", _moment(best, "deviation", original))
    yield from (Line("objective", text) for text in _goals(best))
    yield from (Line("constraint", text) for text in worded(best))
    yield Line("equivalent", alike.words(ours, best))
    if near := alike.flat(ours, best, judged(ours)):
        yield Line("near", near)
    yield Line("active bounds", bounds(best))


def unit_of(one: Results, name: str) -> str:
    """Return the unit of a variable; of what a case makes small it stands beside it."""
    own = f"{name.removesuffix('_true')}_unit"
    return str(one[own].item()) if own in one else str(one[name].attrs["units"])


def _goals(best: Results) -> Iterator[str]:
    """Objectives of the case of a design besides mean and standard deviation, with confidence intervals."""
    names = [] if is_plain(best) else goals_of(best)
    for name in names:
        if len(names) > 2 and usual_of(best, name) in (Usual.MEAN, Usual.DEVIATION):
            continue  # has a line of its own
        value, unit = float(best[f"{name}_true"]), unit_of(best, f"{name}_true")
        low, high = (float(best[f"{name}_{end}"]) for end in ("lower", "upper"))
        text = f"{best[f'{name}_goal'].item()} {labels.quantity(value, unit)}"
        if low < high:
            text += f" (95 % CI {labels.between(low, high, unit)})"
        yield text


_NONE = {
    Verdict.FAILS: "none: every simulated design violates a constraint",
    Verdict.UNDECIDED: "none: no simulated design is certain to satisfy the constraints",
}
"""What stands in place of a recommendation where no design significantly satisfies the constraints, by the best verdict."""


ENDS_IN_WORDS = {"alpha": "lowest mean of f", "beta": "lowest standard deviation of f"}
"""What the ends of a front are, of a case without objectives of its own."""


def _constraints(best: Results) -> str:
    return str(best["constraints"].item()) if "constraints" in best else ""


def _named(best: Results) -> str:
    name = str(best["design"].item())
    if (verdict := verdict_of(best)) in _NONE:
        return f"{_NONE[verdict]}; nearest: {name}"
    if name.rpartition(" ")[2] == "original":
        return f"keep the baseline design ({name}): no simulated design is better"
    role = ENDS_IN_WORDS.get(name.rpartition(" ")[2], "") if is_plain(best) else ""
    return f"{name}: {role}" if role else name


def _case(best: Results) -> str:
    return str(best["case"].item()) if "case" in best else "of the study"


def _values(best: Results) -> str:
    shown = [
        f"{labels.words(v)} = {labels.value(v)}"
        for v in labels.design_variables(best)
        if np.isfinite(float(v))
    ]
    return ", ".join(shown)


def _moment(best: Results, word: str, original: Results | None) -> str:
    """A simulated moment with its confidence interval, and its change from the baseline."""
    one = best[f"{word}_true"]
    unit = str(one.attrs["units"])
    text = labels.quantity(float(one), unit)
    if f"{word}_lower" in best and np.isfinite(float(best[f"{word}_lower"])):
        low, high = (float(best[f"{word}_{end}"]) for end in ("lower", "upper"))
        text += f" (95 % CI {labels.between(low, high, unit)})"
    if original is None or str(original["design"].item()) == str(best["design"].item()):
        return text
    before = float(original[f"{word}_true"])
    change = float(one) / before - 1.0
    return f"{text}, {abs(change):.0%} {'below' if change < 0 else 'above'} the baseline ({labels.quantity(before, unit)})"


def bounds(best: Results) -> str:
    """Return the active bounds of a design, "none" without any."""
    found = str(best["on_bounds"].item()) if "on_bounds" in best else ""
    return found or "none"


def _left(of: Recommended) -> Iterator[Line]:
    """Share of simulations outside the range of Hertz contact."""
    parts, best = [], of.best
    if "beyond_hertz" in best:
        share = int(best["beyond_hertz"]) / int(best["samples"])
        parts.append(f"{share:.0%} of the simulations of this design")
    samples = of.files.get("samples")
    if samples is not None and "flags" in samples:
        beyond = (samples["flags"].to_numpy() & int(Flag.BEYOND_HERTZ)) != 0
        parts.append(f"{beyond.mean():.0%} of all {beyond.size} samples")
    shown = f"outside the range of Hertz contact in {' and '.join(parts)}" if parts else "not known"
    yield Line("contact model", shown)


def _sure(of: Recommended) -> Iterator[Line]:
    """How well the numbers of the recommended design are known."""
    best = of.best
    count = int(best["samples"]) if "samples" in best else 0
    level = float(best.attrs.get("confidence", np.nan))
    text = f"{count} simulations of the recommended design"
    text += " by randomised quasi-Monte Carlo" if best.attrs.get("method") == "qmc" else ""
    if weighted := int(best.get("rare_samples", 0)):
        text += (
            f" and {weighted} weighted ones (importance sampling) for its probabilities of failure"
        )
    if np.isfinite(level):
        paired = np.isfinite(float(best.get("mean_tolerance", np.nan)))
        covered = (
            "sampling error and the error of the tolerance as far as pairs show it"
            if paired
            else "sampling error only"
        )
        text += f"; {level:.0%} confidence intervals, which cover {covered}"
    if missed := str(best["accuracy_missed"].item()) if "accuracy_missed" in best else "":
        text += f". Requested accuracy not reached: {missed}"
    errors = _surrogate_errors(best)
    if len(errors) == 2:
        text += f". Surrogate error: mean {errors[0]:+.1%}, standard deviation {errors[1]:+.1%}"
    yield Line("confidence", text)


def _surrogate_errors(best: Results) -> list[float]:
    """Relative errors of the surrogate's mean and standard deviation, as far as they are known."""
    found = [float(best[f"{w}_error"]) for w in ("mean", "deviation") if f"{w}_error" in best]
    return [error for error in found if np.isfinite(error)]


def _steps(of: Recommended) -> Iterator[str]:
    """What to do, the most useful first."""
    ours, best = of.ours, of.best
    if "beyond_hertz" in best and int(best["beyond_hertz"]) > MANY * int(best["samples"]):
        yield "stiffer bearings or less load, since the contact model is outside its range and forces are indicative only"
    prices = prices_of(best)
    if np.inf in prices:
        yield "a smaller numerics.rtol (or target_error), to decide the constraints"
    elif prices:
        key = "most_samples" if ours.attrs.get("method") == "qmc" else "samples"
        yield f"study.verification.{key}={max(prices):.0f} to decide the constraints"
    if "on_bounds" in best and str(best["on_bounds"].item()):
        yield "wider ranges for the variables at active bounds, if the machine allows it"
    if any(abs(error) > FAR for error in _surrogate_errors(best)):
        yield "a larger study.samples, since the surrogate error is large and a better design may have been missed"
    twins = alike.others(ours, best)
    if twins and ours.attrs.get("method") == "qmc":
        yield "a smaller study.accuracy, to separate equivalent designs"
    elif twins and "samples" in best:
        yield f"study.verification.samples={10 * int(best['samples'])} for confidence intervals a third as wide"


PARTS = (
    LinesOf(10, ("verification",), _head, _steps),
    LinesOf(60, ("verification", "samples"), _left),
    LinesOf(90, ("verification",), _sure),
)
