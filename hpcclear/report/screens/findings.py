"""First screens of commands that answer one question: an identified machine, effects, accuracy against run time."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hpcclear.base.plain import counted
from hpcclear.base.verdict import Verdict
from hpcclear.report import identified, targets
from hpcclear.report.answer import MANY
from hpcclear.report.figures import effects as screening, labels
from hpcclear.report.html.content import Content
from hpcclear.report.screen import Screen, ScreenRow, Tile, Trust, amber, green, red, trusted, upper
from hpcclear.results.content import Results

MOST = 4
"""Unknowns of a record that have a figure; where there are more, all are in the table."""


def machine(found: Results, content: Content) -> Screen:
    """Return the first screen of an identified machine."""
    known = "interval" in found
    trust = [red(upper(text), "identify") for text in identified.warnings(found)]
    if known and not trust:
        trust.append(green("The model explains every signal", "identify"))
    if known:
        coverage = float(np.min(found["coverage"].values))
        level = green if coverage >= 0.9 else amber
        text = f"Check: the 95 % interval holds for {100 * coverage:.0f} % of simulated machines"
        trust.append(level(text, "identify"))
    unknown = _unknowns(found) if known else []
    headline = "What to measure: expected half-widths of each signal"
    if unknown:
        last = unknown[-found.sizes["unknown"] :]
        headline = "; ".join(f"{upper(label)}: {text}" for label, text in last[:2])
    failed = known and not found["explained"].values.all()
    parts = [(label, *text.partition(" (")) for label, text in unknown]
    tiles = [Tile(label, text, within=more.rstrip(")")) for label, text, _, more in parts]
    above = {label.partition(",")[0] for label, _ in unknown if len(unknown) <= MOST}
    shown = (line for line in identified.lines(found) if line.label not in above | {"calibration"})
    rows = tuple(ScreenRow(line.label, (line.text,)) for line in shown)
    return Screen(
        headline,
        (f"measured records: {found.sizes['record']}",) if known else (),
        "the model does not explain every signal" if failed else "",
        tuple(tiles[-MOST:]),
        ("quantity", "result") if rows else (),
        rows,
        trust=trusted(trust),
        figures=("posterior", "features") if known else (),
    )


def _unknowns(found: Results) -> list[tuple[str, str]]:
    """Unknowns of each record with their intervals, in words; of several records with their names."""
    records, names = found["record"].values, found["unknown"].values
    ends = [f", {Path(str(one)).name}" * (len(records) > 1) for one in records]
    return [
        (identified.named(name) + end, identified.interval(found, k, u))
        for k, end in enumerate(ends)
        for u, name in enumerate(names)
    ]


def effects(found: Results, content: Content) -> Screen:
    """Return the first screen of an effect screening."""
    seconds = screening.seconds_of(content.files.get("timing"))
    tolerance = f"{100 * float(found.attrs['tolerance']):g} %"
    chosen = int(np.argmax(found["recommended"].values))
    names, saved = screening.named(found, chosen), screening.saving(found, chosen, seconds)
    headline = f"No effect was found negligible within {tolerance}"
    if chosen:
        more = f"run time saved {saved.words}"
        headline = f"Within {tolerance}, {', '.join(names)} can be neglected: {more}"
    rows = []
    for k in range(1, found.sizes["variant"]):
        change = screening.shown(float(found["change"][k, 0]), float(found["limit"][k, 0]))
        within = ("yes", "no", "undecided")[int(found["decision"][k])]
        cells = change, within, screening.saving(found, k, seconds).words
        rows.append(ScreenRow(screening.label(screening.named(found, k)), cells))
    return Screen(
        headline, (f"f: {labels.objective(found)}", f"{int(np.sum(found['samples'].values))} simulations"),
        header=("disabled", "change of f", "within", "run time saved"), rows=tuple(rows),
        trust=trusted(_screened(found)), figures=("effects",),
        steps=("--scene FILE writes the scene without them",) if chosen else (),
    )  # fmt: skip


def _screened(found: Results) -> Iterator[Trust]:
    decisions = found["decision"].values[1:]
    failed, total = (int(np.sum(found[name].values)) for name in ("failed", "samples"))
    if open_ := int((decisions == Verdict.UNDECIDED).sum()):
        remedy = "correct what fails" if failed else "more samples would decide"
        yield amber(f"{open_} of {len(decisions)} variants are undecided: {remedy}", "effects")
    else:
        yield green("Every variant is decided", "effects")
    if failed:
        shade = red if failed > MANY * total else amber
        yield shade(f"{failed} of {counted(total, 'simulation')} failed", "effects")
    level = f"{100 * float(found.attrs['confidence']):.0f} %"
    yield green(f"Intervals of {level}, from averages over the same points", "effects")


def accuracy(found: Results, content: Content) -> Screen:
    """Return the first screen of accuracy against run time."""
    own = targets.settings(found)
    ways = [(target, targets.cheapest(found, target)) for target in targets.TARGETS]
    rows = []
    for target, way in ways:
        cells = ("not reached", "") if way is None else (way.words, targets.seconds(way.seconds))
        rows.append(ScreenRow(f"error of {100 * target:g} %", cells))
    if own is not None:
        rows.append(ScreenRow("your settings", (own.words, targets.seconds(own.seconds))))
        headline = f"Your settings: error of f at most {100 * own.error:.2g} %, {targets.seconds(own.seconds)} per design"
    else:
        reached = [(target, way) for target, way in ways if way is not None]
        headline = "No measured setting reaches an error of 1 %"
        if reached:
            target, way = reached[-1]
            headline = f"An error of f of {100 * target:g} % costs {targets.seconds(way.seconds)} of one core per design"
    known = green("Errors against references with much tighter settings", "accuracy")
    times = amber("Times are those of one core of this machine", "accuracy")
    return Screen(
        headline, header=("target", "settings", "time of one core"), rows=tuple(rows),
        trust=trusted([known, times]), figures=("accuracy",),
    )  # fmt: skip
