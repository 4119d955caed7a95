"""What the page says of a recommended design besides the first screen, in lines from the files alone; and next steps."""

from collections.abc import Iterator, Mapping

import numpy as np

from hpcclear.report import alike
from hpcclear.report.constraints import constraints_of
from hpcclear.report.merit import any_counts, best_of, judged, merit, ours_of
from hpcclear.report.parts import LinesOf, Recommended, declared
from hpcclear.report.spread import Line
from hpcclear.results.content import Results, number_in, text_in

MANY = 0.05
"""Share of samples outside the range of Hertz contact above which that is the first of the next steps."""

FAR = 0.2
"""Relative error of the surrogate above which more samples are advised."""


def answer(files: Mapping[str, Results]) -> list[Line]:
    """Return the lines of result files by their kind, the most important first; none if no design was verified."""
    verified = files.get("verification")
    if verified is None or not any_counts(verified):
        return []
    ours = ours_of(verified)
    of = Recommended(files, ours, best_of(ours))
    return [line for part in declared(LinesOf) for line in part.lines(of)]


def steps(of: Recommended) -> list[str]:
    """Return what is advised to do next, the most useful first."""
    return [text for part in declared(LinesOf) for text in part.steps(of)]


def beyond_hertz(best: Results) -> float:
    """Return the share of a design's simulations outside the range of Hertz contact."""
    return int(best["beyond_hertz"]) / int(best["samples"])


def _head(of: Recommended) -> Iterator[Line]:
    """Why the design is recommended, the verdicts on its constraints, and designs that are nearly as good."""
    ours, best = of.ours, of.best
    name, case = text_in(best, "design"), text_in(best, "case")
    count = ours.sizes["design"]
    yield Line("criterion", f"{name}: {merit(best)} of {count} simulated designs, case {case}")
    yield from (Line("constraint", str(one)) for one in constraints_of(best))
    if near := alike.flat(ours, best, judged(ours)):
        yield Line("near", near)


def unit_of(one: Results, name: str) -> str:
    """Return the unit of a variable; of what a case makes small it stands beside it."""
    own = f"{name.removesuffix('_true')}_unit"
    return str(one[own].item()) if own in one else str(one[name].attrs["units"])


def _sure(of: Recommended) -> Iterator[Line]:
    missed = text_in(of.best, "accuracy_missed")
    more = missed and f". Requested accuracy not reached: {missed}"
    yield Line("confidence", f"{confidence(of.best)}{more}")


def confidence(best: Results) -> str:
    """Return how well the numbers of a design are known, and what their intervals cover."""
    level = float(best.attrs.get("confidence", np.nan))
    text = f"{int(best['samples'])} simulations of this design"
    text += " by randomised quasi-Monte Carlo" if best.attrs.get("method") == "qmc" else ""
    if weighted := int(best.get("rare_samples", 0)):
        more = f" and {weighted} weighted ones (importance sampling)"
        text += f"{more} for its probabilities of failure"
    if np.isfinite(level):
        covered = "sampling error only"
        if np.isfinite(number_in(best, "mean_tolerance")):
            covered = "sampling error and the error of the tolerance as far as pairs show it"
        text += f"; {100 * level:.0f} % confidence intervals, which cover {covered}"
    return text


def surrogate_errors(best: Results) -> list[float]:
    """Return relative errors of the surrogate's mean and standard deviation, as far as they are known."""
    found = (number_in(best, f"{word}_error") for word in ("mean", "deviation"))
    return [error for error in found if np.isfinite(error)]


def _steps(of: Recommended) -> Iterator[str]:
    ours, best = of.ours, of.best
    if beyond_hertz(best) > MANY:
        yield "stiffer bearings or less load"
    prices = [one.price for one in constraints_of(best) if not np.isnan(one.price)]
    if np.inf in prices:
        yield "a smaller numerics.rtol (or target_error), to decide the constraints"
    elif prices:
        key = "most_samples" if ours.attrs.get("method") == "qmc" else "samples"
        yield f"study.verification.{key}={max(prices):.0f} to decide the constraints"
    if text_in(best, "on_bounds"):
        yield "wider ranges for the variables at active bounds, if the machine allows it"
    if any(abs(error) > FAR for error in surrogate_errors(best)):
        yield "a larger study.samples, since the surrogate error is large and a better design may have been missed"
    twins = alike.others(ours, best)
    if twins and ours.attrs.get("method") == "qmc":
        yield "a smaller study.accuracy, to separate equivalent designs"
    elif twins:
        yield f"study.verification.samples={10 * int(best['samples'])} for confidence intervals a third as wide"


PARTS = (LinesOf(10, _head, _steps), LinesOf(90, _sure))
