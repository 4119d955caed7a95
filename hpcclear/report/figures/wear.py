"""Figures of service lives with wear (kind ``wear``)."""

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results, texts_in


@style.figure(
    "Clearance and objective over the service life: median, 50 % and 90 % bands; individual runs in grey.",
    name="wear",
)
def fan_figure(wear: Results) -> "style.Figure":
    """Clearance of every worn joint, and f, against revolutions: median, quartiles, 5 and 95 %, and single lives."""
    joints = texts_in(wear, "joint")
    figure, axes = style.grid(len(joints) + 1, 1, 30.0 + 45.0 * (len(joints) + 1))
    cycles = wear["cycle"].values
    rows = [(wear, "objective", "objective $f$")]
    rows[:0] = [(wear.sel(joint=name), "clearance", f"clearance, {name}") for name in joints]
    blue = style.colour("blue")
    for panel, (own, name, words) in zip(axes[:, 0], rows, strict=True):
        each, levels = own[name], own[f"{name}_quantile"]
        scale = labels.of(each)
        panel.plot(cycles, scale(each)[:40].T, color=style.colour("grey"), lw=0.4, alpha=0.5)
        value = scale(np.where(np.isfinite(levels), levels, np.nan))
        for low, high, alpha in ((0, 4, 0.2), (1, 3, 0.35)):
            panel.fill_between(cycles, value[low], value[high], color=blue, alpha=alpha, lw=0)
        panel.plot(cycles, value[2], color=blue, label="median, 50 and 90 % of service lives")
        limit = wear.attrs.get(f"limit_{name}")
        if limit is not None:
            look: style.Look = {"color": style.colour("orange"), "ls": "--", "label": "limit"}
            panel.axhline(scale.factor * float(limit), **look)
        panel.set_ylabel(scale.label(words))
        style.key(panel, "upper left")
    axes[-1, 0].set_xlabel(_revolutions(wear))
    return figure


@style.figure("Survival, with 95 % confidence interval (Clopper and Pearson).", 1)
def survival_figure(wear: Results) -> "style.Figure":
    """Share of lives that are not over, with its 95 % confidence interval. Raises InputError where no limit ends a life."""
    if not any(name.startswith("limit_") for name in wear.attrs):
        reason, remedy = "no limit ends a service life", "Give one, such as clearance"
        raise InputError("wear.limit", None, reason, remedy)
    figure, axes = style.grid(1, 1, 70.0)
    panel, cycles = axes[0, 0], wear["cycle"].values
    lower, upper = wear["survival_lower"].values, wear["survival_upper"].values
    blue = style.colour("blue")
    panel.fill_between(cycles, lower, upper, color=blue, alpha=0.25, lw=0, label="95 % CI")
    panel.plot(cycles, wear["survival"].values, color=blue, label="survival")
    panel.set(xlabel=_revolutions(wear), ylabel="survival (–)", ylim=(-0.02, 1.02))
    style.key(panel, "lower left")
    return figure


def _revolutions(wear: Results) -> str:
    """The label of an axis of revolutions, with the hours they take where every life turns alike."""
    each = wear["revolution_time"].values if "revolution_time" in wear else np.zeros(0)
    if not each.size or np.ptp(each) > 0.0:
        return "revolutions (–)"
    last = float(wear["cycle"][-1])
    return f"revolutions (–); {last:.3g} take {last * each[0] / 3600.0:.3g} h"


AGES = 4
"""Ages of a life that profiles are drawn at."""


@style.figure(
    "Depth of wear around bearings and journals, at several ages (medians over all runs).", 2,
    name="wear-profile",
)  # fmt: skip
def profile_figure(wear: Results) -> "style.Figure":
    """Depth of wear around worn bearings and journals at several ages. Raises InputError where surfaces wear evenly."""
    if "bearing_profile" not in wear:
        reason = "wear is uniform around the surfaces: there is no profile"
        raise InputError("wear.profile", "uniform", reason, 'Set it to "angular"')
    panels = [
        (str(name), surface, depths)
        for name in wear["joint"].values
        for surface in ("bearing", "journal")
        if np.max(depths := wear[f"{surface}_profile"].sel(joint=name, quantile=0.5)) > 0.0
    ]
    ages = np.unique(np.linspace(0, wear.sizes["cycle"] - 1, AGES + 1).round().astype(int))[1:]
    rows = max(-(-len(panels) // 2), 1)
    figure, axes = style.grid(rows, 2, 12.0 + 50.0 * rows, subplot_kw={"projection": "polar"})
    angle = np.append(wear["angle"].values, 2.0 * np.pi)
    for panel in axes.ravel()[len(panels) :]:
        panel.remove()
    for panel, (name, surface, depths) in zip(axes.ravel(), panels, strict=False):
        scale = labels.scale("m", depths.values)
        for shade, age in zip(np.linspace(0.3, 1.0, len(ages)), ages, strict=True):
            value, label = scale(depths.isel(cycle=age)), f"{float(wear['cycle'][age]):.3g}"
            look = {"color": style.colour("blue"), "alpha": shade, "label": label}
            panel.plot(angle, np.append(value, value[0]), **look)
        panel.set_title(f"{name}\n{scale.label(surface)}")
        panel.set_rmin(0.0)
        panel.set_rlabel_position(60.0)
    if panels:
        style.legend(figure, axes[0, 0], "lower", title="revolutions")
    return figure
