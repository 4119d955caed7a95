"""The result of a study in a dozen lines, from its files alone: recommended design, its confidence, next steps.

The command prints them at its end, and they head the page.
"""

import re
from collections.abc import Iterator, Mapping

import numpy as np

from hpcclear.base.outcome import Flag
from hpcclear.report import alike, failures, scatter
from hpcclear.report.figures import fits, labels
from hpcclear.report.merit import (
    OPEN,
    USUAL,
    VERDICTS,
    baseline_of,
    best_of,
    goals_of,
    is_plain,
    judged,
    merit,
    ours_of,
    standing,
)
from hpcclear.report.scatter import HALF_WIDTH
from hpcclear.report.spread import Line
from hpcclear.results.content import Results

MANY = 0.05
"""Share of samples outside the range of Hertz contact above which that is the first of the next steps."""

FAR = 0.2
"""Relative error of the surrogate above which more samples are advised."""

SOME = 0.05
"""Share of samples that change with a perturbation above which a design is called sensitive to initial conditions."""

LARGE = 0.1
"""Share of the variance above which chaotic scatter is worth more revolutions."""

LITTLE = 0.01
"""Share of the variance of f, with its half-width, below which a variable is called negligible."""

COARSE = 0.1
"""Half-width of a Sobol index above which more samples are advised."""


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
    best = best_of(ours)
    original = baseline_of(ours)
    chaotic = _scatter(files, best)
    near = alike.flat(ours, best, judged(ours))
    return [
        Line("recommended", _named(best)),
        Line("criterion", f"{merit(ours, best)} of {ours.sizes['design']} simulated designs, case {_case(best)}; "
             f"f: {labels.objective(verified)}"),
        Line("values", _values(best)),
        Line("mean", _moment(best, "mean", original)),
        Line("std. deviation", _moment(best, "deviation", original)),
        *(Line("objective", text) for text in _goals(best)),
        *(Line("constraint", text) for text in constraints(best)),
        Line("equivalent", alike.words(ours, best)),
        *([Line("near", near)] if near else []),
        Line("active bounds", bounds(best)),
        *scatter.lines(files, best),
        *scatter.worst(files, best),
        *_shares(files),
        *(Line("warning", text) for text in _poor_fits(files)),
        Line("contact model", _left(files, best)),
        *(Line("failed", text) for text in _failed(files)),
        *([Line("chaos", chaotic)] if chaotic else []),
        Line("confidence", _sure(best, verified)),
        Line("next steps", "; ".join(_next(files, ours, best, place))),
    ]  # fmt: skip


def unit_of(one: Results, name: str) -> str:
    """Return the unit of a variable; of what a case makes small it stands beside it."""
    own = f"{name.removesuffix('_true')}_unit"
    return str(one[own].item()) if own in one else str(one[name].attrs["units"])


def _goals(best: Results) -> Iterator[str]:
    """Objectives of the case of a design besides mean and standard deviation, with confidence intervals."""
    names = [] if is_plain(best) else goals_of(best)
    for name in names:
        if len(names) > 2 and str(best[f"{name}_goal"].item()) in USUAL[:2]:
            continue  # has a line of its own
        value, unit = float(best[f"{name}_true"]), unit_of(best, f"{name}_true")
        low, high = (float(best[f"{name}_{end}"]) for end in ("lower", "upper"))
        text = (
            f"{labels.statistic(str(best[f'{name}_goal'].item()))} {labels.quantity(value, unit)}"
        )
        if low < high:
            text += f" (95 % CI {labels.between(low, high, unit)})"
        yield text


def constraints(best: Results) -> Iterator[str]:
    """Yield the constraints of the case of a design, each with its value and verdict."""
    if "constraints" in best and str(best["constraints"].item()):
        for text in str(best["constraints"].item()).split("; "):
            text = re.sub(r" ([^\s)]+) at most", r" = \1, at most", labels.statistic(text))
            text = text.replace(") at most", "), at most")
            for word, printed in VERDICTS.items():
                text = text.replace(f": {word}", f": {printed}")
            yield text


_NONE = {
    "broken": "none: every simulated design violates a constraint",
    "cannot be told": "none: no simulated design is certain to satisfy the constraints",
}
"""What stands in place of a recommendation where no design significantly satisfies the constraints, by the best verdict."""


ENDS_IN_WORDS = {"alpha": "lowest mean of f", "beta": "lowest standard deviation of f"}
"""What the ends of a front are, of a case without objectives of its own."""


def _constraints(best: Results) -> str:
    return str(best["constraints"].item()) if "constraints" in best else ""


def _named(best: Results) -> str:
    name = str(best["design"].item())
    if (verdict := standing(_constraints(best))) in _NONE:
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


def _left(files: Mapping[str, Results], best: Results) -> str:
    """Share of simulations outside the range of Hertz contact."""
    parts = []
    if "beyond_hertz" in best:
        share = int(best["beyond_hertz"]) / int(best["samples"])
        parts.append(f"{share:.0%} of the simulations of this design")
    samples = files.get("samples")
    if samples is not None and "flags" in samples:
        beyond = (samples["flags"].to_numpy() & int(Flag.BEYOND_HERTZ)) != 0
        parts.append(f"{beyond.mean():.0%} of all {beyond.size} samples")
    return "outside the range of Hertz contact in " + " and ".join(parts) if parts else "not known"


