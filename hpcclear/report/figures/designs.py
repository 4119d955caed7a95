"""Figures of the optimised designs: fronts, and responses beside each other."""

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.base.objectives import ENDS, ORDINALS
from hpcclear.report.figures import labels, motion, style
from hpcclear.results.content import Results, each, text_in, texts_in


@style.figure("Pareto fronts of all runs as predicted by the surrogate, and the simulated designs.")
def front_figure(front: Results, verification: Results | None = None) -> "style.Figure":
    """Pareto fronts of all cases (kind ``front``), and the designs that were simulated (the paper's Fig. 9; kind
    ``verification``), with confidence intervals, joined to what the surrogate said.

    Axes are what each case makes small: mean and standard deviation, if it requests nothing else; of more than two things each
    two have panels of their own. Left the fronts alone, right with the baseline design and the paper's designs, which lie far
    off.
    """
    cases = texts_in(front, "case")
    asked = {case: _goals(front.sel(case=case)) for case in cases}
    pairs = [(case, x, y) for case in cases for x, y in itertools.combinations(asked[case], 2)]
    alike = all(x.label == pairs[0][1].label for _, x, _ in pairs)
    columns = 1 if verification is None else 2
    options = {"sharex": "col"} if alike else {}
    figure, axes = style.grid(len(pairs), columns, 24.0 + 54.0 * len(pairs), **options)
    for number, (line, (case, x, y)) in enumerate(zip(axes, pairs, strict=True)):
        for column, panel in enumerate(line):
            _runs(panel, front.sel(case=case), x, y)
            if verification is not None:
                _verified(panel, verification, case, x, y, all_designs=column == 1)
                if column == 0:
                    _ends(panel, verification, case, x, y, len(asked[case]))
        line[0].set_title(f"case: {labels.literal(case)}")
        line[0].set_ylabel(y.label)
        line[-1].set_ylabel(y.label)
        for panel in line if number == len(pairs) - 1 or not alike else ():
            panel.set_xlabel(x.label)
    style.legend(figure, axes[0, -1], "lower")
    return figure


NEAREST = 1e-3
"""Relative length of an axis at least, where more than two things are made small: the least of one may be had with all."""

NARROW = 20
"""Letters in a line of a label; longer formulas have two or three lines, and end there."""


class _Goal(NamedTuple):
    """What is on an axis: its label, the variable of the front, those of verified designs, the scale."""

    label: str
    searched: str
    verified: str
    scale: labels.Scale


_GREEK = "αβγδε"
_SIDES = ((4, 3), (4, -9), (12, 3), (12, -9), (20, 3))
"""Where letters stand right of their marks, points; of three and more, left of marks in the right half of a panel."""

_LETTERS = (("mean", r"mean $\mu_f$"), ("deviation", r"standard deviation $\sigma_f$"))


def _goals(one: Results) -> list[_Goal]:
    """What a case makes small, from its part of the fronts."""
    asked = searched(one)
    if len(asked) > 1:
        return [_asked(one, name, *row) for name, row in asked.items()]
    usual = ((name, words, labels.of(one[name])) for name, words in _LETTERS)
    return [_Goal(unit.label(words), name, name, unit) for name, words, unit in usual]


def searched(one: Results) -> dict[str, tuple[str, str]]:
    """Words and unit of what a case makes small, by the variable of its front; none if that is mean and standard deviation."""
    names = [f"searched_{name}" for name in ORDINALS if f"searched_{name}_goal" in one]
    every = {n: (text_in(one, f"{n}_goal"), text_in(one, f"{n}_unit")) for n in names}
    return {name: row for name, row in every.items() if row[0]}


def _asked(one: Results, name: str, words: str, unit: str) -> _Goal:
    """One of them: a formula of the user has no unit."""
    scale = labels.scale(unit or "1", one[name])
    if len(words) > 2 * NARROW:
        words = f"{words[: 2 * NARROW - 6].rstrip()} …"
    label = scale.label(words) if unit else f"{words} (SI)"
    return _Goal(labels.literal(label), name, name.removeprefix("searched_"), scale)


def _runs(panel: "style.Axes", one: Results, x: _Goal, y: _Goal) -> None:
    for k, run in enumerate(one["run"].values):
        row = one.sel(run=run)
        points = [goal.scale(row[goal.searched]) for goal in (x, y)]
        look = {**style.look(k), "ls": "none", "ms": 2.0, "mew": 0.0}
        panel.plot(*points, label=f"predicted, run {run}", **look)


