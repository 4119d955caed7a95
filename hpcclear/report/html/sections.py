"""Sections of the page on designs, findings and trust, made from what there is; None where nothing is."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from hpcclear.base.objectives import ENDS, ORDINALS
from hpcclear.base.outcome import Status
from hpcclear.report import failures
from hpcclear.report.answer import is_plain
from hpcclear.report.figures import effects, labels
from hpcclear.report.html import costs
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table, number, quantity
from hpcclear.statistics.random.survival import quantile_limits, quantiles

_MARKS = {"holds": ("✓", "holds"), "does not hold": ("✗", "fails"), "cannot be told": ("?", "open")}
LIVED = [int(status) for status in Status if status.valid or status is Status.WORN_THROUGH]
"""Endings of lives that count."""

LISTED = 40  # samples listed by number before the rest is only counted


def summary(content: Content) -> dict[str, object]:
    """What was done and found, in plain words."""
    words = [
        *_lives_words(content),
        *_samples_words(content),
        *_effects_words(content),
        *_designs_words(content),
        *_claims_words(content),
        *costs.words(content),
        *_time_words(content),
    ]
    if not words:
        words = ["These are responses of single designs; nothing was sampled or optimised."]
    return {"words": words, "facts": _facts(content)}


def _lives_words(content: Content) -> list[str]:
    lives = content.get("wear")
    if lives is None:
        return []
    last = lives.isel(cycle=-1)
    cycles, failed = float(last["cycle"]), int((~np.isin(lives["ending"], LIVED)).sum())
    early = int((lives["ended"] < cycles).sum()) - failed
    words = [
        f"{lives.sizes['life']} service lives of {'up to ' if early > 0 else ''}{cycles:.4g} revolutions were simulated; "
        f"{_failures(failed)}."
    ]
    ends = lives["end_clearance"] if "end_clearance" in lives else lives["clearance"].isel(cycle=-1)
    levels = quantiles(ends.to_numpy(), np.array([0.05, 0.95]))
    for k, name in enumerate(lives["joint"].to_numpy()):
        low, high = (str(quantity(float(value), "m")) for value in levels[:, k])
        words.append(f"Final clearance of {name}, 5th to 95th percentile: {low} to {high}.")
    if "lifetime_hours_quantile" in lives:
        median = lives.sel(quantile=0.5)
        turns, hours = float(median["lifetime_quantile"]), float(median["lifetime_hours_quantile"])
        if np.isfinite(turns):
            (low,), (high,) = quantile_limits(lives["lifetime"].to_numpy(), np.array([0.5]))
            reach = f"{high:.4g}" if np.isfinite(high) else f"beyond {cycles:.4g}"
            words.append(
                f"Median service life: {turns:.4g} revolutions (95 % CI {max(low, 0.0):.4g} to {reach}), {hours:.4g} h."
            )
    if any(name.startswith("limit_") for name in lives.attrs):
        limits = f"{float(last['survival_lower']):.0%} to {float(last['survival_upper']):.0%}"
        words.append(f"Survival: {float(last['survival']):.0%} (95 % CI {limits}).")
    return words


def _samples_words(content: Content) -> list[str]:
    samples = content.get("samples")
    if samples is None:
        return []
    count, failed = samples.sizes["sample"], int((samples["status"] != 0).sum())
    names = ", ".join(labels.words(v) for v in labels.design_variables(samples))
    words = [f"{count} simulations, varying {names}; {_failures(failed)}."]
    f = samples["objective"]
    if bool(f.notnull().any()):
        low, high = (str(quantity(float(end), str(f.attrs["units"]))) for end in (f.min(), f.max()))
        words.append(
            f"The objective f, {labels.objective(samples)}, lies between {low} and {high}."
        )
    return words


def _effects_words(content: Content) -> list[str]:
    certificate = content.get("effects")
    return (
        []
        if certificate is None
        else effects.statements(certificate, effects.seconds_of(content.get("timing")))
    )


def _designs_words(content: Content) -> list[str]:
    verified = content.get("verification")
    if verified is None:
        return []
    by_name = {str(name): verified.sel(design=name) for name in verified["design"].to_numpy()}
    words = []
    for name, one in by_name.items():
        case, _, letter = name.rpartition(" ")
        base = by_name.get(f"{case} original")
        if letter not in ("alpha", "beta") or base is None or not is_plain(one):
            continue  # the averaged best of a case, or of another goal, which the answer tells
        what = "mean" if letter == "alpha" else "deviation"
        printed = "mean" if letter == "alpha" else "standard deviation"
        change = float(one[f"{what}_true"]) / float(base[f"{what}_true"]) - 1.0
        value = quantity(float(one[f"{what}_true"]), str(one[f"{what}_true"].attrs["units"]))
        told = _as_far_as_told(by_name, one, what)
        words.append(
            f"Design “{name}” has the lowest {printed} of f of all simulated designs{told}: {value}, "
            f"{abs(change):.0%} {'below' if change < 0 else 'above'} the baseline design."
        )
    return words


def _as_far_as_told(by_name: Mapping[str, xr.Dataset], one: xr.Dataset, what: str) -> str:
    """A restriction, where another design of the case has a lower value that is statistically indistinguishable."""
    case = str(one["case"].item()) if "case" in one else ""
    rivals = (rival for rival in by_name.values() if not case or rival["case"].item() == case)
    less = any(float(rival[f"{what}_true"]) < float(one[f"{what}_true"]) for rival in rivals)
    return " within the confidence intervals" if less else ""


def _claims_words(content: Content) -> list[str]:
    claims = content.get("claims")
    if claims is None:
        return []
    verdicts = [str(verdict) for verdict in claims["verdict"].to_numpy()]
    counts = [verdicts.count(verdict) for verdict in _MARKS]
    return [
        f"Of the paper's {len(verdicts)} claims that were tested, {counts[0]} hold on this data, "
        f"{counts[1]} do not, and {counts[2]} are undecided."
    ]


def _time_words(content: Content) -> list[str]:
    timing = content.get("timing")
    if timing is None:
        return []
    spent = {name: float(timing[name].sum()) for name in ("busy", "idle", "compile", "write")}
    total = sum(spent.values()) or 1.0
    ranks = timing.sizes["rank"]
    return [
        f"{ranks} {'rank' if ranks == 1 else 'ranks'} worked on it, "
        f"{spent['busy'] / total:.0%} of {'its' if ranks == 1 else 'their'} time on computing."
    ]


def _failures(count: int) -> str:
    return "no failures" if count == 0 else f"{count} failed"


def _facts(content: Content) -> list[tuple[str, object]]:
    """Key numbers as tiles."""
    facts: list[tuple[str, object]] = []
    samples, verified = content.get("samples"), content.get("verification")
    if samples is not None:
        failed = int((samples["status"] != 0).sum())
        evaluations = int(samples["rhs_evaluations"].sum())
        facts += [
            ("samples", samples.sizes["sample"]),
            ("failed", failed),
            ("force evaluations", f"{evaluations:.3g}"),
        ]
    timing = content.get("timing")
    if timing is not None:
        parts = [
            timing[name].sum("stage").to_numpy() for name in ("busy", "idle", "compile", "write")
        ]
        wall = float(np.sum(parts, axis=0).max())
        facts += [("ranks", timing.sizes["rank"]), ("wall time", f"{wall:.3g} s")]
        if samples is not None and float(timing["busy"].sum()) > 0.0 and "samples" in timing:
            rate = float(
                timing["samples"].sum() / timing["busy"].where(timing["samples"] > 0).sum()
            )
            facts.append(("samples a second and core", f"{rate:.3g}"))
    if verified is not None:
        facts.append(("designs verified", verified.sizes["design"]))
    return facts


def designs(content: Content) -> dict[str, object] | None:
    """Optimised designs, beside what a publication prints if it is about them; the spread along the
    fronts apart."""
    verified = content.get("verification")
    if verified is None:
        return None
    names = [str(name) for name in verified["design"].to_numpy()]
    spread = [k for k, name in enumerate(names) if " front " in name]
    main = sorted(
        (k for k in range(len(names)) if k not in spread), key=lambda k: _place(verified, k)
    )
    words = (
        f"Mean and standard deviation of f, {labels.objective(verified)}: by simulation with 95 % half-widths, and as the "
        "surrogate predicts them."
    )
    caption = "Baseline and optimised designs"
    if content.is_compared:
        words = (
            "Mean and standard deviation of f: by simulation with 95 % half-widths, as the surrogate predicts them, and as the "
            "paper prints them in its Table 4. The printed standard deviations match neither the standard deviation nor the "
            "variance of f in this model; nothing was fitted to them."
        )
        caption = "Table 4: this study and the paper"
    remarks = str(verified.attrs.get("remarks", "none"))
    return {
        "words": words,
        "names": [
            (name, text)
            for name, text in _meanings(names)
            if any(_is_called(one, name) for one in names)
        ],
        "remarks": "" if remarks == "none" else remarks,
        "table": _designs_table(verified.isel(design=main), caption),
        "spread": _designs_table(verified.isel(design=spread), "Designs along the fronts")
        if spread
        else None,
    }


_MEANINGS = (
    ("original", "the baseline design, as the scene file has it"),
    ("alpha", "lowest mean (or first objective of the case) of all simulated designs"),
    (
        "beta",
        "lowest standard deviation (or second objective); ties are broken by the first objective",
    ),
    ("front", "non-dominated designs between the two"),
    ("best", "alpha or beta as predicted by the surrogate alone, in the best run of the search"),
    ("averaged", "the mean of these designs over all runs of the search"),
    ("candidate", "found during the search and simulated like the others"),
)
"""Kinds of designs, by a word of their names, and what they are."""


def _meanings(names: Sequence[str]) -> list[tuple[str, str]]:
    """The same where a front has more than two ends."""
    further = [end for end in ENDS[2:] if any(_is_called(name, end) for name in names)]
    if not further:
        return list(_MEANINGS)
    told = dict(_MEANINGS)
    told["beta"] = told["beta"].replace("the first objective", "the other objectives")
    told["front"] = "non-dominated designs between these"
    told["best"] = told["best"].replace("alpha or beta", "alpha, beta or a further end")
    places = zip(further, ORDINALS[2:], strict=False)
    rows = [(end, f"lowest {place} objective of the case") for end, place in places]
    return [*list(told.items())[:3], *rows, *list(told.items())[3:]]


def _is_called(name: str, kind: str) -> bool:
    """Whether the kind is what a design is called; alpha and beta are also what others come near to."""
    words = name.split()
    return words[-1] == kind if kind in ("original", *ENDS) else kind in words[-2:]


def _place(verified: xr.Dataset, k: int) -> tuple[str, int]:
    """Case by case: the original, then each of ours before the printed one."""
    name = str(verified["design"].to_numpy()[k])
    case = str(verified["case"].to_numpy()[k]) if "case" in verified else ""
    kinds = ("", "best ", "printed ")
    order = ["original", *(f"{kind}{end}" for end in ENDS for kind in kinds)]
    if labels.is_printed(verified.isel(design=k)):
        name = f"printed {name.rpartition(' ')[2]}"
    own = name.removeprefix(f"{case} ")
    return case, order.index(own) if own in order else len(order)


_MOMENTS = (
    ("mean_true", "mean of f"),
    ("deviation_true", "std. deviation of f"),
    ("life_mean", "mean, own wear"),
    ("life_deviation", "std. deviation, own wear"),
    ("mean_surrogate", "surrogate: mean"),
    ("deviation_surrogate", "surrogate: std. deviation"),
    ("mean_paper", "printed: mean"),
    ("deviation_paper", "printed: std. deviation"),
)


def _designs_table(verified: xr.Dataset, caption: str) -> Table:
    """A row for each design; each column in one unit."""
    columns = [(v, labels.words(v)) for v in labels.design_variables(verified)]
    columns += [(verified[name], words) for name, words in _MOMENTS if name in verified]
    scales = [labels.of(variable) for variable, _ in columns]
    header = ["design", *(s.label(words) for s, (_, words) in zip(scales, columns, strict=True))]
    asked = [name for name in ORDINALS if f"{name}_goal" in verified]
    if asked:  # each case asks for its own, so the cells say what it is
        header += [*(f"objective {k + 1}" for k in range(len(asked))), "constraints"]
    rows = []
    for k in range(verified.sizes["design"]):
        row: list[object] = [verified["design"].to_numpy()[k]]
        for scale, (variable, _) in zip(scales, columns, strict=True):
            shown = number(float(variable[k]) * scale.factor)
            row.append(
                Number(shown + _half_width(verified.isel(design=k), str(variable.name), scale))
            )
        rows.append([*row, *_asked(verified.isel(design=k), asked)])
    return Table(header, rows, caption)


def _asked(one: xr.Dataset, names: Sequence[str]) -> list[object]:
    """Cells of what the case of a design asks for, where that is not mean and deviation alone: first, second and so on."""
    if not names:
        return []
    cells: list[object] = []
    for name in names:
        value = labels.quantity(float(one[f"{name}_true"]), str(one[f"{name}_unit"].item()))
        words = labels.statistic(str(one[f"{name}_goal"].item()))
        cells.append(f"{words}: {value}" if words else "")
    return [*cells, str(one["constraints"].item()) or "none"]


def _half_width(one: xr.Dataset, name: str, scale: labels.Scale) -> str:
    """Half of the confidence interval of a true moment, as text behind it."""
    word = name.removesuffix("_true")
    if f"{word}_lower" not in one or f"{word}_upper" not in one:
        return ""
    half = 0.5 * (float(one[f"{word}_upper"]) - float(one[f"{word}_lower"])) * scale.factor
    return f" ± {half:.2g}" if np.isfinite(half) else ""


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
    return [words, Table(header, rows, "Readings of the paper")]


def claims(content: Content) -> list[object] | None:
    """The paper's claims with our verdicts."""
    found = content.get("claims")
    if found is None:
        return None
    rows = []
    for k in range(found.sizes["claim"]):
        one = found.isel(claim=k)
        verdict = str(one["verdict"].item())
        mark, kind = _MARKS.get(verdict, ("", "open"))
        words = "undecided" if kind == "open" else verdict
        badge = {"words": f"{mark} {words}", "kind": kind}
        rows.append([f"{int(one['claim'])}. {one['text'].item()}", badge, one["figure"].item()])
    header = ["claim", "verdict", "the numbers that decide"]
    return [Table(header, rows, "Claims of the paper, tested on this data")]


