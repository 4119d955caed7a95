"""Figures of the optimised designs: fronts, responses side by side, and where the ranks' time went."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ..errors import InputError
from . import labels, motion, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_QUANTITIES = (
    ("contact_force", "crank_rod", "contact force 1\n(O12)"),
    ("contact_force", "rod_slider", "contact force 2\n(O23)"),
    ("crank_moment", "", "crank moment\n"),
    ("slider_acceleration", "", "slider acceleration\n"),
)


@style.drawn
def front_figure(front: xr.Dataset, verification: xr.Dataset | None = None) -> "Figure":
    """Pareto fronts of all cases, and the designs that were simulated directly (the paper's Fig. 9).

    Parameters
    ----------
    front : xarray.Dataset
        Kind ``front``.
    verification : xarray.Dataset, optional
        Kind ``verification``: its designs are drawn with confidence limits, joined to what the surrogate said.

    Returns
    -------
    matplotlib Figure
    """
    cases = [str(case) for case in front["case"].to_numpy()]
    figure, axes = style.grid(len(cases), 1, 14.0 + 56.0 * len(cases), sharex=True)
    x = labels.of(front["mean"])
    y = labels.scale("m", front["deviation"].to_numpy())
    for panel, case in zip(axes[:, 0], cases, strict=True):
        one = front.sel(case=case)
        for k, run in enumerate(front["run"].to_numpy()):
            row = one.sel(run=run)
            options: dict[str, Any] = {"color": style.CYCLE[k % 7], "ms": 2.0, "mew": 0.0}
            points = (row["mean"].to_numpy() * x.factor, row["deviation"].to_numpy() * y.factor)
            panel.plot(*points, style.MARKERS[k % 7], label=f"run {run}", **options)
        if verification is not None:
            _verified(panel, verification, case, x, y)
        panel.set_title(f"case: {labels.literal(case)}")
        panel.set_ylabel(y.label(r"deviation $\sigma_f$"))
    axes[-1, 0].set_xlabel(x.label(r"mean $\mu_f$"))
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=3, columnspacing=1.0)
    style.settle(axes)
    return figure


def _verified(
    panel: Any, verification: xr.Dataset, case: str, x: labels.Scale, y: labels.Scale
) -> None:
    """True mean and deviation of the designs of a case, each joined to the surrogate's."""
    if "case" in verification:
        verification = verification.isel(
            design=np.flatnonzero(verification["case"].to_numpy() == case)
        )
    mean, deviation = (
        verification["mean_true"].to_numpy(),
        verification["deviation_true"].to_numpy(),
    )
    bars = []
    for name, true, unit in (("mean", mean, x), ("deviation", deviation, y)):
        sides = [f"{name}_lower", f"{name}_upper"]
        known = all(side in verification for side in sides)
        bars.append(
            np.abs([verification[side].to_numpy() - true for side in sides]) * unit.factor
            if known
            else None
        )
    options: dict[str, Any] = {"fmt": "o", "mfc": "white", "mec": "black", "ecolor": "black"}
    options |= {
        "ms": 3.6,
        "mew": 0.8,
        "elinewidth": 0.7,
        "zorder": 4,
        "label": "by direct simulation",
    }
    panel.errorbar(mean * x.factor, deviation * y.factor, xerr=bars[0], yerr=bars[1], **options)
    if "mean_surrogate" in verification and "deviation_surrogate" in verification:
        guess = (
            verification["mean_surrogate"].to_numpy(),
            verification["deviation_surrogate"].to_numpy(),
        )
        for k in range(len(mean)):
            line = [(guess[0][k], mean[k]), (guess[1][k], deviation[k])]
            panel.plot(
                np.array(line[0]) * x.factor, np.array(line[1]) * y.factor, "k-", lw=0.5, zorder=3
            )
    for k, name in enumerate(verification["design"].to_numpy()):
        greek = next(
            (mark for word, mark in (("alpha", "α"), ("beta", "β")) if word in str(name)), None
        )
        if greek is not None:
            at = (mean[k] * x.factor, deviation[k] * y.factor)
            panel.annotate(
                greek, at, xytext=(4, 3), textcoords="offset points", fontsize=style.NORMAL
            )


@style.drawn
def comparison_figure(responses: Mapping[str, xr.Dataset], revolutions: int = 2) -> "Figure":
    """Responses of optimised designs beside the original's, α left and β right (the paper's Fig. 10).

    Parameters
    ----------
    responses : mapping of str to xarray.Dataset
        Kind ``response``, by the name of the design: names with ``alpha`` go left, with ``beta`` right, others are
        drawn in both as what to compare with.
    revolutions : int
        The last ones are drawn.

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    InputError
        No response at all, or one with fewer revolutions.
    """
    if not responses:
        raise InputError(
            "responses", {}, "there is nothing to draw", "Give the response of each design"
        )
    columns = _columns(list(responses))
    height = 24.0 + 33.0 * len(_QUANTITIES)
    figure, axes = style.grid(len(_QUANTITIES), len(columns), height, sharex=True, sharey="row")
    shown = {name: motion.latest(response, revolutions) for name, response in responses.items()}
    order = sorted(responses, key=lambda name: ("alpha" in name or "beta" in name, name))
    kinds = list(dict.fromkeys(_kind(name) for name in order))
    for line, (name, joint, words) in zip(axes, _QUANTITIES, strict=True):
        series = {k: r[name].sel(joint=joint) if joint else r[name] for k, r in shown.items()}
        unit = labels.scale(
            str(next(iter(series.values())).attrs["units"]),
            [float(abs(s).max()) for s in series.values()],
        )
        for panel, members in zip(line, columns.values(), strict=True):
            for design in (d for d in order if d in members):
                k = kinds.index(_kind(design))
                turn = motion.turns(shown[design])
                options: dict[str, Any] = {
                    "color": style.CYCLE[(k - 1) % 7],
                    "lw": 0.7,
                    "label": _kind(design),
                }
                panel.plot(turn - turn[0], series[design].to_numpy() * unit.factor, **options)
        line[0].set_ylabel(unit.label(words))
    for panel, title in zip(axes[0], columns, strict=True):
        panel.set_title(title)
    for panel in axes[-1]:
        panel.set_xlabel("crank angle (revolutions)")
    entries: dict[str, Any] = {}
    for panel in axes[0]:
        entries |= {w: h for h, w in zip(*panel.get_legend_handles_labels(), strict=True)}
    words = [labels.literal(word) for word in entries]
    figure.legend(
        list(entries.values()), words, loc="outside lower center", ncols=3, columnspacing=1.0
    )
    style.settle(axes, 4)
    figure.align_ylabels(axes[:, 0])
    return figure


def _columns(names: Sequence[str]) -> dict[str, list[str]]:
    """Which designs each column of the comparison shows, by its title."""
    base = [name for name in names if "alpha" not in name and "beta" not in name]
    found = {}
    for word, title in (("alpha", "solution α"), ("beta", "solution β")):
        members = [name for name in names if word in name]
        if members:
            found[title] = base + members
    return found or {"": base}


def _kind(name: str) -> str:
    """A design's name without α or β: what has the same colour in both columns."""
    bare = name.replace("alpha", "").replace("beta", "").strip(" _-.,")
    return bare or name


@style.drawn
def timing_figure(timing: xr.Dataset) -> "Figure":
    """How every rank spent its time, and how much of it each stage took.

    Parameters
    ----------
    timing : xarray.Dataset
        Kind ``timing``.

    Returns
    -------
    matplotlib Figure
    """
    sizes = [min(timing.sizes["rank"], 64), timing.sizes["stage"]]
    figure, axes = style.grid(
        2, 1, 40.0 + 5.0 * max(3, sum(sizes)), height_ratios=[max(2, s) for s in sizes]
    )
    parts = (
        ("busy", "computing", "blue"),
        ("compile", "compiling", "orange"),
        ("write", "writing", "green"),
    )
    parts += (("idle", "waiting", "grey"),)
    for panel, along, over in zip(axes[:, 0], ("rank", "stage"), ("stage", "rank"), strict=True):
        names = [labels.literal(str(name)) for name in timing[along].to_numpy()]
        left = np.zeros(len(names))
        for name, label, colour in parts:
            spent = timing[name].sum(over).to_numpy()
            panel.barh(
                np.arange(len(names)),
                spent,
                0.7,
                left=left,
                color=style.PALETTE[colour],
                label=label,
            )
            left += spent
        if len(names) <= 64:
            panel.set_yticks(np.arange(len(names)), names)
        panel.invert_yaxis()
        panel.grid(axis="y", visible=False)
        panel.set_ylabel(f"{along} ({'number' if along == 'rank' else 'name'})")
        panel.set_xlabel("time (s)" if along == "rank" else "time of all ranks (s)")
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, loc="outside lower center", ncols=4, columnspacing=1.0)
    style.settle(axes)
    return figure