def _verified(
    panel: "style.Axes", verification: Results, case: str, x: _Goal, y: _Goal, *, all_designs: bool
) -> None:
    """Simulated designs of a case, ours or all, each joined to its prediction by the surrogate."""
    for one in each(verification, "design"):
        label, marker = _mark(one)
        if text_in(one, "case") not in ("", case) or not (all_designs or marker == "o"):
            continue
        at = _place(one, x, y, "true")
        bars = [_bars(one, goal.verified, goal.scale) for goal in (x, y)]
        panel.errorbar(
            *at, xerr=bars[0], yerr=bars[1], color=style.colour("ink"), ecolor=style.colour("grey"), elinewidth=0.5,
            label=label, fmt=marker, ms=3.4, mfc=style.colour("paper"), mew=0.7, zorder=4,
        )  # fmt: skip
        if f"{x.verified}_surrogate" in one and f"{y.verified}_surrogate" in one:
            ends = zip(_place(one, x, y, "surrogate"), at, strict=True)
            panel.plot(*ends, color=style.colour("ink"), lw=0.5, zorder=3)


def _place(one: Results, x: _Goal, y: _Goal, end: str) -> tuple[float, float]:
    """Where a design stands, by simulation ("true") or by the surrogate."""
    across, up = (float(goal.scale(one[f"{goal.verified}_{end}"])) for goal in (x, y))
    return across, up


def _ends(
    panel: "style.Axes", verification: Results, case: str, x: _Goal, y: _Goal, count: int
) -> None:
    """The Greek letters of the ends; of more than two each at a place of its own, as some may lie on each other."""
    from matplotlib.patheffects import withStroke

    names = texts_in(verification, "design")
    sides = _SIDES if count > 2 else _SIDES[:1] * count
    if count > 2:
        panel.margins(0.15)  # room for letters beside marks at the border
        for ends, widen in ((panel.get_xlim(), panel.set_xlim), (panel.get_ylim(), panel.set_ylim)):
            least = NEAREST * max(map(abs, ends))
            if ends[1] - ends[0] < least:  # all have the same but for round-off
                widen(0.5 * (sum(ends) - least), 0.5 * (sum(ends) + least))
    for end, letter, side in zip(ENDS, _GREEK, sides, strict=False):
        if f"{case} {end}" in names:
            one = verification.isel(design=names.index(f"{case} {end}"))
            at = _place(one, x, y, "true")
            if count > 2 and at[0] > np.mean(panel.get_xlim()):
                side = -side[0] - 5, side[1]
            drawn = panel.annotate(letter, at, side, textcoords="offset points")
            if count > 2:
                halo = withStroke(linewidth=1.5, foreground=style.colour("paper"))
                drawn.set_path_effects([halo])


def _mark(one: Results) -> tuple[str, str]:
    """What a design is called in the legend, and its mark."""
    if labels.is_printed(one):
        return "paper (simulated)", "D"
    if labels.is_baseline(one):
        return "baseline (simulated)", "s"
    return "optimised (simulated)", "o"


def _bars(one: Results, name: str, unit: labels.Scale) -> np.ndarray | None:
    """Distances to the confidence intervals as `errorbar` wants them, (2, 1); None if there are none."""
    value, *ends = labels.estimate(one, name)
    return np.abs(np.array(ends)[:, None] - value) * unit.factor if f"{name}_lower" in one else None


@style.drawn
def comparison_figure(responses: Mapping[str, Results]) -> "style.Figure":
    """Responses of designs by name over two revolutions, the baseline first (the paper's Fig. 10); InputError without any."""
    if not responses:
        reason = "there is no response to draw"
        raise InputError("responses", 0, reason, "Give the response of each design")
    order = sorted(responses, key=lambda name: (name != "original", name))
    shown = {name: motion.latest(responses[name]) for name in order}
    quantities = motion.quantities(shown[order[0]])
    figure, axes = style.grid(len(quantities), 1, 24.0 + 33.0 * len(quantities), sharex=True)
    for panel, (name, joint, words) in zip(axes[:, 0], quantities, strict=True):
        series = {k: r[name].sel(joint=joint) if joint else r[name] for k, r in shown.items()}
        largest = [float(np.nanmax(abs(one.values))) for one in series.values()]
        unit = labels.scale(str(series[order[0]].attrs["units"]), largest)
        for k, design in enumerate(order):
            turn = motion.turns(shown[design])
            text = labels.literal("baseline" if design == "original" else design)
            look: style.Look = {"color": style.colour((k - 1) % len(style.NAMES)), "label": text}
            look |= {"lw": 0.7, "ls": style.DASHES[k % len(style.DASHES)]}
            panel.plot(turn - turn[0], unit(series[design]), **look)
        panel.set_ylabel(unit.label(words))
    axes[-1, 0].set_xlabel(motion.turns_label(shown[order[0]]))
    style.legend(figure, axes[0], "lower", columnspacing=1.0)
    figure.align_ylabels(axes[:, 0])
    return figure