def _shares(files: Mapping[str, Results]) -> Iterator[Line]:
    """First-order and total Sobol indices with their errors, the largest total first; none where they are not known."""
    found = files.get("sensitivity")
    if found is None or "sobol_total" not in found:
        return
    indices = {
        kind: [found[f"sobol_{kind}{end}"].to_numpy() for end in ("", "_error")]
        for kind in ("first", "total")
        if f"sobol_{kind}" in found
    }
    total, error = indices["total"]
    if not total.size or not np.isfinite([total, error]).all():
        return
    names = [str(name) for name in found["parameter"].to_numpy()]
    order = np.argsort(-total, kind="stable")
    little = total + HALF_WIDTH * error < LITTLE
    texts = {
        kind: ", ".join(
            scatter.share(names[k], value[k], HALF_WIDTH * error[k]) for k in order if not little[k]
        )
        for kind, (value, error) in indices.items()
    }
    own = "first-order Sobol indices, the share of the variance of f that a variable explains alone (± 95 % half-width)"
    if texts["total"] and "first" in texts:
        yield Line("sensitivity", f"{own}: {texts['first']}")
    if texts["total"]:
        words = "total Sobol indices, with all interactions (their sum may exceed 100 %)"
        yield Line("interactions", f"{words}: {texts['total']}")
    noise, doubt = (float(found.get(f"sobol_noise{end}", np.nan)) for end in ("", "_error"))
    if noise > HALF_WIDTH * doubt and noise > LITTLE:
        text = f"{scatter.share('chaotic scatter', noise, HALF_WIDTH * doubt)} of the variance over the study's ranges, "
        yield Line("chaotic scatter", text + "by perturbed runs; the total indices are without it")
    if little.any():
        hardly = ", ".join(names[k] for k in order if little[k])
        yield Line("negligible", f"{hardly} (total Sobol index below {LITTLE:.0%}, error included)")
    if any(HALF_WIDTH * float(np.nanmax(error)) > COARSE for _, error in indices.values()):
        text = f"Sobol indices are known to ± {COARSE:.0%} or worse: raise study.sensitivity.sobol_samples"
        yield Line("warning", text)


def _failed(files: Mapping[str, Results]) -> list[str]:
    """Why samples failed, where, and what to do; none where all succeeded."""
    samples = files.get("samples")
    return failures.explained(samples) if samples is not None and "status" in samples else []


def _poor_fits(files: Mapping[str, Results]) -> Iterator[str]:
    """Surrogates that do not fit, a sentence for each kind of them."""
    for kind, what in (
        ("sensitivity", "sensitivities by slopes"),
        ("kriging", "the search began there"),
    ):
        if found := fits.warnings(kind, files.get(kind)):
            yield f"{'; '.join(found)} ({what}); simulated values do not depend on surrogates"


def _scatter(files: Mapping[str, Results], best: Results) -> str:
    """Share of the design's variance that is chaos, and how many designs are chaotic; "" if not simulated."""
    found, name = files.get("chaos"), str(best["design"].item())
    if found is None or name not in found["design"].to_numpy():
        return ""
    own = found.sel(design=name)
    moved = found["chaotic"].to_numpy() > SOME
    text = f"{int(moved.sum())} of {moved.size} designs are sensitive to initial conditions"
    if not float(own["chaotic"]) > SOME:
        return f"{text}; the recommended one is not: perturbations of 1e-9, relative, leave its samples unchanged"
    return (
        f"{text}. Relative perturbations of 1e-9 change {float(own['chaotic']):.0%} of the recommended design's samples "
        f"and explain {float(own['chaos_share']):.0%} of its variance"
    )


def _sure(best: Results, verified: Results) -> str:
    count = int(best["samples"]) if "samples" in best else 0
    level = float(verified.attrs.get("confidence", np.nan))
    text = f"{count} simulations of the recommended design"
    text += " by randomised quasi-Monte Carlo" if verified.attrs.get("method") == "qmc" else ""
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
    return text


def _surrogate_errors(best: Results) -> list[float]:
    """Relative errors of the surrogate's mean and standard deviation, as far as they are known."""
    found = [float(best[f"{w}_error"]) for w in ("mean", "deviation") if f"{w}_error" in best]
    return [error for error in found if np.isfinite(error)]


def _next(files: Mapping[str, Results], ours: Results, best: Results, place: str) -> Iterator[str]:
    """What to do, the most useful first; the report in the end."""
    if "beyond_hertz" in best and int(best["beyond_hertz"]) > MANY * int(best["samples"]):
        yield "stiffer bearings or less load, since the contact model is outside its range and forces are indicative only"
    constraints = _constraints(best)
    prices = re.findall(r"about (\d+) simulations would decide", constraints)
    if OPEN in constraints:
        yield "a smaller numerics.rtol (or target_error), to decide the constraints"
    elif prices:
        key = "most_samples" if ours.attrs.get("method") == "qmc" else "samples"
        yield f"study.verification.{key}={max(map(int, prices))} to decide the constraints"
    if "on_bounds" in best and str(best["on_bounds"].item()):
        yield "wider ranges for the variables at active bounds, if the machine allows it"
    if any(abs(error) > FAR for error in _surrogate_errors(best)):
        yield "a larger study.samples, since the surrogate error is large and a better design may have been missed"
    twins = alike.others(ours, best)
    if twins and ours.attrs.get("method") == "qmc":
        yield "a smaller study.accuracy, to separate equivalent designs"
    elif twins and "samples" in best:
        yield f"study.verification.samples={10 * int(best['samples'])} for confidence intervals a third as wide"
    found, name = files.get("chaos"), str(best["design"].item())
    if (
        found is not None
        and name in found["design"].to_numpy()
        and float(found.sel(design=name)["chaos_share"]) > LARGE
    ):
        yield "a larger numerics.averaged_revolutions, since chaotic scatter decreases with it"
    yield (
        f"hpcclear report {place}"
        if place
        else "click its mark on the front below for its response"
    )
