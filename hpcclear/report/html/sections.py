"""Sections of the page on samples, findings and data quality, made from what there is; None where nothing is."""

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.outcome import Status
from hpcclear.report import failures, identified, spread
from hpcclear.report.figures import effects, labels
from hpcclear.report.html.content import Content
from hpcclear.report.html.markup import Number, Table, quantity
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results
from hpcclear.scene.loading import scene_of_text
from hpcclear.statistics.random.survival import order_interval, quantiles

LIVED = [int(status) for status in Status if status.valid or status is Status.WORN_THROUGH]
"""Endings of lives that count."""

LISTED = 40  # samples listed by number before the rest is only counted


def summary(content: Content) -> dict[str, object] | None:
    """What was sampled and found, in plain words; None if other sections have it."""
    words = [*_lives_words(content), *_samples_words(content), *_effects_words(content)]
    if not words and not set(content.files) - {"timing"}:
        words = ["These are responses of single designs; nothing was sampled or optimised."]
    return {"words": words, "facts": _facts(content)} if words else None


def _lives_words(content: Content) -> list[str]:
    lives = content.get("wear")
    if lives is None:
        return []
    last = lives.isel(cycle=-1)
    cycles, failed = float(last["cycle"]), int((~np.isin(lives["ending"], LIVED)).sum())
    early = int((lives["ended"].to_numpy() < cycles).sum()) - failed
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
            every = lives["lifetime"].to_numpy()
            known = every[~np.isnan(every)]
            least, most = order_interval(known, 0.5, len(every) - len(known))
            reach = f"{most:.4g}" if np.isfinite(most) else f"beyond {cycles:.4g}"
            words.append(
                f"Median service life: {turns:.4g} revolutions (95 % CI {np.nan_to_num(least):.4g} to {reach}), {hours:.4g} h."
            )
    if any(name.startswith("limit_") for name in lives.attrs):
        interval = f"{float(last['survival_lower']):.0%} to {float(last['survival_upper']):.0%}"
        words.append(
            f"Survival after {cycles:.4g} revolutions: {float(last['survival']):.0%} (95 % CI {interval})."
        )
    return words


def _samples_words(content: Content) -> list[str]:
    samples = content.get("samples")
    if samples is None:
        return []
    count, failed = samples.sizes["sample"], int(np.count_nonzero(samples["status"]))
    names = ", ".join(labels.words(v) for v in labels.design_variables(samples))
    words = [f"{count} simulations, varying {names}; {_failures(failed)}."]
    f = samples["objective"]
    if not np.isnan(f).all():
        ends = float(np.nanmin(f)), float(np.nanmax(f))
        low, high = (str(quantity(end, str(f.attrs["units"]))) for end in ends)
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


def _facts(content: Content) -> list[tuple[str, object]]:
    """Numbers of samples and designs as tiles."""
    facts: list[tuple[str, object]] = []
    if (samples := content.get("samples")) is not None:
        failed = int(np.count_nonzero(samples["status"]))
        facts += [("samples", samples.sizes["sample"]), ("failed", failed)]
    if (verified := content.get("verification")) is not None:
        facts.append(("designs simulated with confidence intervals", verified.sizes["design"]))
    return facts


def _failures(count: int) -> str:
    return "no failures" if count == 0 else f"{count} failed"


def identified_machine(content: Content) -> list[object] | None:
    """Unknowns of a machine with their intervals, growth, what to measure, and warnings."""
    found = content.get("identify")
    if found is None:
        return None
    rows: list[list[object]] = [[line.label, line.text] for line in identified.lines(found)]
    table = Table(["quantity", "result"], rows, "Unknowns of the machine")
    return [table, *(f"Warning: {text}." for text in identified.warnings(found))]


def statistics(content: Content) -> list[object] | None:
    """Statistics of the samples, shares beyond thresholds of the study, and warnings; of a study its designs have them."""
    samples = content.get("samples")
    if samples is None or content.get("verification") is not None:
        return None
    lines = spread.statistics(samples, _thresholds(samples))
    rows = [[line.label, line.text] for line in lines]
    table = Table(
        ["quantity", "95 % confidence interval in brackets"], rows, "Statistics of the samples"
    )
    warnings = [f"Warning: {text}." for text in spread.remarks(samples)]
    return [*([table] if rows else []), *warnings] or None


def compared(content: Content) -> list[object]:
    """Statistics of several samples in one table, a column for each file."""
    every = {name: own["samples"] for name, own in content.samples.items()}
    rows = spread.rows_of(spread.side_by_side(every))
    words = f"The files {', '.join(content.samples)} are compared here; a part on each follows."
    caption = "Statistics of the samples, with 95 % confidence intervals"
    return [words, Table(["quantity", *content.samples], rows, caption)]


def _thresholds(samples: Results) -> list[spread.Beyond]:
    """Values of f that the cases of the study keep below, or whose exceedance they make small."""
    try:
        study = scene_of_text(str(samples.attrs.get("scene", "")), "scene").study
    except InputError:
        return []
    goals = [
        goal
        for case in (study.cases if study else ())
        for goal in (*(case.objectives or ()), *(case.constraints or ()))
    ]
    values = {goal.limit for goal in goals if goal.limit is not None}
    return [spread.Beyond("objective", value) for value in sorted(values)]


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
                    _listed(hit, len(numbers)),
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
            rows.append([flag.name.lower(), Number(len(hit)), words, _listed(hit, len(numbers))])
    if rows:
        parts.append(
            Table(["flag", "samples", "why", "which"], rows, "Valid results to be read with care")
        )
    else:
        parts.append("No sample carries a warning.")
    return parts


def _listed(numbers: np.ndarray, of: int) -> str:
    """Numbers of samples, the first ones only where they are many, "all" where all are meant."""
    if len(numbers) == of > 1:
        return "all"
    if len(numbers) > max(LISTED, of // 2):
        return f"all but {of - len(numbers)}"
    shown = ", ".join(str(n) for n in numbers[:LISTED])
    return shown if len(numbers) <= LISTED else f"{shown} and {len(numbers) - LISTED} more"


PARTS = (
    SectionOf(20, "identify", "Identified machine", "parts.html", identified_machine),
    SectionOf(50, "statistics", "Statistics of the samples", "parts.html", statistics, of_samples=True, each=True),
    SectionOf(70, "summary", "Summary", "summary.html", summary, of_samples=True, each=True),
    SectionOf(110, "trust", "Data quality", "parts.html", trust, of_samples=True, each=True),
)  # fmt: skip
