"""Figures of lives of worn joints (kind ``wear``)."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@style.drawn
def fan_figure(wear: xr.Dataset) -> "Figure":
    """Clearance of every worn joint, and f, against revolutions: median, quartiles, 5 and 95 %; single lives behind them.

    Of a dataset of kind ``wear``.
    """
    joints = [str(name) for name in wear["joint"].to_numpy()]
    figure, axes = style.grid(len(joints) + 1, 1, 30.0 + 45.0 * (len(joints) + 1))
    cycles = wear["cycle"].to_numpy()
    drawn = [
        (
            wear["clearance"].sel(joint=name),
            wear["clearance_quantile"].sel(joint=name),
            f"clearance, {name}",
            "clearance",
        )
        for name in joints
    ]
    drawn.append((wear["objective"], wear["objective_quantile"], "objective $f$", "objective"))
    for panel, (each, levels, words, name) in zip(axes[:, 0], drawn, strict=True):
        scale = labels.scale(str(each.attrs.get("units", "1")), each.to_numpy())
        panel.plot(
            cycles,
            scale.factor * each.to_numpy()[:40].T,
            color=style.PALETTE["grey"],
            lw=0.4,
            alpha=0.5,
        )
        value = scale.factor * np.where(np.isfinite(levels), levels, np.nan)
        for low, high, alpha in ((0, 4, 0.2), (1, 3, 0.35)):
            panel.fill_between(
                cycles, value[low], value[high], color=style.PALETTE["blue"], alpha=alpha, lw=0
            )
        panel.plot(
            cycles, value[2], color=style.PALETTE["blue"], label="median, 50 and 90 % of lives"
        )
        limit = wear.attrs.get(f"limit_{name}")
        if limit is not None:
            panel.axhline(
                scale.factor * float(limit), color=style.PALETTE["orange"], ls="--", label="limit"
            )
        panel.set_ylabel(scale.label(words))
        panel.legend(loc="upper left")
    axes[-1, 0].set_xlabel("revolutions (–)")
    style.settle(axes)
    return figure


@style.drawn
def survival_figure(wear: xr.Dataset) -> "Figure":
    """Share of lives that are not over against revolutions, with 95 % limits.

    Of a dataset of kind ``wear``.

    Raises
    ------
    InputError
        No limit was given that could end a life.
    """
    if not any(name.startswith("limit_") for name in wear.attrs):
        raise InputError("wear.limit", None, "no limit ends a life", "Give one, such as clearance")
    figure, axes = style.grid(1, 1, 70.0)
    panel, cycles = axes[0, 0], wear["cycle"].to_numpy()
    lower, upper = wear["survival_lower"].to_numpy(), wear["survival_upper"].to_numpy()
    panel.fill_between(
        cycles, lower, upper, color=style.PALETTE["blue"], alpha=0.25, lw=0, label="95 % limits"
    )
    panel.plot(cycles, wear["survival"].to_numpy(), color=style.PALETTE["blue"], label="survival")
    panel.set_ylim(-0.02, 1.02)
    panel.set_xlabel("revolutions (–)")
    panel.set_ylabel("lives that are not over (–)")
    panel.legend(loc="lower left")
    style.settle(axes)
    return figure
