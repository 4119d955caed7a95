"""Impact and noise in one response: impacts in each joint and the loudest bands in words; force levels and orders drawn."""

from collections.abc import Iterator

import numpy as np

from hpcclear.base.errors import InputError
from hpcclear.report import bearings
from hpcclear.report.figures import labels, style
from hpcclear.results.content import Results, Variable, texts_in

HEADER = ("joint", "impacts", "energy lost", "in flight", "RMS force")
"""Columns of the rows of `joints`."""

LOUDEST = 3
"""Third-octave bands that are named, the loudest first."""


def joints(response: Results) -> Iterator[list[str]]:
    """Yield a row of `HEADER` for each joint with clearance; none where the response has no measures of impact."""
    if "impact_energy" not in response:
        return
    names = texts_in(response, "joint")
    for joint in (one.joint for one in bearings.bearings(response)):
        at = names.index(joint)
        ends = (response[name].values[at] for name in ("contact_loss", "contact_loss_limit"))
        loss, reach = (float(np.degrees(one)) for one in ends)
        flown = _with(loss, reach, "deg")
        means = ("impacts", "impact_energy", "rms_contact_force")
        impacts, lost, force = (_mean(response, name, at) for name in means)
        yield [joint, impacts, lost, flown, force]


def frame(response: Results) -> Iterator[tuple[str, str]]:
    """Yield what the force on the frame is, and its loudest third octaves, each with its name."""
    if "rms_frame_force" not in response:
        return
    yield "RMS force on the frame", _mean(response, "rms_frame_force")
    if "frame_force_level" in response:
        level = response["frame_force_level"].values
        order = np.argsort(-np.nan_to_num(level, nan=-np.inf))[:LOUDEST]
        loudest = zip(level[order], response["band"].values[order], strict=True)
        known = [f"{one:.1f} dB at {band_name(at)}" for one, at in loudest if np.isfinite(one)]
        yield "highest third octaves", f"{', '.join(known)} (re 1 µN)"


def band_name(centre: float) -> str:
    """Return the nominal frequency of a third-octave band, IEC 61260-1: 1.25 kHz of 1259 Hz."""
    nominal = (1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0)
    tenths = round(10.0 * np.log10(centre))
    value = nominal[tenths % 10] * 10.0 ** (tenths // 10)
    return f"{value / 1e3:g} kHz" if value >= 1e3 else f"{value:g} Hz"


def _mean(response: Results, name: str, at: int | tuple[()] = ()) -> str:
    value, reach = (float(response[one].values[at]) for one in (name, f"{name}_limit"))
    return _with(value, reach, str(response[name].attrs["units"]))


def _with(value: float, reach: float, unit: str) -> str:
    """A mean with its half-width; three digits where there are too few revolutions for one."""
    if not np.isfinite(reach):
        return labels.quantity(value, unit, 3)
    if reach <= 1e-3 * abs(value):
        return labels.quantity(value, unit, 4)
    return labels.with_half_width(value, reach, unit)


FALL = 80.0
"""Levels that are further below the highest are not shown, dB."""


@style.figure("force levels and orders", 80, along="band")
def noise_figure(response: Results) -> "style.Figure":
    """Third-octave levels of forces with 95 % CI, and RMS of their orders. Raises InputError where there are no levels."""
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
