"""Sections of the page on samples, effects and data quality, made from what there is; None where nothing is."""

import json
from collections.abc import Sequence

import numpy as np
import tomli_w

from hpcclear.base.outcome import Status
from hpcclear.report import failures, identified, spread
from hpcclear.report.figures import effects, labels
from hpcclear.report.html.content import Content, scene_of
from hpcclear.report.html.markup import Number, PageTable, preformatted
from hpcclear.report.parts import SectionOf
from hpcclear.results.content import Results, texts_in
from hpcclear.scene.syntax import parse

LISTED = 40  # samples listed by number before the rest is only counted


def screened(found: Results, content: Content) -> list[object]:
    """What each effect changes and saves, why others are kept, and the tables of the scene without what can be neglected."""
    seconds = effects.seconds_of(content.files.get("timing"))
    return [
        _changes(found, seconds),
        *effects.statements(found, seconds),
        *(f"{name} is kept: {reason}." for name, reason in json.loads(found.attrs["kept"]).items()),
        *([preformatted(text)] if (text := _changed(found)) else []),
    ]


def _changes(found: Results, seconds: effects.Times) -> PageTable:
    """A row a variant: what is off, changes with confidence intervals, time, verdict."""
    shown = np.flatnonzero(np.isfinite(found["change"][1:]).any(axis=0))
    words, every = {"mean": "mean f", "deviation": "std. dev."}, texts_in(found, "response")
    names = (words.get(every[k], every[k]) for k in shown)
    header = ["off", *names, "run time saved", "within"]
    rows: list[list[object]] = []
    for k in range(1, found.sizes["variant"]):
        one = found.isel(variant=k)
        cells = [effects.shown(float(one["change"][r]), float(one["limit"][r])) for r in shown]
        verdict = ("yes", "no", "?")[int(one["decision"])]
        saved = effects.saving(found, k, seconds).words
        rows.append([effects.label(effects.named(found, k)), *map(Number, cells), saved, verdict])
    return PageTable(header, rows, "Changes with effects disabled, against all enabled")


def _changed(found: Results) -> str:
    """Tables of the scene that change where what can be neglected is left out, as TOML to paste; "" if nothing can."""
    chosen = int(np.argmax(found["recommended"].values))
    scene = scene_of(found)
    if not chosen or scene is None:
        return ""
    whole = scene.resolved()
    reduced = parse(found.attrs["reduced_scene"], "reduced scene")
    changed = {key: value for key, value in reduced.items() if whole.get(key) != value}
    gone = [key for key in whole if key not in reduced]
    more = f"; [{'], ['.join(gone)}] goes" if gone else ""
    head = f"# Without {', '.join(effects.named(found, chosen))}, in place of the same tables"
    return f"{head}{more}.\n{tomli_w.dumps(changed)}"


def identified_machine(found: Results, content: Content) -> list[object]:
    """Unknowns of a machine with their intervals, growth, what to measure, and warnings."""
    rows = [[line.label, line.text] for line in identified.lines(found)]
    table = PageTable(["quantity", "result"], rows, "Unknowns of the machine")
    return [table, *(f"Warning: {text}." for text in identified.warnings(found))]


def statistics(samples: Results, content: Content) -> list[object]:
    """Statistics of the samples, shares beyond thresholds of the study, and warnings; of a study its designs have them."""
    if "verification" in content.files:
        return []
    lines = spread.statistics(samples, _thresholds(samples))
    rows = [[line.label, line.text] for line in [*lines, *spread.in_time(samples)]]
    header = ["quantity", "95 % confidence interval in brackets"]
    table = PageTable(header, rows, "Statistics of the samples")
    return [*[table] * bool(rows), *(f"Warning: {text}." for text in spread.remarks(samples))]


def compared(content: Content) -> list[object] | None:
    """Statistics of several samples in one table, a column for each file."""
    if not content.samples:
        return None
    every = {name: own["samples"] for name, own in content.samples.items()}
    rows = spread.rows_of(spread.side_by_side(every))
    caption = "Statistics of the samples, with 95 % confidence intervals"
    return [PageTable(["quantity", *content.samples], rows, caption)]


def _thresholds(samples: Results) -> list[spread.Beyond]:
    """Values of f that the cases of the study keep below, or whose exceedance they make small."""
    scene = scene_of(samples)
    cases = scene.study.cases if scene is not None and scene.study is not None else ()
    goals = [(*(case.objectives or ()), *(case.constraints or ())) for case in cases]
    values = {goal.limit for own in goals for goal in own if goal.limit is not None}
    return [spread.Beyond("objective", value) for value in sorted(values)]


def trust(samples: Results, content: Content) -> list[object]:
    """Samples that failed, and those to be read with care."""
    status = samples["status"].values
    numbers = samples["sample"].values
    failed: list[list[object]] = []
    for code in Status:
        hit = numbers[status == code]
        if code is not Status.OK and hit.size:
            place = failures.where(status == code, failures.variables(samples))
            which = _listed(hit, len(numbers))
            name = code.name.lower()
            failed.append([name, Number(len(hit)), code.message, place, code.remedy, which])
    flags = samples["flags"].values
    marked: list[list[object]] = []
    for flag, words in labels.FLAGS.items():
        hit = numbers[(flags & flag) != 0]
        if hit.size:
            which = _listed(hit, len(numbers))
            marked.append([flag.name.lower(), Number(len(hit)), words, which])
    heads = ["outcome", "samples", "what happened", "where", "what to change", "which"]
    lost = PageTable(heads, failed, "Samples that failed; their numbers are missing, never 0")
    heads = ["flag", "samples", "why", "which"]
    careful = PageTable(heads, marked, "Valid results to be read with care")
    return [
        lost if failed else "No sample failed.",
        careful if marked else "No sample carries a warning.",
    ]


def _listed(numbers: Sequence[int] | np.ndarray, of: int) -> str:
    """Numbers of samples, the first ones only where they are many, "all" where all are meant."""
    if len(numbers) == of > 1:
        return "all"
    if len(numbers) > max(LISTED, of // 2):
        return f"all but {of - len(numbers)}"
    shown = ", ".join(str(n) for n in numbers[:LISTED])
    return shown if len(numbers) <= LISTED else f"{shown} and {len(numbers) - LISTED} more"


PARTS = (
    SectionOf(10, "identify", "identified", "Identified machine", identified_machine, "identify"),
    SectionOf(10, "effects", "screened", "Effects", screened, "effects"),
    SectionOf(10, "quality", "compared", "Comparison", compared),
    SectionOf(
        20, "quality", "statistics", "Statistics of the samples", statistics, "samples", True
    ),
    SectionOf(30, "quality", "trust", "Data quality", trust, "samples", True),
)