def trust(content: Content) -> list[object] | None:
    """Samples that failed, and those to be read with care."""
    samples = content.get("samples")
    if samples is None:
        return None
    status = samples["status"].to_numpy()
    numbers = samples["sample"].to_numpy()
    parts: list[object] = []
    rows: list[list[object]] = []
    for code in Status:
        hit = numbers[status == code]
        if code is not Status.OK and hit.size:
            rows.append(
                [
                    code.name.lower(),
                    Number(len(hit)),
                    code.message,
                    failures.where(status == code, failures.variables(samples)),
                    code.remedy,
                    _listed(hit),
                ]
            )
    if rows:
        header = ["outcome", "samples", "what happened", "where", "what to change", "which"]
        parts.append(Table(header, rows, "Samples that failed; their numbers are missing, never 0"))
    else:
        parts.append("No sample failed.")
    rows = []
    flags = samples["flags"].to_numpy() if "flags" in samples else np.zeros(len(numbers), int)
    for flag, words in labels.FLAGS.items():
        hit = numbers[(flags & flag) != 0]
        if hit.size:
            rows.append([flag.name.lower(), Number(len(hit)), words, _listed(hit)])
    if rows:
        parts.append(
            Table(["flag", "samples", "why", "which"], rows, "Valid results to be read with care")
        )
    else:
        parts.append("No sample carries a warning.")
    return parts


def _listed(numbers: np.ndarray) -> str:
    shown = ", ".join(str(n) for n in numbers[:LISTED])
    return shown if len(numbers) <= LISTED else f"{shown} and {len(numbers) - LISTED} more"
