"""Which effects a scene can do without (kind ``effects``): a bar each, cost beside change, and the sentences that say it."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from hpcclear.base.student import student
from hpcclear.base.verdict import Verdict
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results
from hpcclear.results.names import ALL_ON, SECONDS_BY_ROUND

CONFIDENCE = 0.95
"""Confidence level of what is saved."""


def named(content: Results, variant: int) -> list[str]:
    """Names of the effects that are off in a variant."""
    off = content["off"].values[variant].astype(bool)
    return [str(name) for name in content["effect"].values[off]]


def label(names: list[str]) -> str:
    """A variant in words."""
    return " + ".join(names) if names else ALL_ON


Times = Mapping[str, Sequence[float]]
"""Processor times of a sample, s, round by round, of each variant by `label`."""


class Saving(NamedTuple):
    """Share of a sample's run time that a variant saves, negative if it takes longer."""

    share: float
    half: float
    """Half-width of its 95 % confidence interval, from round to round; NaN where it is an estimate."""
    rounds: int
    """Rounds that it was measured in; 0: it is estimated from evaluations."""

    @property
    def words(self) -> str:
        """The share with its half-width."""
        if not np.isfinite(self.half):
            return f"about {100 * self.share:.0f} %" + ("" if self.rounds else ", by evaluations")
        share, _, half = labels.paired(100 * abs(self.share), 100 * self.half).partition(" ± ")
        sign = "-" if self.share < 0.0 and float(share) else ""
        if abs(self.share) <= self.half:  # zero as far as was measured
            return f"none significant ({sign}{share} % ± {half} %)"
        return f"none, it takes {share} % ± {half} % longer" if sign else f"{share} % ± {half} %"


def seconds_of(timing: Results | None) -> Times:
    """Processor times of a sample of each variant; empty where they were not measured."""
    return json.loads("{}" if timing is None else timing.attrs.get(SECONDS_BY_ROUND, "{}"))


def saving(content: Results, variant: int, seconds: Times) -> Saving:
    """What a variant saves: measured in pairs with the whole scene, else by evaluations."""
    off = label(named(content, variant))
    here, whole = (np.array(seconds.get(name, ())) for name in (off, label([])))
    count = len(here)
    if count == 0 or len(whole) != count or not whole.all():
        return Saving(1.0 - float(content["work"][variant]), np.nan, 0)
    shares = 1.0 - here / whole
    half = np.nan
    if count > 1:
        half = student(CONFIDENCE, count - 1) * float(shares.std(ddof=1)) / np.sqrt(count)
    return Saving(float(shares.mean()), float(half), count)


def shown(value: float, limit: float) -> str:
    """Return a relative change with its half-width in per cent, with as many digits as the half-width allows."""
    if not np.isfinite(value):
        return "-"
    value, limit = 100.0 * value, 100.0 * limit
    digits = int(min(1 - np.floor(np.log10(max(limit, 1e-2))), 2))  # negative: of tens
    number, half = (f"{round(one, digits):+.{max(digits, 0)}f}" for one in (value, limit))
    return f"{number[float(number) == 0.0 :]} ± {half[1:]} %"


def undecided(content: Results, variant: int) -> str:
    """Why it is not known whether a variant is within the tolerance, and what would decide it; "" where it is known."""
    one, tolerance = content.isel(variant=variant), float(content.attrs["tolerance"])
    if int(one["decision"]) != Verdict.UNDECIDED:
        return ""
    open_ = (one["judged"].values == 1) & (one["finding"].values == Verdict.UNDECIDED)
    room = tolerance - np.abs(one["change"].values[open_])
    name, count = label(named(content, variant)), int(one["samples"])
    if np.isnan(room).any():
        return f"{name}: undecided, {int(one['failed'])} of {count} samples failed."
    if room.min() <= 0.0:
        return f"{name}: undecided with {count} samples."
    more = count * float((one["limit"].values[open_] / room).max()) ** 2
    more = float(f"{more:.1g}")
    return f"{name}: undecided with {count} samples, about {more:.0f} would suffice."


def statements(content: Results, seconds: Times) -> list[str]:
    """A sentence for what is undecided, for pairs that are more than their sum, and for what may be left out."""
    singles = [k for k in range(1, content.sizes["variant"]) if len(named(content, k)) == 1]
    chosen = int(np.argmax(content["recommended"].values))
    tolerance = f"{100 * float(content.attrs['tolerance']):g} %"
    last = f"No effect was found negligible within {tolerance}."
    if chosen:
        names, saved = ", ".join(named(content, chosen)), saving(content, chosen, seconds).words
        last = f"Within {tolerance} these effects can be neglected: {names}. Time saved: {saved}."
    doubts = (undecided(content, k) for k in singles)
    return [*filter(None, doubts), *distinguished(content), last]


