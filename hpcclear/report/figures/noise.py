"""Force levels of one response: third octaves with their confidence intervals, and orders."""

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report.figures import labels, style
from hpcclear.report.noise import band_name
from hpcclear.results.content import Results, Variable, texts_in

FALL = 80.0
"""Levels that are further below the highest are not shown, dB."""


@style.figure("response", "noise", "force levels and orders", 80, along="band")
def noise_figure(response: Results) -> "style.Figure":
    """Third-octave levels of the force on the frame and of contact forces with 95 % confidence intervals, and the root mean
    squares of their orders. Raises InputError where the response has no levels."""
    if "band" not in response:
        remedy = "Give a joint clearance, and store 64 instants a revolution or more"
        raise InputError("noise", "", "this response has no force levels", remedy)
    figure, axes = style.grid(2, 1, 110.0)
    forces = _forces(response)
    highest = max(float(np.nanmax(level)) for level, *_ in forces.values())
    for row, (name, (level, lower, upper, orders)) in enumerate(forces.items()):
        colour = style.colour(row)
        _levels(axes[0, 0], (level, lower, upper), name, colour)
        unit = labels.scale("N", [float(np.max(one)) for *_, one in forces.values()])
        axes[1, 0].loglog(orders.labels["order"], unit(orders), color=colour, lw=0.7, label=name)
    axes[0, 0].set(xscale="log", ylabel="level (dB re 1 µN)", title="third octaves")
    axes[0, 0].set_ylim(bottom=highest - FALL)
    bands = response["band"].values[::3]
    axes[0, 0].set_xticks(bands, [band_name(one) for one in bands], rotation=45.0)
    axes[0, 0].minorticks_off()
    style.key(axes[0, 0], "lower right")
    axes[1, 0].set(title="orders", xlabel="order (multiples of the crank frequency)")
    axes[1, 0].set_ylabel(unit.label("RMS of the order"))
    return figure


def _levels(
    panel: "style.Axes", ends: tuple[Variable, Variable, Variable], name: str, colour: str
) -> None:
    """A line with its interval; an end at nothing is at the bottom."""
    level, lower, upper = ends
    there = np.isfinite(level.values)
    band = level.labels["band"][there]
    panel.plot(band, level.values[there], "o-", ms=2.5, lw=0.8, color=colour, label=name)
    least = np.nan_to_num(lower.values[there], nan=np.nan, neginf=-1e3)
    panel.fill_between(band, least, upper.values[there], color=colour, alpha=0.25, lw=0.0)


def _forces(response: Results) -> dict[str, tuple[Variable, Variable, Variable, Variable]]:
    """Level, ends of its interval, and orders, of the force on the frame and of each contact force that is not 0."""
    ends = ("level", "level_lower", "level_upper", "orders")
    found = {}
    if "frame_force_level" in response:
        found["force on the frame"] = tuple(response[f"frame_force_{end}"] for end in ends)
    for joint in texts_in(response, "joint"):
        own = tuple(response[f"contact_force_{end}"].sel(joint=joint) for end in ends)
        if float(np.max(own[-1])) > 0.0:
            found[joint.replace("_", " ")] = own
    return found  # type: ignore[return-value]