def distinguished(content: Results) -> Iterator[str]:
    """Pairs whose change of f is significantly not the sum of the two, a sentence each."""
    off = content["off"].values
    single = {int(np.argmax(row)): k for k, row in enumerate(off) if row.sum() == 1}
    for k, row in enumerate(off):
        parts = np.flatnonzero(row).tolist()
        if len(parts) != 2 or any(p not in single for p in parts):
            continue
        rows = [k, *(single[p] for p in parts)]
        change = content["change"].values[rows, 0]
        limit = np.sqrt((content["limit"].values[rows, 0] ** 2).sum())
        if abs(change[0] - change[1:].sum()) > limit:
            whole, parts_sum = (f"{100 * one:+.2g} %" for one in (change[0], change[1:].sum()))
            yield f"{label(named(content, k))} interact: together they change f by {whole}, not {parts_sum}."


def caption(effects: Results, timing: Results | None) -> str:
    """What `effects_figure` shows."""
    seconds, cost = seconds_of(timing), "estimated from evaluations of the equations of motion"
    variants = range(1, effects.sizes["variant"])
    if rounds := max((saving(effects, k, seconds).rounds for k in variants), default=0):
        cost = f"mean of {rounds} paired measurements"
        cost += " with its 95 % confidence interval" if rounds > 1 else ""
    return (
        "Size of the change of the mean of f with each effect off, with its "
        f"{100 * float(effects.attrs['confidence']):g} % confidence interval; dashed: the tolerance. Green: within it in all "
        "judged results, red: needed, grey: undecided. “Left out”: the effects that can be neglected together. Right: run "
        f"time saved, {cost}."
    )


@style.figure(caption)
def effects_figure(effects: Results, timing: Results | None = None) -> "style.Figure":
    """Change of f by each effect with its confidence interval, and its run time, by evaluations where `timing` is missing."""
    off = effects["off"].values
    seconds = seconds_of(timing)
    rows = [k for k in range(1, len(off)) if off[k].sum() == 1]
    chosen = int(np.argmax(effects["recommended"].values))
    rows += [chosen] if chosen not in (0, *rows) else []
    figure, axes = style.grid(1, 2, 22.0 + 7.0 * len(rows), sharey=True, width_ratios=(3, 2))
    change, limit = (100 * effects[name].values[rows, 0] for name in ("change", "limit"))
    colours = ("green", "vermilion", "grey")  # by `Verdict`
    places = np.arange(len(rows))[::-1]
    floor = 10.0 ** np.floor(np.log10(10.0 * float(effects.attrs["tolerance"])))
    panel, cost = axes[0]
    ends = np.maximum(np.abs(change) + np.outer((-1, 1), limit), floor)
    length = np.maximum(np.abs(change), floor)
    panel.barh(
        places, length, color=[style.colour(colours[int(effects["decision"][k])]) for k in rows],
        height=0.6, xerr=np.abs(ends - length), error_kw={"lw": 0.9},
    )  # fmt: skip
    panel.set(xscale="log", xlim=(floor, None))
    panel.xaxis.set_minor_formatter("")
    tolerance = 100 * float(effects.attrs["tolerance"])
    panel.axvline(tolerance, color=style.colour("orange"), ls="--", lw=0.9)
    panel.set_yticks(places, [_wrapped(named(effects, k), k == chosen) for k in rows])
    panel.set_xlabel("|change of mean $f$| (%)")
    saved = [saving(effects, k, seconds) for k in rows]
    shares, halves = np.array([(100 * one.share, 100 * one.half) for one in saved]).T
    bar: style.Look = {"height": 0.6, "xerr": halves, "error_kw": {"lw": 0.9}}
    cost.barh(places, shares, color=style.colour("blue"), **bar)
    cost.set_xlim(-50, 100)  # what takes longer than half as much again is no saving
    cost.set_xlabel("run time saved (%)")
    return figure


def _wrapped(names: list[str], recommended: bool) -> str:
    """A label of few words a line, marked if it is what is recommended."""
    lines = [" + ".join(names[k : k + 2]) for k in range(0, len(names), 2)]
    return "\n".join(lines) + (" (left out)" if recommended else "")
